"""Angles of the hinges at an ending: closed forms that turn one direction into another.

Two crossed hinges a, b turn u into w where a . Rot(b, q) u = a . w, which has the form A cos q + B sin q = C: two
solutions, distinguished by a side of +1 or -1. One hinge does the rest (Paden-Kahan subproblems 1 and 4).
"""

from __future__ import annotations

import math

from ...common.arrays import Floats
from .._jit import routine
from ..vectors import Vec, along, angle_between, cross, dot, scale, where


@routine
def turned(v: Vec, axis: Vec, cosine: float, sine: float) -> Vec:
    """`v` turned about a unit vector."""
    return along(along(scale(cosine, v), sine, cross(axis, v)), (1.0 - cosine) * dot(axis, v), axis)


@routine
def turned_back(T: Floats, v: Vec) -> Vec:
    """`v` turned by the inverse of the rotation of `T`."""
    return (
        T[0, 0] * v[0] + T[1, 0] * v[1] + T[2, 0] * v[2],
        T[0, 1] * v[0] + T[1, 1] * v[1] + T[2, 1] * v[2],
        T[0, 2] * v[0] + T[1, 2] * v[1] + T[2, 2] * v[2],
    )


@routine
def angle_to(axis: Vec, u: Vec, w: Vec) -> float:
    """Angle from `u` to `w` about a unit vector, right-handed, in (-pi, pi]; components along it are ignored."""
    sine, cosine = parts_about(axis, u, w)
    return math.atan2(sine, cosine)


@routine
def parts_about(axis: Vec, u: Vec, w: Vec) -> tuple[float, float]:
    """Sine and cosine of the angle from `u` to `w` about a unit vector, times the lengths of their parts across it."""
    return dot(axis, cross(u, w)), dot(u, w) - dot(axis, u) * dot(axis, w)


@routine
def solve_angle(A: float, B: float, C: float, side: float) -> tuple[float, float, float]:
    """Cosine and sine of one of the two solutions of A cos q + B sin q = C, and its singularity margin.

    q = atan2(B, A) + side acos(C / h), h = hypot(A, B). The margin is the squared sine of the angle to the double root;
    it is negative where no solution exists, and the angle is then that of the double root.
    """
    square = A * A + B * B
    is_determined, discriminant = square > 0.0, square - C * C
    C = where(discriminant < 0.0, math.copysign(math.sqrt(square), C), C)
    root = side * math.sqrt(max(discriminant, 0.0))
    square = where(is_determined, square, 1.0)
    return (
        where(is_determined, (A * C - B * root) / square, 1.0),
        where(is_determined, (B * C + A * root) / square, 0.0),
        where(is_determined, discriminant / square, -1.0),
    )


@routine
def aim(axes: Floats, u: Vec, w: Vec, side: float) -> tuple[Vec, float, float, float]:
    """Two crossed hinges that turn `u`, given at home, into `w`: `u` turned by the last one; cosine and sine of its
    angle; the singularity margin."""
    a, b = (axes[0, 0], axes[0, 1], axes[0, 2]), (axes[1, 0], axes[1, 1], axes[1, 2])
    bu = dot(b, u)
    cosine, sine, singularity_margin = solve_angle(
        dot(a, along(u, -bu, b)), dot(a, cross(b, u)), dot(a, w) - dot(a, b) * bu, side
    )
    return turned(u, b, cosine, sine), cosine, sine, singularity_margin


@routine
def universal_angles(axes: Floats, u: Vec, w: Vec, side: float, angles: Floats) -> float:
    """Fill angles[:2] of two crossed hinges that turn `u`, given at home, into `w`; the singularity margin."""
    by_last, cosine, sine, singularity_margin = aim(axes, u, w, side)
    angles[0] = angle_to((axes[0, 0], axes[0, 1], axes[0, 2]), by_last, w)
    angles[1] = math.atan2(sine, cosine)
    return singularity_margin


@routine
def aimed_axis(axes: Floats, u: Vec, w: Vec, side: float) -> Vec:
    """The last of two crossed hinges that turn `u`, given at home, into `w`, times a positive number."""
    a, b = (axes[0, 0], axes[0, 1], axes[0, 2]), (axes[1, 0], axes[1, 1], axes[1, 2])
    by_last, _, _, _ = aim(axes, u, w, side)
    sine, cosine = parts_about(a, by_last, w)
    size = math.sqrt(sine * sine + cosine * cosine)
    return along(along(scale(cosine, b), sine, cross(a, b)), (size - cosine) * dot(a, b), a)


@routine
def pointing_error(axes: Floats, u: Vec, w: Vec, angles: Floats) -> float:
    """Angle between `w` and the direction into which two crossed hinges at these angles turn `u`."""
    a, b = (axes[0, 0], axes[0, 1], axes[0, 2]), (axes[1, 0], axes[1, 1], axes[1, 2])
    by_last = turned(u, b, math.cos(angles[1]), math.sin(angles[1]))
    return angle_between(w, turned(by_last, a, math.cos(angles[0]), math.sin(angles[0])))


@routine
def spin_angle(T: Floats, axis: Vec) -> float:
    """Angle of a rotation about `axis`, its own axis, in (-pi, pi]."""
    sine = axis[0] * (T[2, 1] - T[1, 2]) + axis[1] * (T[0, 2] - T[2, 0]) + axis[2] * (T[1, 0] - T[0, 1])
    return math.atan2(sine, T[0, 0] + T[1, 1] + T[2, 2] - 1.0)
