"""The robot description (URDF) of a platform for rviz, and its joints as the node computes them from bodies."""

from __future__ import annotations

from typing import NamedTuple
from xml.etree import ElementTree as ET

import numpy as np

from ...common.arrays import Floats
from ...common.rotations import square_to
from ...machine.description.joints import Joint
from ...machine.description.mechanism import Mechanism
from ...machine.description.sketch import joint_places, middle
from ...machine.files.units import metres_of
from ...machine.moved_bodies import BASE, FIRST_MOVED, PLATFORM, TURNS, Motion
from ...view.drawn_parts import Part, Place, parts_of, size_of
from ...view.page.posed_drawing import THICKNESS
from ..interop.names import unique
from ..interop.urdf_tree import UrdfTree, kind_of_joint, left_out
from ..interop.xml_reading import number_text
from .machine_data import Machine

TILTS, TILTS_NEXT = 2, 3
"""Kinds of the two hinges that aim a rod between balls, after SLIDES and TURNS; see `coordinate` in platform.hpp."""

UNTURNED = np.zeros(3)
COLOURS = {"base": "0.55 0.55 0.55 1", "platform": "0.0 0.45 0.70 1", "link": "0.42 0.42 0.42 1"}
"""Colours of roles: red, green, blue, opacity."""


class ShownJoint(NamedTuple):
    """A joint of the description.

    Attributes
    ----------
    kind : SLIDES, TURNS, TILTS or TILTS_NEXT.
    parent, body : numbers of the bodies that it is between.
    axis : at home, unit vector (3,).
    line : of the rod that it aims, at home, unit vector (3,); else zeros.
    home, lo, hi : of its coordinate [rad or m].
    column : of the coordinate in the mechanism; -1 of a rod between balls.
    """

    name: str
    kind: int
    parent: int
    body: int
    axis: Floats
    line: Floats
    home: float
    lo: float
    hi: float
    column: int


class PlatformDescription(UrdfTree):
    """A tree whose loops are cut at joints that the node's bodies do not hang on; joints count as in the file.

    The end effector floats on the base: the node broadcasts where it is.

    Attributes
    ----------
    joints : that move, in their order.
    missing : bodies whose places follow from no leg.
    """

    def __init__(self, machine: Machine) -> None:
        mechanism, bodies = machine.mechanism, machine.bodies
        super().__init__(mechanism, metres_of(mechanism.length_unit))
        self.joints: list[ShownJoint] = []
        self._names, self._numbers = {*mechanism.bodies}, bodies.numbers
        self._joint_names = {joint.name for joint in mechanism.joints}
        self._places = joint_places(mechanism, None, mechanism.home_pose[:3, 3])
        self.remark(f"'{mechanism.name}', written by pfabrik: lengths in m, joints count as in the machine's own file")
        self.remark("loops are cut; the node of this package publishes all joints, and where the end effector is")
        for remark in left_out(mechanism):
            self.remark(remark)
        self._links = {BASE: mechanism.base, PLATFORM: mechanism.end_effector}
        self.link(mechanism.base, np.zeros(3))
        joint = unique(f"{mechanism.end_effector}:pose", self._joint_names)
        self.join(joint, "floating", mechanism.base, mechanism.end_effector, mechanism.home_pose[:3, 3] * self.metres)
        self._add_motions(bodies.motions)
        for body, number in bodies.numbers.items():
            if number in self._links and body not in self.origins:
                link = self._links[number]
                self.join(unique(f"{body}:fixed", self._names), "fixed", link, body, self.origins[link])
        self.missing = [body for body in mechanism.bodies if body not in self.origins]
        for body in self.missing:
            self.remark(f"left out, for no leg tells how it turns: {body}")
        self._add_cut_drives()
        self._elements = {str(link.get("name")): link for link in self.root.iterfind("link")}
        for part in parts_of(mechanism):
            self._draw(part)

    def _add_motions(self, motions: list[Motion]) -> None:
        waiting = dict(enumerate(motions, FIRST_MOVED))
        while placed := [number for number, motion in waiting.items() if self._parent(motion) in self._links]:
            for number in placed:
                motion = waiting.pop(number)
                parent, moved = self._parent(motion), unique(f"{motion.joint}:moved", self._names)
                self._links[number] = motion.body or moved
                (self._add_joint if motion.column >= 0 else self._add_rod)(parent, number, motion)

    def _parent(self, motion: Motion) -> int:
        """The number of the body that a body hangs on, a rod between balls at its ball; -1 if that does not follow."""
        if motion.column >= 0:
            return motion.on
        first, second = self.mechanism.joint(motion.joint).connects
        return self._numbers.get(second if motion.body == first else first, -1)

    def _add_joint(self, parent: int, number: int, motion: Motion) -> None:
        each = self.mechanism.coordinates[motion.column]
        at = self.origins[self._links[parent]] if each.joint.at is None else motion.point * self.metres
        element = self.join(each.name, kind_of_joint(each), self._links[parent], self._links[number], at)
        self.move(element, each, motion.sign, from_home=False)
        home, lo, hi = np.array([each.home, *each.limits]) * (1.0 if motion.kind == TURNS else self.metres)
        axis = motion.axis * motion.sign
        self.joints.append(
            ShownJoint(each.name, motion.kind, parent, number, axis, UNTURNED, home, lo, hi, each.column)
        )

    def _add_rod(self, parent: int, number: int, motion: Motion) -> None:
        """Two hinges that aim a rod between balls: it does not turn about its line."""
        at = np.array(self._places[motion.joint]) * self.metres
        first, line = square_to(motion.axis)[0], motion.axis
        between = unique(f"{motion.joint}:tilted", self._names)
        links = self._links[parent], between, self._links[number]
        for kind, axis, ends in (
            (TILTS, first, links[:2]),
            (TILTS_NEXT, np.cross(line, first), links[1:]),
        ):
            name = unique(f"{motion.joint}:tilt", self._joint_names)
            ET.SubElement(self.join(name, "continuous", *ends, at), "axis", xyz=number_text(axis))
            self.joints.append(ShownJoint(name, kind, parent, number, axis, line, 0.0, -np.inf, np.inf, -1))

    def _add_cut_drives(self) -> None:
        """Add drives that are no joints of the tree: the node publishes them all the same."""
        known = {joint.column for joint in self.joints}
        for each in self.mechanism.drives:
            if each.column not in known:
                nothing = UNTURNED, UNTURNED, 0.0, 0.0, 0.0
                self.joints.append(ShownJoint(each.name, TURNS, BASE, BASE, *nothing, each.column))

    def _draw(self, part: Part) -> None:
        """Add a part to the link of its body: cylinders between its ends, a ball or a box."""
        if part.body in self.missing:
            return
        ends, radius = [self._at(end) for end in part.ends], THICKNESS * size_of(self.mechanism) * part.radius
        if part.kind == "ball":
            self._see(part, ends[0], "sphere", radius=radius)
        elif part.kind == "carriage":
            self._see(part, ends[0], "box", size=np.full(3, 2.0 * radius))
        elif part.kind == "plate":
            for start, end in zip(ends, [*ends[1:], ends[0]], strict=True):
                self._bar(part, start, end, radius)
        else:
            self._bar(part, *_strut_ends(self.mechanism, part, *ends), radius)

    def _at(self, place: Place) -> Floats:
        if isinstance(place, np.ndarray):
            return place
        return middle([self._places[name] for name in place]) if place else self.mechanism.home_pose[:3, 3]

    def _bar(self, part: Part, start: Floats, end: Floats, radius: float) -> None:
        x, y, z = along = end - start
        if not along.any():
            return
        turned = np.array([0.0, np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)])
        self._see(part, 0.5 * (start + end), "cylinder", turned, radius=radius, length=float(np.linalg.norm(along)))

    def _see(self, part: Part, at: Floats, kind: str, rpy: Floats = UNTURNED, **sizes: float | Floats) -> None:
        """Add a solid to the link of a part's body; lengths in the mechanism's unit."""
        visual = ET.SubElement(self._elements[part.body], "visual")
        xyz = at * self.metres - self.origins[part.body]
        ET.SubElement(visual, "origin", xyz=number_text(xyz), rpy=number_text(rpy))
        numbers = {name: number_text(np.ravel(size) * self.metres) for name, size in sizes.items()}
        ET.SubElement(ET.SubElement(visual, "geometry"), kind, numbers)
        ET.SubElement(ET.SubElement(visual, "material", name=part.role), "color", rgba=COLOURS[part.role])


def _strut_ends(mechanism: Mechanism, part: Part, start: Floats, end: Floats) -> tuple[Floats, Floats]:
    """Ends of a bar at home: a strut's cylinder does not reach its end, its rod is as long as the shortest strut."""
    length = float(np.linalg.norm(end - start))
    slides = [mechanism.joint(name) for name in part.joints if mechanism.joint(name).along is not None]
    if part.kind == "barrel":
        return start, start + part.length / length * (end - start)
    if part.kind == "bar" and len(slides) == 1 and slides[0].range is not None and part.ends == _ends_of(slides[0]):
        shortest = length + np.min(slides[0].range) - mechanism.home_coordinate(slides[0].name)
        return end - shortest / length * (end - start), end
    return start, end


def _ends_of(slide: Joint) -> tuple[Place, ...]:
    return tuple((name,) for name in slide.along or ())
