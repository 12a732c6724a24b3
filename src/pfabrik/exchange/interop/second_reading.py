"""Joints of descriptions as a second reader has them, which shares no code with the importer: for `verify`.

Of a URDF, MuJoCo places the links; of an SDF, and of joints beside the links of a URDF, the few lines below do. What
they say of a joint holds in every configuration in which the importer's model is closed, or one of the two is wrong.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import NamedTuple
from xml.etree import ElementTree as ET

import numpy as np
from scipy.spatial.transform import Rotation

from ...common.arrays import Floats

CLOSING = ("loop_joint", "constraint", "loop", "ball_constraint", "weld_constraint")
"""Elements beside links and joints that tell a joint."""

COPY = " in "
"""What stands between the names of a link and of the joint that its copy is for."""

KINDS = ("fixed", "revolute", "prismatic", "universal", "spherical")

STIFF = {"continuous": "revolute", "hinge": "revolute", "pin": "revolute", "weld": "fixed", "ball": "spherical"}
"""Types of joints -> the names that they have here."""


class SaidJoint(NamedTuple):
    """A joint of a file.

    Attributes
    ----------
    kind : "fixed", "revolute", "prismatic", "universal" or "spherical"; nothing is said of others.
    links : its parent and its child.
    sides : its frame on each, (2, 4, 4) [m], which meet at zero.
    axis : in these frames, (3,), of length 1; of a universal joint, that on its parent.
    """

    name: str
    kind: str
    links: tuple[str, str]
    sides: Floats
    axis: Floats

    def error(self, frames: Mapping[str, Floats], value: float | None) -> tuple[float, float]:
        """How far the joint is from what its kind allows, where its links are [m], [rad].

        Parameters
        ----------
        value : its coordinate there [rad or m]; None where it is not known.
        """
        first, second = (frames[link] @ side for link, side in zip(self.links, self.sides, strict=True))
        relative = np.linalg.inv(first) @ second
        shift, turn = relative[:3, 3], Rotation.from_matrix(relative[:3, :3])
        if self.kind == "prismatic":
            shift = shift - self.axis * (shift @ self.axis if value is None else value)
        if self.kind == "revolute" and value is not None:
            turn = Rotation.from_rotvec(-value * self.axis) * turn
        elif self.kind == "revolute":
            turned = turn.apply(self.axis)
            turn = Rotation.from_rotvec(np.cross(self.axis, turned))
        is_free = self.kind in ("spherical", "universal")
        return float(np.linalg.norm(shift)), 0.0 if is_free else float(turn.magnitude())


def joints_said(root: ET.Element, retyped: Mapping[str, str]) -> list[SaidJoint]:
    """The joints of a description, those that close its loops among them.

    Parameters
    ----------
    retyped : joint of a URDF -> its type, in place of that of the description.
    """
    said = _of_sdf(root) if root.tag == "sdf" else _of_urdf(root, retyped)
    return [each for each in said if each.kind in KINDS]


def _of_sdf(root: ET.Element) -> list[SaidJoint]:
    models = [each for each in root.iter("model") if each.find("joint") is not None]
    return [] if len(models) != 1 else list(_placed(models[0], models[0].findall("joint"), {}, root.get("version", "")))


def _placed(
    model: ET.Element, joints: list[ET.Element], links: Mapping[str, Floats], version: str
) -> Iterator[SaidJoint]:
    """Yield joints of SDF.

    Parameters
    ----------
    links : links that are placed elsewhere -> where they are, (4, 4) [m].
    """
    parts = {each.get("name", ""): each for each in model if each.tag in ("link", "frame", "joint")}
    first = next((each.get("name", "") for each in model.iterfind("link")), "")

    def plain(name: str | None) -> str:
        return (name or "").strip().split("::")[-1]

    def place(name: str) -> Floats:
        """Where a frame is in the model: poses multiplied on the way to the frame that is the model's."""
        frame = np.eye(4)
        while name in parts:
            each = parts[name]
            pose = each.find("pose")
            frame = _pose(pose) @ frame
            on = {"joint": plain(each.findtext("child")), "frame": each.get("attached_to", "")}.get(each.tag, "")
            name = (None if pose is None else pose.get("relative_to")) or on
        return links.get(name, np.eye(4)) @ frame

    def link(name: str) -> str:
        """The link that a frame is on."""
        while name not in links and parts.get(name, model).tag in ("frame", "joint"):
            each = parts[name]
            name = plain(each.findtext("child")) if each.tag == "joint" else each.get("attached_to") or "__model__"
        return (model.get("canonical_link") or first) if name == "__model__" else name

    for joint in joints:
        name = joint.get("name", "")
        parts[name] = joint
        ends = [plain(joint.findtext(end)) for end in ("parent", "child")]
        frames = [place(plain(joint.findtext(f"{end}_frame")) or name) for end in ("parent", "child")]
        on = [link(end) for end in ends]
        sides = [np.linalg.inv(place(each)) @ frame for each, frame in zip(on, frames, strict=True)]
        xyz = joint.find("axis/xyz")
        axis = np.array([0.0, 0.0, 1.0] if xyz is None else [float(word) for word in (xyz.text or "").split()])
        by_model = (joint.findtext("axis/use_parent_model_frame") or "").strip() in ("1", "true")
        base = "__model__" if by_model or version in ("1.0", "1.2", "1.3", "1.4") else ""
        base = base or ("" if xyz is None else xyz.get("expressed_in", "")) or name
        axis = place(name)[:3, :3].T @ place(base)[:3, :3] @ axis
        kind = joint.get("type", "")
        yield SaidJoint(name, STIFF.get(kind, kind), (on[0], on[1]), np.array(sides), axis / np.linalg.norm(axis))


def _pose(pose: ET.Element | None) -> Floats:
    values = [] if pose is None else [float(word) for word in (pose.text or "").split()]
    if pose is None or not values:
        return np.eye(4)
    if pose.get("rotation_format") == "quat_xyzw":
        return _frame(values[:3], Rotation.from_quat(values[3:]))
    return _frame(values[:3], Rotation.from_euler("xyz", values[3:], degrees=pose.get("degrees") in ("true", "1")))


def _frame(at: Floats | list[float], turn: Rotation) -> Floats:
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = turn.as_matrix(), at
    return frame


def _of_urdf(root: ET.Element, retyped: Mapping[str, str]) -> list[SaidJoint]:
    """Joints of a URDF, as MuJoCo places them; it knows hinges and slides, so others are held there."""
    import mujoco

    plain = ET.Element("robot", name="robot")
    settings = ET.SubElement(plain, "mujoco")
    ET.SubElement(settings, "compiler", fusestatic="false", boundmass="1", boundinertia="1")
    for link in root.iterfind("link"):
        ET.SubElement(plain, "link", name=link.get("name", ""))
    joints: dict[str, tuple[str, str, str]] = {}  # body -> name, kind and parent
    for joint in root.iterfind("joint"):
        name, kind = joint.get("name", ""), joint.get("type", "")
        parent, body = ("".join(each.get("link", "") for each in joint.iterfind(end)) for end in ("parent", "child"))
        if body in joints:  # a loop: MuJoCo has a tree, with a copy of the link
            body += f"{COPY}{name}"
            ET.SubElement(plain, "link", name=body)
        moves = {"revolute": "continuous"}.get(kind, kind)
        moves = moves if moves in ("continuous", "prismatic") and name not in retyped else "fixed"
        copy = ET.SubElement(plain, "joint", name=name, type=moves)
        ET.SubElement(copy, "parent", link=parent)
        ET.SubElement(copy, "child", link=body)
        copy.extend(each for tag in ("origin", "axis") for each in joint.iterfind(tag))
        kind = retyped.get(name, kind).lower()
        joints[body] = name, "universal" if kind.startswith("ujoint") else STIFF.get(kind, kind), parent
    model = mujoco.MjModel.from_xml_string(ET.tostring(plain, encoding="unicode"))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    bodies = [data.body(index) for index in range(model.nbody)]
    frames = {each.name: _frame(each.xpos, Rotation.from_matrix(each.xmat.reshape(3, 3))) for each in bodies}
    said = []
    for body, (name, kind, parent) in joints.items():
        first = int(model.body(body).jntadr[0])
        axis = np.array([1.0, 0.0, 0.0]) if first < 0 else model.jnt_axis[first]
        sides = np.array([np.linalg.inv(frames[parent]) @ frames[body], np.eye(4)])
        said.append(SaidJoint(name, kind, (parent, body.partition(COPY)[0]), sides, axis))
    for joint in root.iterfind("gazebo/joint"):
        said += _placed(joint, [joint], frames, "")
    return [*said, *_bonds(root, frames)]


def _bonds(model: ET.Element, frames: Mapping[str, Floats]) -> Iterator[SaidJoint]:
    """Yield the joints of elements that are there to close a loop.

    Parameters
    ----------
    frames : link -> where it is at zero, (4, 4) [m].
    """
    for number, each in enumerate((child for child in model if child.tag in CLOSING and len(child)), 1):
        ends = [(child, link) for child in each for link in _link_in(child, frames)]
        sides, axes = [], []
        for end, _ in ends:
            own = [end, end.find("origin"), each.find(f"{end.tag}_origin")]
            origin = next((one for one in own if one is not None and {"xyz", "rpy"} & {*one.attrib}), None)
            points = [one for one in each if re.fullmatch(f".*_p_{end.tag[-1]}[PQ]", one.tag, re.IGNORECASE)]
            text = (points[0].get("value") or points[0].text or "") if points else "0 0 0"
            at = [float(word) for word in ((origin.get("xyz") if origin is not None else None) or text).split()]
            turn = [float(word) for word in (origin.get("rpy", "0 0 0") if origin is not None else "0 0 0").split()]
            sides.append(_frame(at, Rotation.from_euler("xyz", turn)))
            said = (each.find(f"{end.tag}_axis"), end.find("axis"), each.find("axis"))
            axis = next((one for one in said if one is not None), None)
            axes.append(np.array([float(word) for word in ("1 0 0" if axis is None else axis.get("xyz", "")).split()]))
        common = each.find("origin")
        if common is not None:
            at, turn = ([float(word) for word in common.get(key, "0 0 0").split()] for key in ("xyz", "rpy"))
            sides[0] = sides[0] @ _frame(at, Rotation.from_euler("xyz", turn))
        if each.find("axis[@frame='parent']") is not None:
            across = frames[ends[1][1]][:3, :3].T @ frames[ends[0][1]][:3, :3]
            axes = [sides[0][:3, :3].T @ axes[0], sides[1][:3, :3].T @ across @ axes[0]]
        one, other = (axis / np.linalg.norm(axis) for axis in axes)
        kind = each.get("type", each.tag.partition("_")[0] if each.tag.endswith("_constraint") else "hinge").lower()
        kind = {"point": "spherical", "3d": "spherical", "6d": "fixed"}.get(kind, STIFF.get(kind, kind))
        if kind in ("revolute", "prismatic"):
            sides[1] = sides[1] @ _frame([0.0] * 3, Rotation.align_vectors([other], [one])[0])
        links = (ends[0][1], ends[1][1])
        yield SaidJoint(each.get("name") or f"closure_{number}", kind, links, np.array(sides), one)


def _link_in(element: ET.Element, links: Mapping[str, Floats]) -> list[str]:
    """The link that an element names, in an attribute or as its text; none where it is a point or an axis."""
    texts = [text.split("::")[-1].strip() for text in (*element.attrib.values(), element.text or "")]
    return [text for text in texts if text in links][:1]
