"""The links and joints of one model in SDF, as a tree of links and the joints that close its loops."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import NamedTuple
from xml.etree import ElementTree as ET

import numpy as np

from ..arrays import Floats
from ..errors import Fault, InvalidMechanism, near_miss
from ..rotations import from_quaternion
from .couplings import Coupling
from .digits import FEWEST, NOTHING, Rounding, digits_of
from .notes import Note
from .told_loops import named_in
from .urdf_links import HERE, MOST_FAULTS, UrdfJoint, UrdfLinks, frame_at, placed_at, require_few
from .xml_reading import fault, numbers_in

TYPES = ("revolute", "continuous", "prismatic", "fixed", "ball", "universal")
"""Joint types of SDF that are read."""

MODEL = "__model__"
"""The frame in which poses are, unless they say otherwise."""

WORLD = "world"

ENDLESS = 1e16
"""A limit [rad or m] that stands for none."""

CUT_LAST = {"ball": 2, "revolute": 1, "continuous": 1}
"""Joint types -> how much rather than others they close a loop: those whose coordinates nobody asks for."""


class SdfJoint(NamedTuple):
    """A joint of a model: its place (4, 4) [m] and axes (2, 3) in the model, else as of `UrdfJoint`."""

    name: str
    type: str
    parent: str
    child: str
    place: Floats
    axes: Floats
    limits: tuple[float, float] | None
    max_speed: float | None
    mimic: Coupling | None

    def between(self, parent: str, child: str, frames: Mapping[str, Floats]) -> UrdfJoint:
        """The joint that hangs a link on another, whichever is its child in the file."""
        frame, inward = _within(frames[parent], frames[child]), _within(frames[child], HERE)
        axes = self.axes if child == self.child else -self.axes[:: -1 if self.type == "universal" else 1]
        point = (inward @ self.place)[:3, 3]
        return self._joint(parent, child, frame, point, axes @ inward[:3, :3].T)

    def closing(self, frames: Mapping[str, Floats]) -> tuple[UrdfJoint, Floats]:
        """The joint as one that closes a loop, and its place (4, 4) [m] in its child's frame."""
        frame, on_child = (_within(frames[link], self.place) for link in (self.parent, self.child))
        return self._joint(self.parent, self.child, frame, np.zeros(3), self.axes @ self.place[:3, :3]), on_child

    def _joint(self, parent: str, child: str, frame: Floats, point: Floats, axes: Floats) -> UrdfJoint:
        placed = placed_at(frame[:3, 3], frame[:3, :3])
        more = (self.limits, self.max_speed, self.mimic)
        return UrdfJoint(self.name, self.type.upper(), parent, child, frame, placed, point, axes, *more)


def _within(outer: Floats, frame: Floats) -> Floats:
    """A frame (4, 4) in another."""
    turn = outer[:3, :3].T
    inner = np.eye(4)
    inner[:3, :3], inner[:3, 3] = turn @ frame[:3, :3], turn @ (frame[:3, 3] - outer[:3, 3])
    return inner


class Poses:
    """The frames of a model: its links, joints and frames, each relative to another.

    Parameters
    ----------
    known : frames that are placed already, (4, 4) [m].
    """

    def __init__(self, model: ET.Element, known: Mapping[str, Floats]) -> None:
        self.elements = {
            each.get("name", ""): each for tag in ("link", "frame", "joint") for each in model.findall(tag)
        }
        self.frames: dict[str, Floats] = {MODEL: HERE, WORLD: HERE, **known}
        self.roundings: dict[str, Rounding] = dict.fromkeys(self.frames, NOTHING)
        poses = [(each.findtext("pose") or "").split() for each in self.elements.values()]
        self._lengths = digits_of(" ".join(words[:3]) for words in poses)
        self._turns = digits_of(" ".join(words[3:]) for words in poses)

    def link(self, name: str, place: str) -> str:
        """The link that a name of a link or frame stands for."""
        seen = {name}
        while name in self.elements and self.elements[name].tag == "frame":
            name = self.elements[name].get("attached_to", "")
            if name in seen:
                raise fault(place, f"'{name}', a frame attached to itself", "a frame on a link")
            seen.add(name)
        if name != WORLD and (
            name not in self.frames if name not in self.elements else self.elements[name].tag != "link"
        ):
            links = [name for name, each in self.elements.items() if each.tag == "link"] or self.frames
            raise fault(
                place, f"'{name}'{near_miss(name, links)}", "a link of the model; links of nested ones are not read"
            )
        return name

    def __getitem__(self, name: str) -> Floats:
        """The place of a frame in the model, (4, 4) [m]."""
        chain: dict[str, ET.Element] = {}
        while name not in self.frames:
            element = self.elements.get(name)
            if element is None or name in chain:
                found = (
                    "which is relative to itself"
                    if name in chain
                    else f"of no link, joint or frame{near_miss(name, self.elements)}"
                )
                raise fault(f"pose of '{next(iter(chain), name)}'", f"'{name}', {found}", "a frame of the model")
            chain[name] = element
            name = _base(element)
        for each, element in reversed(chain.items()):
            local, length, angle = self._local(element)
            self.frames[each] = self.frames[name] @ local
            self.roundings[each] = self.roundings[name].on(local[:3, 3], length, angle)
            name = each
        return self.frames[name]

    def _local(self, element: ET.Element) -> tuple[Floats, float, float]:
        """An element's pose (4, 4) [m], and the error of its digits [m], [rad]."""
        pose, place = element.find("pose"), f"pose of '{element.get('name', '')}'"
        local = pose_in(pose, place)
        words = [] if pose is None else (pose.text or "").split()
        turn = np.array([float(word) for word in words[3:]])
        length = float(np.linalg.norm(self._lengths.errors(local[:3, 3])))
        angle = float(np.linalg.norm(self._turns.errors(turn, FEWEST - 1)))
        return local, length, np.radians(angle) if pose is not None and pose.get("degrees") in ("true", "1") else angle


def pose_in(pose: ET.Element | None, place: str) -> Floats:
    """The frame (4, 4) [m] of a <pose>."""
    if pose is None or not (pose.text or "").strip():
        return HERE
    is_quaternion = pose.get("rotation_format") == "quat_xyzw"
    values = numbers_in(pose.text or "", 7 if is_quaternion else 6)
    if values is None or (is_quaternion and not values[3:].any()):
        expected = "3 numbers and a quaternion x y z w" if is_quaternion else "6 numbers: x y z roll pitch yaw"
        raise fault(place, f"'{(pose.text or '').strip()}'", expected)
    if is_quaternion:
        frame = frame_at(values[:3], np.zeros(3))
        frame[:3, :3] = from_quaternion(values[3:])
        return frame
    return frame_at(values[:3], np.radians(values[3:]) if pose.get("degrees") in ("true", "1") else values[3:])


def _end(joint: ET.Element, end: str) -> str:
    """The name of a joint's parent or child, without that of its model."""
    element = joint.find(end)
    return "" if element is None else named_in(element).rpartition("::")[2]


def _base(element: ET.Element) -> str:
    """The frame that an element's pose is relative to."""
    pose = element.find("pose")
    default = {"joint": _end(element, "child"), "frame": element.get("attached_to", "")}
    return (pose.get("relative_to", "") if pose is not None else "") or default.get(element.tag, "") or MODEL


def read_sdf(root: ET.Element, notes: list[Note]) -> UrdfLinks:
    """The links of the one model in a file."""
    model = _only_model(root, notes)
    require_few(len(model.findall("joint")))
    names = Counter(each.get("name", "") for tag in ("link", "frame", "joint") for each in model.findall(tag))
    for name, count in names.items():
        if count > 1 or name in ("", WORLD, MODEL):
            raise fault(
                f"model '{model.get('name', '')}'",
                f"the name '{name}', which is empty, reserved or used twice",
                "one each",
            )
    poses, joints = Poses(model, {}), []
    faults: list[Fault] = []
    for element in model.findall("joint"):
        try:
            joints.append(sdf_joint(element, poses, root.get("version", "")))
        except InvalidMechanism as error:
            faults += error.faults
    named = [joint.name for joint in joints]
    for joint in joints:
        if joint.mimic is not None and joint.mimic.leader not in named:
            leader = joint.mimic.leader
            faults.append(
                Fault(f"joint '{joint.name}'.mimic", f"'{leader}'{near_miss(leader, named)}", "another joint")
            )
    if faults:
        raise InvalidMechanism(faults[:MOST_FAULTS])
    links = [link.get("name", "") for link in model.findall("link")]
    children = {joint.child for joint in joints}
    is_held = any(WORLD in (joint.parent, joint.child) for joint in joints)
    base = WORLD if is_held else next((link for link in links if link not in children), (links or [WORLD])[0])
    frames = {link: poses[link] for link in ([WORLD] if is_held else []) + links}
    driven = _driven(model, named)
    return _tree(model, base, joints, frames, poses, driven)


def _tree(
    model: ET.Element,
    base: str,
    joints: Sequence[SdfJoint],
    frames: Mapping[str, Floats],
    poses: Poses,
    driven: Sequence[str],
) -> UrdfLinks:
    """A tree of all links, and the joints that are left as what closes its loops."""
    group = {link: link for link in frames}

    def first_of(link: str) -> str:
        while group[link] != link:
            group[link] = link = group[group[link]]
        return link

    tree: list[SdfJoint] = []
    closing: list[SdfJoint] = []
    is_asked = {joint.name: bool(joint.name in driven or joint.limits or joint.mimic) for joint in joints}
    for joint in sorted(joints, key=lambda each: 0 if is_asked[each.name] else CUT_LAST.get(each.type, 0)):
        one, other = first_of(joint.parent), first_of(joint.child)
        (closing if one == other else tree).append(joint)
        group[one] = other
    hanging: dict[str, list[tuple[SdfJoint, str]]] = {}
    for joint in tree:
        hanging.setdefault(joint.parent, []).append((joint, joint.child))
        hanging.setdefault(joint.child, []).append((joint, joint.parent))
    reached, outward = [base], []
    for link in reached:  # grows while it is looked through
        for joint, other in hanging.get(link, []):
            if other not in reached:
                outward.append(joint.between(link, other, frames))
                reached.append(other)
    apart = [link for link in frames if link not in reached]
    if apart:
        found = f"links that no joint connects with '{base}' ({', '.join(apart[:5])})"
        raise fault(f"model '{model.get('name', '')}'", found, "joints between all links")
    points = {
        name: (poses.link(name, "frame"), poses[name][:3, 3])
        for name, each in poses.elements.items()
        if each.tag == "frame"
    }
    roundings = {link: poses.roundings[link] for link in frames}
    of_joints = {joint.name: poses.roundings[joint.name] for joint in joints}
    name = model.get("name", "mechanism")
    links = UrdfLinks(name, base, outward, frames, roundings, of_joints, driven, points=points)
    return links.closed_by([joint.closing(frames) for joint in closing])


def sdf_joint(element: ET.Element, poses: Poses, version: str = "") -> SdfJoint:
    """A <joint> of SDF, in a model or in the <gazebo> of a URDF."""
    name, kind = element.get("name", ""), element.get("type", "")
    place = f"joint '{name}'"
    if kind not in TYPES:
        raise fault(
            place, f"type '{kind}'", f"one of {', '.join(TYPES)}; what couples joints goes by --actuated or --fixed"
        )
    parent, child = (poses.link(_end(element, end), f"{place}.{end}") for end in ("parent", "child"))
    if parent == child:
        raise fault(place, f"'{parent}' as parent and as child", "two links")
    at = poses[name]
    axes = []
    for tag in ("axis", "axis2"):
        axis, xyz = element.find(tag), element.find(f"{tag}/xyz")
        direction = numbers_in("0 0 1" if xyz is None else xyz.text or "", 3)
        if direction is None or not direction.any():
            raise fault(f"{place}.{tag}", "no direction", "three numbers, not all zero")
        said = (axis.findtext("use_parent_model_frame") or "").strip() if axis is not None else ""
        is_old = said in ("1", "true") or (version[:3] in ("1.0", "1.2", "1.3", "1.4") and len(version) == 3)
        frame = xyz.get("expressed_in", "") if xyz is not None else ""
        axes.append((HERE if is_old else poses[frame] if frame else at)[:3, :3] @ direction)
    low, high, speed = (_limit(element, key, place) for key in ("lower", "upper", "velocity"))
    is_limited = kind in ("revolute", "prismatic") and max(abs(low), abs(high)) < ENDLESS
    mimic = next((each for tag in ("axis/mimic", "mimic") if (each := element.find(tag)) is not None), None)
    return SdfJoint(
        name,
        kind,
        parent,
        child,
        at,
        np.array(axes),
        (low, high) if is_limited else None,
        speed if 0.0 < speed < ENDLESS else None,
        None if mimic is None else _coupling(name, mimic, place),
    )


def _limit(element: ET.Element, key: str, place: str) -> float:
    """A limit of a joint's first axis; endless where it has none."""
    default = -np.inf if key == "lower" else np.inf
    text = (element.findtext(f"axis/limit/{key}") or str(default)).strip()
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if np.isnan(value):
        raise fault(f"{place}.limit.{key}", f"'{text}'", "a number")
    return value


def _coupling(name: str, mimic: ET.Element, place: str) -> Coupling:
    """How a joint follows another: by its multiple of the leader's distance from a reference, and an offset."""
    values = []
    for key, default in (("multiplier", "1"), ("offset", "0"), ("reference", "0")):
        value = numbers_in(mimic.get(key) or mimic.findtext(key) or default, 1)
        if value is None:
            raise fault(f"{place}.mimic.{key}", "no number", "a number")
        values.append(float(value[0]))
    ratio, offset, reference = values
    return Coupling(name, mimic.get("joint", ""), (offset - ratio * reference, ratio))


def _driven(model: ET.Element, joints: Sequence[str]) -> list[str]:
    """The joints that a controller drives."""
    named = [
        (each.text or "").strip()
        for plugin in model.findall("plugin")
        if "controller" in f"{plugin.get('name', '')} {plugin.get('filename', '')}".lower()
        for each in plugin.iter("joint_name")
    ]
    return [name for name in dict.fromkeys(named) if name in joints]


def _only_model(root: ET.Element, notes: list[Note]) -> ET.Element:
    """The one model of a file; refused where there are more, or where it is put together from others."""
    models = [*root.findall("model"), *root.findall("world/model")]
    flat = "one model in one piece, as `gz sdf -p FILE` prints it"
    if len(models) != 1:
        found = f"{len(models)} models" + (
            f" ({', '.join(each.get('name', '') for each in models[:5])})" if models else ""
        )
        raise fault("sdf", found, flat)
    for tag in ("include", "model"):
        if (inner := models[0].find(tag)) is not None:
            name = inner.get("name") or (inner.findtext("uri") or "").strip()
            raise fault(f"model '{models[0].get('name', '')}'", f"<{tag}> '{name}' within it", flat)
    included = [(each.findtext("uri") or "").strip() for each in root.findall("world/include")]
    if included:
        notes.append(Note("what the world includes beside the model is left out", tuple(included)))
    if pose_in(models[0].find("pose"), "pose of the model").tolist() != HERE.tolist():
        notes.append(Note("base coordinates are those of the model: its own pose in the world is left out"))
    return models[0]
