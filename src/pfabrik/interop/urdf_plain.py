"""A robot description and its loops as a MuJoCo model of the same numbers: the arithmetic is left to MuJoCo."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree import ElementTree as ET

from .loops_file import LinkLoop
from .urdf_links import UrdfJoint, UrdfLinks, number_text, placed_at

MUJOCO_TYPES = {"revolute": "hinge", "prismatic": "slide", "spherical": "ball"}


def plain_robot(links: UrdfLinks, loops: Iterable[LinkLoop]) -> ET.Element:
    """A description as a MuJoCo model; its loops as `connect` and `weld`."""
    plain = ET.Element("mujoco")
    # roll, pitch and yaw are about fixed axes; what moves has a mass, which one does not matter
    ET.SubElement(plain, "compiler", angle="radian", eulerseq="XYZ", boundmass="1", boundinertia="1")
    world, equality = ET.SubElement(plain, "worldbody"), ET.SubElement(plain, "equality")
    frame = links.frames[links.root]
    root = {"name": links.root, **placed_at(frame[:3, 3], frame[:3, :3])}
    bodies = {links.root: world if links.root == "world" else ET.SubElement(world, "body", root)}
    for joint in links.joints:
        bodies[joint.child] = _body(bodies[joint.parent], joint)
    for number, loop in enumerate(loops):
        for part in range(2 if loop.type == "revolute" else 1):  # of a hinge, a second pair of points along its axis
            sites = [f"loop {number} {part} {side}" for side in range(2)]
            for link, site, side in zip(loop.links, sites, loop.sides, strict=True):
                place = placed_at(side[:3, 3] + part * side[:3, 2], side[:3, :3])
                ET.SubElement(bodies[link], "site", {"name": site, **place})
            tag = "weld" if loop.type == "fixed" else "connect"
            ET.SubElement(equality, tag, site1=sites[0], site2=sites[1])
    return plain


def _body(parent: ET.Element, joint: UrdfJoint) -> ET.Element:
    """The child of a joint, with the joints of MuJoCo that the joint is."""
    placed = joint.written or placed_at(joint.frame[:3, 3], joint.frame[:3, :3])
    body = ET.SubElement(parent, "body", {"name": joint.child, **placed})
    for name, kind, axis in joint.elementary():
        if kind != "fixed":
            attributes = {} if axis is None else {"axis": number_text(axis)}
            at = number_text(joint.point)
            ET.SubElement(body, "joint", {"name": name, "type": MUJOCO_TYPES[kind], "pos": at, **attributes})
    return body
