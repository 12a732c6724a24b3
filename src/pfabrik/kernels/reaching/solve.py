"""The two kernels of inverse kinematics: rows that are reached directly, and rows that need the iterations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .._jit import inlined, kernel, routine
from ..vectors import copy_row, copy_table
from .blocks import BLOCK, LENGTHS, WORST, is_all_struts, lay_out_pose, measure_struts, read_actuator
from .frames import identity_pose, move_carriers
from .measure import measure_all, pose_errors
from .passes import reach_chain_directly
from .plan import (
    FAILED,
    HELD,
    HOLD_NOTHING,
    HOLD_ORIENTATION,
    HOME_X,
    INVALID,
    ITERATIONS,
    LENGTH,
    LIMIT_EXCESS,
    PENDING,
    POINT_END,
    POSITION_ERROR,
    PROJECTED,
    REACHED,
    RESIDUAL,
    ROTATION_ERROR,
    ROUNDS,
    Configuration,
    Floats,
    Plan,
    Rows,
    Seeds,
    Settings,
    Work,
)
from .project import copy_configuration, project_target, step_back
from .rows import (
    home_modes,
    is_beyond_horizon,
    load_seed,
    load_target,
    new_configuration,
    new_work,
    read_modes,
    write_reached,
    write_row,
)
from .search import place_ends, reach_pose
from .settle import TRANSLATES, TURNS, settle


@kernel
def solve_directly(plan: Plan, targets: Floats, seeds: Seeds, settings: Settings, rows: Rows) -> int:
    """Answer every row whose chains all reach by closed form; returns how many rows are left pending.

    A row that is not a pose becomes INVALID and keeps its arrays untouched.
    """
    now = new_configuration(plan)
    modes = np.ones(plan.branches.shape[0])
    first_modes = np.ones(plan.branches.shape[0])
    home_modes(plan, now, first_modes)
    wanted = np.zeros((4, 4))
    shared = seeds.poses.shape[0] == 1
    in_blocks = shared and settings.exact == 1 and targets.shape[0] > 1 and is_all_struts(plan)
    width = BLOCK if in_blocks else 1
    table = np.zeros((LENGTHS + plan.branches.shape[0], width))
    columns = np.full(width, -1)
    copy_row(first_modes, modes)
    if targets.shape[0] > 0:
        load_seed(plan, seeds, 0, now, modes)
    pending = 0
    for start in range(0, targets.shape[0], width):
        end = min(start + width, targets.shape[0])
        if in_blocks:
            lay_out_block(plan, targets, start, end, wanted, columns, now, table)
        for i in range(start, end):
            column = columns[i - start]
            if column >= 0 and table[WORST, column] <= 0.0:
                write_column(plan, i, column, now, table, rows)
                continue
            if not load_target(plan, targets[i], wanted):
                rows.status[i] = INVALID
                continue
            if not shared:
                copy_row(first_modes, modes)
                load_seed(plan, seeds, i, now, modes)
            if is_beyond_horizon(targets[i], wanted):
                rows.status[i] = PENDING
                pending += 1
                continue
            pending += solve_one_directly(plan, i, wanted, now, modes, settings, rows)
    return pending


@routine
def lay_out_block(
    plan: Plan,
    targets: Floats,
    start: int,
    end: int,
    wanted: Floats,
    columns: NDArray[np.int64],
    now: Configuration,
    table: Floats,
) -> None:
    """Measure all struts for a block of targets; `columns` says where each target is in the table, -1 for no pose."""
    n = 0
    for i in range(start, end):
        columns[i - start] = -1
        if load_target(plan, targets[i], wanted) and not is_beyond_horizon(targets[i], wanted):
            lay_out_pose(wanted, table, n)
            columns[i - start] = n
            n += 1
    for b in range(plan.branches.shape[0]):
        measure_struts(plan, b, now, table, n)


@inlined
def solve_one_directly(
    plan: Plan, i: int, wanted: Floats, now: Configuration, modes: Floats, settings: Settings, rows: Rows
) -> int:
    """Answer one row by closed forms; 1 where that leaves it pending, else 0."""
    copy_table(wanted, now.pose)
    reached, gap, excess = settings.exact == 1, 0.0, 0.0
    for c in range(plan.chains.shape[0]):
        if reached:
            reached, chain_gap, chain_excess = reach_chain_directly(plan, c, now, modes, settings)
            gap, excess = max(gap, chain_gap), max(excess, chain_excess)
    if not reached:
        rows.status[i] = PENDING
        return 1
    write_row(plan, i, now, rows)
    write_reached(i, gap, excess, rows)
    return 0


@routine
def write_column(plan: Plan, i: int, column: int, now: Configuration, table: Floats, rows: Rows) -> None:
    """Row `i` from a column of the block: struts end on their targets, and no limit is exceeded."""
    for k in range(3):
        for j in range(4):
            rows.poses[i, k, j] = table[4 * k + j, column]
            rows.poses[i, 3, j] = 1.0 if j == 3 else 0.0
    for j in range(plan.trunk_joints.shape[0]):
        rows.trunks[i, j] = now.trunks[j]
    for j in range(rows.actuators.shape[1]):
        rows.actuators[i, j] = read_actuator(plan, j, now, table, column)
    write_reached(i, 0.0, 0.0, rows)


@routine
def write_answer(plan: Plan, i: int, now: Configuration, wanted: Floats, target: Floats, rows: Rows) -> None:
    """The answer of row `i`: the configuration, measured."""
    write_row(plan, i, now, rows)
    rows.measures[i, POSITION_ERROR], rows.measures[i, ROTATION_ERROR] = pose_errors(plan, now.pose, wanted, target)
    rows.measures[i, RESIDUAL], rows.measures[i, LIMIT_EXCESS] = measure_all(plan, now)


@routine
def solve_row(
    plan: Plan,
    i: int,
    targets: Floats,
    wanted: Floats,
    safe: Configuration,
    now: Configuration,
    work: Work,
    settings: Settings,
    rows: Rows,
) -> None:
    """One target by every means: reach it, or project it, or walk back to where it was feasible.

    With no rounds to spend, one that is not reached stays pending.
    """
    copy_table(wanted, now.pose)
    reached, iterations = reach_pose(plan, now, work, settings)
    rounds = 0
    rows.counters[i, HELD] = HOLD_NOTHING
    if reached and settings.exact == 0:
        reached = close_loops(plan, now, work, settings)
    if not reached and settings.max_rounds == 0:
        rows.status[i] = PENDING
        return
    if not reached:
        # the chains are bent toward the target by now; a projection that keeps what is held starts from there
        copy_table(now.nodes, work.seed_nodes)
        copy_row(now.trunks, work.seed_trunks)
        staying = staying_in_mode(settings)
        hold = settings.hold
        for _hold in range(2):
            copy_table(wanted, now.pose)
            copy_table(work.seed_nodes, now.nodes)
            copy_row(work.seed_trunks, now.trunks)
            move_carriers(plan, now)
            reached, more, more_rounds = project_target(plan, hold, now, work, staying)
            iterations += more
            rounds += more_rounds
            rows.counters[i, HELD] = HOLD_NOTHING if plan.scalars[POINT_END] == 1.0 else hold
            if reached or hold == HOLD_NOTHING or plan.scalars[POINT_END] == 1.0:
                break
            hold = HOLD_NOTHING
        if not reached:
            step_back(plan, safe, wanted, now, work, settings)
    rows.counters[i, ITERATIONS] = iterations
    rows.counters[i, ROUNDS] = rounds
    write_answer(plan, i, now, wanted, targets[i], rows)
    rows.status[i] = judge_row(plan, i, settings, rows)


@routine
def staying_in_mode(settings: Settings) -> Settings:
    """The same settings, staying in the working mode."""
    return Settings(
        settings.tolerance,
        settings.rotation_tolerance,
        settings.slack,
        settings.max_iterations,
        settings.max_rounds,
        settings.exact,
        0,
        settings.hold,
        settings.chained,
    )


@routine
def close_loops(plan: Plan, now: Configuration, work: Work, settings: Settings) -> bool:
    """After passes that end within a coarse tolerance: move the platform the little it takes to close all loops."""
    for c in range(plan.chains.shape[0]):
        place_ends(plan, c, now)
    free = TRANSLATES | TURNS
    if settings.hold == HOLD_ORIENTATION or plan.scalars[POINT_END] == 1.0:
        free = TRANSLATES
    return settle(plan, 0, plan.chains.shape[0], free, now, work)


@routine
def judge_row(plan: Plan, i: int, settings: Settings, rows: Rows) -> int:
    """The status a row has earned by its measures."""
    if (
        rows.measures[i, RESIDUAL] > 10.0 * settings.slack
        or rows.measures[i, LIMIT_EXCESS] * plan.scalars[LENGTH] > 10.0 * settings.slack
    ):
        return FAILED
    if (
        rows.measures[i, POSITION_ERROR] <= settings.tolerance
        and rows.measures[i, ROTATION_ERROR] <= settings.rotation_tolerance
    ):
        return REACHED
    return PROJECTED


@kernel
def solve_by_iteration(plan: Plan, targets: Floats, seeds: Seeds, settings: Settings, rows: Rows) -> int:
    """Answer every pending row; with `settings.chained`, all rows in turn, each from the answer before it.

    Returns how many rows it answered.
    """
    now, safe, home = new_configuration(plan), new_configuration(plan), new_configuration(plan)
    work = new_work(plan)
    first_modes = np.ones(plan.branches.shape[0])
    home_modes(plan, home, first_modes)
    identity_pose(home.pose)
    for i in range(3):
        home.pose[i, 3] = plan.scalars[HOME_X + i]
    wanted = np.zeros((4, 4))
    answered = 0
    for i in range(targets.shape[0]):
        if settings.chained == 0 and rows.status[i] != PENDING:
            continue
        if not load_target(plan, targets[i], wanted):
            rows.status[i] = INVALID
            continue
        if settings.chained == 0 or answered == 0:
            copy_row(first_modes, work.modes)
            load_seed(plan, seeds, i, now, work.modes)
        elif rows.status[i - 1] == REACHED:
            read_modes(plan, now, work.modes)
        gap, excess = measure_all(plan, now)
        feasible = gap <= settings.slack and excess * plan.scalars[LENGTH] <= settings.slack
        copy_configuration(plan, now if feasible else home, safe)
        solve_row(plan, i, targets, wanted, safe, now, work, settings, rows)
        answered += 1
    return answered
