"""Loops in elements of a file beside its tree of links, in the dialects of several programs.

<loop_joint type="spherical"><link1 link="a" xyz="…" rpy="…"/><link2 …/></loop_joint>       Isaac Sim, an older Drake
<loop_joint type="revolute"><parent link="a"/><child link="b"/><parent_origin …/>…          exporters of Fusion
<constraint type="revolute"><parent link="a"/><parent_origin …/><parent_axis …/>…           proposed for URDF
<loop type="revolute"><predecessor link="a"/><successor link="b"/><origin …/><axis …/>      URDF+
<drake:ball_constraint><drake:ball_constraint_body_A name="a"/>…                            Drake, in URDF and SDF

What binds two bodies and is none of these is refused by its name, for dropped it would open a loop.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np

from ...common.arrays import Floats
from ...errors import Fault, near_miss
from .loops_file import KINDS
from .opened import frame_along
from .urdf_links import HERE, UrdfJoint, frame_at, origin_of, vector_in
from .xml_reading import fault, numbers_in

DIALECTS = ("loop_joint", "constraint", "loop", "ball_constraint", "weld_constraint")
"""Elements that tell a loop."""

SIDE = r"link_?[12ab]|parent|child|predecessor|successor|.*body_?[ab12]"
"""Elements in one of these that name a link; what begins as one of them does belongs to it."""

TYPES = {**KINDS, "point": "spherical", "continuous": "revolute", "prismatic": "prismatic", "universal": "universal"}
"""Types of loops -> those of joints."""

HARMLESS = ("material", "visual", "inertial", "sensor", "plugin", "transmission", "ros2_control", "group")
"""Elements that may name several bodies and bind none, besides those with `collision` in their names."""

SPRING = "linear_spring_damper"
"""An element that pulls at two links, and holds nothing."""


def told_joint(element: ET.Element, frames: Mapping[str, Floats], number: int) -> tuple[UrdfJoint, Floats]:
    """The joint that an element describes, and its place (4, 4) [m] in its second link's frame.

    Parameters
    ----------
    frames : link -> where it is at zero, (4, 4) [m].
    number : for the name of a loop that has none.
    """
    place = f"<{element.tag}> '{element.get('name', '')}'"
    sides = [child for child in element if re.fullmatch(SIDE, child.tag, re.IGNORECASE)]
    links = [named_in(side).rpartition("::")[2] for side in sides]
    if len(links) != 2:
        raise fault(place, f"{len(links)} links", "two, as in <link1 link='a'/><link2 link='b'/>")
    for link in links:
        if link not in frames:
            raise fault(place, f"'{link}'{near_miss(link, frames)}", "a link of the robot")
    try:
        first, second = (_place(element, side) for side in sides)
        first = first @ origin_of(element.find("origin"))
        axes = [_axis(element, side) for side in sides]
    except ValueError:
        raise fault(place, "a place or an axis without its three numbers", "three finite numbers each") from None
    is_typed = "type" in element.attrib or element.tag.endswith("_constraint")
    said = element.get("type", element.tag.removesuffix("_constraint") if is_typed else "hinge").lower()
    if said not in TYPES or (not is_typed and not axes[0].any()):
        found = f"type '{said}'" if is_typed else "neither a type nor an axis"
        raise fault(place, found, f"one of {', '.join(TYPES)}; what couples joints goes by --actuated or --fixed")
    kind = TYPES[said]
    if kind not in ("spherical", "fixed") and not all(axis.any() for axis in axes):
        raise fault(f"{place}.axis", "no direction", "three numbers, not all zero")
    if kind == "universal" and not np.cross(axes[0], axes[1]).any():
        raise fault(f"{place}.axis", "one direction", "two, as in <parent_axis/> and <child_axis/>")
    if element.find("axis[@frame='parent']") is not None:
        across = frames[links[1]][:3, :3].T @ frames[links[0]][:3, :3]
        axes = [first[:3, :3].T @ axes[0], second[:3, :3].T @ across @ axes[0]]
    axes = [axis if axis.any() else np.eye(3)[0] for axis in axes]
    if kind in ("revolute", "prismatic") and not np.array_equal(axes[0], axes[1]):
        second = second.copy()
        second[:3, :3] = second[:3, :3] @ frame_along(axes[1]) @ frame_along(axes[0]).T
    name = element.get("name") or f"closure_{number}"
    return UrdfJoint(name, kind.upper(), links[0], links[1], first, axes=np.array(axes)), second


def attached_by(plugin: ET.Element) -> ET.Element:
    """The fixed joint of SDF that a plugin makes of two links once a simulation runs; else the plugin itself."""
    joint = ET.Element("joint", name=plugin.get("name", "").rpartition("::")[2], type="fixed")
    for end in ("parent", "child"):
        ET.SubElement(joint, end).text = (plugin.findtext(f"{end}_link") or plugin.findtext(end) or "").strip()
    is_bond = all(end.text for end in joint) and re.search("attach|detach", joint.get("name", ""), re.IGNORECASE)
    return joint if is_bond else plugin


def named_in(element: ET.Element) -> str:
    """The name that an element has as an attribute, or as its text."""
    keys = ("link", "name", "value", "body")
    return next((element.attrib[key] for key in keys if key in element.attrib), element.text or "").strip()


def _place(element: ET.Element, side: ET.Element) -> Floats:
    """The place (4, 4) [m] of a loop on one of its links; ValueError where it is no numbers."""
    for each in (side, side.find("origin"), element.find(f"{side.tag}_origin")):
        if each is not None and {"xyz", "rpy"} & {*each.attrib}:
            return origin_of(each)
    for each in element:
        if re.fullmatch(rf".*_p_{side.tag[-1]}[PQ]", each.tag, re.IGNORECASE):
            point = numbers_in(named_in(each), 3)
            if point is None:
                raise ValueError
            return frame_at(point, np.zeros(3))
    return HERE


def _axis(element: ET.Element, side: ET.Element) -> Floats:
    """The axis of a loop on one of its links (3,); 0 where it has none, ValueError where it is no numbers."""
    own = (element.find(f"{side.tag}_axis"), side.find("axis"), element.find("axis"))
    return vector_in(next((each for each in own if each is not None), None), "xyz")


def unread_loops(
    element: ET.Element, bodies: Collection[str], root: str, known: Collection[frozenset[str]], remedy: str
) -> Iterator[Fault]:
    """Yield the innermost elements in one that name two bodies, or a parent and a child, each as a fault.

    Parameters
    ----------
    root : the body that others hang on; what binds it alone, as to the world, closes no loop.
    known : pairs of bodies whose loop is described elsewhere.
    remedy : what is expected in place of such an element.
    """
    tag = element.tag
    if tag in HARMLESS or "collision" in tag:
        return
    inner = [fault for child in element for fault in unread_loops(child, bodies, root, known, remedy)]
    yield from (replace(fault, place=f"<{tag}>{fault.place}") for fault in inner)
    names = links_named(element, bodies)
    keys = {*element.attrib, *(child.tag for child in element)}
    is_pair = {"parent", "child"} <= keys and set(names) != {root}
    if not inner and (len(names) > 1 or is_pair) and frozenset(names) not in known:
        between = " and ".join(f"'{name}'" for name in names) or "two bodies"
        name = element.get("name")
        yield Fault(f"<{tag}>" + (f" '{name}'" if name else ""), f"a bond of {between} that is not read", remedy)


def links_named(element: ET.Element, bodies: Collection[str]) -> list[str]:
    """The bodies that an element names, each once."""
    return [*dict.fromkeys(_names(element, bodies))]


def _names(element: ET.Element, bodies: Collection[str]) -> Iterator[str]:
    """Yield the bodies that attributes and texts in an element name, outside harmless ones."""
    if element.tag in HARMLESS or "collision" in element.tag:
        return
    for text in (*element.attrib.values(), element.text or ""):
        name = text.strip().rpartition("::")[2]
        words = [name] if name in bodies else text.replace(",", " ").split()
        if all(word in bodies for word in words):
            yield from words
    for child in element:
        yield from _names(child, bodies)
