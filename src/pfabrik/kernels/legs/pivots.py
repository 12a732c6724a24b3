"""Pivots: legs without length, made of slides and then one ending with its centre fixed in the platform.

Constraints, with d the displacement of the centre and R the rotation of the platform: d stays in the span of the
slides; a . R b is constant for two hinges, R a = a for one hinge, R = I for a weld.
"""

from __future__ import annotations

import math

from ...common.arrays import Floats, Record
from .._jit import routine
from ..vectors import Vec, cross, dot, move, put, sub, turn, vec, where
from .endings import angle_to, spin_angle, turned, universal_angles
from .frames import ZERO, put_pose_slope
from .records import BASE_END, BASE_LINE, CROSS, HINGE, PLATFORM_END, PLATFORM_LINE, TRIPLE

# Added to conditions that an axis also meets when it is turned over.
TURNED_OVER = 2.0


@routine
def place_pivot(pivot: Record, frame: Floats, side: float, values: Floats) -> float:
    """Fill the values of a pivot at a pose; the singularity margin."""
    offset = sub(move(frame, vec(pivot["platform_end_point"])), vec(pivot["base_end_point"]))
    for i in range(pivot["slides"]):
        values[PLATFORM_END + i] = dot(vec(pivot["slide_rows"][i]), offset)
    axes = pivot["base_end_axes"]
    if pivot["base_end"] == HINGE:
        values[BASE_END] = spin_angle(frame, vec(axes[0]))
    elif pivot["base_end"] == CROSS:
        values[BASE_END] = angle_to(vec(axes[0]), vec(axes[1]), turn(frame, vec(axes[1])))
        values[BASE_END + 1] = last_angle(frame, axes, values[BASE_END], 0.0, 1)
    elif pivot["base_end"] == TRIPLE:
        last = vec(axes[2])
        put(values[BASE_LINE:PLATFORM_LINE], turn(frame, last))
        singularity_margin = universal_angles(axes, last, vec(values[BASE_LINE:]), side, values[BASE_END:PLATFORM_END])
        values[BASE_END + 2] = last_angle(frame, axes, values[BASE_END], values[BASE_END + 1], 2)
        return singularity_margin
    return 1.0


@routine
def last_angle(frame: Floats, axes: Floats, first: float, second: float, last: int) -> float:
    """Angle of the last of two or three hinges, from the angles of those before it."""
    axis = vec(axes[last])
    across = any_across(axis)
    back = turned(turn(frame, across), vec(axes[0]), math.cos(first), -math.sin(first))
    if last == 2:
        back = turned(back, vec(axes[1]), math.cos(second), -math.sin(second))
    return angle_to(axis, across, back)


@routine
def any_across(v: Vec) -> Vec:
    """A direction normal to a unit vector, and to the coordinate axis that it is farthest from."""
    x, y, z = abs(v[0]), abs(v[1]), abs(v[2])
    first = where(x <= y, where(x <= z, 1.0, 0.0), 0.0)
    second = where(y <= z, 1.0 - first, 0.0)
    return cross(v, (first, second, 1.0 - first - second))


@routine
def pivot_rows(pivot: Record, frame: Floats, rows: Floats) -> None:
    """Fill the constraints of a pivot."""
    n, n_fixed = pivot["first_row"], 3 - pivot["slides"]
    offset = sub(move(frame, vec(pivot["platform_end_point"])), vec(pivot["base_end_point"]))
    for i in range(n_fixed):
        rows[n + i] = dot(vec(pivot["fixed_rows"][i]), offset)
    penalty = 0.0
    for i in range(pivot["upright"]):
        axis = vec(pivot["base_end_axes"][i])
        penalty = where(dot(axis, turn(frame, axis)) < 0.0, TURNED_OVER, penalty)
    for i in range(pivot["n_rows"] - n_fixed):
        kept, moved = vec(pivot["kept"][i]), turn(frame, vec(pivot["moved"][i]))
        rows[n + n_fixed + i] = dot(kept, moved) - pivot["value"][i] + penalty


@routine
def pivot_slopes(pivot: Record, frame: Floats, slopes: Floats) -> None:
    """Fill the derivatives of the constraints of a pivot."""
    n, n_fixed = pivot["first_row"], 3 - pivot["slides"]
    for i in range(n_fixed):
        put_pose_slope(pivot, frame, vec(pivot["fixed_rows"][i]), ZERO, slopes[n + i])
    for i in range(pivot["n_rows"] - n_fixed):
        kept, moved = vec(pivot["kept"][i]), turn(frame, vec(pivot["moved"][i]))
        put_pose_slope(pivot, frame, ZERO, cross(moved, kept), slopes[n + n_fixed + i])
