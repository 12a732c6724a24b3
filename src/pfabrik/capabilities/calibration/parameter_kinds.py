"""Kinds of parameters of a machine: centres, axes, zeros of actuators and lengths of rods."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...common.arrays import Floats
from ...errors import InvalidArgument, UnsupportedMechanism
from ...machine.description.geometry import Geometry, geometry_of
from ...machine.description.mechanism import Joint, Mechanism
from ...tolerances import TOLERANCES
from .measurements import INSTRUMENT
from .shifts import DrivenRods, Shift

KINDS = ("points", "axes", "offsets", "lengths", "frame", "tool", "scale")

_NUMBERED = re.compile(r"^(.*?)(\d+)$")


class Candidates:
    """All parameters that a machine has, apart from its dimensions, by their kinds.

    - "points": the centre of every joint, `A1.x`, `A1.y`, `A1.z` [length]; of a hinge two of them, as its place along
      its axis does not matter; none of a prismatic joint, whose place does not.
    - "axes": the direction of every axis of a file, as turns about base axes, `A1.rx` [rad].
    - "offsets": what is to be added to the reading of an actuator, `B1.offset` [length or rad].
    - "lengths": of the rods on an actuated joint of the base, `A1.rod` [length].
    - "frame", "tool": of the instrument, `frame.x` [length] to `frame.rz` [rad]; none where a joint has this name.
    - "scale": the factor on the reading of an actuator, `B1.scale`.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, self.geometry = mechanism, geometry_of(mechanism)
        self.length = mechanism.characteristic_length
        self.rods: list[DrivenRods] = []

    def of_kind(self, kind: str) -> list[Shift]:
        """The shifts of a kind."""
        made = {"points": self._points, "axes": self._axes, "offsets": self._offsets, "lengths": self._lengths}
        made |= {"frame": lambda: self._moves(0), "tool": lambda: self._moves(1), "scale": self._scale}
        return list(made[kind]())

    def _points(self) -> Iterator[Shift]:
        for j, joint in enumerate(self.mechanism.joints):
            if joint.at is None or joint.type in ("prismatic", "fixed"):
                continue
            skipped = -1
            if joint.type in ("revolute", "cylindrical"):
                skipped = int(np.argmax(np.abs(self.geometry.axes[j, 0])))
            for axis in range(3):
                if axis != skipped:
                    shift = self._none(f"{joint.name}.{'xyz'[axis]}", self.geometry.points[j, axis], is_angle=False)
                    shift.points[j, axis] = 1.0
                    yield shift

    def _axes(self) -> Iterator[Shift]:
        for j, joint in enumerate(self.mechanism.joints):
            if joint.axis is None and joint.axes is None:
                continue
            skipped = int(np.argmax(np.abs(self.geometry.axes[j, 0]))) if joint.axis is not None else -1
            for axis in range(3):
                if axis != skipped:
                    shift = self._none(f"{joint.name}.r{'xyz'[axis]}", 0.0, is_angle=True)
                    shift.turns[j, axis] = 1.0
                    yield shift

    def _offsets(self) -> Iterator[Shift]:
        for drive in self.mechanism.drives:
            shift = self._none(f"{drive.name}.offset", 0.0, is_angle=drive.kind == "angle")
            shift.home[drive.column] = 1.0
            yield shift

    def _moves(self, which: int) -> Iterator[Shift]:
        name, is_point = INSTRUMENT[which], self.mechanism.end_effector_is_joint
        if name in {joint.name for joint in self.mechanism.joints} or (which == 1 and is_point):
            return
        for place, what in enumerate(("rx", "ry", "rz", "x", "y", "z")):
            shift = self._none(f"{name}.{what}", 0.0, is_angle=place < 3)
            shift.moves[which, place] = 1.0
            yield shift

    def _scale(self) -> Iterator[Shift]:
        for drive in self.mechanism.drives:
            shift = replace(self._none(f"{drive.name}.scale", 1.0, is_angle=False), scale=1.0)
            shift.factors[drive.column] = 1.0
            yield shift

    def _lengths(self) -> Iterator[Shift]:
        found = False
        for drive in self.mechanism.drives:
            for rods in self._rods_on(drive.joint, drive.column):
                found = True
                ends = self.geometry.points[[rods.base_end, rods.platform_end]]
                length = float(np.linalg.norm(ends[1] - ends[0]))
                shift = self._none(f"{drive.joint.name}.rod", length, is_angle=False)
                self.rods.append(rods)
                yield replace(shift, rods=(len(self.rods) - 1,))
        if not found:
            reason = "no rod is between an actuated joint on the base and the end effector; free 'points' or dimensions"
            raise UnsupportedMechanism(self.mechanism.name, [reason], "calibrated by its lengths")

    def _rods_on(self, proximal: Joint, column: int) -> Iterator[DrivenRods]:
        """The rods on the body that a proximal joint moves; they are to be of one length."""
        mechanism = self.mechanism
        if mechanism.base not in proximal.connects or proximal.type not in ("revolute", "prismatic"):
            return
        body = next(each for each in proximal.connects if each != mechanism.base)
        on_body = [j for j, joint in enumerate(mechanism.joints) if body in joint.connects and joint is not proximal]
        pairs = [(j, k) for j in on_body for k in self._far_ends(j, body)]
        if not pairs:
            return
        lengths = [float(np.linalg.norm(self.geometry.points[j] - self.geometry.points[k])) for j, k in pairs]
        if np.ptp(lengths) > TOLERANCES.alignment * self.length:
            given = " and ".join(f"{length:.6g}" for length in lengths)
            reason = f"the rods on '{proximal.name}' have the lengths {given}: free 'points' or dimensions"
            raise UnsupportedMechanism(mechanism.name, [reason], "calibrated by its lengths")
        number = mechanism.joints.index(proximal)
        turns = proximal.type == "revolute"
        yield DrivenRods(number, column, *pairs[0], moved=np.array(on_body), turns=turns)

    def _far_ends(self, j: int, body: str) -> Iterator[int]:
        """Joints at the end effector of the rods that begin at joint j."""
        joints, end_effector = self.mechanism.joints, self.mechanism.end_effector_body
        rod = next(each for each in joints[j].connects if each != body)
        if joints[j].at is None or rod in (self.mechanism.base, end_effector):
            return
        beyond = [k for k, joint in enumerate(joints) if rod in joint.connects and k != j]
        tip = self.mechanism.end_effector
        if len(beyond) == 1 and joints[beyond[0]].at is not None:
            k = beyond[0]
            ends = end_effector in joints[k].connects or joints[k].name == tip
            if ends and not self._is_curved(j, k):
                yield k

    def _is_curved(self, j: int, k: int) -> bool:
        """True for a link between hinges that are not parallel: the distance of their centres says nothing of it."""
        hinges = all(self.mechanism.joints[each].type in ("revolute", "cylindrical") for each in (j, k))
        across = np.cross(self.geometry.axes[j, 0], self.geometry.axes[k, 0])
        return hinges and float(np.linalg.norm(across)) > TOLERANCES.alignment

    def _none(self, name: str, value: float, *, is_angle: bool) -> Shift:
        """A shift that changes nothing yet."""
        shape, columns = (len(self.mechanism.joints), 3), len(self.geometry.home)
        scale = 1.0 if is_angle else self.length
        points, turns, home, factors = (np.zeros(size) for size in (shape, shape, columns, columns))
        return Shift(name, float(value), scale, is_angle, points, turns, home, np.zeros((2, 6)), factors)


def tied(mechanism: Mechanism, shifts: Sequence[Shift]) -> list[Shift]:
    """One shift in place of those of all copies of a joint, which then stay copies of each other.

    Raises
    ------
    InvalidArgument : joints that are numbered alike are not copies of each other, turned about one axis.
    """
    rotations = _copy_rotations(mechanism)
    by_name = {shift.name: shift for shift in shifts}
    numbers = {joint.name: j for j, joint in enumerate(mechanism.joints)}
    columns = {coordinate.name: coordinate.column for coordinate in mechanism.coordinates}
    made = []
    for shift in shifts:
        owner, _, what = shift.name.partition(".")
        stem, number, rest = _stem(owner)
        if number == 0 or stem not in rotations:
            made.append(shift)
        elif number == 1:
            points, turns, home = shift.points.copy(), shift.turns.copy(), shift.home.copy()
            factors = shift.factors.copy()
            rods = list(shift.rods)
            first = numbers[owner.partition("[")[0]]
            for k, rotation in rotations[stem].items():
                other = numbers[f"{stem}{k}"]
                points[other] = rotation @ shift.points[first]
                turns[other] = rotation @ shift.turns[first]
                if what == "offset":
                    home[columns[f"{stem}{k}{rest}"]] = 1.0
                if what == "scale":
                    factors[columns[f"{stem}{k}{rest}"]] = 1.0
                if what == "rod":
                    rods += by_name[f"{stem}{k}.rod"].rods
            _check_equal(mechanism, shift, [by_name.get(f"{stem}{k}{rest}.{what}") for k in rotations[stem]])
            name = f"{stem}{rest}.{what}"
            shift = replace(shift, name=name, rods=tuple(rods), points=points, turns=turns, home=home, factors=factors)
            made.append(shift)
    return made


def _check_equal(mechanism: Mechanism, shift: Shift, others: Sequence[Shift | None]) -> None:
    if shift.rods and any(o is None or abs(o.value - shift.value) > 1e-6 * shift.scale for o in others):
        raise InvalidArgument("ties", f"rods of other lengths than '{shift.name}'", "copies with rods of one length")


def _stem(name: str) -> tuple[str, int, str]:
    """A joint's name without its number, its number (0 if it has none), and what is behind it, such as "[1]"."""
    own, bracket, rest = name.partition("[")
    match = _NUMBERED.match(own)
    return (match[1], int(match[2]), bracket + rest) if match else (own, 0, "")


def _copy_rotations(mechanism: Mechanism) -> dict[str, dict[int, Floats]]:
    """Stem of joint names -> copy number, from 2 -> the rotation that takes copy 1 to it."""
    groups: dict[str, dict[int, int]] = {}
    for j, joint in enumerate(mechanism.joints):
        stem, number, _ = _stem(joint.name)
        if number:
            groups.setdefault(stem, {})[number] = j
    copied = {stem: copies for stem, copies in groups.items() if 1 in copies and len(copies) > 1}
    geometry = geometry_of(mechanism)
    found: dict[str, dict[int, Floats]] = {stem: {} for stem in copied}
    counts = {tuple(sorted(copies)) for copies in copied.values()}
    for count in counts:
        stems = [stem for stem, copies in copied.items() if tuple(sorted(copies)) == count]
        for k in count[1:] if count[0] == 1 else ():
            rotation = _rotation_between(mechanism, geometry, [(copied[s][1], copied[s][k]) for s in stems])
            for stem in stems:
                found[stem][k] = rotation
    return found


def _rotation_between(mechanism: Mechanism, geometry: Geometry, pairs: list[tuple[int, int]]) -> Floats:
    """The rotation about the origin that takes the first joints of pairs to the second."""
    size = mechanism.characteristic_length
    vectors = [(geometry.points[a] / size, geometry.points[b] / size) for a, b in pairs]
    vectors += [(geometry.axes[a, 0], geometry.axes[b, 0]) for a, b in pairs if mechanism.joints[a].axis is not None]
    given = [(a, b) for a, b in vectors if np.isfinite(a).all() and np.isfinite(b).all()]
    before, after = np.array(given).reshape(-1, 2, 3).transpose(1, 0, 2)
    covariance = after.T @ before
    if np.linalg.matrix_rank(covariance, tol=TOLERANCES.alignment) < 2:
        covariance[2, 2] += 1.0  # a single point of a plane: turned about z
    left, _, right = np.linalg.svd(covariance)
    rotation = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    if np.abs(before @ rotation.T - after).max(initial=0.0) > TOLERANCES.alignment:
        names = ", ".join(mechanism.joints[b].name for _, b in pairs[:3])
        expected = "joints of equal names but for their numbers that a turn about the origin takes to each other"
        raise InvalidArgument("ties", f"{names}, which are no turned copies of number 1", expected)
    return np.asarray(rotation)
