"""The nearest feasible configuration of legs in closed form: SQP in the platform's pose and the proximal coordinates.

It is the method of `joints.descend`, with a quarter of the unknowns: steps are taken in the motions that the legs'
equations leave free at each configuration, and are brought back onto the equations before they are judged.
"""

from __future__ import annotations

import math

from ...common.arrays import Floats, Ints, Record, Records
from .._jit import routine
from ..free_motions import FreeMotions, put_step, restoring_step
from ..joints.linearise_loops import begin_pricing
from ..legs.records import Table
from ..projecting import is_over
from ..search_constants import CLOSED, CORRECTIONS, LONGEST_STEP, NEARLY_CLOSED, RESTORING
from ..sqp import (
    allowed_violation,
    begin_descent,
    is_closed,
    is_hopeless,
    is_stuck_infeasible,
    judge_step,
    longest,
    needs_correction,
    plan_step,
    resume,
    scale_objective,
    violation,
)
from ..vectors import wrap
from .equations import PlatformState, close_rods
from .linearise import lagrangian_hessian, linearise
from .pose_constants import (
    ARRIVED,
    MISSES,
    NEAR,
    NEAR_INCUMBENT,
    NEARBY,
    PLATFORM_SCALE,
    PROXIMAL_SCALE,
    SHORT,
    STEPS_AWAY,
    STUCK,
)
from .search import SearchScratch, copy_platform_state, move, set_platform_users
from .search_records import PlatformObjective


@routine
def take_step(table: Table, reduced: FreeMotions, x: Floats, state: PlatformState, search: SearchScratch) -> float:
    """Take a step of the free motions plus the step that meets the equations, not too long; the share taken."""
    step = search.step
    n = step.shape[0]
    put_step(x, reduced, search.step)
    largest = 0.0
    for j in range(n):
        largest = max(largest, abs(step[j]) * (PLATFORM_SCALE if n == 6 else 1.0 if j < 6 else PROXIMAL_SCALE))
    share = LONGEST_STEP / max(largest, LONGEST_STEP)
    move(table, search.step, share, state)
    close_rods(table, state, search.leg_eval)
    return share


@routine
def restore_feasibility(
    table: Table,
    row: int,
    objective: PlatformObjective,
    state: PlatformState,
    tolerance: float,
    search: SearchScratch,
    reduced: FreeMotions,
    steps: int,
) -> bool:
    """Restoration: bring a configuration, linearised in `reduced`, onto its equations and within its limits.

    True if both hold to the tolerance, or to NEARLY_CLOSED when the steps are spent. All unknowns take part if
    redundant joints enter the equations, or if the pivot unknowns alone do not close them: a rod that does not reach
    needs the platform.
    """
    before = math.inf
    for _step in range(steps):
        if is_closed(reduced.linear, tolerance):
            return True
        gap = reduced.linear.totals[0]["gap"]
        by_all = table.task[0]["redundant"] > 0 or gap > STUCK * before
        if is_over(search.effort[0]) or not restoring_step(reduced, by_all, search.p):
            return False
        before = gap
        take_step(table, reduced, search.p.x, state, search)
        linearise(table, row, objective, state, search, reduced)
    return is_closed(reduced.linear, max(tolerance, NEARLY_CLOSED))


@routine
def is_near(legs: Records, state: PlatformState, incumbent: PlatformState, blocking: Ints) -> bool:
    """True if a configuration is so near to the incumbent that a descent would end there.

    Parameters
    ----------
    blocking : (legs,): 1 for legs that block the incumbent; redundant joints of the others may be anywhere.
    """
    pose, other, q = state.pose, incumbent.pose, state.q
    for i in range(3):
        for j in range(4):
            if abs(pose[i, j] - other[i, j]) > NEAR_INCUMBENT:
                return False
    for k in range(q.shape[0]):
        is_free = blocking[k] == 0 and legs[k]["makes"] > 0
        if not is_free and abs(wrap(q[k] - incumbent.q[k], 0.0)) > NEAR_INCUMBENT:
            return False
    return True


@routine
def has_same_curvature(reduced: FreeMotions, before: FreeMotions, control: Record) -> bool:
    """True if the last step was so short, and its prediction so good, that the Hessian can be reused.

    The free motions must be the same: the equations have the same pivots.
    """
    totals, totals_before = reduced.linear.totals[0], before.linear.totals[0]
    is_short = control["predicted"] <= SHORT * totals["value"]
    if not is_short or control["is_exact"] == 0 or totals["rank"] != totals_before["rank"]:
        return False
    for r in range(totals["rank"]):
        if reduced.pivots[r] != before.pivots[r]:
            return False
    return True


@routine
def descend(
    table: Table,
    row: int,
    objective: PlatformObjective,
    best_distance: float,
    incumbent: PlatformState,
    search: SearchScratch,
) -> float:
    """Restore feasibility at `best`, then descend to the nearest configuration; the distance there.

    Infinite if no feasible configuration is found, or if the search will not come as near as `best_distance`;
    `best_distance` itself if it comes by the incumbent; that of the last feasible configuration if the effort is over.
    If infeasible steps cannot be restored, the search goes on from the last feasible configuration and restores after
    every step.
    """
    reduced, unit = search.first, search.gradient.unit
    search.near[0] = NEAR
    begin_pricing(search.gradient)
    unit[0], search.control[0]["steps"], search.control[0]["is_restoring"] = 1.0, 0, 0
    if is_over(search.effort[0]):
        return math.inf
    linearise(table, row, objective, search.best, search, reduced)
    if not restore_feasibility(table, row, objective, search.best, CLOSED, search, reduced, RESTORING):
        return math.inf
    unit[0] = scale_objective(reduced.linear)
    for j in range(search.objective_gradient.shape[0]):
        search.objective_gradient[j] *= unit[0]
    if reduced.linear.totals[0]["value"] == 0.0:
        return 0.0
    keep_closed(reduced, search)
    for closing in range(2):
        search.control[0]["is_restoring"] = closing
        if closing == 1:
            copy_platform_state(search.closed, search.best)
            linearise(table, row, objective, search.best, search, reduced)
        distance = take_steps(table, row, objective, best_distance, incumbent, closing, search)
        set_platform_users(2, search)
        if distance >= 0.0:
            return distance
        if is_over(search.effort[0]):
            copy_platform_state(search.closed, search.best)
            return math.sqrt(2.0 * search.control[0]["closed"] / unit[0])
    return math.inf


@routine
def keep_closed(reduced: FreeMotions, search: SearchScratch) -> None:
    """Keep a feasible configuration, linearised in `reduced`, as the last one."""
    copy_platform_state(search.best, search.closed)
    search.control[0]["closed"] = reduced.linear.totals[0]["value"]


@routine
def take_steps(
    table: Table,
    row: int,
    objective: PlatformObjective,
    best_distance: float,
    incumbent: PlatformState,
    closing: int,
    search: SearchScratch,
) -> float:
    """Take the steps of `descend` from `best`, linearised in `search.first`; the distance, negative if not restored.

    Parameters
    ----------
    closing : 1 to restore feasibility after each step, before it is judged.
    """
    reduced, other, hessian, control = search.first, search.second, search.hessian, search.control[0]
    unit = search.gradient.unit
    begin_descent(reduced.linear, hessian, control)
    n_missed = 0
    while control["is_done"] == 0:
        if is_over(search.effort[0]):
            return -1.0
        if not has_same_curvature(reduced, other, control):
            control["largest"] = lagrangian_hessian(table, row, objective, search, reduced)
        is_accepted = False
        while not is_accepted and control["is_done"] == 0:
            if is_over(search.effort[0]):
                return -1.0
            if plan_step(reduced.linear, hessian, control, objective.pose.max_iterations, search.p):
                copy_platform_state(search.best, search.trial)
                share = take_step(table, reduced, search.p.x, search.trial, search)
                search.near[0] = min(NEAR, max(NEARBY, STEPS_AWAY * share * longest(search.step, search.step.shape[0])))
                linearise(table, row, objective, search.trial, search, other)
                is_feasible = True
                if closing == 1:
                    is_feasible = restore_feasibility(
                        table, row, objective, search.trial, CLOSED, search, other, RESTORING
                    )
                elif needs_correction(reduced.linear, other.linear, share, control):
                    tolerance = allowed_violation(control, share)
                    is_feasible = restore_feasibility(
                        table, row, objective, search.trial, tolerance, search, other, CORRECTIONS
                    )
                    is_feasible = is_feasible or other.linear.totals[0]["gap"] <= max(CLOSED, violation(reduced.linear))
                is_accepted = judge_step(reduced.linear, other.linear, is_feasible, share, control)
                if not is_accepted and not is_closed(other.linear, CLOSED):
                    n_missed += 1
                    if n_missed == MISSES:
                        set_platform_users(1, search)
                if is_accepted:
                    copy_platform_state(search.trial, search.best)
                    reduced, other = other, reduced
                    if best_distance < math.inf and is_near(table.legs, search.best, incumbent, search.blocking):
                        return best_distance
                    deficit = reduced.linear.totals[0]["value"] - 0.5 * unit[0] * best_distance * best_distance
                    if is_hopeless(deficit, share, control):
                        return math.inf
                    if is_closed(reduced.linear, CLOSED):
                        keep_closed(reduced, search)
                        if reduced.linear.totals[0]["value"] <= 0.5 * unit[0] * ARRIVED * ARRIVED:
                            control["is_done"] = 1
            if is_stuck_infeasible(reduced.linear, is_accepted, objective.pose.max_iterations, control):
                if not restore_feasibility(table, row, objective, search.best, CLOSED, search, reduced, RESTORING):
                    return -1.0
                resume(control)
                is_accepted = True
    if not restore_feasibility(table, row, objective, search.best, CLOSED, search, reduced, RESTORING):
        return -1.0
    distance = math.sqrt(2.0 * reduced.linear.totals[0]["value"] / unit[0])
    return distance if distance > ARRIVED else 0.0
