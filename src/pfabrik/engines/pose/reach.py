"""Solution of targets by the legs' closed forms, in the working mode of the start, on all cores."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...common.arrays import Floats, Mask, Records
from ...common.batch import put, take
from ...common.derived import derived
from ...common.rotations import nearest_turn
from ...kernels.pose.tables import BY_LEGS
from ...kernels.rows import LIMIT_EXCESS, OPEN, PENDING, REACHED, RESIDUAL, Rows
from ...kernels.threads import in_blocks
from ...machine.decomposition.leg_table import LegTable
from ...machine.model import Model
from ...machine.poses import are_poses, between
from ...options import Options
from ..joints.configurations import Configurations
from ..joints.effort import continued
from .single import Answers, answer_phases, request_from
from .table import TableHandle, legs_at_rest, local_table, table_handle

ROWS_A_BLOCK, ROWS_A_RUN = 1024, 4096
"""Rows of one kernel call: of the kernel that solves targets one by one, and of the kernel for blocks."""


def reach(
    model: Model,
    targets: Floats,
    start: Configurations | None,
    sides: Floats,
    keep_mode: bool,
    rows: Rows,
    *,
    is_tried: bool = False,
    continues: bool = True,
) -> tuple[int, Floats]:
    """Solve for targets (n, 4, 4) by the legs' closed forms.

    Parameters
    ----------
    sides : branches of the start with the coordinates of redundant joints, (n or 1, legs).
    is_tried : True if the only row has failed before; its status is set.
    continues : implicit joints are led to far targets in small steps, if `keep_mode`.

    Returns
    -------
    The number of unsolved rows, and the answers' `sides`.
    """
    start_poses = model.mechanism.home_pose[None] if start is None else start.rows.poses
    legs = local_table(model.legs) if keep_mode else table_handle(model.legs)
    if model.legs.has_implicit_joints:
        sides = np.repeat(sides, len(targets), axis=0) if len(sides) == 1 else sides.copy()
    n_unsolved = 1 if is_tried else _reach_at_start(model, start is None, legs, targets, start_poses, sides, rows)
    if n_unsolved and continues and keep_mode and model.legs.has_implicit_joints:
        n_unsolved -= _continue_to(model, legs, targets, start_poses, sides, rows)
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
    """Solve rows with free redundant joints at their start; return the number of unsolved rows."""
    resting = legs_at_rest(model.legs) if from_home else None
    if resting is None:
        return _answer(model.legs.is_for_blocks, legs, targets, start_poses, sides, rows)
    rows.actuators[:] = resting.actuators
    return _answer(True, table_handle(resting.table), targets, start_poses, resting.table.home_sides, rows)


def _continue_to(
    model: Model, legs: TableHandle, targets: Floats, start_poses: Floats, sides: Floats, rows: Rows
) -> int:
    """Solve the remaining rows by continuation from their starts; return the number of solved rows.

    Every step completes the pose near the configuration before, and is halved if that fails, so that implicit joints
    keep their branch.
    """
    unsolved = np.flatnonzero(rows.status != REACHED)
    unsolved = unsolved[are_poses(targets[unsolved])]  # singular values of what is not finite may never be found
    first_poses = np.broadcast_to(start_poses, targets.shape)[unsolved]
    present, last_sides, last = first_poses.copy(), sides[unsolved], take(rows, unsolved)

    def advance(active: NDArray[np.intp], shares: Floats) -> Mask:
        step_targets = between(first_poses[active], targets[unsolved[active]], shares[:, None, None])
        block, block_sides = take(last, active), last_sides[active]
        reach_on_sides(legs, step_targets, present[active], block_sides, block)
        is_reached = np.asarray(block.status == REACHED)
        reached = active[is_reached]
        put(last, reached, block, is_reached)
        present[reached], last_sides[reached] = block.poses[is_reached], block_sides[is_reached]
        return is_reached

    solved = np.flatnonzero(continued(len(unsolved), advance) == 1.0)
    put(rows, unsolved[solved], last, solved)
    sides[unsolved[solved]] = last_sides[solved]
    return len(solved)


def _move_redundant(
    model: Model, targets: Floats, start: Configurations | None, sides: Floats, keep_mode: bool, rows: Rows
) -> int:
    """Solve the remaining rows by moving free redundant joints; return the number of unsolved rows."""
    unsolved = np.flatnonzero(rows.status != REACHED)
    request = request_from(model, Options(), start, sides.copy(), keep_mode, nearby=False)
    answer_phases(request, targets, Answers(rows, np.empty_like(sides), sides), unsolved, BY_LEGS, BY_LEGS)
    rows.status[rows.status == OPEN] = PENDING
    return int(np.count_nonzero(rows.status != REACHED))


def rest_redundant(model: Model, start: Configurations | None, start_sides: Floats, sides: Floats, rows: Rows) -> Mask:
    """Move redundant joints of answers nearer to those of their starts, poses kept; return a mask of changed rows.

    The pose is asked for from the start, as a target: what reaches it moves them least.
    """
    n, columns = len(sides), model.legs.implicit_joints["leg"]
    found = Answers(take(rows, np.arange(n)), np.empty_like(sides), sides.copy())
    request = request_from(model, Options(), start, start_sides.copy(), True, nearby=False)
    answer_phases(request, rows.poses.copy(), found, np.arange(n), BY_LEGS, BY_LEGS)
    far, before = (np.linalg.norm((array - start_sides)[:, columns], axis=1) for array in (found.sides, sides))
    is_changed = np.asarray((found.rows.status == REACHED) & (far < before))
    sides[is_changed], rows.actuators[is_changed] = found.sides[is_changed], found.rows.actuators[is_changed]
    for measure in (RESIDUAL, LIMIT_EXCESS):
        rows.measures[is_changed, measure] = found.rows.measures[is_changed, measure]
    if start is not None:
        count_turns(model, start.rows.actuators, rows)
    return is_changed


def reach_on_sides(legs: TableHandle, targets: Floats, start_poses: Floats, sides: Floats, rows: Rows) -> int:
    """Solve targets one by one from given `sides` (n, legs); return the number of unsolved rows."""
    return _answer(False, legs, targets, start_poses, sides, rows)


def _answer(by_blocks: bool, legs: TableHandle, targets: Floats, start_poses: Floats, sides: Floats, rows: Rows) -> int:
    """Solve targets on all cores, in blocks of poses or one by one; return the number of unsolved rows."""
    if by_blocks:
        from ...kernels.legs.blocks import answer_blocks as answer
    else:
        from ...kernels.legs.answer import answer

    def run(block: slice) -> int:
        return answer(
            legs.address,
            targets[block],
            _block_of(start_poses, block),
            _block_of(sides, block),
            rows.status[block],
            rows.poses[block],
            rows.actuators[block],
            rows.measures[block],
        )

    return sum(in_blocks(run, len(targets), ROWS_A_RUN if by_blocks else ROWS_A_BLOCK))


def _complete(model: Model, legs: TableHandle, targets: Floats, start_poses: Floats, sides: Floats, rows: Rows) -> int:
    """Complete the poses of rows that the kernel for blocks left OPEN; return the number of solved rows."""
    is_open = (rows.status == OPEN).nonzero()[0]
    if not len(is_open):
        return 0
    block = take(rows, is_open)
    start_poses, sides = (array if len(array) == 1 else array[is_open] for array in (start_poses, sides))
    n_unsolved = reach_on_sides(legs, targets[is_open], start_poses, sides, block)
    put(rows, is_open, block)
    return len(is_open) - n_unsolved


def count_turns(model: Model, start_values: Floats, rows: Rows) -> None:
    """Add whole turns to actuators with more than one turn: nearest to the start's values (n or 1, n_a)."""
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
    """Actuators that may turn more than once."""
    driven = table.driven
    return np.asarray(driven[(driven["turns"] == 1) & (driven["hi"] - driven["lo"] > 2.0 * np.pi)])


def _block_of(array: Floats, block: slice) -> Floats:
    """Select the rows of a block, or the single row for all; contiguous and writable, as kernels require."""
    part = array if len(array) == 1 else array[block]
    return np.require(part, requirements=["C", "W"])
