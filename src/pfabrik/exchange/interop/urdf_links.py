"""The links and joints of a robot description (URDF), checked, with their numbers as the file writes them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from xml.etree import ElementTree as ET

import numpy as np

from ...common.arrays import Floats
from ...common.rotations import from_rpy, square_to
from ...errors import Fault, InvalidMechanism, near_miss
from ...machine.description.joints import JointType
from .couplings import Coupling
from .digits import FEWEST, NOTHING, Rounding, digits_of
from .loops_file import LinkLoop
from .opened import LoopType, frame_along
from .xml_fields import UNLIMITED, Field, coupling_of, drive_of, read_fields, rotor_of, text_at
from .xml_reading import fault, number_text, numbers_in

TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar", "ball", "spherical", "universal")
"""Joint types that are read: those of URDF, and those that Drake and MuJoCo add."""

MOST_FAULTS = 20
"""Most faults that are told at once."""

ZERO, X = "0 0 0", "1 0 0"
PLACED = {
    "xyz": Field("origin/xyz", (0.0, 0.0, 0.0), "m"),
    "rpy": Field("origin/rpy", (0.0, 0.0, 0.0), "rad"),
    "axis": Field("axis/xyz", (1.0, 0.0, 0.0)),
}
"""Where a joint is."""

HERE: Floats = np.eye(4)
"""A frame that is another's."""


@dataclass(frozen=True)
class UrdfJoint:
    """A joint of a description, from a link to one that hangs on it.

    Attributes
    ----------
    type : as of URDF, or of a file of loops that retypes it, in capitals.
    frame : the child's frame at zero in that of the parent, (4, 4) [m].
    point : the place of the joint in the child's frame, (3,) [m].
    axes : its axis there, of any length but zero, and the second one of a universal joint, (2, 3).
    limits : least and largest coordinate [rad or m]; None where the file has none.
    max_speed : [rad/s or m/s]; None where the file has none, or 0, which stands for none.
    max_acceleration : [rad/s² or m/s²], likewise; max_torque : [N m or N], likewise.
    rotor : the inertia of its motor's rotor [kg m²], and the gear between; friction : dry and viscous, in SI units.
    mimic : how it follows another joint; None where it does not.
    written : `frame` as attributes of MuJoCo, in the numbers of the file; empty where it has none.
    meets : of a joint that is placed in a model, where its frame on the child is drawn, (4, 4) [m], which is there to
        meet `frame`; None where it is drawn where they meet.
    """

    name: str
    type: str
    parent: str
    child: str
    frame: Floats
    point: Floats = field(default_factory=lambda: np.zeros(3))
    axes: Floats = field(default_factory=lambda: np.eye(3)[:2])
    limits: tuple[float, float] | None = None
    max_speed: float | None = None
    max_acceleration: float | None = None
    max_torque: float | None = None
    rotor: tuple[float | None, float | None] = (None, None)
    friction: tuple[float, float] | None = None
    mimic: Coupling | None = None
    written: Mapping[str, str] = field(default_factory=dict)
    meets: Floats | None = None

    def elementary(self) -> list[tuple[str, JointType, Floats | None]]:
        """Names, types and axes (3,), in the child's frame, of the joints that it is, from its parent to its child."""
        x, y, z = np.eye(3)
        letters = {"X": x, "Y": y, "Z": z}
        parts: list[tuple[str, JointType, Floats | None]]
        if self.type == "FIXED":
            parts = [("", "fixed", None)]
        elif self.type in ("SPHERICAL", "BALL"):
            parts = [("", "spherical", None)]
        elif self.type == "FLOATING":
            parts = [("_x", "prismatic", x), ("_y", "prismatic", y), ("_z", "prismatic", z), ("", "spherical", None)]
        elif self.type.startswith("UJOINT_"):
            parts = [(f"_{letter}", "revolute", letters[letter]) for letter in self.type[-2:]]
        elif self.type == "UNIVERSAL":
            parts = [("_1", "revolute", self.axes[0]), ("_2", "revolute", self.axes[1])]
        elif self.type == "PLANAR":
            first, second = square_to(self.axes[0])
            parts = [("_x", "prismatic", first), ("_y", "prismatic", second), ("", "revolute", self.axes[0])]
        else:
            parts = [("", "prismatic" if self.type == "PRISMATIC" else "revolute", self.axes[0])]
        return [(self.name + suffix, kind, axis) for suffix, kind, axis in parts]


@dataclass(frozen=True)
class UrdfLinks:
    """The tree of a description's links, and the loops that the file itself tells.

    Attributes
    ----------
    root : the link from which all others hang.
    joints : from the root outward.
    frames : link -> its frame at zero in base coordinates, (4, 4) [m].
    roundings : link -> how exactly the digits of the file place it [m, rad].
    joint_roundings : joint -> the same.
    driven : names that the file says are driven, of joints unless it is mistaken.
    loops : those of joints whose child hangs on another joint too.
    frame_joints : joint -> the link whose frame it is, where joints are such frames.
    """

    name: str
    root: str
    joints: Sequence[UrdfJoint]
    frames: Mapping[str, Floats]
    roundings: Mapping[str, Rounding]
    joint_roundings: Mapping[str, Rounding]
    driven: Sequence[str]
    loops: Sequence[LinkLoop] = ()
    frame_joints: Mapping[str, str] = field(default_factory=dict)

    def closed_by(self, joints: Sequence[tuple[UrdfJoint, Floats]], asked: Collection[str]) -> UrdfLinks:
        """With joints that close loops, each with its place (4, 4) [m] in its child's frame.

        A ball, a weld and a free hinge are loops; what has coordinates that somebody asks for moves a twin of the
        child, which is welded to it.

        Parameters
        ----------
        asked : names of the joints that a caller drives or holds.
        """
        tree, loops, frames = [*self.joints], [*self.loops], dict(self.frames)
        roundings, joint_roundings = dict(self.roundings), dict(self.joint_roundings)
        for joint, on_child in joints:
            on_parent, name, links = joint.frame, joint.name, (joint.parent, joint.child)
            parts = [kind for _, kind, _ in joint.elementary()]
            kind: LoopType = "spherical" if parts == ["spherical"] else "fixed"
            if parts == ["revolute"] and not (joint.limits or joint.mimic or joint.name in {*self.driven, *asked}):
                kind = "revolute"
            elif parts not in (["spherical"], ["fixed"]):
                twin, offset = f"{joint.child}:{joint.name}", on_parent[:3, 3]
                digits = digits_of([number_text(offset)])
                rounding = self.roundings[joint.parent].on(offset, digits.error(offset), 0.0)
                roundings[twin] = joint_roundings.setdefault(joint.name, rounding)
                frames[twin] = frames[joint.parent] @ on_parent
                tree.append(replace(joint, child=twin))
                on_parent, name, links = HERE, f"{joint.name}:weld", (twin, joint.child)
            sides = np.array([on_parent, on_child])
            if kind == "revolute":
                sides[:, :3, :3] = [frame_along(axis) for axis in sides[:, :3, :3] @ joint.axes[0]]
            loops.append(LinkLoop(name, kind, links, sides))
        placed = replace(self, frames=frames, roundings=roundings, joint_roundings=joint_roundings)
        return replace(placed, joints=tree, loops=loops)


def read_links(root: ET.Element, retyped: Mapping[str, str], asked: Collection[str]) -> UrdfLinks:
    """The links of a description; InvalidMechanism with every fault.

    Parameters
    ----------
    retyped : joint -> its type, in place of that of the description.
    asked : names of the joints that a caller drives or holds.
    """
    joints = _joints(root, retyped)
    first: dict[str, UrdfJoint] = {}
    for joint in joints:
        first.setdefault(joint.child, joint)
    second = [joint for joint in joints if first[joint.child] is not joint]
    _add_gears(root, first)
    names = [link.get("name", "") for link in root.iterfind("link")]
    roots = [name for name in names if name not in first]
    if len(roots) != 1:
        found = f"{len(roots)} links that are no child" + (f" ({', '.join(roots[:5])})" if roots else "")
        raise fault("robot", found, "one, from which all others hang")
    outward = outward_from(roots[0], first.values())
    if apart := set(names) - {roots[0], *(joint.child for joint in outward)}:
        some = ", ".join(sorted(apart)[:5])
        raise fault("robot", f"links that do not hang on '{roots[0]}' ({some})", "a tree of all links")
    frames = {roots[0]: HERE}
    for joint in outward:
        frames[joint.child] = frames[joint.parent] @ joint.frame
    of_links, of_joints = _roundings(outward, second, _axes_written(root), roots[0])
    paths = ("transmission/joint", "ros2_control/joint[command_interface]")
    driven = [each.get("name", "") for path in paths for each in root.iterfind(path)]
    tree = UrdfLinks(
        root.get("name", "mechanism"),
        roots[0],
        outward,
        frames,
        of_links,
        of_joints,
        [*dict.fromkeys(driven)],
        frame_joints={joint.name: joint.child for joint in outward},
    )
    return tree.closed_by([(joint, HERE) for joint in second], asked)


def _joints(root: ET.Element, retyped: Mapping[str, str]) -> list[UrdfJoint]:
    """All joints as the file has them; InvalidMechanism with what keeps them from being read."""
    links, joints = ([each.get("name", "") for each in root.iterfind(tag)] for tag in ("link", "joint"))
    faults = [
        Fault(f"{what} '{name}'", "a name that is empty, or used twice", "a name of its own")
        for what, names in (("link", links), ("joint", joints))
        for name, count in sorted(Counter(names).items())
        if not name or count > 1
    ]
    found = [_joint(element, links, joints, retyped, faults) for element in root.iterfind("joint")]
    if faults:
        raise InvalidMechanism(faults[:MOST_FAULTS])
    return found


def _add_gears(root: ET.Element, joints: dict[str, UrdfJoint]) -> None:
    """Put what elements beside the joints say of drives into the joints, by their children: couplings, and rotors."""
    for element in root.iterfind("coupling"):
        leader, follower = (joints.get(text_at(element, f"{end}/link")) for end in ("predecessor", "successor"))
        ratio = numbers_in(text_at(element, "ratio/value"), 1)
        if leader and follower and ratio is not None and leader.parent == follower.parent:
            coupling = Coupling(follower.name, leader.name, (0.0, float(ratio[0])))
            joints[follower.child] = replace(follower, mimic=coupling)
    for element in root.iterfind("transmission"):
        moved = {each.get("name", "") for each in element.iterfind("joint")}
        rotor = rotor_of(element.find("actuator"), f"transmission '{element.get('name', '')}'", [])
        for joint in [each for each in joints.values() if rotor != (None, None) and each.name in moved]:
            joints[joint.child] = replace(joint, rotor=rotor)


def outward_from(root: str, joints: Iterable[UrdfJoint]) -> list[UrdfJoint]:
    """The joints that hang on a link, directly or through others, from it outward."""
    hanging: dict[str, list[UrdfJoint]] = {}
    for joint in joints:
        hanging.setdefault(joint.parent, []).append(joint)
    outward, links = [], [root]
    for link in links:  # grows while it is looked through
        outward += hanging.pop(link, [])
        links += [joint.child for joint in outward[len(links) - 1 :]]
    return outward


def frame_at(xyz: Floats, rpy: Floats) -> Floats:
    """A frame (4, 4) at a point (3,) [m], turned by roll, pitch and yaw (3,) [rad]."""
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = from_rpy(rpy), xyz
    return frame


def vector_in(element: ET.Element | None, key: str, default: str = ZERO) -> Floats:
    """Three numbers of an attribute; ValueError where it has others."""
    value = numbers_in(text_at(element, key) or default, 3)
    if value is None:
        raise ValueError(key)
    return value


def origin_of(element: ET.Element | None) -> Floats:
    """The frame (4, 4) [m] of an element with `xyz` and `rpy`; ValueError where they are not three numbers each."""
    return frame_at(vector_in(element, "xyz"), vector_in(element, "rpy"))


def _joint(
    element: ET.Element, links: Collection[str], names: Collection[str], retyped: Mapping[str, str], faults: list[Fault]
) -> UrdfJoint:
    name, kind = element.get("name", ""), element.get("type", "")
    place = f"joint '{name}'"
    if kind not in TYPES:
        faults.append(Fault(place, f"type '{kind}'", f"one of {', '.join(TYPES)}"))
    parent, child = (text_at(element, f"{end}/link") for end in ("parent", "child"))
    for end, link in (("parent", parent), ("child", child)):
        if link not in links:
            faults.append(Fault(f"{place}.{end}", f"'{link}'{near_miss(link, links)}", "a link of the robot"))
    said = read_fields(element, PLACED, place, faults)
    if kind not in ("fixed", "floating", "ball", "spherical", "universal") and not said["axis"].any():
        faults.append(Fault(f"{place}.axis", "no direction", "three numbers, not all zero"))
    kind = retyped.get(name, kind).upper()
    ends = (0.0, 0.0) if text_at(element, "limit/lower|limit/upper") else UNLIMITED
    return UrdfJoint(
        name,
        kind,
        parent,
        child,
        frame_at(said["xyz"], said["rpy"]),
        axes=HERE[:2, :3] if kind == "UNIVERSAL" else np.array([said["axis"]] * 2),
        mimic=coupling_of(name, element.find("mimic"), names, place, faults),
        written={"pos": text_at(element, "origin/xyz") or ZERO, "euler": text_at(element, "origin/rpy") or ZERO},
        **drive_of(kind, element, place, faults, ends),
    )


def _axes_written(root: ET.Element) -> list[str]:
    """The axes of all joints as the file writes them."""
    return [text_at(joint, "axis/xyz") or X for joint in root.iterfind("joint")]


def _roundings(
    outward: Sequence[UrdfJoint], closing: Sequence[UrdfJoint], axes_written: Sequence[str], root: str
) -> tuple[dict[str, Rounding], dict[str, Rounding]]:
    """Link, and joint -> how exactly the digits of the file place it [m, rad], from the root outward."""
    lengths, turns = (digits_of(each.written[key] for each in (*outward, *closing)) for key in ("pos", "euler"))
    axes = digits_of(axes_written)
    of_links, of_joints = {root: NOTHING}, {}
    for joint in (*outward, *closing):
        offset, axis = joint.frame[:3, 3], joint.axes[0]
        angle = turns.error([float(word) for word in joint.written["euler"].split()], FEWEST - 1)
        rounding = of_links[joint.parent].on(offset, lengths.error(offset), angle)
        of_links.setdefault(joint.child, rounding)
        skew = axes.error(axis) / np.linalg.norm(axis) if np.count_nonzero(axis) > 1 else 0.0
        of_joints[joint.name] = rounding._replace(angle=rounding.angle + float(skew))
    return of_links, of_joints
