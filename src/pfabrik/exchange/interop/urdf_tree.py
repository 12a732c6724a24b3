"""Links and joints of a robot description (URDF), whose frames are parallel to the base's at home."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree import ElementTree as ET

import numpy as np

from ...common.arrays import Floats
from ...common.rotations import from_rotvec, to_rpy
from ...machine.description.joint_coordinates import JointCoordinate
from ...machine.description.mechanism import Mechanism
from .mjcf_bodies import axes_of, si_unit
from .xml_reading import number_text

DRAKE = "drake"
"""Prefix of what Drake's dialect adds to URDF: highest accelerations, rotors and gears."""


class UrdfTree:
    """The elements of a description, as they are added.

    Attributes
    ----------
    metres : length of the mechanism's unit [m].
    origins : of the links at home [m].
    """

    def __init__(self, mechanism: Mechanism, metres: float) -> None:
        self.mechanism, self.metres = mechanism, metres
        self.root = ET.Element("robot", {"name": mechanism.name, f"xmlns:{DRAKE}": "http://drake.mit.edu"})
        self.origins: dict[str, Floats] = {}

    def remark(self, text: str) -> None:
        """Add a comment."""
        self.root.append(ET.Comment(f" {text} ".replace("--", "- -")))

    def text(self) -> str:
        """The description as text."""
        ET.indent(self.root)
        return ET.tostring(self.root, encoding="unicode") + "\n"

    def link(self, name: str, origin: Floats) -> None:
        """Add a link, unless it is there."""
        if name not in self.origins:
            ET.SubElement(self.root, "link", name=name)
        self.origins[name] = origin

    def join(self, name: str, kind: str, parent: str, child: str, origin: Floats) -> ET.Element:
        """A joint, with its child at an origin [m]."""
        element = ET.SubElement(self.root, "joint", name=name, type=kind)
        ET.SubElement(element, "parent", link=parent)
        ET.SubElement(element, "child", link=child)
        ET.SubElement(element, "origin", xyz=number_text(origin - self.origins[parent]), rpy="0 0 0")
        self.link(child, origin)
        return element

    def move(self, element: ET.Element, coordinate: JointCoordinate, sign: float, *, from_home: bool) -> None:
        """Add the axis and the limits of a joint, counted from home or as the mechanism's file counts.

        Parameters
        ----------
        sign : -1 if the coordinate moves the parent.
        """
        joint, unit = coordinate.joint, si_unit(coordinate, self.metres)
        axis = axes_of(self.mechanism, joint)[coordinate.place] * sign
        ET.SubElement(element, "axis", xyz=number_text(axis))
        if not from_home:
            _put_back(element, coordinate, axis, coordinate.home * unit)
        most, rate, gain = (coordinate.said(key) for key in ("max_torque", "max_speed", "max_acceleration"))
        limit = {"effort": repr(float(most or 0.0))}
        if joint.range is not None:
            lower, upper = (np.array(coordinate.limits) - (coordinate.home if from_home else 0.0)) * unit
            limit |= {"lower": repr(float(lower)), "upper": repr(float(upper))}
        limit["velocity"] = repr(float((rate or 0.0) * unit))
        if gain is not None:
            limit[f"{DRAKE}:acceleration"] = repr(float(gain * unit))
        ET.SubElement(element, "limit", limit)
        if (friction := coordinate.said("friction")) is not None:
            dry, viscous = map(repr, friction)
            ET.SubElement(element, "dynamics", damping=viscous, friction=dry)


def _put_back(element: ET.Element, coordinate: JointCoordinate, axis: Floats, home: float) -> None:
    """Move the origin of a joint to where its coordinate is 0 [rad or m]."""
    origin = element.find("origin")
    assert origin is not None
    if coordinate.kind != "angle":
        origin.set("xyz", number_text(np.array(str(origin.get("xyz")).split(), float) - home * axis))
        return
    origin.set("rpy", number_text(to_rpy(from_rotvec(-home * axis))))


def kind_of_joint(coordinate: JointCoordinate) -> str:
    """The type of the joint that has one coordinate of a mechanism."""
    if coordinate.kind != "angle":
        return "prismatic"
    return "continuous" if coordinate.joint.range is None else "revolute"


def left_out(mechanism: Mechanism) -> Iterator[str]:
    """Yield remarks on what no description has."""
    for joint in mechanism.joints:
        if joint.cone is not None:
            yield f"a limit that URDF has no word for: the cone of {joint.name}"
    for word, key in (("effort", "max_torque"), ("velocity", "max_speed")):
        if unsaid := [drive.name for drive in mechanism.drives if drive.said(key) is None]:
            yield f"{word} is 0, which stands for no limit that is known, of {', '.join(unsaid)}"
    if mechanism.shapes or mechanism.clearance is not None:
        yield "shapes of bodies and their clearance are left out"
