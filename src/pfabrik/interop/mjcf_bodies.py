"""The bodies of a MuJoCo model, with their joints, masses, sites and what is drawn of them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from xml.etree import ElementTree as ET

import numpy as np

from ..arrays import Floats
from ..description.home_mobility import universal_axes
from ..description.joint_coordinates import JointCoordinate
from ..description.joint_types import KINDS
from ..description.joints import Joint
from ..description.mechanism import Mechanism
from ..kinematics import columns, links_of
from .cuts import Branch, CutTree
from .mjcf_struts import Half, halves_of, struts_of
from .names import unique
from .physics import Physics
from .xml_reading import number_text

REFERENCE_POINT = "reference_point"
"""Name of the site that targets place."""

WORLD = "world"
"""MuJoCo's name of the body that rests."""

THICKNESS = 0.015
"""Radius of what is drawn of a link [L]."""


@dataclass(frozen=True)
class Names:
    """Names of the sites of a model, but for those at joint centres on first bodies, which have the joints' names.

    Attributes
    ----------
    ends : joint that is cut -> the site at its centre on its second body.
    reference : of the site at the reference point.
    """

    ends: Mapping[str, str]
    reference: str


def names_of(mechanism: Mechanism, tree: CutTree) -> Names:
    """Names for all other sites."""
    taken = {joint.name for joint in mechanism.joints}
    ends = {joint.name: unique(f"{joint.name}:end", taken) for joint in tree.cuts}
    return Names(ends, unique(REFERENCE_POINT, taken))


def si_unit(coordinate: JointCoordinate, metres: float) -> float:
    """The unit of a coordinate [rad or m]."""
    return 1.0 if coordinate.kind == "angle" else metres


def as_attributes(values: Mapping[str, float]) -> dict[str, str]:
    """Numbers by name as attributes."""
    return {name: repr(value) for name, value in values.items()}


def bodies(mechanism: Mechanism, tree: CutTree, names: Names, metres: float, physics: Physics) -> ET.Element:
    """All bodies as a tree, the base fixed to the world; frames parallel at home, each at the joint it hangs on."""
    world = ET.Element("worldbody")
    elements = {mechanism.base: world if mechanism.base == WORLD else ET.SubElement(world, "body", name=mechanism.base)}
    origins = {mechanism.base: np.zeros(3)}
    points = _points(mechanism, metres)
    for branch in tree.branches:
        parent, at = origins[branch.parent], branch.joint.at
        origin = parent if at is None else np.array(at) * metres
        body = ET.SubElement(elements[branch.parent], "body", name=branch.body, pos=number_text(origin - parent))
        elements[branch.body], origins[branch.body] = body, origin
        for attributes in _joints(mechanism, branch, metres, physics):
            ET.SubElement(body, "joint", attributes)
        body.append(_inertial(branch.body, points.get(branch.body, [origin]), origin, physics))
    for name in mechanism.bodies:
        elements[name].extend(_drawn(points[name], origins[name], physics))
        elements[name].extend(_thick(mechanism, name, origins[name], metres))
    for half in halves_of(mechanism):
        elements[half.body].append(_half(half, origins[half.body], metres))
    for site, body_name, point in _sites(mechanism, tree, names, metres):
        place = number_text(point - origins[body_name])
        ET.SubElement(elements[body_name], "site", name=site, pos=place, size=repr(2.0 * THICKNESS * physics.length))
    return world


def _points(mechanism: Mechanism, metres: float) -> Mapping[str, list[Floats]]:
    """Body -> the joint centres on it, and the reference point on the end effector, at home [m]."""
    points: dict[str, list[Floats]] = defaultdict(list)
    for joint in mechanism.joints:
        if joint.at is not None:
            for body in joint.connects:
                points[body].append(np.array(joint.at) * metres)
    points[mechanism.end_effector_body].append(np.array(mechanism.reference_point) * metres)
    return {body: points[body] or [np.zeros(3)] for body in mechanism.bodies}


def _sites(mechanism: Mechanism, tree: CutTree, names: Names, metres: float) -> Iterator[tuple[str, str, Floats]]:
    """Every site: its name, its body and where it is at home [m]."""
    reference = np.array(mechanism.reference_point) * metres
    for joint in mechanism.joints:
        place = reference if joint.at is None else np.array(joint.at) * metres
        if joint.at is not None or joint in tree.cuts:
            yield joint.name, joint.connects[0], place
        if joint in tree.cuts:
            yield names.ends[joint.name], joint.connects[1], place
    yield names.reference, mechanism.end_effector_body, reference


def _joints(mechanism: Mechanism, branch: Branch, metres: float, physics: Physics) -> Iterator[dict[str, str]]:
    """Attributes of the joints that a body hangs on, from its parent outward: one for each coordinate, or a ball."""
    joint = branch.joint
    if joint.type == "spherical":
        yield {"name": joint.name, "type": "ball"} | as_attributes(physics.joint(True, False))
        return
    coordinates = mechanism.coordinates[columns(mechanism)[joint.name]]
    for each in coordinates if branch.forward else reversed(coordinates):
        turning, unit = each.kind == "angle", si_unit(each, metres)
        attributes = {
            "name": each.name,
            "type": "hinge" if turning else "slide",
            "axis": number_text(axes_of(mechanism, joint)[each.place] * (1.0 if branch.forward else -1.0)),
        }
        if each.home:
            attributes["ref"] = repr(each.home * unit)
        if joint.range is not None:
            attributes["range"] = number_text(np.array(each.limits) * unit)
        yield attributes | as_attributes(physics.joint(turning, each.place in joint.driven))


def axes_of(mechanism: Mechanism, joint: Joint) -> Floats:
    """The axes of a joint's coordinates at home, (coordinates, 3)."""
    if joint.type == "universal":
        return universal_axes(mechanism, joint)
    return np.array([mechanism.home_axis(joint.name)] * len(KINDS[joint.type].coordinates))


UNTOUCHED = {"contype": "0", "conaffinity": "0", "mass": "0", "group": "3"}
"""Attributes of the geoms of shapes: they touch nothing and weigh nothing until told otherwise."""


def _thick(mechanism: Mechanism, body: str, origin: Floats, metres: float) -> Iterator[ET.Element]:
    """The shapes of a body as geoms but meshes; those of struts, whose length changes, are written as halves."""
    links, struts = (links_of(mechanism), struts_of(mechanism)) if mechanism.shapes else (None, {})
    for k, shape in enumerate(mechanism.shapes if links is not None else ()):
        assert links is not None
        if shape.body != body or k in struts or shape.kind == "mesh":
            continue
        places, size = links.places[k], np.array([0.5 * metres])
        attributes = {"pos": number_text(places[0] * metres - origin)}
        if shape.kind == "capsule":
            attributes = {"fromto": number_text((places[:2] * metres - origin).ravel())}
            size = size * shape.thickness
        elif shape.kind == "sphere":
            size = size * (shape.diameter or 0.0)
        elif shape.kind == "box":
            attributes["xyaxes"] = number_text(places[1:3].ravel())
            size = size * np.array(shape.size)
        else:
            attributes["zaxis"] = number_text(places[1])
            size = size * [shape.diameter or 0.0, shape.thickness]
        kind = "cylinder" if shape.kind == "disc" else shape.kind
        yield ET.Element("geom", {"type": kind, **attributes, "size": number_text(size), **UNTOUCHED})


def _half(half: Half, origin: Floats, metres: float) -> ET.Element:
    """The part of a strut that moves with one body, as a geom."""
    ends, radius = number_text((half.ends * metres - origin).ravel()), repr(half.radius * metres)
    return ET.Element("geom", {"name": half.name, "type": "capsule", "fromto": ends, "size": radius, **UNTOUCHED})


def _inertial(body: str, points: list[Floats], origin: Floats, physics: Physics) -> ET.Element:
    mass, centre, moment = physics.inertia(body, np.array(points))
    place = number_text(centre - origin)
    return ET.Element("inertial", mass=repr(mass), pos=place, diaginertia=number_text(np.full(3, moment)))


def _drawn(points: list[Floats], origin: Floats, physics: Physics) -> Iterator[ET.Element]:
    """Thin rods from the middle of a body to its joints; they touch nothing and weigh nothing."""
    middle = np.mean(points, axis=0)
    radius = THICKNESS * physics.length
    for point in points:
        if np.linalg.norm(point - middle) > radius:
            ends = number_text(np.concatenate([middle - origin, point - origin]))
            through = {"contype": "0", "conaffinity": "0", "mass": "0", "group": "1"}
            yield ET.Element("geom", {"type": "capsule", "fromto": ends, "size": repr(radius), **through})
