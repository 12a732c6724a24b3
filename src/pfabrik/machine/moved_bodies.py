"""Bodies whose places follow from the pose and from coordinates of legs, for exported files and for pages."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ..common.arrays import Floats
from ..kernels.clearance.solids import CAPSULE, DISC, KIND
from ..kernels.legs import records as K
from ..tolerances import TOLERANCES
from .decomposition.leg_forms import LegForm, Rod
from .description.home_mobility import joint_screws
from .description.joints import Joint
from .description.links import links_of
from .description.mechanism import Mechanism
from .model import model_of
from .motion.displacements import columns

BASE, PLATFORM, FIRST_MOVED = 0, 1, 2
"""Numbers of bodies in the exported file: those that move with joint coordinates follow."""

SLIDES, TURNS, WITH_BASE_END, WITH_PLATFORM_END = 0, 1, 2, 3
"""How a body moves: by a coordinate of a leg, or along a rod, with one of its ends; see `pfk_body` in the C."""

AT_ITS_FIRST_BODY = ("prismatic", "cylindrical")
"""Types of joints whose centre is a point of their first body alone."""


class Motion(NamedTuple):
    """The motion of a body relative to another by one coordinate of a leg, or with the line of a rod.

    Attributes
    ----------
    on : the number of the other body.
    kind : a slide along the axis, a turn about it through the point; or with an end of a rod, along its line.
    leg, place, sense : of the coordinate: the deviation from home is sense * value.
    axis, point : at home, in base coordinates.
    joint : whose motion it is, or at the end that a rod moves with.
    column, sign : of the joint's coordinate, which moves the body by sign * coordinate; -1 of a rod.
    body : the body that moves; empty if another motion of the joint follows.
    """

    on: int
    kind: int
    leg: int
    place: int
    sense: float
    axis: Floats
    point: Floats
    joint: str
    column: int
    sign: float
    body: str

    def screw(self, size: float) -> tuple[list[float], list[float]]:
        """Angular velocity, and velocity at the origin [L], by a unit of the coordinate; `size` is L [length]."""
        if self.kind == SLIDES:
            return [0.0, 0.0, 0.0], self.axis.tolist()
        return self.axis.tolist(), np.cross(self.point / size, self.axis).tolist()


class MovedBodies:
    """The bodies whose places follow from the pose and from coordinates of legs, each numbered when it is needed.

    Attributes
    ----------
    numbers : of the bodies; bodies that are fixed to each other have one number.
    motions : of the bodies from number `FIRST_MOVED`.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.motions: list[Motion] = []
        self._mechanism = mechanism
        self._known = {int(record["column"]): record for record in model_of(mechanism).legs.known}
        self.numbers = {mechanism.base: BASE}
        if not mechanism.end_effector_is_joint:
            self.numbers[mechanism.end_effector] = PLATFORM
        self._ways, self._lengths = self._shortest_ways([*self.numbers])

    @property
    def count(self) -> int:
        """The number of bodies, those between the motions of a joint among them."""
        return FIRST_MOVED + len(self.motions)

    @property
    def names(self) -> list[str]:
        """The names of the bodies of each number."""
        names = ["", self._mechanism.end_effector, *(f"within joint {motion.joint}" for motion in self.motions)]
        for number in set(self.numbers.values()):
            names[number] = ", ".join(body for body, its_number in self.numbers.items() if its_number == number)
        return names

    def number_all(self) -> None:
        """Number all bodies: those that follow from the base, from the platform, and from rods between balls."""
        self._number_from([self._mechanism.base])
        self._number_from([*self.numbers])
        while True:
            waiting = [body for body in self._mechanism.bodies if body not in self.numbers]
            rod = next((rod for body in waiting for rod in self._rods_of(body)), None)
            if rod is None:
                return
            self._number_along(rod)
            self._number_from([*self.numbers])

    def _number_from(self, sources: Sequence[str]) -> None:
        self._ways, self._lengths = self._shortest_ways(sources)
        for body in filter(self.is_placed, self._mechanism.bodies):
            self.number(body)

    def is_placed(self, body: str) -> bool:
        """True if a body's place follows."""
        return body in self._lengths

    def of_centre(self, joint: Joint) -> int | None:
        """The number of a body that has the centre of a joint as its point; None if none follows."""
        mechanism = self._mechanism
        if mechanism.end_effector_is_joint and joint.name == mechanism.end_effector:
            return PLATFORM
        bodies = joint.connects[:1] if joint.type in AT_ITS_FIRST_BODY and not joint.is_rigid else joint.connects
        near = [body for body in bodies if self.is_placed(body)]
        return self.number(min(near, key=self._lengths.__getitem__)) if near else None

    def number(self, body: str) -> int:
        """The number of a body; its motions are added where it has none yet."""
        if body not in self.numbers:
            before, joint = self._ways[body]
            on = self.number(before)
            for motion in self._motions(joint, before == joint.connects[0]):
                self.motions.append(motion._replace(on=on))
                on = FIRST_MOVED + len(self.motions) - 1
            if not joint.is_rigid:
                self.motions[-1] = self.motions[-1]._replace(body=body)
            self.numbers[body] = on
        return self.numbers[body]

    def along_rod(self, solid: int) -> int | None:
        """The number of a body that moves along the line of a rod as a solid on it does; None unless it is round there.

        The rod may spin about its line in any way.
        """
        mechanism, links = self._mechanism, links_of(self._mechanism)
        sizes, place = links.sizes[solid], links.places[solid]
        near = TOLERANCES.alignment * mechanism.characteristic_length
        for rod in self._rods_of(mechanism.shapes[solid].body):
            record = model_of(mechanism).legs.legs[rod.leg]
            start, line = record["base_end_point"] * mechanism.characteristic_length, record["line"]
            points = place[:2] if sizes[KIND] == CAPSULE else place[:1]
            is_on_line = bool((np.linalg.norm(np.cross(points - start, line), axis=1) <= near).all())
            is_round = sizes[KIND] == CAPSULE or (
                sizes[KIND] == DISC and np.linalg.norm(np.cross(place[1], line)) <= TOLERANCES.alignment
            )
            if is_on_line and is_round:
                return self._number_along(rod)
        return None

    def _rods_of(self, body: str) -> Iterator[Motion]:
        """Yield the motions of a body along the lines of rods."""
        table = model_of(self._mechanism).legs
        for leg, (form, record) in enumerate(zip(table.forms, table.legs, strict=True)):
            end = _end_with(form, body)
            if end is not None and record["frame"] in (K.FROM_BASE, K.FROM_PLATFORM):
                on = BASE if record["frame"] == K.FROM_BASE else PLATFORM
                point = record["base_end_point" if end[0] == WITH_BASE_END else "platform_end_point"]
                numbers = 1.0, record["line"], point * self._mechanism.characteristic_length
                yield Motion(on, end[0], leg, K.Q_PROXIMAL, *numbers, end[1], -1, 1.0, body)

    def _number_along(self, rod: Motion) -> int:
        for place, before in enumerate(self.motions):
            if (before.leg, before.kind) == (rod.leg, rod.kind):
                return FIRST_MOVED + place
        self.motions.append(rod)
        self.numbers.setdefault(rod.body, FIRST_MOVED + len(self.motions) - 1)
        return FIRST_MOVED + len(self.motions) - 1

    def _shortest_ways(self, sources: Sequence[str]) -> tuple[dict[str, tuple[str, Joint]], dict[str, int]]:
        """Of every body that follows: the body before it and the joint between them, and the number of coordinates."""
        ways: dict[str, tuple[str, Joint]] = {}
        lengths = dict.fromkeys(sources, 0)
        joints = [joint for joint in self._mechanism.joints if self._follows(joint)]
        is_changed = True
        while is_changed:
            is_changed = False
            for joint in joints:
                for before, after in (joint.connects, joint.connects[::-1]):
                    length = lengths.get(before, math.inf) + self._n_coordinates(joint)
                    if length < lengths.get(after, math.inf):
                        ways[after], lengths[after], is_changed = (before, joint), int(length), True
        return ways, lengths

    def _n_coordinates(self, joint: Joint) -> int:
        return 0 if joint.is_rigid else len(self._columns(joint))

    def _columns(self, joint: Joint) -> range:
        span = columns(self._mechanism)[joint.name]
        return range(span.start, span.stop)

    def _follows(self, joint: Joint) -> bool:
        """True if legs have all coordinates of a joint; they have none of a ball, nor of a joint cut at its centre."""
        mechanism = self._mechanism
        is_cut = mechanism.end_effector_is_joint and joint.name == mechanism.end_effector
        known = self._known.keys() >= {*self._columns(joint)}
        return joint.is_rigid or (known and not is_cut and joint.type != "spherical")

    def _motions(self, joint: Joint, forward: bool) -> list[Motion]:
        """The motions of a joint's second body relative to its first, or the other way round, outward."""
        if joint.is_rigid:
            return []
        point = np.array(self._mechanism.reference_point if joint.at is None else joint.at)
        sign, motions = 1.0 if forward else -1.0, []
        for column, screw in zip(self._columns(joint), joint_screws(self._mechanism, joint), strict=True):
            kind, axis = (TURNS, screw[:3]) if screw[:3].any() else (SLIDES, screw[3:])
            record = self._known[column]
            leg, at, sense = int(record["leg"]), int(record["place"]), float(record["sense"]) * sign
            motions.append(Motion(BASE, kind, leg, at, sense, axis, point, joint.name, column, sign, ""))
        return motions if forward else motions[::-1]


def _end_with(form: LegForm, body: str) -> tuple[int, str] | None:
    """The end of a rod that a body moves with, along the rod's line, and the joint there; None of other bodies."""
    if not isinstance(form, Rod):
        return None
    slide, first, last = form.slide, form.base_ending.elements[-1], form.platform_ending.elements[0]
    if body == (slide.inward if slide is not None else first.outward):
        return WITH_BASE_END, first.joint.name
    if body == (slide.outward if slide is not None else last.inward):
        return WITH_PLATFORM_END, last.joint.name
    return None


def angles_needed(motions: Sequence[Motion], leg: int, start: int) -> bool:
    """True if angles of an end of a rod place bodies; `start` is the first place of that end's angles."""
    return any(
        motion.leg == leg and start <= motion.place < start + 3 and start in (K.BASE_END, K.PLATFORM_END)
        for motion in motions
    )
