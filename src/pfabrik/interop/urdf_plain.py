"""A robot description and its loops as a MuJoCo model of the same numbers: the arithmetic is left to MuJoCo."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree import ElementTree as ET

from .loops_file import KINDS, LoopsFile

AXES = {"X": "1 0 0", "Y": "0 1 0", "Z": "0 0 1"}


def plain_robot(root: ET.Element, closing: LoopsFile) -> ET.Element:
    """A description (URDF) that has been found sound, as a MuJoCo model; its loops as `connect` and `weld`."""
    plain = ET.Element("mujoco")
    # roll, pitch and yaw are about fixed axes; what moves has a mass, which one does not matter
    ET.SubElement(plain, "compiler", angle="radian", eulerseq="XYZ", boundmass="1", boundinertia="1")
    world, equality = ET.SubElement(plain, "worldbody"), ET.SubElement(plain, "equality")
    joints = list(root.iterfind("joint"))
    children = {_link(joint, "child") for joint in joints}
    bodies: dict[str, ET.Element] = {}
    ends = [link.get("name", "") for link in root.iterfind("link") if link.get("name", "") not in children]
    for link in ends:
        bodies[link] = ET.SubElement(world, "body", name=link)
    for link in ends:  # grows while it is looked through
        for joint in joints:
            if _link(joint, "parent") == link:
                child = _link(joint, "child")
                bodies[child] = _body(bodies[link], joint, child, closing.retyped)
                ends.append(child)
    links = {joint.get("name", ""): _link(joint, "child") for joint in joints}
    for number, entry in enumerate(closing.entries):
        _close(bodies, equality, number, entry, links)
    return plain


def _link(joint: ET.Element, end: str) -> str:
    element = joint.find(end)
    return "" if element is None else element.get("link", "")


def _body(parent: ET.Element, joint: ET.Element, child: str, retyped: Mapping[str, str]) -> ET.Element:
    """The child of a joint, with what the joint is."""
    origin, along, name = joint.find("origin"), joint.find("axis"), joint.get("name", "")
    place = {} if origin is None else {"pos": origin.get("xyz", "0 0 0"), "euler": origin.get("rpy", "0 0 0")}
    body = ET.SubElement(parent, "body", {"name": child, **place})
    axis = "1 0 0" if along is None else along.get("xyz", "1 0 0")
    kind = retyped.get(name, joint.get("type", "")).upper()
    if kind in ("SPHERICAL", "FLOATING"):
        ET.SubElement(body, "joint", name=name, type="ball" if kind == "SPHERICAL" else "free")
    elif kind.startswith("UJOINT_"):
        for letter in kind[-2:]:
            ET.SubElement(body, "joint", name=f"{name}_{letter}", axis=AXES[letter])
    elif kind != "FIXED":
        ET.SubElement(body, "joint", name=name, type="slide" if kind == "PRISMATIC" else "hinge", axis=axis)
    return body


def _close(
    bodies: Mapping[str, ET.Element],
    equality: ET.Element,
    number: int,
    entry: Mapping[str, Any],
    links: Mapping[str, str],
) -> None:
    """One loop: two sites that are to meet; of a hinge, two more along its axis."""
    ends = [end if end in bodies else links[end] for end in entry.get("links") or entry["frames"]]
    points = entry.get("at", [[0, 0, 0]] * 2)
    axes = entry.get("axis", [[0, 0, 1]] * 2)
    kind = KINDS[entry.get("type", "ball")]
    for part in range(2 if kind == "revolute" else 1):
        sites = []
        for side, (end, point, axis) in enumerate(zip(ends, points, axes, strict=True)):
            size = sum(value**2 for value in axis) ** 0.5
            at = [value + part * step / size for value, step in zip(point, axis, strict=True)]
            sites.append(f"loop {number} {part} {side}")
            ET.SubElement(bodies[end], "site", name=sites[-1], pos=_text(at))
        tag = "weld" if kind == "fixed" else "connect"
        ET.SubElement(equality, tag, site1=sites[0], site2=sites[1])


def _text(values: Sequence[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
