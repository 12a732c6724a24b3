"""The kernel of the paper's method: rows answered by passes, projected where they do not reach, then closed exactly."""

from __future__ import annotations

import numpy as np

from .._jit import routine, search
from ..vectors import copy_row, copy_table
from .frames import identity_pose, move_carriers, place_ends
from .measure import measure_all, pose_errors
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
from .project import copy_configuration, project_target, reach_pose, step_back
from .rows import (
    home_modes,
    load_seed,
    load_target,
    new_configuration,
    new_work,
    write_row,
)
from .settle import TRANSLATES, TURNS, settle


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
    """One target: reach it, or project it, or walk back to where it was feasible."""
    copy_table(wanted, now.pose)
    gap, iterations = reach_pose(plan, now, work, settings)
    reached, rounds = gap <= settings.enough, 0
    rows.counters[i, HELD] = HOLD_NOTHING
    if reached:
        reached = close_loops(plan, now, work, settings)
    if not reached:
        # the chains are bent toward the target by now; a projection that keeps what is held starts from there
        copy_table(now.nodes, work.seed_nodes)
        copy_row(now.trunks, work.seed_trunks)
        hold = settings.hold
        for _hold in range(2):
            copy_table(wanted, now.pose)
            copy_table(work.seed_nodes, now.nodes)
            copy_row(work.seed_trunks, now.trunks)
            move_carriers(plan, now)
            reached, more, more_rounds = project_target(plan, hold, now, work, settings)
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


@search
def solve_by_iteration(plan: Plan, targets: Floats, seeds: Seeds, settings: Settings, rows: Rows) -> int:
    """Answer every pending row; returns how many it answered."""
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
        if rows.status[i] != PENDING:
            continue
        if not load_target(plan, targets[i], wanted):
            rows.status[i] = INVALID
            continue
        copy_row(first_modes, work.modes)
        load_seed(plan, seeds, i, now, work.modes)
        gap, excess = measure_all(plan, now)
        feasible = gap <= settings.slack and excess * plan.scalars[LENGTH] <= settings.slack
        copy_configuration(plan, now if feasible else home, safe)
        solve_row(plan, i, targets, wanted, safe, now, work, settings, rows)
        answered += 1
    return answered
