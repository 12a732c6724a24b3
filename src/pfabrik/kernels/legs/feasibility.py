"""How far poses are inside, or beyond, the limits of legs in closed form."""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Floats, Ints, Record, Records
from .._jit import routine, search
from ..rotations import difference, turn_about_z, yaw_difference
from ..vectors import angle_between, copy_row, scale, vec
from .answer import CLOSE, KEPT, complete, deviation, end_of_rows, new_completion, put_rows
from .endings import missed_by
from .poses import lean_to, load, put_pose, turn_pose
from .records import BASE_END, BASE_LINE, CARRIAGE, CRANK, CROSS, PIVOT, PLATFORM_END, PLATFORM_LINE, ROD, SLIDE, TRIPLE
from .table import open_table

PARTS, MORE_PARTS = 4, 16
"""Parts of the way from the start in which a pose is completed where, all at once, it does not close within limits; and
where in so many it did not close, or led arms beyond limits, which near where these are singular turn far at once."""


@routine
def share_of(off: float, room: float) -> float:
    """Distance from a bound as a share of the room there is: of half the range, or of a cone's half angle.

    A locked joint has none: 0 on its value, infinite off it.
    """
    if room > KEPT:
        return off / room
    return 0.0 if abs(off) <= KEPT else math.copysign(math.inf, off)


@routine
def least_margin(limited: Records, cones: Records, values: Floats) -> tuple[float, int]:
    """The least share of any limit, and which it is: two of each range, then cones; -1 where there is none."""
    least, binding = math.inf, -1
    for i in range(limited.shape[0]):
        lo, hi, value = limited[i]["lo"], limited[i]["hi"], deviation(limited[i], values)
        below, above = share_of(value - lo, 0.5 * (hi - lo)), share_of(hi - value, 0.5 * (hi - lo))
        if min(below, above) < least:
            least, binding = min(below, above), 2 * i + (1 if above < below else 0)
    for i in range(cones.shape[0]):
        own, place = values[cones[i]["leg"]], cones[i]["place"]
        angle = angle_between(vec(cones[i]["axis"]), (own[place], own[place + 1], own[place + 2]))
        share = share_of(cones[i]["half_angle"] - angle, cones[i]["half_angle"])
        if share < least:
            least, binding = share, 2 * limited.shape[0] + i
    return least, binding


@search
def feasibility(
    machine: int,
    targets: Floats,
    begins: Floats,
    sides: Floats,
    margins: Floats,
    bindings: Ints,
) -> None:
    """Fill the least margin of each target (n, 4, 4) [length], and which limit it is of.

    After the limits of `least_margin` come, for each leg, that it reaches (margin: minus the gap, as a share of the
    rod) and, for each, that it closes (minus its largest constraint, or the angle by which crossed hinges cannot point
    where they should). NaN and -1 where a target is no pose.
    """
    table = open_table(machine)
    scratch, legs, task, limited, cones = new_completion(table), table.legs, table.task, table.limited, table.cones
    before, toward, n_legs = np.zeros((4, 4)), np.zeros((4, 4)), legs.shape[0]
    own, turn = np.zeros(n_legs), np.zeros(3)
    n_limits = 2 * limited.shape[0] + cones.shape[0]
    for row in range(targets.shape[0]):
        margins[row], bindings[row] = math.nan, -1
        is_pose, closed = True, False
        for parts in (1, PARTS, MORE_PARTS):
            if parts > 1 and not (margins[row] < 0.0 and task[0]["unset"] + task[0]["implicit"] > 0):
                break
            if parts == MORE_PARTS and closed and task[0]["implicit"] == 0:
                break
            aim(begins[0], begins[0], 1.0, task[0], before, turn)
            copy_row(sides[0], own)
            for part in range(1, parts + 1):
                aim(targets[row], begins[0], part / parts, task[0], toward, turn)
                is_pose = load(toward, before, task[0], scratch.pose)
                closed = is_pose and complete(table, own, scratch)
                if not closed:
                    break
                put_pose(scratch.pose, task[0]["length"], before)
                copy_row(scratch.sides, own)
            if not is_pose:
                break
            if parts > 1 and not closed:
                continue
            least, binding = least_margin(limited, cones, scratch.values)
            if not closed:
                put_rows(legs, scratch.frames, scratch.values, scratch.lines, scratch.rows)
                for k in range(n_legs):
                    share = reach_of(legs[k], scratch.values[k])
                    if share < -CLOSE and share < least:
                        least, binding = share, n_limits + k
                    share = -max(largest_row(legs, scratch.rows, k), missed_by_ends(legs[k], scratch.values[k]))
                    if share < -CLOSE and share < least:
                        least, binding = share, n_limits + n_legs + k
            if parts == 1 or least > margins[row]:
                margins[row], bindings[row] = least, binding


@routine
def aim(target: Floats, begin: Floats, share: float, task: Record, toward: Floats, turn: Floats) -> None:
    """Fill a target that is a share of the way from another pose, (4, 4) [length] each."""
    for i in range(4):
        for j in range(4):
            toward[i, j] = target[i, j]
    if share == 1.0:
        return
    for i in range(3):
        toward[i, 3] = begin[i, 3] + share * (target[i, 3] - begin[i, 3])
        for j in range(3):
            toward[i, j] = begin[i, j]
    if task["rotations"] == 3:
        difference(target, begin, turn)
        turn_pose(toward, scale(share, vec(turn)))
    elif task["rotations"] == 2:
        lean_to(target, share, toward)
    elif task["rotations"] == 1:
        turn_about_z(toward, share * yaw_difference(target, begin))


@routine
def reach_of(leg: Record, own: Floats) -> float:
    """Minus the gap that a leg leaves where its carrier does not reach, as a share of its rod."""
    if leg["kind"] == ROD and (leg["proximal"] == CRANK or leg["proximal"] == CARRIAGE):
        return -abs(own[SLIDE]) / leg["length"]
    return 0.0


@routine
def missed_by_ends(leg: Record, own: Floats) -> float:
    """The largest angle by which crossed hinges of a leg, or the first two of three, cannot point where they should."""
    if leg["kind"] == PIVOT and leg["base_end"] == TRIPLE:
        axes = leg["base_end_axes"]
        return missed_by(axes, vec(axes[2]), vec(own[BASE_LINE:]), own[BASE_END:])
    worst = 0.0
    if leg["kind"] == ROD and leg["base_end_aimed"] == 1 and leg["base_end"] == CROSS:
        worst = missed_by(leg["base_end_axes"], vec(leg["line"]), vec(own[BASE_LINE:]), own[BASE_END:])
    if leg["kind"] == ROD and leg["platform_end_aimed"] == 1 and leg["platform_end"] == CROSS:
        worst = max(
            worst, missed_by(leg["platform_end_axes"], vec(leg["line"]), vec(own[PLATFORM_LINE:]), own[PLATFORM_END:])
        )
    return worst


@routine
def largest_row(legs: Records, rows: Floats, k: int) -> float:
    """The largest constraint of a leg [L or rad]."""
    worst = 0.0
    for i in range(legs[k]["first_row"], end_of_rows(legs, k, rows.shape[0])):
        worst = max(worst, abs(rows[i]))
    return worst
