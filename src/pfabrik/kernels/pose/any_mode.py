"""Inverse kinematics by legs in closed form in any working mode, other than the start's if need be."""

from __future__ import annotations

from ...common.arrays import Floats, Ints
from .._jit import routine
from ..legs.answer import (
    Completion,
    complete_pose,
    cone_cosine,
    deviation,
    excess_of,
    place_legs,
    put_rows,
    write_answer,
)
from ..legs.complete_poses import read_target
from ..legs.frames import set_frames
from ..legs.leg_constants import KEPT, LEAST_MARGIN
from ..legs.margin_rows import largest_constraint
from ..legs.records import Table
from ..rows import PENDING, REACHED, UNSURE
from ..vectors import copy_row
from .equations import owner_of
from .pose_constants import HALF_DIGITS, MOST_CHOICES
from .search_records import PoseSolutions


@routine
def note_misfits(table: Table, values: Floats, rows: Floats, misfits: Floats) -> None:
    """Mark the legs that do not close on a pose within their limits, by the owners of their proximal joints."""
    for k in range(misfits.shape[0]):
        misfits[k] = 0.0
    for k in range(misfits.shape[0]):
        if largest_constraint(table.legs, rows, k) > KEPT:
            misfits[owner_of(table, k)] = 1.0
    for i in range(table.limited.shape[0]):
        limited = table.limited[i]
        value = deviation(limited, values)
        if not max(limited["lo"] - value, value - limited["hi"]) <= KEPT:
            misfits[owner_of(table, limited["leg"])] = 1.0
    for i in range(table.cones.shape[0]):
        if not cone_cosine(table.cones[i], values) >= table.cones[i]["least_cosine"]:
            misfits[owner_of(table, table.cones[i]["leg"])] = 1.0
    for k in range(misfits.shape[0]):
        if table.legs[k]["orients"] == 1:
            misfits[k] = misfits[k + 1] = max(misfits[k], misfits[k + 1])


@routine
def is_singular(table: Table, sides: Floats, scratch: Completion) -> bool:
    """True if legs on these sides reach a pose to within `HALF_DIGITS`, one of them at a dead point."""
    set_frames(scratch.pose, table.task[0], scratch.frames)
    singularity_margin, _ = place_legs(table.legs, scratch.frames, sides, scratch.values, scratch.lines)
    if singularity_margin > LEAST_MARGIN * LEAST_MARGIN or singularity_margin < -HALF_DIGITS * HALF_DIGITS:
        return False
    residual = put_rows(table.legs, scratch.frames, scratch.values, scratch.lines, scratch.rows)
    return bool(residual <= HALF_DIGITS and excess_of(table.limited, table.cones, scratch.values) <= HALF_DIGITS)


@routine
def note_choices(table: Table, sides: Floats, choices: Ints) -> int:
    """List the legs that have two sides; their number."""
    legs, n = table.legs, 0
    for k in range(legs.shape[0]):
        if sides[k] != 0.0 and legs[k]["implicit"] == 0:
            choices[n] = k
            n += 1
    return n


@routine
def count_changes(choice: int) -> int:
    """Number of legs that a choice changes: the bits that are set."""
    n = 0
    while choice > 0:
        n += choice & 1
        choice >>= 1
    return n


@routine
def put_changed(start_sides: Floats, choices: Ints, n_choices: int, choice: int, sides: Floats) -> None:
    """Fill the sides of a start with some legs changed: the first of the choices is the highest bit."""
    copy_row(start_sides, sides)
    for c in range(n_choices):
        if choice >> (n_choices - 1 - c) & 1 == 1:
            sides[choices[c]] = -start_sides[choices[c]]


@routine
def answer_in_any_mode(
    table: Table,
    target: Floats,
    begin: Floats,
    sides: Floats,
    misfits: Floats,
    choices: Ints,
    scratch: Completion,
    answer: PoseSolutions,
) -> int:
    """Solve a target [length] by legs on any sides, within all limits: its status; else it is PENDING, or UNSURE.

    If it sets the whole pose, each leg takes the side that fits it; if legs complete the pose together, all
    combinations of their sides are tried.

    Parameters
    ----------
    begin : the pose that the target is completed from, (4, 4) [length].
    sides : sides to start from, (legs,); filled with the solution's.
    misfits, choices : scratch memory, (legs,).
    answer : filled with pose, actuators and measures where the status is REACHED.
    """
    legs, task, n_passes, status = table.legs, table.task[0], 1, PENDING
    for k in range(legs.shape[0]):
        n_passes = 3 if legs[k]["orients"] == 1 else n_passes
    n_choices = note_choices(table, sides, choices)
    is_coupled = task["unset"] + task["implicit"] > 0
    n_tries = 2 ** min(n_choices, MOST_CHOICES) - 1 if is_coupled else n_passes
    for attempt in range(1, n_tries + 1):
        if not is_coupled and read_target(target, begin, task, scratch.pose):
            set_frames(scratch.pose, task, scratch.frames)
            place_legs(legs, scratch.frames, sides, scratch.values, scratch.lines)
            put_rows(legs, scratch.frames, scratch.values, scratch.lines, scratch.rows)
            note_misfits(table, scratch.values, scratch.rows, misfits)
        for c in range(n_choices):
            k = choices[c]
            is_flipped = (attempt ^ (attempt - 1)) >> c & 1 == 1
            if not is_coupled:  # a rod first, then its orienting joint, then the rod again
                is_flipped = misfits[k] == 1.0 and (legs[k]["orients"] == 1) == (attempt == 2)
            sides[k] = -sides[k] if is_flipped else sides[k]
        if not read_target(target, begin, task, scratch.pose):
            break
        if complete_pose(table, sides, scratch):
            if write_answer(table, scratch, answer.poses[0], answer.actuators[0], answer.measures[0]) == REACHED:
                copy_row(scratch.sides, sides)
                return REACHED
        elif task["unset"] == 0 and is_singular(table, sides, scratch):
            status = UNSURE
    return status
