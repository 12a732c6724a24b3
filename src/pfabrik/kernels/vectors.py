"""Vectors of three numbers as tuples, which compiled code keeps in registers."""

from __future__ import annotations

import math
from typing import TypeAlias

from ..common.arrays import Floats
from ._jit import inlined, routine

Vec: TypeAlias = tuple[float, float, float]
# Excess over the end of a range up to which an angle counts as on it, not a turn away [rad].
ON_BOUND = 1e-9


@inlined
def where(condition: bool, a: float, b: float) -> float:
    """`a` if the condition holds, else `b`; both are computed, and neither may divide by zero.

    The formulas of legs choose by it wherever they ask something of a number, so that they are expressions.
    """
    return a if condition else b


@routine
def vec(a: Floats) -> Vec:
    return (a[0], a[1], a[2])


@routine
def put(a: Floats, v: Vec) -> None:
    a[0] = v[0]
    a[1] = v[1]
    a[2] = v[2]


@routine
def copy_row(source: Floats, to: Floats) -> None:
    """Copy a one-dimensional array; a slice assignment would allocate."""
    for i in range(source.shape[0]):
        to[i] = source[i]


@routine
def copy_table(source: Floats, to: Floats) -> None:
    """Copy a two-dimensional array."""
    for i in range(source.shape[0]):
        for j in range(source.shape[1]):
            to[i, j] = source[i, j]


@routine
def add(a: Vec, b: Vec) -> Vec:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@routine
def sub(a: Vec, b: Vec) -> Vec:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@routine
def scale(k: float, a: Vec) -> Vec:
    return (k * a[0], k * a[1], k * a[2])


@routine
def along(a: Vec, k: float, b: Vec) -> Vec:
    """a + k b."""
    return (a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2])


@routine
def dot(a: Vec, b: Vec) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@routine
def cross(a: Vec, b: Vec) -> Vec:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@routine
def norm(a: Vec) -> float:
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@routine
def flatten(a: Vec, n: Vec) -> Vec:
    """The part of `a` normal to the unit vector `n`."""
    return along(a, -dot(a, n), n)


@routine
def turn(T: Floats, a: Vec) -> Vec:
    """Rotate `a` by the rotation of the pose `T`, whose first three rows are read."""
    return (
        T[0, 0] * a[0] + T[0, 1] * a[1] + T[0, 2] * a[2],
        T[1, 0] * a[0] + T[1, 1] * a[1] + T[1, 2] * a[2],
        T[2, 0] * a[0] + T[2, 1] * a[1] + T[2, 2] * a[2],
    )


@routine
def move(T: Floats, a: Vec) -> Vec:
    """Map the point `a` by the pose `T`."""
    return add(turn(T, a), (T[0, 3], T[1, 3], T[2, 3]))


@routine
def rotate(a: Vec, axis: Vec, angle: float) -> Vec:
    """`a` turned about the unit vector `axis`, by Rodrigues' formula."""
    c, s = math.cos(angle), math.sin(angle)
    return along(along(scale(c, a), s, cross(axis, a)), (1.0 - c) * dot(axis, a), axis)


@routine
def angle_between(a: Vec, b: Vec) -> float:
    """Angle in [0, pi], accurate near both ends."""
    return math.atan2(norm(cross(a, b)), dot(a, b))


@routine
def angle_about(axis: Vec, a: Vec, b: Vec) -> float:
    """Angle from `a` to `b` about `axis`, right-handed, in (-pi, pi]; both in the plane normal to it."""
    return math.atan2(dot(axis, cross(a, b)), dot(a, b))


@routine
def wrap(angle: float, centre: float) -> float:
    """An angle moved by whole turns to within half a turn of `centre`."""
    return angle - 2.0 * math.pi * math.floor((angle - centre) / (2.0 * math.pi) + 0.5)


@routine
def wrap_into(angle: float, lo: float, hi: float) -> float:
    """An angle moved by whole turns into a range: near its middle, or near 0 (home) if it spans more than a turn."""
    if hi - lo <= 2.0 * math.pi:
        return wrap(angle, 0.5 * (lo + hi))
    angle = wrap(angle, 0.0)
    raised = where(angle < lo - ON_BOUND, angle + 2.0 * math.pi, angle)
    return where(angle > hi + ON_BOUND, angle - 2.0 * math.pi, raised)
