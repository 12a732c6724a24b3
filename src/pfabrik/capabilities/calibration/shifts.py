"""The geometry of a machine as a function of changes of its points, axes, zeros and rod lengths, batches at a time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...common.arrays import Floats, Ints
from ...common.rotations import from_rotvec
from ...machine.description.geometry import Geometry, geometry_of
from ...machine.description.home_mobility import ends_of_default_axes
from ...machine.description.mechanism import Mechanism

NEWTON_STEPS = 12
"""Steps in which a proximal joint finds the place of a rod of another length: from millimetres off, five suffice."""


@dataclass(frozen=True)
class Shift:
    """Changes per unit of one parameter.

    Attributes
    ----------
    name : of the parameter.
    value : at the machine as it is described.
    scale : a change that the machine would notice: L for a length, 1 for an angle.
    is_angle : the value is an angle [rad]; else a length.
    points : changes of centres, (joints, 3).
    turns : rotation vectors of the joints' axes, (joints, 3).
    home : changes of coordinates at home, (columns,).
    moves : changes of the instrument's frame and target, a rotation vector and a place each, (2, 6).
    factors : changes of the factors on readings, (columns,).
    rods : numbers of the rods whose length it sets.
    """

    name: str
    value: float
    scale: float
    is_angle: bool
    points: Floats
    turns: Floats
    home: Floats
    moves: Floats
    factors: Floats
    rods: tuple[int, ...] = ()


@dataclass(frozen=True)
class DrivenRods:
    """DrivenRods of one length between a proximal joint's body and the platform.

    The proximal joint takes up the difference of another length: at home it is then elsewhere, and the rest is not.

    Attributes
    ----------
    proximal, column : the proximal joint's number, and its coordinate.
    base_end, platform_end : the joints at the ends of one of the rods.
    moved : all joints on the proximal joint's body but itself.
    turns : the proximal joint turns; else it slides.
    """

    proximal: int
    column: int
    base_end: int
    platform_end: int
    moved: Ints
    turns: bool


class ShiftedGeometry:
    """The geometry of a machine by the values of shifts.

    Attributes
    ----------
    like : the machine that the geometry is of. Prismatic joints along two others that have an offset are not along
        them in it, but have an axis and a value at home, which still follow from the centres.
    """

    def __init__(self, mechanism: Mechanism, shifts: list[Shift], rods: list[DrivenRods]) -> None:
        self.shifts, self.rods = shifts, rods
        joints = mechanism.joints
        at = {joint.name: j for j, joint in enumerate(joints)}
        columns = [[c.column for c in mechanism.coordinates if c.joint is joint] for joint in joints]
        self._along = [
            (j, columns[j][0], *(at[end.name] for end in mechanism.ends_along(joint)))
            for j, joint in enumerate(joints)
            if joint.along is not None
        ]
        zeros = np.sum([shift.home != 0.0 for shift in shifts], axis=0, dtype=int) if shifts else np.zeros(0, int)
        explicit = {j for j, column, _, _ in self._along if len(zeros) and zeros[column]}
        self._explicit = explicit
        self.like = with_own_axes(mechanism, explicit) if explicit else mechanism
        self._square = []
        for j, joint in enumerate(joints):
            if joint.type == "universal" and joint.axes is None:
                ends, is_forward = ends_of_default_axes(mechanism, joint)
                if ends:
                    self._square.append((j, at[ends[0].name], is_forward))
        self.base = geometry_of(self.like)
        shape = (len(shifts), len(joints), 3)
        self._points = np.array([shift.points for shift in shifts]).reshape(shape)
        self._turns = np.array([shift.turns for shift in shifts]).reshape(shape)
        self._home = np.array([shift.home for shift in shifts]).reshape(len(shifts), len(self.base.home))
        self._tip = at[mechanism.end_effector] if mechanism.end_effector_is_joint else -1
        self._has_turns = bool(self._turns.any())

    def at(self, values: Floats, base: Geometry | None = None) -> Geometry:
        """The geometries at parameter values (b, p): every array with the batch in front.

        Parameters
        ----------
        base : the geometries (b, ...) that are shifted; by default, that of the machine.
        """
        base = self.base if base is None else base
        n, changes = len(values), values - [shift.value for shift in self.shifts]
        points = np.broadcast_to(base.points, (n, *self.base.points.shape)) + np.tensordot(changes, self._points, 1)
        axes = np.broadcast_to(base.axes, (n, *self.base.axes.shape)).copy()
        if self._has_turns:
            axes = np.einsum("bjxy,bjky->bjkx", from_rotvec(np.tensordot(changes, self._turns, 1)), axes)
        home = np.broadcast_to(base.home, (n, len(self.base.home))) + changes @ self._home
        reference = np.broadcast_to(base.reference_point, (n, 3)).copy()
        for p, shift in enumerate(self.shifts):
            for rod in shift.rods:
                _lengthen(self.rods[rod], values[:, p], points, axes, home)
        self._follow(points, axes, home, changes)
        if self._tip >= 0:
            reference = points[:, self._tip]
        return Geometry(points, axes, home, reference)

    def _follow(self, points: Floats, axes: Floats, home: Floats, changes: Floats) -> None:
        """Put axes and values that follow from centres."""
        for j, column, start, end in self._along:
            span = points[:, end] - points[:, start]
            length = np.sqrt(np.einsum("bi,bi->b", span, span))
            axes[:, j, 0] = span / length[:, None]
            home[:, column] = length + (changes @ self._home[:, column] if j in self._explicit else 0.0)
        for j, end, is_forward in self._square:
            normals = square_pairs(points[:, end] - points[:, j])
            axes[:, j] = normals if is_forward else normals[:, ::-1]


def square_pairs(lines: Floats) -> Floats:
    """The default axes of universal joints whose lines (b, 3) are: unit vectors (b, 2, 3), see `noted_vectors`."""
    x, y, z = lines.T
    s = -np.copysign(np.sqrt(x * x + y * y + z * z), x)
    u, w, t = y / (x - s), z / (x - s), (s - x) / s
    first = np.stack([-t * u, 1.0 - t * u * u, -t * u * w], axis=-1)
    second = np.stack([-t * w, -t * u * w, 1.0 - t * w * w], axis=-1)
    return np.stack([first, second], axis=1)


def _lengthen(rods: DrivenRods, lengths: Floats, points: Floats, axes: Floats, home: Floats) -> None:
    """Move a proximal joint so that its rods have other lengths (b,), in points, axes and home values."""
    axis, centre = axes[:, rods.proximal, 0], points[:, rods.proximal]
    end, begin = points[:, rods.platform_end], points[:, rods.base_end]
    moves, place = np.zeros(len(points)), begin
    for _ in range(NEWTON_STEPS):
        rotations = from_rotvec(axis * moves[:, None])
        if rods.turns:
            place = centre + np.einsum("bij,bj->bi", rotations, begin - centre)
            velocity = np.cross(axis, place - centre)
        else:
            place, velocity = begin + axis * moves[:, None], axis
        gap = 0.5 * (((end - place) ** 2).sum(axis=1) - lengths**2)
        moves = moves + gap / ((end - place) * velocity).sum(axis=1)
    if rods.turns:
        rotations = from_rotvec(axis * moves[:, None])
        around = centre[:, None]
        points[:, rods.moved] = around + np.einsum("bij,bkj->bki", rotations, points[:, rods.moved] - around)
        axes[:, rods.moved] = np.einsum("bij,bkaj->bkai", rotations, axes[:, rods.moved])
    else:
        points[:, rods.moved] += (axis * moves[:, None])[:, None]
    home[:, rods.column] += moves


def with_own_axes(mechanism: Mechanism, which: set[int]) -> Mechanism:
    """The same machine with prismatic joints, of these numbers, that are along two others given by axis and home."""
    geometry = geometry_of(mechanism)
    home = {c.joint.name: geometry.home[c.column] for c in mechanism.coordinates}
    joints = [
        replace(joint, along=None, axis=tuple(geometry.axes[j, 0].tolist()), home=float(home[joint.name]))
        if j in which
        else joint
        for j, joint in enumerate(mechanism.joints)
    ]
    return replace(mechanism, joints=tuple(joints))
