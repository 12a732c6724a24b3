"""The bodies of a MuJoCo model: joints, masses, servos, sites, struts, and what is drawn of them."""

from __future__ import annotations

import json
from collections import Counter, defaultdict
from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple
from xml.etree import ElementTree as ET

import numpy as np

from ...common.arrays import Floats
from ...common.checks import require_mapping, require_positive
from ...errors import UnknownName
from ...kinematics import columns, links_of
from ...machine.description.body_inertias import BodyInertia, inertias_of
from ...machine.description.body_masses import as_moments
from ...machine.description.form_faults import shown
from ...machine.description.graph import sliding_along
from ...machine.description.home_mobility import universal_axes
from ...machine.description.joint_coordinates import JointCoordinate
from ...machine.description.joints import KINDS, Joint
from ...machine.description.mechanism import Mechanism, Shape
from ...tolerances import TOLERANCES
from .collision import Solid
from .cuts import Branch, CutTree
from .names import unique
from .xml_reading import fault, number_text

DENSITY = 100.0
"""Mass of the end effector over the cube of the characteristic length [kg/m³]: 0.8 kg for a hexapod of 200 mm."""

LINK = 0.1
"""Mass of any other body over that of the end effector."""

DOUBLED = 0.1
"""Share of the mass of a body that each of its doubles has, in the same place: together they weigh what it does."""

THINNEST = 0.1
"""Least radius of gyration of a body [L]: a light body that turns easily would need shorter steps."""

WEIGHTLESS = 1e-3
"""Mass of a body that weighs nothing, over that of the heaviest: a model with less than that blows up."""

POINT = 1e-5
"""Radius of gyration of a point and about the line of a rod [L]: MuJoCo turns nothing without, and none sees it."""

LEAST_INERTIA = 1e-14
"""Least moment of inertia [kg m²]: MuJoCo refuses a tenth of it."""

SERVO_RATE = 120.0
"""Natural frequency of the servos [1/s] where they carry all of the machine: an eighth of what one step of the
simulation can follow. A platform that its legs hold by short levers settles tens of times more slowly."""

STEP = 0.001
"""Time step of the simulation [s]."""


@dataclass(frozen=True)
class Physics:
    """The masses of a simulation model, and what follows from them, in SI units.

    Attributes
    ----------
    masses : body -> its mass [kg].
    made_up : moving bodies whose masses neither the caller gave nor the mechanism has.
    weightless : those that weigh nothing in the mechanism.
    is_solid : True if all of them have mass, and moments of inertia about every axis, in the mechanism.
    known : what bodies weigh of which the mechanism has it, lengths in its unit.
    length : the characteristic length [m].
    heaviest : the largest of the masses, which any servo can carry [kg].
    """

    masses: Mapping[str, float]
    made_up: tuple[str, ...]
    weightless: tuple[str, ...]
    is_solid: bool
    known: Mapping[str, BodyInertia]
    length: float
    heaviest: float

    def inertia(self, body: str, points: Floats, metres: float) -> BodyInertia:
        """Mass [kg], centre of mass [m] and inertia [kg m²] of a body with these points.

        Where the mechanism does not have it, as if the mass were in a ball around the points.
        """
        mass, spread = self.masses[body], float(np.sqrt(points.var(axis=0).sum()))
        ball = mass * max(spread, THINNEST * self.length) ** 2 * np.eye(3)
        if body not in self.known:
            return BodyInertia(mass, points.mean(axis=0), ball)
        _, centre, inertia = self.known[body]
        is_solid = np.linalg.eigvalsh(inertia)[0] > 0.0
        least = 0.0 if is_solid else max(mass * (POINT * self.length) ** 2, LEAST_INERTIA)
        return BodyInertia(mass, centre * metres, inertia * metres**2 + least * np.eye(3))

    def carried(self, turning: bool) -> float:
        """The load of a servo: a moment of inertia [kg m²] if it turns, else a mass [kg]."""
        return self.heaviest * self.length**2 if turning else self.heaviest

    def servo(self, drive: JointCoordinate) -> dict[str, float]:
        """Gains of a critically damped position servo, per radian or metre."""
        carried = self.carried(drive.kind == "angle") + (drive.armature or 0.0)
        return {"kp": carried * SERVO_RATE**2, "kv": 2.0 * carried * SERVO_RATE}

    def joint(self, turning: bool, drive: JointCoordinate | None = None) -> dict[str, float]:
        """Armature and friction: those that the mechanism has, else made up if masses are.

        An armature is made up as well where a driven body may be a point or weigh nothing: a stiff servo on a light
        body blows up without.

        Parameters
        ----------
        drive : the coordinate, if it is driven: a passive one has neither in the mechanism.
        """
        carried = self.carried(turning)
        made_up = carried if self.made_up else 0.0
        armature, friction = 0.01 * made_up, (0.0, 0.02 * made_up)
        if drive is not None:
            unsaid = 0.0 if self.is_solid else 0.2 * carried
            armature = unsaid if drive.armature is None else drive.armature
            friction = drive.said("friction") or friction
        said = {"armature": armature, "frictionloss": friction[0], "damping": friction[1]}
        return {name: value for name, value in said.items() if value}


def physics(mechanism: Mechanism, metres: float, masses: Mapping[str, float] | None) -> Physics:
    """Masses as given, else as the mechanism has them, the others plausible.

    Parameters
    ----------
    metres : length of the mechanism's unit [m].
    masses : body -> mass [kg], of some of the bodies.

    Raises
    ------
    UnknownName : a mass of no body of the mechanism.
    InvalidArgument : a mass that is not positive.
    """
    given = {}
    for body, mass in require_mapping("masses", masses, "masses in kg by the names of bodies").items():
        if body not in mechanism.bodies:
            raise UnknownName("body", body, mechanism.bodies)
        given[body] = require_positive(f"masses['{body}']", mass)
    length = mechanism.characteristic_length * metres
    whole = DENSITY * length**3
    plausible = {body: whole if body == mechanism.end_effector_body else LINK * whole for body in mechanism.bodies}
    weighed = inertias_of(mechanism, metres)
    moving = [body for body in mechanism.bodies if body != mechanism.base]
    said = {body: each for body, each in weighed.items() if body not in given}
    known = {body: each for body, each in said.items() if each.mass > 0.0}
    weightless = tuple(body for body in moving if body in said and body not in known)
    every = plausible | dict.fromkeys(weightless, 0.0) | {body: each.mass for body, each in known.items()} | given
    heaviest = max(every[body] for body in moving) or whole
    every |= dict.fromkeys(weightless, WEIGHTLESS * heaviest)
    made_up = tuple(body for body in moving if body not in said and body not in given)
    has_points = any(np.linalg.eigvalsh(known[body].inertia)[0] <= 0.0 for body in moving if body in known)
    is_solid = not (made_up or weightless or has_points)
    return Physics(every, made_up, weightless, is_solid, known, length, heaviest)


SLIDING = ("prismatic", "cylindrical")
"""Joints whose centre rests on one of their bodies only."""

STRUT = "strut"
"""What notes and geoms of struts are called: the note `strut.3` has the geoms `strut_3_1` and `strut_3_2`."""


class Half(NamedTuple):
    """The part of a strut that moves with one of its two bodies: its ends at home (2, 3), and its radius [length]."""

    name: str
    body: str
    ends: Floats
    radius: float


def struts_of(mechanism: Mechanism) -> dict[int, tuple[Joint, Joint]]:
    """Index of a shape -> the two joints that it is between, of capsules whose two ends do not move with one body."""
    links = links_of(mechanism) if mechanism.shapes else None
    struts = {}
    for k, names in enumerate(() if links is None else links.joints):
        joints = [mechanism.joint(name) for name in names]
        body = mechanism.shapes[k].body
        if any(body not in joint.connects or joint.type in SLIDING for joint in joints):
            struts[k] = (joints[0], joints[1])
    return struts


def halves_of(mechanism: Mechanism) -> Iterator[Half]:
    """Yield the halves of the struts that two capsules are exactly, at any length within the range.

    Each is as long as half the longest strut. Together they are the strut unless it is shorter than one of them: so the
    longest is at most twice the shortest.
    """
    for k, joints in struts_of(mechanism).items():
        length, bodies = _half_length(mechanism, mechanism.shapes[k], joints)
        if length == 0.0:
            continue
        ends = np.array([joint.at for joint in joints])
        along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        for side, (body, sign) in enumerate(zip(bodies, (1.0, -1.0), strict=True)):
            half = np.array([ends[side], ends[side] + sign * length * along])
            yield Half(f"{STRUT}_{k}_{side + 1}", body, half, 0.5 * mechanism.shapes[k].thickness)


def _half_length(mechanism: Mechanism, shape: Shape, joints: tuple[Joint, Joint]) -> tuple[float, tuple[str, ...]]:
    """Half of a strut's greatest length, and its two bodies; 0 where two halves would not be it."""
    nothing: tuple[float, tuple[str, ...]] = (0.0, ())
    parts = sliding_along(mechanism, shape.body)
    bodies = tuple(next((body for body in joint.connects if body in parts), "") for joint in joints)
    slides = [each for each in mechanism.joints if each.type == "prismatic" and set(each.connects) == set(bodies)]
    if any(joint.type in SLIDING for joint in joints) or len(set(bodies)) < 2 or len(slides) != 1:
        return nothing
    span = np.subtract(*(np.array(joint.at) for joint in reversed(joints)))
    length, axis = float(np.linalg.norm(span)), np.array(mechanism.home_axis(slides[0].name))
    if np.linalg.norm(np.cross(span, axis)) > TOLERANCES.alignment * length or slides[0].range is None:
        return nothing
    sign = np.sign(span @ axis) * (1.0 if slides[0].connects[1] == bodies[1] else -1.0)
    change = sign * (np.array(slides[0].range) - mechanism.home_coordinate(slides[0].name))
    shortest, longest = length + change.min(), length + change.max()
    return (0.5 * float(longest), bodies) if 0.5 * longest <= shortest else nothing


def strut_notes(mechanism: Mechanism, metres: float) -> Iterator[tuple[str, str]]:
    """Yield names and texts of the custom elements that tell of struts."""
    for k, joints in struts_of(mechanism).items():
        shape = mechanism.shapes[k]
        data = [shape.body, shape.thickness * metres, *(joint.name for joint in joints)]
        yield f"{STRUT}.{k}", json.dumps(data)


def read_struts(notes: dict[str, str]) -> Iterator[tuple[str, Solid]]:
    """Yield the number of each strut of a model's notes, and the strut as a solid [m]."""
    for name, text in notes.items():
        prefix, _, number = name.partition(".")
        if prefix == STRUT:
            try:
                body, thickness, first, second = json.loads(text)
                strut = Shape(str(body), thickness=float(thickness), between=(str(first), str(second)))
            except (ValueError, TypeError):
                expected = '["body", thickness in metres, "joint", "joint"]'
                raise fault(f"custom text '{name}'", shown(text), expected) from None
            yield number, Solid(strut, strut.body)


def is_half(name: str, struts: Container[str]) -> bool:
    """True if a geom is called as half of one of some struts, by their numbers."""
    prefix, _, rest = name.partition("_")
    return prefix == STRUT and rest.rpartition("_")[0] in struts


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
        weighed = branch.double_of or branch.body
        inertia = physics.inertia(weighed, np.array(points[weighed]), metres)
        body.append(_inertial(inertia, share_of(branch.body, tree), origin))
    for name in mechanism.bodies:
        elements[name].extend(_drawn(points[name], origins[name], physics))
        elements[name].extend(_thick(mechanism, name, origins[name], metres))
    for half in halves_of(mechanism):
        ends = number_text((half.ends * metres - origins[half.body]).ravel())
        capsule = {"name": half.name, "type": "capsule", "fromto": ends, "size": repr(half.radius * metres)}
        ET.SubElement(elements[half.body], "geom", capsule | UNTOUCHED)
    for site, body_name, point in _sites(mechanism, tree, names, metres):
        place = number_text(point - origins[body_name])
        ET.SubElement(elements[body_name], "site", name=site, pos=place, size=repr(2.0 * THICKNESS * physics.length))
    return world


def share_of(body: str, tree: CutTree) -> float:
    """The share that a body of the tree has of its mass: its doubles have the rest, and they theirs."""
    doubles = Counter(branch.double_of for branch in tree.branches)
    is_double = any(branch.body == body and branch.double_of for branch in tree.branches)
    return DOUBLED if is_double else 1.0 - DOUBLED * doubles[body]


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
        yield {"name": joint.name, "type": "ball"} | as_attributes(physics.joint(True))
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
        yield attributes | as_attributes(physics.joint(turning, each if each.place in joint.driven else None))


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


def _inertial(inertia: BodyInertia, share: float, origin: Floats) -> ET.Element:
    """What a body weighs, or a share of it."""
    place, moments = number_text(inertia.centre - origin), np.array(as_moments(share * inertia.inertia))
    kind = {"fullinertia": number_text(moments)} if moments[3:].any() else {"diaginertia": number_text(moments[:3])}
    return ET.Element("inertial", {"mass": repr(share * inertia.mass), "pos": place, **kind})


def _drawn(points: list[Floats], origin: Floats, physics: Physics) -> Iterator[ET.Element]:
    """Thin rods from the middle of a body to its joints; they touch nothing and weigh nothing."""
    middle = np.mean(points, axis=0)
    radius = THICKNESS * physics.length
    for point in points:
        if np.linalg.norm(point - middle) > radius:
            ends = number_text(np.concatenate([middle - origin, point - origin]))
            through = {"contype": "0", "conaffinity": "0", "mass": "0", "group": "1"}
            yield ET.Element("geom", {"type": "capsule", "fromto": ends, "size": repr(radius), **through})
