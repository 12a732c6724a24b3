"""The links and joints of a robot description (URDF), checked, with their numbers as the file writes them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree as ET

import numpy as np

from ..arrays import Floats
from ..description.joint_types import JointType
from ..errors import Fault, InvalidMechanism
from ..rotations import from_rpy, square_to
from .couplings import Coupling
from .xml_reading import fault

TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
"""Joint types of URDF."""


@dataclass(frozen=True)
class UrdfJoint:
    """A joint of a description.

    Attributes
    ----------
    type : as of URDF, or of a file of loops that retypes it, in capitals.
    parent, child : its links; the child's frame is the joint's.
    xyz, rpy, axis_text : three numbers each, as they are written [m], [rad].
    limits : least and largest coordinate [rad or m]; None where the file has none.
    max_speed : [rad/s or m/s]; None where the file has none, or 0, which stands for none.
    mimic : how it follows another joint; None where it does not.
    """

    name: str
    type: str
    parent: str
    child: str
    xyz: str
    rpy: str
    axis_text: str
    limits: tuple[float, float] | None
    max_speed: float | None
    mimic: Coupling | None

    @property
    def frame(self) -> Floats:
        """The joint's frame at zero in that of its parent, (4, 4) [m]."""
        return frame_at(self.xyz, self.rpy)

    @property
    def axis(self) -> Floats:
        """The direction of the axis in the joint's frame, (3,), of any length but zero."""
        return numbers_in(self.axis_text)

    def elementary(self) -> list[tuple[str, JointType, Floats | None]]:
        """Names, types and axes (3,), in the joint's frame, of the joints that it is, from its parent to its child."""
        x, y, z = np.eye(3)
        letters = {"X": x, "Y": y, "Z": z}
        parts: list[tuple[str, JointType, Floats | None]]
        if self.type == "FIXED":
            parts = [("", "fixed", None)]
        elif self.type == "SPHERICAL":
            parts = [("", "spherical", None)]
        elif self.type == "FLOATING":
            parts = [("_x", "prismatic", x), ("_y", "prismatic", y), ("_z", "prismatic", z), ("", "spherical", None)]
        elif self.type.startswith("UJOINT_"):
            parts = [(f"_{letter}", "revolute", letters[letter]) for letter in self.type[-2:]]
        elif self.type == "PLANAR":
            first, second = square_to(self.axis)
            parts = [("_x", "prismatic", first), ("_y", "prismatic", second), ("", "revolute", self.axis)]
        else:
            parts = [("", "prismatic" if self.type == "PRISMATIC" else "revolute", self.axis)]
        return [(self.name + suffix, kind, axis) for suffix, kind, axis in parts]


@dataclass(frozen=True)
class UrdfLinks:
    """The tree of a description's links.

    Attributes
    ----------
    root : the link from which all others hang.
    joints : from the root outward.
    frames : link -> its frame at zero in that of the root, (4, 4) [m].
    link_of : joint -> its child, whose frame is the joint's.
    driven : names of the joints that a transmission drives.
    """

    name: str
    root: str
    joints: Sequence[UrdfJoint]
    frames: Mapping[str, Floats]
    link_of: Mapping[str, str]
    driven: Sequence[str]


def read_links(root: ET.Element, retyped: Mapping[str, str]) -> UrdfLinks:
    """The links of a description; InvalidMechanism with every fault.

    Parameters
    ----------
    retyped : joint -> its type, in place of that of the description.
    """
    faults = list(_faults(root))
    if faults:
        raise InvalidMechanism(faults)
    joints = [_joint(element, retyped) for element in root.iterfind("joint")]
    link_of = {joint.name: joint.child for joint in joints}
    names = [link.get("name", "") for link in root.iterfind("link")]
    roots = [name for name in names if name not in link_of.values()]
    if len(roots) != 1:
        found = f"{len(roots)} links that are no child" + (f" ({', '.join(roots[:5])})" if roots else "")
        raise fault("robot", found, "one, from which all others hang")
    children: dict[str, list[UrdfJoint]] = {}
    for joint in joints:
        children.setdefault(joint.parent, []).append(joint)
    frames: dict[str, Floats] = {roots[0]: np.eye(4)}
    outward: list[UrdfJoint] = []
    links = [roots[0]]
    for link in links:  # grows while it is looked through
        for joint in children.get(link, []):
            frames[joint.child] = frames[link] @ joint.frame
            outward.append(joint)
            links.append(joint.child)
    apart = [name for name in names if name not in frames]
    if apart:
        raise fault("robot", f"links that do not hang on '{roots[0]}' ({', '.join(apart[:5])})", "a tree of all links")
    transmitted = dict.fromkeys(joint.get("name", "") for joint in root.iterfind("transmission/joint"))
    driven = [name for name in transmitted if name in link_of]
    return UrdfLinks(root.get("name", "mechanism"), roots[0], outward, frames, link_of, driven)


def frame_at(xyz: str, rpy: str) -> Floats:
    """A frame (4, 4) at three numbers [m], turned by roll, pitch and yaw [rad]."""
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = from_rpy(numbers_in(rpy)), numbers_in(xyz)
    return frame


def numbers_in(text: str) -> Floats:
    """The numbers of a text, with blanks between them."""
    return np.array([float(word) for word in text.split()])


def _joint(element: ET.Element, retyped: Mapping[str, str]) -> UrdfJoint:
    name, origin, limit = element.get("name", ""), element.find("origin"), element.find("limit")
    is_limited = limit is not None and ("lower" in limit.attrib or "upper" in limit.attrib)
    limits = (_number(limit, "lower", 0.0), _number(limit, "upper", 0.0))
    speed = _number(limit, "velocity", 0.0)
    return UrdfJoint(
        name,
        retyped.get(name, element.get("type", "")).upper(),
        _link(element, "parent"),
        _link(element, "child"),
        _text(origin, "xyz", "0 0 0"),
        _text(origin, "rpy", "0 0 0"),
        _text(element.find("axis"), "xyz", "1 0 0"),
        limits if is_limited else None,
        speed if speed > 0.0 else None,
        _coupling(name, element.find("mimic")),
    )


def _coupling(name: str, mimic: ET.Element | None) -> Coupling | None:
    if mimic is None:
        return None
    return Coupling(name, mimic.get("joint", ""), (_number(mimic, "offset", 0.0), _number(mimic, "multiplier", 1.0)))


def _link(joint: ET.Element, end: str) -> str:
    """Name of a joint's parent or child."""
    return _text(joint.find(end), "link", "")


def _text(element: ET.Element | None, key: str, default: str) -> str:
    return default if element is None else element.get(key, default)


def _number(element: ET.Element | None, key: str, default: float) -> float:
    return float(_text(element, key, str(default)))


def _faults(root: ET.Element) -> Iterator[Fault]:
    """Yield what keeps the links and joints from being read, each at its joint."""
    links = [link.get("name", "") for link in root.iterfind("link")]
    names = [joint.get("name", "") for joint in root.iterfind("joint")]
    for kind, listed in (("link", links), ("joint", names)):
        for name in sorted({name for name in listed if not name or listed.count(name) > 1}):
            yield Fault(f"{kind} '{name}'", "a name that is empty, or used twice", "a name of its own")
    children: set[str] = set()
    for joint in root.iterfind("joint"):
        place = f"joint '{joint.get('name', '')}'"
        if joint.get("type") not in TYPES:
            yield Fault(place, f"type '{joint.get('type')}'", f"one of {', '.join(TYPES)}")
        for end in ("parent", "child"):
            if _link(joint, end) not in links:
                yield Fault(f"{place}.{end}", f"'{_link(joint, end)}'", "a link of the robot")
        if _link(joint, "child") in children:
            yield Fault(f"{place}.child", f"'{_link(joint, 'child')}', which hangs on another joint too", "a tree")
        children.add(_link(joint, "child"))
        for tag in ("origin", "axis", "limit"):
            element = joint.find(tag)
            for key, text in () if element is None else element.attrib.items():
                count = 3 if key in ("xyz", "rpy") else 1
                if not _is_numbers(text, count):
                    yield Fault(f"{place}.{tag}.{key}", f"'{text}'", f"{count} numbers; xacro files want xacro")
        yield from _mimic_faults(place, joint.find("mimic"), names)
        axis = _text(joint.find("axis"), "xyz", "1 0 0")
        if joint.get("type") not in ("fixed", "floating") and not (_is_numbers(axis, 3) and numbers_in(axis).any()):
            yield Fault(f"{place}.axis", "no direction", "three numbers, not all zero")


def _mimic_faults(place: str, mimic: ET.Element | None, names: Sequence[str]) -> Iterator[Fault]:
    if mimic is None:
        return
    if mimic.get("joint", "") not in names:
        yield Fault(f"{place}.mimic.joint", f"'{mimic.get('joint', '')}'", "a joint of the robot")
    for key in ("multiplier", "offset"):
        if not _is_numbers(mimic.get(key, "0"), 1):
            yield Fault(f"{place}.mimic.{key}", f"'{mimic.get(key)}'", "a number")


def _is_numbers(text: str, count: int) -> bool:
    try:
        values = numbers_in(text)
    except ValueError:
        return False
    return len(values) == count and bool(np.isfinite(values).all())
