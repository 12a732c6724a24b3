"""Reaching targets by the legs' closed forms, in the working mode of the start, on all cores."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Mask, Records
from ..batch import put, take
from ..closure.configurations import Configurations
from ..closure.continuation import continued
from ..decomposition.leg_table import LegTable
from ..derived import derived
from ..kernels.platform.tables import BY_LEGS
from ..kernels.rows import LIMIT_EXCESS, OPEN, PENDING, REACHED, RESIDUAL, Rows
from ..kernels.threads import in_blocks
from ..model import Model
from ..options import Options
from ..poses import between
from ..rotations import nearest_turn
from .redundant_joints import split_by_redundant
from .rows_one_by_one import Answers, answer_phases, request_from, step_redundant_joints
from .table import TableHandle, legs_at_rest, local_table, table_handle

ROWS_A_BLOCK, ROWS_A_RUN = 1024, 4096
"""Rows of one call of the kernels that solve targets one by one, and in blocks."""


def reach(
    model: Model,
    targets: Floats,
    start: Configurations | None,
    sides: Floats,
    keep_mode: bool,
    rows: Rows,
    *,
    is_tried: bool = False,
) -> tuple[int, Floats]:
    """Solve the rows that legs reach.

    Parameters
    ----------
    is_tried : the only row was tried already, without success; its status is set.

    Returns
    -------
    The number of unsolved rows, and the sides of the answers with the coordinates of redundant joints.
    """
    start_poses = model.mechanism.home_pose[None] if start is None else start.rows.poses
    legs = local_table(model.legs) if keep_mode else table_handle(model.legs)
    if model.legs.has_implicit_joints:
        sides = np.repeat(sides, len(targets), axis=0) if len(sides) == 1 else sides.copy()
    n_unsolved = 1 if is_tried else _reach_at_start(model, start is None, legs, targets, start_poses, sides, rows)
    if n_unsolved and keep_mode and model.legs.has_implicit_joints:
        n_unsolved -= _lead(model, legs, targets, start_poses, sides, rows)
    if n_unsolved and model.legs.is_for_blocks and model.legs.task["unset"][0]:
        n_unsolved -= _complete(model, legs, targets, start_poses, sides, rows)
    if n_unsolved and model.legs.has_free_redundant:
        sides = np.repeat(sides, len(targets), axis=0) if len(sides) == 1 else sides.copy()
        n_unsolved = _move_redundant(model, targets, start, sides, keep_mode, rows)
    if start is not None:
        count_turns(model, start.rows.actuators, rows)
    return n_unsolved, sides


def _reach_at_start(
    model: Model, from_home: bool, legs: TableHandle, targets: Floats, start_poses: Floats, sides: Floats, rows: Rows
) -> int:
    """Solve the rows that legs reach while free redundant joints stay; return the number of unsolved rows."""
    resting = legs_at_rest(model.legs) if from_home else None
    if resting is None:
        return _run(model.legs.is_for_blocks, legs, targets, start_poses, sides, rows)
    rows.actuators[:] = resting.actuators
    return _run(True, table_handle(resting.table), targets, start_poses, resting.table.home_sides, rows)


def _lead(model: Model, legs: TableHandle, targets: Floats, start_poses: Floats, sides: Floats, rows: Rows) -> int:
    """Lead the platform from its start to the targets that are not reached; return the number of rows solved.

    Each step completes near the configuration before, and halves where that fails: implicit joints keep their branch.
    """
    unsolved = np.flatnonzero(rows.status != REACHED)
    begin = np.broadcast_to(start_poses, targets.shape)[unsolved]
    present, led_sides, led = begin.copy(), sides[unsolved], take(rows, unsolved)

    def advance(active: NDArray[np.intp], shares: Floats) -> Mask:
        wanted = between(begin[active], targets[unsolved[active]], shares[:, None, None])
        block, block_sides = take(led, active), led_sides[active]
        reach_on_sides(legs, wanted, present[active], block_sides, block)
        is_reached = np.asarray(block.status == REACHED)
        reached = active[is_reached]
        put(led, reached, block, is_reached)
        present[reached], led_sides[reached] = block.poses[is_reached], block_sides[is_reached]
        return is_reached

    solved = np.flatnonzero(continued(len(unsolved), advance) == 1.0)
    put(rows, unsolved[solved], led, solved)
    sides[unsolved[solved]] = led_sides[solved]
    return len(solved)


def _move_redundant(
    model: Model, targets: Floats, start: Configurations | None, sides: Floats, keep_mode: bool, rows: Rows
) -> int:
    """Solve rows by moving free redundant joints, and write their coordinates; return the number of unsolved rows."""
    unsolved = np.flatnonzero(rows.status != REACHED)
    request = request_from(model, Options(), start, sides.copy(), keep_mode, nearby=False)
    answer_phases(request, targets, Answers(rows, np.empty_like(sides), sides), unsolved, BY_LEGS, BY_LEGS)
    rows.status[rows.status == OPEN] = PENDING
    return int(np.count_nonzero(rows.status != REACHED))


def rest_redundant(model: Model, start: Configurations | None, start_sides: Floats, sides: Floats, rows: Rows) -> Mask:
    """Move the redundant joints of answers, (n, legs), to where they are nearest to those of starts at the same poses.

    Each independent set alone: limits that end a projection may hold one where it is. Return the mask of rows changed.
    """
    start_sides = np.broadcast_to(start_sides, sides.shape)
    table, rested, is_changed = model.legs, start_sides.copy(), np.zeros(len(sides), bool)
    step_redundant_joints(model, rows.poses, rested)
    for _, legs in split_by_redundant(table):
        columns = np.intersect1d(table.implicit_joints["leg"], np.arange(len(table.legs))[legs])
        candidate, block = sides.copy(), take(rows, np.arange(len(sides)))
        candidate[:, columns] = rested[:, columns]
        far, before = (np.linalg.norm((each - start_sides)[:, columns], axis=1) for each in (candidate, sides))
        reach_on_sides(local_table(table), rows.poses, rows.poses, candidate, block)
        is_nearer = (block.status == REACHED) & (far < before)
        sides[is_nearer], rows.actuators[is_nearer] = candidate[is_nearer], block.actuators[is_nearer]
        for measure in (RESIDUAL, LIMIT_EXCESS):
            rows.measures[is_nearer, measure] = block.measures[is_nearer, measure]
        is_changed |= is_nearer
    if start is not None:
        count_turns(model, start.rows.actuators, rows)
    return is_changed


def reach_on_sides(legs: TableHandle, targets: Floats, start_poses: Floats, sides: Floats, rows: Rows) -> int:
    """Solve targets one by one by legs on given sides (n, legs), as `legs.answer`; return the number not reached."""
    return _run(False, legs, targets, start_poses, sides, rows)


def _run(by_blocks: bool, legs: TableHandle, targets: Floats, start_poses: Floats, sides: Floats, rows: Rows) -> int:
    """Solve targets on all cores, in blocks of poses or one by one; return the number not reached."""
    if by_blocks:
        from ..kernels.legs.blocks import answer_blocks as answer
    else:
        from ..kernels.legs.answer import answer

    def run(block: slice) -> int:
        return answer(
            legs.address,
            targets[block],
            _part(start_poses, block),
            _part(sides, block),
            rows.status[block],
            rows.poses[block],
            rows.actuators[block],
            rows.measures[block],
        )

    return sum(in_blocks(run, len(targets), ROWS_A_RUN if by_blocks else ROWS_A_BLOCK))


def _complete(model: Model, legs: TableHandle, targets: Floats, start_poses: Floats, sides: Floats, rows: Rows) -> int:
    """Solve the rows that blocks left OPEN, whose poses are to be completed; return the number reached."""
    is_open = (rows.status == OPEN).nonzero()[0]
    if not len(is_open):
        return 0
    block = take(rows, is_open)
    start_poses, sides = (array if len(array) == 1 else array[is_open] for array in (start_poses, sides))
    n_unsolved = reach_on_sides(legs, targets[is_open], start_poses, sides, block)
    put(rows, is_open, block)
    return len(is_open) - n_unsolved


def count_turns(model: Model, start_values: Floats, rows: Rows) -> None:
    """Add whole turns to actuators that may turn more than once: nearest to the start's values (n or 1, n_a)."""
    for driven in _turning(model.legs):
        is_solved = rows.status != PENDING
        values, previous = rows.actuators[is_solved, driven["column"]], start_values[:, driven["column"]]
        previous = previous if len(start_values) == 1 else previous[is_solved]
        lo, hi = driven["home"] + driven["lo"], driven["home"] + driven["hi"]
        rows.actuators[is_solved, driven["column"]] = nearest_turn(values, previous, lo, hi)


def turns_repeatedly(table: LegTable) -> bool:
    """True if some actuator may turn more than once."""
    return len(_turning(table)) > 0


@derived
def _turning(table: LegTable) -> Records:
    """The actuators that may turn more than once."""
    driven = table.driven
    return np.asarray(driven[(driven["turns"] == 1) & (driven["hi"] - driven["lo"] > 2.0 * np.pi)])


def _part(array: Floats, block: slice) -> Floats:
    """The rows of a block, or the single row for all; writable, as kernels are compiled for."""
    part = array if len(array) == 1 else array[block]
    return np.require(part, requirements=["C", "W"])
