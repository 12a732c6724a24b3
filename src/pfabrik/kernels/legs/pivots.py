"""A leg of no length, at a pose: slides, then one ending whose centre the platform keeps in place.

Constraints, with d the displacement of the centre and R the rotation of the platform: d does not leave the slides; of
two hinges a . R b keeps its value; of one hinge R a = a; of a weld R = I.
"""

from __future__ import annotations

import math

from ...arrays import Floats, Record
from .._jit import routine
from ..vectors import Vec, cross, dot, move, put, sub, turn, vec
from .endings import aim, angle_to, spin_angle, turned
from .frames import NOWHERE, put_pose_slope
from .records import BASE_END, BASE_LINE, CROSS, HINGE, PLATFORM_END, PLATFORM_LINE, TRIPLE

# What is added to conditions that an axis meets also where it is turned over.
TURNED_OVER = 2.0


@routine
def place_pivot(pivot: Record, frame: Floats, side: float, own: Floats) -> float:
    """Fill a pivot's values; how sure they are, see `LEAST_MARGIN`."""
    offset = sub(move(frame, vec(pivot["platform_end_point"])), vec(pivot["base_end_point"]))
    for i in range(pivot["slides"]):
        own[PLATFORM_END + i] = dot(vec(pivot["slide_rows"][i]), offset)
    axes = pivot["base_end_axes"]
    if pivot["base_end"] == HINGE:
        own[BASE_END] = spin_angle(frame, vec(axes[0]))
    elif pivot["base_end"] == CROSS:
        own[BASE_END] = angle_to(vec(axes[0]), vec(axes[1]), turn(frame, vec(axes[1])))
        own[BASE_END + 1] = last_angle(frame, axes, own[BASE_END], 0.0, 1)
    elif pivot["base_end"] == TRIPLE:
        last = vec(axes[2])
        put(own[BASE_LINE:PLATFORM_LINE], turn(frame, last))
        singularity_margin = aim(axes, last, vec(own[BASE_LINE:]), side, own[BASE_END:PLATFORM_END])
        own[BASE_END + 2] = last_angle(frame, axes, own[BASE_END], own[BASE_END + 1], 2)
        return singularity_margin
    return 1.0


@routine
def last_angle(frame: Floats, axes: Floats, first: float, second: float, last: int) -> float:
    """Angle about the last of two or three hinges, once those before it have turned."""
    axis = vec(axes[last])
    across = any_across(axis)
    back = turned(turn(frame, across), vec(axes[0]), math.cos(first), -math.sin(first))
    if last == 2:
        back = turned(back, vec(axes[1]), math.cos(second), -math.sin(second))
    return angle_to(axis, across, back)


@routine
def any_across(v: Vec) -> Vec:
    """Some direction square to a unit vector."""
    x, y, z = abs(v[0]), abs(v[1]), abs(v[2])
    if x <= y and x <= z:
        return cross(v, (1.0, 0.0, 0.0))
    return cross(v, (0.0, 1.0, 0.0)) if y <= z else cross(v, (0.0, 0.0, 1.0))


@routine
def pivot_rows(pivot: Record, frame: Floats, rows: Floats) -> None:
    """Fill a pivot's constraints."""
    n, n_fixed = pivot["first_row"], 3 - pivot["slides"]
    offset = sub(move(frame, vec(pivot["platform_end_point"])), vec(pivot["base_end_point"]))
    for i in range(n_fixed):
        rows[n + i] = dot(vec(pivot["fixed_rows"][i]), offset)
    over = 0.0
    for i in range(pivot["upright"]):
        axis = vec(pivot["base_end_axes"][i])
        over = TURNED_OVER if dot(axis, turn(frame, axis)) < 0.0 else over
    for i in range(pivot["axis_rows"]):
        kept, moved = vec(pivot["kept"][i]), turn(frame, vec(pivot["moved"][i]))
        rows[n + n_fixed + i] = dot(kept, moved) - pivot["value"][i] + over


@routine
def pivot_slopes(pivot: Record, frame: Floats, slopes: Floats) -> None:
    """Fill the derivatives of a pivot's constraints."""
    n, n_fixed = pivot["first_row"], 3 - pivot["slides"]
    for i in range(n_fixed):
        put_pose_slope(pivot, frame, vec(pivot["fixed_rows"][i]), NOWHERE, slopes[n + i])
    for i in range(pivot["axis_rows"]):
        kept, moved = vec(pivot["kept"][i]), turn(frame, vec(pivot["moved"][i]))
        put_pose_slope(pivot, frame, NOWHERE, cross(moved, kept), slopes[n + n_fixed + i])
