"""The nearest feasible configuration of legs in closed form: a descent on the platform's pose and its rods' carriers.

As on joint coordinates (`closure.descend`), in a quarter of the unknowns: its motions are those that the legs'
equations leave free, found anew at each configuration, and each step is brought back onto them before it is judged.
"""

from __future__ import annotations

import math

from ...arrays import Floats, Ints, Record, Records
from .._jit import routine
from ..free_motions import FreeMotions, put_step, restoring_step
from ..legs.records import REDUNDANT, Table
from ..sqp import (
    CLOSED,
    CORRECTIONS,
    LONGEST_STEP,
    MUCH,
    NEARLY_CLOSED,
    RESTORING,
    allowed_violation,
    begin_descent,
    is_closed,
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
from .lagrangian import lagrangian_hessian
from .linearise import linearise
from .records import PlatformObjective
from .search import NEAR, NEARBY, STEPS_AWAY, Search, copy_platform_state, count_platform, move

HOPELESS = 8.0
"""A search that is farther than the nearest yet by so many times what its last step promised is given up, unless the
step was short for damping."""

THERE = 1e-12
"""Distance at which a search has arrived, and which counts as none [L]."""

OF_PROXIMAL, ALONE = 0.6, 0.5
"""What the steps of carriers count beside those of the platform: they end where rods have their lengths. And those of
the platform where it alone has unknowns: the squares of rods' lengths are then quadratic in its position."""

STUCK = 0.2
"""Share of a gap that a step which closes it leaves at most: at a double root Newton's method leaves a quarter."""

SHORT = 1e-6
"""Share of the objective that a step promised after which curvature is not felt for again: it has changed by about a
thousandth."""

NEAR_INCUMBENT = 0.01
"""A search that comes so near to the nearest configuration met yet [rad or L] would end there."""

MISSES = 4
"""Steps that left loops open and did not lead down after which equations are solved for the platform too: next to a
dead point a carrier tells where the platform is so steeply that the model is good for far less than is left to go."""


@routine
def take(table: Table, reduced: FreeMotions, x: Floats, state: PlatformState, search: Search) -> float:
    """Take a step of the free motions, and with it one that meets the equations; the share of it not too long."""
    step = search.step
    n = step.shape[0]
    put_step(x, reduced, search.step)
    most = 0.0
    for j in range(n):
        most = max(most, abs(step[j]) * (ALONE if n == 6 else 1.0 if j < 6 else OF_PROXIMAL))
    share = LONGEST_STEP / max(most, LONGEST_STEP)
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
    search: Search,
    reduced: FreeMotions,
    steps: int,
) -> bool:
    """Bring a configuration, at which `reduced` is, onto its equations and within its limits, by the shortest way.

    Both to a tolerance; where rounding keeps it from that, to what counts as closed. Equations are met by all unknowns
    where arms have a say in them, or pivots alone do not close them: a rod that does not reach needs the platform.
    """
    before = math.inf
    for _step in range(steps):
        if is_closed(reduced.linear, tolerance):
            return True
        gap = reduced.linear.totals[0]["gap"]
        if not restoring_step(reduced, table.task[0]["redundant"] > 0 or gap > STUCK * before, search.p):
            return False
        before = gap
        take(table, reduced, search.p.x, state, search)
        linearise(table, row, objective, state, search, reduced)
    return is_closed(reduced.linear, max(tolerance, NEARLY_CLOSED))


@routine
def is_near(legs: Records, state: PlatformState, incumbent: PlatformState, holding: Ints) -> bool:
    """Whether a configuration is so near to another that a descent would end there.

    Parameters
    ----------
    holding : (legs,): 1 for those that hold the other where it is; arms of others may be anywhere.
    """
    pose, other, q = state.pose, incumbent.pose, state.q
    for i in range(3):
        for j in range(4):
            if abs(pose[i, j] - other[i, j]) > NEAR_INCUMBENT:
                return False
    for k in range(q.shape[0]):
        if (holding[k] == 1 or legs[k]["kind"] != REDUNDANT) and abs(wrap(q[k] - incumbent.q[k], 0.0)) > NEAR_INCUMBENT:
            return False
    return True


@routine
def has_same_curvature(reduced: FreeMotions, before: FreeMotions, control: Record) -> bool:
    """Whether the last step was so short, and told so well what it would gain, that curvature is what it was before.

    It is told in the same free motions only where equations have the same pivots.
    """
    totals, others = reduced.linear.totals[0], before.linear.totals[0]
    is_short = control["predicted"] <= SHORT * totals["value"]
    if not is_short or control["is_exact"] == 0 or totals["rank"] != others["rank"]:
        return False
    for r in range(totals["rank"]):
        if reduced.pivots[r] != before.pivots[r]:
            return False
    return True


@routine
def is_hopeless(behind: float, share: float, control: Record) -> bool:
    """Whether a search that is so far behind the nearest yet, in the objective, will not come as near; `share` of the
    last step was taken."""
    is_damped = control["damping"] > MUCH * control["largest"]
    return bool(not is_damped and HOPELESS * control["predicted"] < share * behind)


@routine
def descend(
    table: Table, row: int, objective: PlatformObjective, best_distance: float, incumbent: PlatformState, search: Search
) -> float:
    """From `best`, brought onto its equations, down to the nearest; the distance there, infinite if not feasible.

    And infinite where what steps promise says that it will not come as near as `best_distance`; where it comes by the
    configuration that is so near, that is where it ends. Where steps that leave something open are lost, it goes on
    from the last configuration that was closed, and closes each.
    """
    reduced, unit = search.first, search.gradient.unit
    search.near[0] = NEAR
    unit[0], search.control[0]["steps"], search.control[0]["is_restoring"] = 1.0, 0, 0
    linearise(table, row, objective, search.best, search, reduced)
    if not restore_feasibility(table, row, objective, search.best, CLOSED, search, reduced, RESTORING):
        return math.inf
    unit[0] = scale_objective(reduced.linear)
    for j in range(search.force.shape[0]):
        search.force[j] *= unit[0]
    if reduced.linear.totals[0]["value"] == 0.0:
        return 0.0
    copy_platform_state(search.best, search.closed)
    for closing in range(2):
        search.control[0]["is_restoring"] = closing
        if closing == 1:
            copy_platform_state(search.closed, search.best)
            linearise(table, row, objective, search.best, search, reduced)
        distance = take_steps(table, row, objective, best_distance, incumbent, closing, search)
        count_platform(2, search)
        if distance >= 0.0:
            return distance
    return math.inf


@routine
def take_steps(
    table: Table,
    row: int,
    objective: PlatformObjective,
    best_distance: float,
    incumbent: PlatformState,
    closing: int,
    search: Search,
) -> float:
    """Steps from `best`, at which `search.first` is, as of `descend`; negative if what they left open does not close.

    Parameters
    ----------
    closing : 1 to close each step before it is judged.
    """
    reduced, other, hessian, control = search.first, search.second, search.hessian, search.control[0]
    unit = search.gradient.unit
    begin_descent(reduced.linear, hessian, control)
    missed = 0
    while control["is_done"] == 0:
        if not has_same_curvature(reduced, other, control):
            control["largest"] = lagrangian_hessian(table, row, objective, search, reduced)
        is_accepted = False
        while not is_accepted and control["is_done"] == 0:
            if plan_step(reduced.linear, hessian, control, objective.pose.max_iterations, search.p):
                copy_platform_state(search.best, search.trial)
                share = take(table, reduced, search.p.x, search.trial, search)
                search.near[0] = min(NEAR, max(NEARBY, STEPS_AWAY * share * longest(search.step, search.step.shape[0])))
                linearise(table, row, objective, search.trial, search, other)
                closes = True
                if closing == 1:
                    closes = restore_feasibility(table, row, objective, search.trial, CLOSED, search, other, RESTORING)
                elif needs_correction(reduced.linear, other.linear, share, control):
                    tolerance = allowed_violation(control, share)
                    closes = restore_feasibility(
                        table, row, objective, search.trial, tolerance, search, other, CORRECTIONS
                    )
                    closes = closes or other.linear.totals[0]["gap"] <= max(CLOSED, violation(reduced.linear))
                is_accepted = judge_step(reduced.linear, other.linear, closes, share, control)
                if not is_accepted and not is_closed(other.linear, CLOSED):
                    missed += 1
                    if missed == MISSES:
                        count_platform(1, search)
                if is_accepted:
                    copy_platform_state(search.trial, search.best)
                    reduced, other = other, reduced
                    if best_distance < math.inf and is_near(table.legs, search.best, incumbent, search.holding):
                        return best_distance
                    behind = reduced.linear.totals[0]["value"] - 0.5 * unit[0] * best_distance * best_distance
                    if is_hopeless(behind, share, control):
                        return math.inf
                    if is_closed(reduced.linear, CLOSED):
                        copy_platform_state(search.best, search.closed)
                        if reduced.linear.totals[0]["value"] <= 0.5 * unit[0] * THERE * THERE:
                            control["is_done"] = 1
            if is_stuck_infeasible(reduced.linear, is_accepted, objective.pose.max_iterations, control):
                if not restore_feasibility(table, row, objective, search.best, CLOSED, search, reduced, RESTORING):
                    return -1.0
                resume(control)
                is_accepted = True
    if not restore_feasibility(table, row, objective, search.best, CLOSED, search, reduced, RESTORING):
        return -1.0
    distance = math.sqrt(2.0 * reduced.linear.totals[0]["value"] / unit[0])
    return distance if distance > THERE else 0.0
