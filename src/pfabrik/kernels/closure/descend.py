"""The nearest feasible configuration: a descent on joint coordinates along closed loops, within every limit.

Its unknowns are the motions that the loops leave free, found anew at each configuration; each step is brought back
onto the loops before it is judged, so that every configuration on the way is feasible.
"""

from __future__ import annotations

import math

from ...arrays import Floats
from .._jit import routine, search
from ..free_motions import FreeMotions, project, put_multipliers, put_step, restoring_step
from ..holding import balance
from ..rotations import turn_ball
from ..sqp import (
    CLOSED,
    LONGEST_STEP,
    NEARLY_CLOSED,
    PROBE,
    RESTORING,
    begin_descent,
    go_on,
    is_closed,
    judge_step,
    longest,
    on_the_way,
    plan_step,
    rests_open,
    scale_objective,
    symmetrise,
)
from .linearise import (
    Workspace,
    add_anchors,
    add_cone,
    add_force,
    cone_excess,
    linearise,
    open_workspace,
    walk_all,
)
from .loops import BALL, Closed, Loops, Objective
from .path_kinematics import State, copy_state, load_row, open_loops, store_row
from .pose_objective import pose_gradient


@routine
def lagrangian_gradient(
    loops: Loops, row: int, objective: Objective, state: State, work: Workspace, out: Floats
) -> None:
    """Gradient of the Lagrangian at a configuration, by multipliers of limits and the `balance` of the loops."""
    n, paths, multipliers = len(loops.lo), len(loops.paths) - 1, work.hessian.multipliers
    walk_all(loops, state, work)
    _, held = pose_gradient(objective.pose, objective.pose.targets[row], state.X, work.gradient, True)
    for j in range(n):
        out[j] = multipliers[2 * j + 1] - multipliers[2 * j]
    add_anchors(row, objective, state, work.gradient.unit[0], out)
    for i in range(6):
        work.force[0, i] = work.gradient.force[i]
        for path in range(1, paths):
            work.force[path, i] = work.balance[6 * (path - 1) + i]
            work.force[0, i] -= work.force[path, i]
        for k in range(held):
            work.force[0, i] += work.balance[6 * (paths - 1) + k] * work.gradient.holds[k, i]
    for path in range(paths):
        add_force(loops, path, work.force[path], work, out)
    for cone in range(len(loops.cone_angles)):
        if multipliers[2 * n + cone] != 0.0:
            cone_excess(loops, cone, objective.pose.margin, state, work)
            add_cone(loops, cone, multipliers[2 * n + cone], work, out)


@routine
def lagrangian_hessian(loops: Loops, row: int, objective: Objective, work: Workspace, reduced: FreeMotions) -> float:
    """Curvature of the objective and of the active limits along the loops, at `work.best`; the largest on the diagonal.

    By differences of the gradient of the Lagrangian, whose multipliers of the loops balance it at pivot coordinates.
    """
    n, linear, H, trial = len(loops.lo), reduced.linear, work.hessian.H, work.trial
    motions = linear.totals[0]["motions"]
    basis, here, there, along = reduced.basis, work.here, work.there, work.row
    for i in range(work.balance.shape[0]):
        work.balance[i] = 0.0
    lagrangian_gradient(loops, row, objective, work.best, work, work.here)
    work.control[0]["holding"] = put_multipliers(work.here, reduced, work.balance)
    lagrangian_gradient(loops, row, objective, work.best, work, work.here)
    for a in range(motions):
        probe = PROBE / math.sqrt(linear.metric[a, a])
        for j in range(n):
            along[j] = basis[j, a]
        copy_state(work.best, trial)
        move(loops, work.row, probe, trial)
        lagrangian_gradient(loops, row, objective, trial, work, work.there)
        for j in range(n):
            there[j] = (there[j] - here[j]) / probe
        project(there, reduced, H[a])
    return symmetrise(H, motions)


@routine
def move(loops: Loops, step: Floats, share: float, state: State) -> None:
    """Take a share of a step."""
    for k in range(len(loops.kinds)):
        j = loops.columns[k]
        if loops.kinds[k] == BALL:
            turn_ball(state.balls[k], share * step[j], share * step[j + 1], share * step[j + 2])
        else:
            state.q[j] += share * step[j]


@routine
def take(loops: Loops, reduced: FreeMotions, x: Floats, state: State, work: Workspace) -> float:
    """Take a step of the free motions, and with it one that closes the loops; the share of it that is not too long."""
    put_step(x, reduced, work.row)
    share = LONGEST_STEP / max(longest(work.row, len(loops.lo)), LONGEST_STEP)
    move(loops, work.row, share, state)
    return share


@routine
def restore_feasibility(
    loops: Loops,
    row: int,
    objective: Objective,
    state: State,
    tolerance: float,
    work: Workspace,
    reduced: FreeMotions,
) -> bool:
    """Bring a configuration, at which `reduced` is, onto its loops and within its limits, by the shortest way.

    Both to a tolerance; where rounding keeps it from that, to what counts as closed.
    """
    for _step in range(RESTORING):
        if is_closed(reduced.linear, tolerance):
            return True
        if not restoring_step(reduced, False, work.p):  # by all, steps leap over wrists' singularities
            return False
        take(loops, reduced, work.p.x, state, work)
        linearise(loops, row, objective, state, work, reduced)
    return is_closed(reduced.linear, max(tolerance, NEARLY_CLOSED))


@routine
def descend(loops: Loops, row: int, objective: Objective, work: Workspace) -> int:
    """From a feasible `work.best`, at which `work.first` is, down to the nearest; how many steps it took."""
    reduced, other, best, trial, p = work.first, work.second, work.best, work.trial, work.p
    hessian, control, most = work.hessian, work.control[0], objective.pose.max_iterations
    work.gradient.unit[0] = scale_objective(reduced.linear)
    begin_descent(reduced.linear, hessian, control)
    while control["done"] == 0:
        control["largest"] = lagrangian_hessian(loops, row, objective, work, reduced)
        led_down = False
        while not led_down and control["done"] == 0:
            if plan_step(reduced.linear, hessian, control, most, p):
                copy_state(best, trial)
                share = take(loops, reduced, p.x, trial, work)
                linearise(loops, row, objective, trial, work, other)
                tolerance = on_the_way(control, share)
                feasible = restore_feasibility(loops, row, objective, trial, tolerance, work, other)
                led_down = judge_step(reduced.linear, other.linear, feasible, share, control)
                if led_down:
                    copy_state(trial, best)
                    reduced, other = other, reduced
            if rests_open(reduced.linear, led_down, most, control):
                if restore_feasibility(loops, row, objective, best, CLOSED, work, reduced):
                    go_on(control)
                led_down = True
    restore_feasibility(loops, row, objective, best, CLOSED, work, reduced)
    return int(control["steps"])


@search
def approach(machine: int, scratch: int, objective: Objective, closed: Closed, weights: Floats) -> None:
    """Bring every row, from a configuration that is closed within its limits or nearly so, as near as it comes.

    With no steps to take, tell instead how hard every limit holds each row back where it is, (n, 2 columns + cones):
    the multiplier of the limit, by how much nearer the target comes per unit by which it gives way; else 0.

    Parameters
    ----------
    machine, scratch : see `open_loops` and `new_workspace`.
    """
    loops, work = open_loops(machine), open_workspace(scratch)
    best, first = work.best, work.first
    for row in range(len(closed.coordinates)):
        load_row(loops, row, closed, best)
        closed.iterations[row] = 0
        work.gradient.unit[0] = 1.0
        linearise(loops, row, objective, best, work, first)
        if objective.pose.max_iterations == 0:
            scale_objective(first.linear)
            for c in range(balance(first.linear, objective.pose.near, work.p, work.pulls)):
                weights[row, first.linear.which[c]] = work.p.x[c]
            continue
        if restore_feasibility(loops, row, objective, best, CLOSED, work, first):
            closed.iterations[row] = descend(loops, row, objective, work)
        linearise(loops, row, objective, best, work, first)
        store_row(loops, row, best, closed)
        for group in range(closed.gaps.shape[1]):  # the loops are looked at as a whole
            closed.gaps[row, group] = first.linear.totals[0]["gap"]
            closed.excesses[row, group] = max(first.linear.totals[0]["excess"] - objective.pose.margin, 0.0)
            closed.misses[row, group] = 0.0
