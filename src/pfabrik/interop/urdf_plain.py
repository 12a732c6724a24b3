"""A robot description and its loops as a MuJoCo model of the same numbers: the arithmetic is left to MuJoCo."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from xml.etree import ElementTree as ET

from ..arrays import Floats
from .loops_file import LinkLoop
from .urdf_links import UrdfJoint, UrdfLinks
from .xml_reading import number_text

MUJOCO_TYPES = {"revolute": "hinge", "prismatic": "slide", "spherical": "ball"}


def plain_robot(links: UrdfLinks, loops: Iterable[LinkLoop]) -> ET.Element:
    """A description as a MuJoCo model; its loops as `connect` and `weld`."""
    plain = ET.Element("mujoco")
    # roll, pitch and yaw are about fixed axes; what moves has a mass, which one does not matter
    ET.SubElement(plain, "compiler", angle="radian", eulerseq="XYZ", boundmass="1", boundinertia="1")
    world, equality = ET.SubElement(plain, "worldbody"), ET.SubElement(plain, "equality")
    root = {"name": links.root, **_place(links.frames[links.root])}
    bodies = {links.root: world if links.root == "world" else ET.SubElement(world, "body", root)}
    for joint in links.joints:
        bodies[joint.child] = _body(bodies[joint.parent], joint)
    for number, loop in enumerate(loops):
        for part in range(2 if loop.type == "revolute" else 1):  # of a hinge, a second pair of points along its axis
            sites = [f"loop {number} {part} {side}" for side in range(2)]
            for link, site, side in zip(loop.links, sites, loop.sides, strict=True):
                point = number_text(side[:3, 3] + part * side[:3, 2])
                ET.SubElement(bodies[link], "site", {"name": site, **_place(side), "pos": point})
            tag = "weld" if loop.type == "fixed" else "connect"
            ET.SubElement(equality, tag, site1=sites[0], site2=sites[1])
    return plain


def _place(frame: Floats) -> Mapping[str, str]:
    """A frame (4, 4) [m] as attributes of MuJoCo."""
    return {"pos": number_text(frame[:3, 3]), "xyaxes": number_text(frame[:3, :2].T.ravel())}


def _body(parent: ET.Element, joint: UrdfJoint) -> ET.Element:
    """The child of a joint, with the joints of MuJoCo that the joint is."""
    body = ET.SubElement(parent, "body", {"name": joint.child, **(joint.written or _place(joint.frame))})
    for name, kind, axis in joint.elementary():
        if kind != "fixed":
            attributes = {} if axis is None else {"axis": number_text(axis)}
            at = number_text(joint.point)
            ET.SubElement(body, "joint", {"name": name, "type": MUJOCO_TYPES[kind], "pos": at, **attributes})
    return body
