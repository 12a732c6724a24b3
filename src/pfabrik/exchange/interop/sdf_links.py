"""The links and joints of one model in SDF, as a tree of links and the joints that close its loops."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np

from ...common.arrays import Floats
from ...common.rotations import from_quaternion
from ...errors import Fault, InvalidMechanism, near_miss
from ...machine.description.graph import Edge, spanning_tree
from ...machine.description.joints import Joint
from .digits import FEWEST, NOTHING, Rounding, digits_of
from .notes import Note, note_names
from .told_loops import named_in
from .urdf_links import HERE, MOST_FAULTS, UrdfJoint, UrdfLinks, frame_at
from .xml_fields import Field, coupling_of, drive_of, read_fields, rotor_of, text_at
from .xml_reading import fault, number, numbers_in

TYPES = ("revolute", "continuous", "prismatic", "fixed", "ball", "universal")
"""Joint types of SDF that are read."""

MODEL = "__model__"
"""The frame in which poses are, unless they say otherwise."""

WORLD = "world"

AXES = {tag: Field(f"{tag}/xyz", (0.0, 0.0, 1.0)) for tag in ("axis", "axis2")}
"""Directions of a joint."""

OLD = ("1.0", "1.2", "1.3", "1.4")
"""Versions in which axes are in the model's frame."""

CUT_LAST = {"BALL": 2, "REVOLUTE": 1, "CONTINUOUS": 1}
"""Joint types -> how much rather than others they close a loop: those whose coordinates nobody asks for."""


def hung(joint: UrdfJoint, forward: bool, frames: Mapping[str, Floats]) -> UrdfJoint:
    """A joint that is placed in the model as one that hangs a link on another: its child on its parent, if forward."""
    parent, child = (joint.parent, joint.child) if forward else (joint.child, joint.parent)
    ends = (joint.frame, joint.frame if joint.meets is None else joint.meets)
    on_parent, on_child = ends if forward else ends[::-1]
    drawn = frames[child] if joint.meets is None else on_parent @ _within(on_child, frames[child])
    frame, inward = _within(frames[parent], drawn), _within(frames[child], on_child)
    axes = joint.axes if forward else -joint.axes[:: -1 if joint.type == "UNIVERSAL" else 1]
    axes = axes @ joint.frame[:3, :3] @ inward[:3, :3].T
    return replace(joint, parent=parent, child=child, frame=frame, point=inward[:3, 3], axes=axes, meets=None)


def closing(joint: UrdfJoint, frames: Mapping[str, Floats]) -> tuple[UrdfJoint, Floats]:
    """A joint that is placed in the model as one that closes a loop, and its place (4, 4) [m] in its child's frame."""
    frame = _within(frames[joint.parent], joint.frame)
    on_child = _within(frames[joint.child], joint.frame if joint.meets is None else joint.meets)
    return replace(joint, frame=frame, axes=joint.axes @ joint.frame[:3, :3], meets=None), on_child


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
    known : links that are placed already, (4, 4) [m].
    """

    def __init__(self, model: ET.Element, known: Mapping[str, Floats]) -> None:
        self.elements = {each.get("name", ""): each for each in model if each.tag in ("link", "frame", "joint")}
        links = [name for name, each in self.elements.items() if each.tag == "link"]
        self.links, self._canonical = {*(known or [WORLD]), *links}, model.get("canonical_link") or "".join(links[:1])
        self.frames: dict[str, Floats] = {MODEL: HERE, WORLD: HERE, **known}
        self.roundings: dict[str, Rounding] = dict.fromkeys(self.frames, NOTHING)
        poses = [(each.findtext("pose") or "").split() for each in self.elements.values()]
        self._lengths = digits_of(" ".join(words[:3]) for words in poses)
        self._turns = digits_of(" ".join(words[3:]) for words in poses)

    def link(self, name: str, place: str) -> str:
        """The link that a name of a link, or of a frame or joint on one, stands for."""
        seen: set[str] = set()
        while name not in self.links and name in (*self.elements, MODEL) and name not in seen:
            seen.add(name)
            element = self.elements.get(name)
            on = "" if element is None else _end(element, "child") or element.get("attached_to", MODEL)
            name = on or self._canonical
        if name not in self.links:
            found = "which is attached to itself" if name in seen else f"no link{near_miss(name, self.links)}"
            raise fault(place, f"'{name}', {found}", "a link of the model, or a frame on one")
        return name

    def __getitem__(self, name: str) -> Floats:
        """The place of a frame in the model, (4, 4) [m]."""
        chain: dict[str, ET.Element] = {}
        while name not in self.frames:
            if name not in self.elements or name in chain:
                found = "relative to itself" if name in chain else f"no frame{near_miss(name, self.elements)}"
                raise fault(f"pose of '{next(iter(chain), name)}'", f"'{name}', {found}", "a frame of the model")
            chain[name] = self.elements[name]
            name = _base(chain[name])
        for each, element in reversed(chain.items()):
            pose = element.find("pose")
            local = pose_in(pose, f"pose of '{each}'")
            turn = [] if pose is None else [float(word) for word in (pose.text or "").split()[3:]]
            angle = self._turns.error(turn, FEWEST - 1) * (np.pi / 180.0 if _is_in_degrees(pose) else 1.0)
            self.roundings[each] = self.roundings[name].on(local[:3, 3], self._lengths.error(local[:3, 3]), angle)
            self.frames[each] = self.frames[name] @ local
            name = each
        return self.frames[name]


def pose_in(pose: ET.Element | None, place: str) -> Floats:
    """The frame (4, 4) [m] of a <pose>."""
    text = "" if pose is None else (pose.text or "").strip()
    if pose is None or not text:
        return HERE
    is_quaternion = pose.get("rotation_format") == "quat_xyzw"
    values = numbers_in(text, 7 if is_quaternion else 6)
    if values is None or (is_quaternion and not values[3:].any()):
        raise fault(place, f"'{text}'", f"x y z and {'a quaternion x y z w' if is_quaternion else 'roll pitch yaw'}")
    if is_quaternion:
        frame = frame_at(values[:3], np.zeros(3))
        frame[:3, :3] = from_quaternion(values[3:])
        return frame
    return frame_at(values[:3], np.radians(values[3:]) if _is_in_degrees(pose) else values[3:])


def _is_in_degrees(pose: ET.Element | None) -> bool:
    return pose is not None and pose.get("degrees") in ("true", "1")


def _end(joint: ET.Element, end: str) -> str:
    """The name of a joint's parent or child, without that of its model."""
    element = joint.find(end)
    return "" if element is None else named_in(element).rpartition("::")[2]


def _base(element: ET.Element) -> str:
    """The frame that an element's pose is relative to."""
    pose = element.find("pose")
    default = {"joint": _end(element, "child"), "frame": element.get("attached_to", "")}
    return (pose.get("relative_to", "") if pose is not None else "") or default.get(element.tag, "") or MODEL


def read_sdf(root: ET.Element, asked: Collection[str], notes: list[Note]) -> UrdfLinks:
    """The links of the one model in a file, hung on each other by joints whose coordinates somebody asks for first.

    Parameters
    ----------
    asked : names of the joints that a caller drives or holds.
    """
    model = only_model(root, notes)
    name = model.get("name", "mechanism")
    place, poses = f"model '{name}'", Poses(model, {})
    counts = Counter(each.get("name", "") for each in model if each.tag in ("link", "frame", "joint"))
    for each in [each for each, count in counts.items() if count > 1 or each in ("", WORLD, MODEL)]:
        raise fault(place, f"the name '{each}', which is empty, reserved or used twice", "a name of its own")
    joints: list[UrdfJoint] = []
    faults: list[Fault] = []
    for element in model.findall("joint"):
        try:
            joints.append(sdf_joint(element, poses, root.get("version", "")))
        except InvalidMechanism as error:
            faults += error.faults
    if faults:
        raise InvalidMechanism(faults[:MOST_FAULTS])
    links = [link.get("name", "") for link in model.findall("link")]
    children = {joint.child for joint in joints}
    free = next((link for link in links if link not in children), (links or [WORLD])[0])
    base = WORLD if any(WORLD in (joint.parent, joint.child) for joint in joints) else free
    frames = {link: poses[link] for link in (base, *links)}
    driven = _driven(model)
    begun = [each.get("name", "") for each in model.findall("joint") if number(each, "axis/initial_position")]
    note_names(notes, "initial positions are left out, of", begun)
    named = {*driven, *asked, *(joint.name for joint in joints if joint.limits is not None or joint.mimic is not None)}
    kept_first = sorted(joints, key=lambda joint: 0 if joint.name in named else CUT_LAST.get(joint.type, 0))
    ends = [(joint.parent, joint.child) for joint in kept_first]
    grown = spanning_tree([Edge(Joint("", "fixed", pair), pair) for pair in ends], base)
    apart = [link for link in links if link not in grown.paths]
    if apart:
        found = f"links that no joint connects with '{base}' ({', '.join(apart[:5])})"
        raise fault(place, found, "joints between all links")
    hanging = [(kept_first[index], forward) for index, forward in grown.steps]
    outward = [hung(joint, forward, frames) for joint, forward in hanging]
    for each in (element.get("name", "") for element in model.findall("frame")):
        link = poses.link(each, f"frame '{each}'")
        frames[each] = poses[each]
        outward.append(UrdfJoint(f"{each}_frame", "FIXED", link, each, _within(frames[link], frames[each])))
    loops = [closing(joint, frames) for joint in joints if joint.name not in {each.name for each, _ in hanging}]
    if any(joint.meets is not None for joint in joints):  # links are not where they are drawn
        for joint in outward:
            frames[joint.child] = frames[joint.parent] @ joint.frame
    of_joints = {joint.name: poses.roundings[joint.name] for joint in joints}
    of_links = {link: poses.roundings[link] for link in frames}
    tree = UrdfLinks(name, base, outward, frames, of_links, of_joints, driven)
    return tree.closed_by(loops, asked)


def sdf_joint(element: ET.Element, poses: Poses, version: str = "") -> UrdfJoint:
    """A <joint> of SDF, in a model or in the <gazebo> of a URDF; its frame and axes in the model."""
    name, kind = element.get("name", ""), element.get("type", "")
    place = f"joint '{name}'"
    if kind not in TYPES:
        ways = "; what couples joints goes by --actuated or --fixed"
        raise fault(place, f"type '{kind}'", f"one of {', '.join(TYPES)}{ways}")
    parent, child = (poses.link(_end(element, end), f"{place}.{end}") for end in ("parent", "child"))
    if parent == child:
        raise fault(place, f"'{parent}' as parent and as child", "two links")
    frame, meets = (_place_on(poses, element, end) for end in ("parent", "child"))
    across, faults = frame[:3, :3] @ poses[name][:3, :3].T, list[Fault]()
    directions = read_fields(element, AXES, place, faults)
    idle = [tag for tag, xyz in directions.items() if not xyz.any()]
    faults += [Fault(f"{place}.{tag}", "no direction", "three numbers, not all zero") for tag in idle]
    axes = [across @ _turn_of(element, tag, poses, version) @ xyz for tag, xyz in directions.items()]
    mimic = next((each for path in ("axis/mimic", "mimic") if (each := element.find(path)) is not None), None)
    is_apart = any(element.find(f"{end}_frame") is not None for end in ("parent", "child"))
    joint = UrdfJoint(
        name,
        kind.upper(),
        parent,
        child,
        frame,
        axes=np.array(axes),
        meets=meets if is_apart else None,
        rotor=rotor_of(element, place, faults),
        mimic=coupling_of(name, mimic, poses.elements, place, faults),
        **drive_of(kind.upper(), element.find("axis"), f"{place}.axis", faults),
    )
    if faults:
        raise InvalidMechanism(faults)
    return joint


def _turn_of(joint: ET.Element, tag: str, poses: Poses, version: str) -> Floats:
    """The rotation (3, 3) of the frame in which an axis of a joint is, in the model."""
    by_model = text_at(joint, f"{tag}/use_parent_model_frame") in ("1", "true") or version in OLD
    base = MODEL if by_model else text_at(joint, f"{tag}/xyz/expressed_in") or joint.get("name", "")
    return poses[base][:3, :3]


def _place_on(poses: Poses, joint: ET.Element, end: str) -> Floats:
    """The place of a joint's frame on its parent or child, (4, 4) [m] in the model.

    Drake's `parent_frame` and `child_frame` are two frames that meet at zero; without, both are the joint's own.
    """
    name = joint.get("name", "")
    given, place = _end(joint, f"{end}_frame"), f"joint '{name}'.{end}_frame"
    if not given:
        return poses[name]
    link, own = poses.link(given, place), poses.link(_end(joint, end), f"joint '{name}'.{end}")
    if link != own:
        raise fault(place, f"'{given}', which is on '{link}'", f"a frame on '{own}'")
    return poses[given]


def _driven(model: ET.Element) -> list[str]:
    """The joints that plugins name, which drive them, but for those that publish where joints are."""
    plugins = [each for each in model.findall("plugin") if "publisher" not in each.get("name", "").lower()]
    named = [(each.text or "").strip() for plugin in plugins for each in plugin.iter("joint_name")]
    return [*dict.fromkeys(named)]


def only_model(root: ET.Element, notes: list[Note]) -> ET.Element:
    """The one model of a file; refused where there are more, or where it is put together from others."""
    every = [*root.findall("model"), *root.findall("world/model")]
    models = [model for model in every if model.find("joint") is not None] or every
    flat = "one model in one piece, as `gz sdf -p FILE` prints it"
    if len(models) != 1:
        names = ", ".join(each.get("name", "") for each in models[:5])
        raise fault("sdf", f"{len(models)} models" + f" ({names})" * bool(models), flat)
    for tag in ("include", "model"):
        if (inner := models[0].find(tag)) is not None:
            name = inner.get("name") or (inner.findtext("uri") or "").strip()
            raise fault(f"model '{models[0].get('name', '')}'", f"<{tag}> '{name}' within it", flat)
    beside = [each.get("name", "") for each in every if each is not models[0]]
    beside += [(each.findtext("uri") or "").strip() for each in root.findall("world/include")]
    note_names(notes, "what the world has beside the model is left out", beside)
    if pose_in(models[0].find("pose"), "pose of the model").tolist() != HERE.tolist():
        notes.append(Note("base coordinates are those of the model: its own pose in the world is left out"))
    return models[0]
