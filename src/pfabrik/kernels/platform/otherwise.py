"""Poses that legs in closed form reach on other sides than those they start on: in other working modes."""

from __future__ import annotations

import numpy as np

from ...arrays import Floats, Ints
from .._jit import routine, search
from ..legs.answer import (
    KEPT,
    Completion,
    complete_pose,
    cone_cosine,
    deviation,
    excess_of,
    new_completion,
    place_legs,
    put_rows,
    write_answer,
)
from ..legs.endings import LEAST_MARGIN
from ..legs.feasibility import largest_constraint
from ..legs.frames import set_frames
from ..legs.poses import read_target
from ..legs.records import REDUNDANT, Table
from ..legs.table import open_table
from ..rows import PENDING, REACHED, UNSURE
from ..vectors import copy_row
from .equations import main_of

NEARLY = 1e-6
"""By how much legs at dead points may be off, where closed forms tell half their digits [rad or L]."""

MOST_CHOICES = 8
"""Legs with two solutions beyond which not every combination of them is tried, where a pose is completed by all."""


@routine
def note_misfits(table: Table, values: Floats, rows: Floats, misfits: Floats) -> None:
    """Note which legs, by those whose carriers they are on, do not close on a pose within their limits."""
    for k in range(misfits.shape[0]):
        misfits[k] = 0.0
    for k in range(misfits.shape[0]):
        if largest_constraint(table.legs, rows, k) > KEPT:
            misfits[main_of(table, k)] = 1.0
    for i in range(table.limited.shape[0]):
        limited = table.limited[i]
        value = deviation(limited, values)
        if not max(limited["lo"] - value, value - limited["hi"]) <= KEPT:
            misfits[main_of(table, limited["leg"])] = 1.0
    for i in range(table.cones.shape[0]):
        if not cone_cosine(table.cones[i], values) >= table.cones[i]["least_cosine"]:
            misfits[main_of(table, table.cones[i]["leg"])] = 1.0
    for k in range(misfits.shape[0]):
        if table.legs[k]["orients"] == 1:
            misfits[k] = misfits[k + 1] = max(misfits[k], misfits[k + 1])


@routine
def is_singular(table: Table, sides: Floats, scratch: Completion) -> bool:
    """Whether legs on these sides reach a pose, as far as can be told where one of them is at a dead point."""
    set_frames(scratch.pose, table.task[0], scratch.frames)
    singularity_margin, _ = place_legs(table.legs, scratch.frames, sides, scratch.values, scratch.lines)
    if singularity_margin > LEAST_MARGIN * LEAST_MARGIN or singularity_margin < -NEARLY * NEARLY:
        return False
    worst = put_rows(table.legs, scratch.frames, scratch.values, scratch.lines, scratch.rows)
    return bool(worst <= NEARLY and excess_of(table.limited, table.cones, scratch.values) <= NEARLY)


@routine
def note_choices(table: Table, sides: Floats, choosing: Ints) -> int:
    """Note the legs that take one of two solutions; how many these are."""
    legs, n = table.legs, 0
    for k in range(legs.shape[0]):
        if sides[k] != 0.0 and (legs[k]["kind"] != REDUNDANT or legs[k]["orients"] == 1):
            choosing[n] = k
            n += 1
    return n


@search
def answer_otherwise(
    machine: int,
    targets: Floats,
    begins: Floats,
    sides: Floats,
    status: Ints,
    poses: Floats,
    actuators: Floats,
    measures: Floats,
) -> int:
    """Answer targets (n, 4, 4) [length] that legs reach on any sides within all limits; others are PENDING, or UNSURE.

    Where a target sets the whole pose, every leg takes the sides that suit it; where legs complete it together, their
    sides are tried in all combinations.

    Parameters
    ----------
    machine : see `open_table`.
    begins : poses that targets are completed from, (n or 1, 4, 4) [length].
    sides : where to start, (n, legs), and where answers are.

    Returns
    -------
    How many are not reached.
    """
    table = open_table(machine)
    scratch, legs, n_legs, own, left = new_completion(table), table.legs, table.legs.shape[0], table.task[0], 0
    misfits, choosing, alone = np.zeros(n_legs), np.zeros(n_legs, np.int64), 1
    for k in range(n_legs):
        alone = 3 if legs[k]["orients"] == 1 else alone
    n_choices = note_choices(table, sides[0], choosing) if sides.shape[0] > 0 else 0
    together = own["unset"] + own["implicit"] > 0
    tries = 2 ** min(n_choices, MOST_CHOICES) - 1 if together else alone
    for row in range(targets.shape[0]):
        status[row], begin = PENDING, begins[row if begins.shape[0] > 1 else 0]
        for attempt in range(1, tries + 1):
            if not together and read_target(targets[row], begin, own, scratch.pose):
                set_frames(scratch.pose, own, scratch.frames)
                place_legs(legs, scratch.frames, sides[row], scratch.values, scratch.lines)
                put_rows(legs, scratch.frames, scratch.values, scratch.lines, scratch.rows)
                note_misfits(table, scratch.values, scratch.rows, misfits)
            for c in range(n_choices):
                k = choosing[c]
                flips = (attempt ^ (attempt - 1)) >> c & 1 == 1
                if not together:  # a rod first, then the arm that it is on, then the rod again
                    flips = misfits[k] == 1.0 and (legs[k]["orients"] == 1) == (attempt == 2)
                sides[row, k] = -sides[row, k] if flips else sides[row, k]
            if not read_target(targets[row], begin, own, scratch.pose):
                break
            if complete_pose(table, sides[row], scratch):
                if write_answer(table, scratch, poses[row], actuators[row], measures[row]) == REACHED:
                    status[row] = REACHED
                    copy_row(scratch.sides, sides[row])
                    break
            elif own["unset"] == 0 and is_singular(table, sides[row], scratch):
                status[row] = UNSURE
        left += 0 if status[row] == REACHED else 1
    return left
