"""Margins of poses to the limits of legs in closed form; negative beyond a limit."""

from __future__ import annotations

import math

import numpy as np

from ...common.arrays import Floats, Ints, Record, Records
from .._jit import routine, search
from ..quaternions import difference, turn_about_z, yaw_difference
from ..search_constants import NEARLY_CLOSED
from ..vectors import angle_between, copy_row, scale, vec, where
from .answer import Completion, complete_pose, deviation, new_completion, put_rows
from .complete_poses import put_pose, read_target, tilt_to, turn_pose
from .endings import pointing_error
from .leg_constants import KEPT, MORE_PARTS, PARTS
from .records import (
    BASE_END,
    BASE_LINE,
    CROSS,
    FROM_BASE,
    HINGE,
    PLATFORM_END,
    PLATFORM_LINE,
    Q_PROXIMAL,
    REDUNDANT,
    SLIDE,
    Table,
    open_table,
)


@routine
def relative_margin(distance: float, half_range: float) -> float:
    """Distance from a bound as a share of half the range, or of a cone's half angle.

    For a locked joint, without a range: 0 on its value, infinite off it.
    """
    if half_range > KEPT:
        return distance / half_range
    return where(abs(distance) <= KEPT, 0.0, math.copysign(math.inf, distance))


@routine
def range_margins(coordinate: Record, values: Floats) -> tuple[float, float]:
    """Relative margins of a coordinate from both ends of its range."""
    lo, hi, value = coordinate["lo"], coordinate["hi"], deviation(coordinate, values)
    return relative_margin(value - lo, 0.5 * (hi - lo)), relative_margin(hi - value, 0.5 * (hi - lo))


@routine
def cone_margin(cone: Record, values: Floats) -> float:
    """Relative margin of a line from the edge of its cone."""
    leg_values, place = values[cone["leg"]], cone["place"]
    angle = angle_between(vec(cone["axis"]), (leg_values[place], leg_values[place + 1], leg_values[place + 2]))
    return relative_margin(cone["half_angle"] - angle, cone["half_angle"])


@routine
def least_margin(limited: Records, cones: Records, values: Floats) -> tuple[float, int]:
    """The least relative margin of all limits, and its index: two per range, then the cones; -1 if none.

    Of margins that are equal to `KEPT`, as those of both rods of a parallelogram, the first is taken.
    """
    least, binding = math.inf, -1
    for i in range(limited.shape[0]):
        below, above = range_margins(limited[i], values)
        if min(below, above) < least - KEPT:
            least, binding = min(below, above), 2 * i + (1 if above < below - KEPT else 0)
    for i in range(cones.shape[0]):
        margin = cone_margin(cones[i], values)
        if margin < least - KEPT:
            least, binding = margin, 2 * limited.shape[0] + i
    return least, binding


@search
def feasibility(
    machine: int,
    targets: Floats,
    begins: Floats,
    sides: Floats,
    margins: Floats,
    bindings: Ints,
    completed: Floats,
) -> None:
    """Fill the least margin of each target (n, 4, 4) [length], the index of its limit, and what it was measured at.

    After the limits of `least_margin` come two more for each leg: first for all legs, that the leg reaches (minus the
    gap, as a share of the rod); then for all legs, that it closes (minus the largest constraint, or the angle by which
    crossed hinges miss their direction). NaN and -1 if a target is no pose.

    Parameters
    ----------
    completed : (n, 12 + legs): the rows of the pose that a target was completed to [length], then the coordinates of
        implicit joints [L or rad]; without rows, none are written.
    """
    table = open_table(machine)
    scratch, legs, task, limited, cones = new_completion(table), table.legs, table.task, table.limited, table.cones
    start, target, n_legs = np.zeros((4, 4)), np.zeros((4, 4)), legs.shape[0]
    row_sides, turn = np.zeros(n_legs), np.zeros(3)
    n_limits = 2 * limited.shape[0] + cones.shape[0]
    for row in range(targets.shape[0]):
        margins[row], bindings[row] = math.nan, -1
        is_pose, is_closed = True, False
        for parts in (1, PARTS, MORE_PARTS):
            if parts > 1 and not (margins[row] < 0.0 and task[0]["unset"] + task[0]["implicit"] > 0):
                break
            if parts == MORE_PARTS and is_closed and task[0]["implicit"] == 0:
                break
            interpolate_target(begins[0], begins[0], 1.0, task[0], start, turn)
            copy_row(sides[0], row_sides)
            for part in range(1, parts + 1):
                interpolate_target(targets[row], begins[0], part / parts, task[0], target, turn)
                is_pose = read_target(target, start, task[0], scratch.pose)
                is_closed = is_pose and complete_pose(table, row_sides, scratch)
                if not is_closed:
                    break
                put_pose(scratch.pose, task[0]["length"], start)
                copy_row(scratch.sides, row_sides)
            if not is_pose:
                break
            if parts > 1 and not is_closed:
                continue
            least, binding = least_margin(limited, cones, scratch.values)
            if not is_closed:
                put_rows(legs, scratch.frames, scratch.values, scratch.lines, scratch.rows)
                for k in range(n_legs):
                    margin = reach_margin(legs[k], scratch.values[k])
                    if margin < -NEARLY_CLOSED and margin < least - KEPT:
                        least, binding = margin, n_limits + k
                    margin = closing_margin(legs, k, scratch.rows, scratch.values)
                    if margin < -NEARLY_CLOSED and margin < least - KEPT:
                        least, binding = margin, n_limits + n_legs + k
            if parts == 1 or least > margins[row]:
                margins[row], bindings[row] = least, binding
                if completed.shape[0] > 0:
                    put_completed(table, scratch, completed[row])


@routine
def put_completed(table: Table, scratch: Completion, to: Floats) -> None:
    """Fill the pose and the coordinates at which legs were placed last."""
    for i in range(3):
        for j in range(4):
            to[4 * i + j] = scratch.frames[FROM_BASE, i, j] * (table.task[0]["length"] if j == 3 else 1.0)
    for k in range(table.legs.shape[0]):
        to[12 + k] = scratch.values[k, Q_PROXIMAL] if table.legs[k]["kind"] == REDUNDANT else 0.0


@search
def read_targets(machine: int, targets: Floats, begins: Floats, completed: Floats) -> None:
    """Fill the rows of the poses [length] of targets that set all of a pose; NaN if a target is none."""
    table = open_table(machine)
    task, pose = table.task[0], np.zeros((4, 4))
    for row in range(targets.shape[0]):
        is_pose = read_target(targets[row], begins[0], task, pose)
        for i in range(3):
            for j in range(4):
                part = pose[i, j] * (task["length"] if j == 3 else 1.0)
                completed[row, 4 * i + j] = part if is_pose else math.nan


@routine
def interpolate_target(target: Floats, start: Floats, share: float, task: Record, out: Floats, turn: Floats) -> None:
    """Fill a target that is a share of the way from a start to a target, (4, 4) [length] each."""
    for i in range(4):
        for j in range(4):
            out[i, j] = target[i, j]
    if share == 1.0:
        return
    for i in range(3):
        out[i, 3] = start[i, 3] + share * (target[i, 3] - start[i, 3])
        for j in range(3):
            out[i, j] = start[i, j]
    if task["rotations"] == 3:
        difference(target, start, turn)
        turn_pose(out, scale(share, vec(turn)))
    elif task["rotations"] == 2:
        tilt_to(target, share, out)
    elif task["rotations"] == 1:
        turn_about_z(out, share * yaw_difference(target, start))


@routine
def reach_margin(leg: Record, values: Floats) -> float:
    """Minus the gap that a rod leaves where its proximal joint does not reach, as a share of its length."""
    return -abs(values[SLIDE]) / leg["length"] if leg["has_proximal"] == 1 else 0.0


@routine
def closing_margin(legs: Records, k: int, rows: Floats, values: Floats) -> float:
    """Minus the largest constraint of a leg, or the angle by which its crossed hinges miss their direction."""
    return -max(largest_constraint(legs, rows, k), largest_pointing_error(legs[k], values[k]))


@routine
def largest_pointing_error(leg: Record, values: Floats) -> float:
    """The largest angle by which crossed hinges of a leg, or the first two of three, miss their direction [rad]."""
    line, worst = vec(leg["line"]), 0.0
    if leg["base_end_aimed"] == 1 and leg["base_end"] != HINGE:
        worst = pointing_error(leg["base_end_axes"], line, vec(values[BASE_LINE:]), values[BASE_END:])
    if leg["platform_end_aimed"] == 1 and leg["platform_end"] == CROSS:
        missed = pointing_error(leg["platform_end_axes"], line, vec(values[PLATFORM_LINE:]), values[PLATFORM_END:])
        worst = max(worst, missed)
    return worst


@routine
def largest_constraint(legs: Records, rows: Floats, k: int) -> float:
    """The largest constraint of a leg [L or rad]."""
    worst = 0.0
    for i in range(legs[k]["first_row"], legs[k]["first_row"] + legs[k]["n_rows"]):
        worst = max(worst, abs(rows[i]))
    return worst
