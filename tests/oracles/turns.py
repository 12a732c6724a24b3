"""Rotations and placed bodies in stacks, one a row."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pfabrik.tolerances import TOLERANCES

Array = NDArray[np.float64]


class Placed(NamedTuple):
    """Where a body is: x = turn x_home + shift, in base coordinates [length]."""

    turn: Array  # (n, 3, 3)
    shift: Array  # (n, 3)

    def point(self, home: Array) -> Array:
        """Where a point (3,) of the body is, (n, 3)."""
        return np.asarray(self.turn @ home + self.shift)


def at_home(n: int) -> Placed:
    """A body that has not moved, in n rows."""
    return Placed(np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3)))


def anchored(turn: Array, home: Array, present: Array) -> Placed:
    """The body that is turned so, and whose point `home` (3,) is at `present` (n, 3)."""
    return Placed(turn, present - turn @ home)


def unit(vector: object) -> Array:
    """A vector at length one."""
    array = np.array(vector, dtype=float)
    return array / np.linalg.norm(array)


def is_parallel(a: Array, b: Array, sine: float = TOLERANCES.alignment) -> bool:
    """True if two unit vectors are parallel or opposite, up to a sine."""
    return float(np.linalg.norm(np.cross(a, b))) <= sine


def turns_about(axis: Array, angles: Array) -> Array:
    """Rotations (n, 3, 3) about one unit axis (3,) by angles (n,) [rad]."""
    return np.asarray(Rotation.from_rotvec(angles[:, None] * axis).as_matrix())


def angle_about(axis: Array, start: Array, end: Array) -> Array:
    """Angles (n,) [rad] about an axis (3,) by which directions (n, 3) or (3,) come as near to others as they can."""
    cosines = (start * end).sum(axis=-1) - (start @ axis) * (end @ axis)
    return np.asarray(np.arctan2(np.cross(start, end) @ axis, cosines))


def angle_of(turns: Array, axis: Array) -> Array:
    """Angles (n,) [rad] of rotations (n, 3, 3) about an axis (3,) of theirs."""
    skew = turns - np.swapaxes(turns, 1, 2)
    sines = 0.5 * np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1) @ axis
    return np.asarray(np.arctan2(sines, 0.5 * (np.trace(turns, axis1=1, axis2=2) - 1.0)))


def either_angle(x: Array, y: Array, part: Array, square: Array, side: Array | float) -> Array:
    """A solution (n,) [rad] of x cos q + y sin q = part: the one to the left (+1) or right (-1) of (x, y).

    Where there is none, the nearest angle. `square` is x^2 + y^2 - part^2, which who asks knows more exactly.
    """
    return np.arctan2(y, x) + side * np.arctan2(np.sqrt(np.maximum(square, 0.0)), part)


def aimed(axes: Sequence[Array], before: Array, home: Array, line: Array, other: bool = False) -> list[Array]:
    """Rotations (n, 3, 3) of the bodies behind one or two hinges, one a hinge, that point a direction as asked.

    One hinge has one solution; two have two, of which home's is taken, or the `other`. Without one, the direction comes
    as near as it can. Degenerate: a line along the first axis, about which any angle is a solution: 0 is taken.

    Parameters
    ----------
    axes : unit axes (3,) at home.
    before : rotations (n, 3, 3) of the body that the first hinge is on.
    home, line : the direction at home, (3,), and the one asked for, (n, 3); of any length.
    """
    inside = np.einsum("nji,nj->ni", before, line)
    if len(axes) == 1:
        return [before @ turns_about(axes[0], angle_about(axes[0], home, inside))]
    first, second = axes
    inside = inside / np.maximum(np.linalg.norm(inside, axis=1), np.finfo(float).tiny)[:, None]
    home = unit(home)
    x, y = first @ (home - second * (second @ home)), first @ np.cross(second, home)
    part = inside @ first - (first @ second) * (second @ home)
    side = np.copysign(1.0, y if other else -y)
    bent = turns_about(second, either_angle(x, y, part, x * x + y * y - part * part, side))
    outer = before @ turns_about(first, angle_about(first, bent @ home, inside))
    return [outer, outer @ bent]


def shortest_turn(start: Array, end: Array) -> Array:
    """The shortest rotations (n, 3, 3) that take a unit vector (3,) to others (n, 3); a half turn to its opposite."""
    middle = start + end
    opposite = np.linalg.norm(middle, axis=1) <= TOLERANCES.rank
    middle = np.where(opposite[:, None], np.cross(start, np.eye(3)[np.abs(start).argmin()]), middle)
    middle = middle / np.linalg.norm(middle, axis=1)[:, None]
    half_turn = 2.0 * middle[:, :, None] * middle[:, None, :] - np.eye(3)
    about_start = 2.0 * np.outer(start, start) - np.eye(3)  # before a half turn about the middle, the shortest turn
    return np.asarray(np.where(opposite[:, None, None], half_turn, half_turn @ about_start))
