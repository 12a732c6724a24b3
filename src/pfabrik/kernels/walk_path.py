"""Joints in series: the pose of the end effector and its twist by each coordinate, row by row."""

from __future__ import annotations

import math

from ..common.arrays import Floats
from ._jit import routine, search
from .vectors import Vec, add, along, cross, dot, move, norm, put, rotate, scale, sub, turn

# Kinds of motions, and the columns of their table: kind, first coordinate, sign, axis at home, fixed point at home.
TURN, SLIDE, BALL = 0, 1, 2
KIND, PLACE, SIGN, AXIS, POINT, WIDTH = 0, 1, 2, 3, 6, 9
# Angle [rad] below which the series of (a - sin a) / a^3 is used, from which digits cancel otherwise.
SMALL = 1e-2


@search
def walk_path(motions: Floats, end: Floats, deviations: Floats, poses: Floats, twists: Floats) -> None:
    """Fill displacements of the end point's body, and twists, at coordinates (n, k), deviations from home.

    Each motion multiplies by exp(sign d s), s its unit screw at home: a turn A about p to R A, x + R (p - A p).

    Parameters
    ----------
    motions : from the base outward, (m, WIDTH) [length].
    end : the end point at home, (3,) [length].
    poses : filled with displacements from home, (n, 4, 4), but the position is that of the end point.
    twists : filled with [velocity of the end point; angular velocity] by coordinates, (n, 6, k).
    """
    for row in range(deviations.shape[0]):
        walk_row(motions, end, deviations[row], poses[row], twists[row])


@routine
def walk_row(motions: Floats, end: Floats, deviations: Floats, T: Floats, columns: Floats) -> None:
    """Fill the displacement (4, 4) and the twists (6, k) of one row; see `walk_path`."""
    for i in range(4):
        for j in range(4):
            T[i, j] = 1.0 if i == j else 0.0
    for k in range(motions.shape[0]):
        motion, values = motions[k], deviations[int(motions[k, PLACE]) :]
        put_axes(motion, values, T, columns[:, int(motion[PLACE]) :])
        move_on(motion, values, T)
    x = move(T, (end[0], end[1], end[2]))
    for i in range(3):
        T[i, 3] = x[i]
    for k in range(motions.shape[0]):
        place = int(motions[k, PLACE])
        for j in range(place, place + (3 if motions[k, KIND] == BALL else 1)):
            if motions[k, KIND] != SLIDE:
                arm = sub(x, (columns[0, j], columns[1, j], columns[2, j]))
                put(columns[:3, j], cross((columns[3, j], columns[4, j], columns[5, j]), arm))


@routine
def move_on(motion: Floats, values: Floats, T: Floats) -> None:
    """Multiply a displacement by a motion; `values` begins with its coordinates."""
    sign, axis = motion[SIGN], turn(T, (motion[AXIS], motion[AXIS + 1], motion[AXIS + 2]))
    point = (motion[POINT], motion[POINT + 1], motion[POINT + 2])
    angle, fixed = sign * values[0], move(T, point)
    if motion[KIND] == SLIDE:
        for i in range(3):
            T[i, 3] += angle * axis[i]
        return
    if motion[KIND] == BALL:
        vector = (sign * values[0], sign * values[1], sign * values[2])
        angle = norm(vector)
        axis = turn(T, scale(1.0 / angle if angle > 0.0 else 0.0, vector))
    for j in range(3):
        put(T[:3, j], rotate((T[0, j], T[1, j], T[2, j]), axis, angle))
    carried = turn(T, point)
    for i in range(3):
        T[i, 3] = fixed[i] - carried[i]


@routine
def put_axes(motion: Floats, values: Floats, T: Floats, columns: Floats) -> None:
    """Fill columns of twists with present axes, by the rate of coordinates, and above them the points they go through.

    Of a slide, with its velocity. A ball's vector v of length a turns its body at (I + b V + c V^2) dv/dt, with V the
    cross product by v, b = (1 - cos a) / a^2 and c = (a - sin a) / a^3.
    """
    sign, axis = motion[SIGN], (motion[AXIS], motion[AXIS + 1], motion[AXIS + 2])
    if motion[KIND] == SLIDE:
        put(columns[:3, 0], scale(sign, turn(T, axis)))
        put(columns[3:, 0], (0.0, 0.0, 0.0))
        return
    point = move(T, (motion[POINT], motion[POINT + 1], motion[POINT + 2]))
    if motion[KIND] == TURN:
        put(columns[:3, 0], point)
        put(columns[3:, 0], scale(sign, turn(T, axis)))
        return
    v: Vec = (sign * values[0], sign * values[1], sign * values[2])
    a = norm(v)
    half = math.sin(0.5 * a) / a if a > 0.0 else 0.5
    c = (a - math.sin(a)) / a**3 if a > SMALL else 1.0 / 6.0 - a * a / 120.0
    for j in range(3):
        e = (1.0 if j == 0 else 0.0, 1.0 if j == 1 else 0.0, 1.0 if j == 2 else 0.0)
        turning = along(add(e, scale(2.0 * half * half, cross(v, e))), c, sub(scale(dot(v, e), v), scale(a * a, e)))
        put(columns[:3, j], point)
        put(columns[3:, j], scale(sign, turn(T, turning)))
