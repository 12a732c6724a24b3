"""The nearest feasible configuration: a descent on joint coordinates along closed loops, within every limit.

Its unknowns are the motions that the loops leave free, found anew at each configuration; each step is brought back
onto the loops before it is judged, so that every configuration on the way is feasible.
"""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Floats
from .._jit import routine, search
from ..free_motions import FreeMotions, new_free_motions, project, put_multipliers, put_step, restoring_step
from ..holding import balance
from ..qp import QP, new_qp
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
    new_workspace,
    walk_all,
)
from .loops import BALL, Closed, Layout, Loops, Objective
from .path_kinematics import State, copy_state, load_row, new_state, store_row
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
def lagrangian_hessian(
    loops: Loops, row: int, objective: Objective, state: State, trial: State, work: Workspace, view: FreeMotions
) -> float:
    """Curvature of the objective and of the active limits along the loops, into `hessian`; the largest on its diagonal.

    By differences of the gradient of the Lagrangian, whose multipliers of the loops balance it at pivot coordinates.
    """
    n, linear, H = len(loops.lo), view.linear, work.hessian.H
    motions = linear.totals[0]["motions"]
    basis, here, there, along = view.basis, work.here, work.there, work.row
    for i in range(work.balance.shape[0]):
        work.balance[i] = 0.0
    lagrangian_gradient(loops, row, objective, state, work, work.here)
    work.control[0]["holding"] = put_multipliers(work.here, view, work.balance)
    lagrangian_gradient(loops, row, objective, state, work, work.here)
    for a in range(motions):
        probe = PROBE / math.sqrt(linear.metric[a, a])
        for j in range(n):
            along[j] = basis[j, a]
        copy_state(state, trial)
        move(loops, work.row, probe, trial)
        lagrangian_gradient(loops, row, objective, trial, work, work.there)
        for j in range(n):
            there[j] = (there[j] - here[j]) / probe
        project(there, view, H[a])
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
def take(loops: Loops, view: FreeMotions, x: Floats, state: State, work: Workspace) -> float:
    """Take a step of the free motions, and with it one that closes the loops; the share of it that is not too long."""
    put_step(x, view, work.row)
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
    view: FreeMotions,
    p: QP,
) -> bool:
    """Bring a configuration, at which `view` is, onto its loops and within its limits, by the shortest way.

    Both to a tolerance; where rounding keeps it from that, to what counts as closed.
    """
    for _step in range(RESTORING):
        if is_closed(view.linear, tolerance):
            return True
        if not restoring_step(view, False, p):  # by all, steps leap over wrists' singularities
            return False
        take(loops, view, p.x, state, work)
        linearise(loops, row, objective, state, work, view)
    return is_closed(view.linear, max(tolerance, NEARLY_CLOSED))


@routine
def descend(
    loops: Loops,
    row: int,
    objective: Objective,
    best: State,
    trial: State,
    work: Workspace,
    first: FreeMotions,
    second: FreeMotions,
    p: QP,
) -> int:
    """From a feasible configuration, at which `first` is, down to the nearest; how many steps it took."""
    view, other, hessian, control, most = first, second, work.hessian, work.control[0], objective.pose.max_iterations
    work.gradient.unit[0] = scale_objective(view.linear)
    begin_descent(view.linear, hessian, control)
    while control["done"] == 0:
        control["largest"] = lagrangian_hessian(loops, row, objective, best, trial, work, view)
        led_down = False
        while not led_down and control["done"] == 0:
            if plan_step(view.linear, hessian, control, most, p):
                copy_state(best, trial)
                share = take(loops, view, p.x, trial, work)
                linearise(loops, row, objective, trial, work, other)
                tolerance = on_the_way(control, share)
                feasible = restore_feasibility(loops, row, objective, trial, tolerance, work, other, p)
                led_down = judge_step(view.linear, other.linear, feasible, share, control)
                if led_down:
                    copy_state(trial, best)
                    view, other = other, view
            if rests_open(view.linear, led_down, most, control):
                if restore_feasibility(loops, row, objective, best, CLOSED, work, view, p):
                    go_on(control)
                led_down = True
    restore_feasibility(loops, row, objective, best, CLOSED, work, view, p)
    return int(control["steps"])


@search
def approach(loops: Loops, layout: Layout, objective: Objective, closed: Closed, weights: Floats) -> None:
    """Bring every row, from a configuration that is closed within its limits or nearly so, as near as it comes.

    With no steps to take, tell instead how hard every limit holds each row back where it is, (n, 2 columns + cones):
    the multiplier of the limit, by how much nearer the target comes per unit by which it gives way; else 0.
    """
    rows = 6 * len(loops.paths)  # of all paths but the first, and six that may be held
    best, trial, n = new_state(loops), new_state(loops), len(loops.lo)
    first, second, work = (
        new_free_motions(n, rows, 2 * n + len(loops.cone_angles)),
        new_free_motions(n, rows, 2 * n + len(loops.cone_angles)),
        new_workspace(loops, layout, rows),
    )
    k = len(first.linear.h)
    p, pulls = new_qp(k, k), np.zeros((k, len(loops.lo)))
    for row in range(len(closed.coordinates)):
        load_row(loops, row, closed, best)
        closed.iterations[row] = 0
        work.gradient.unit[0] = 1.0
        if objective.pose.max_iterations == 0:
            linearise(loops, row, objective, best, work, first)
            scale_objective(first.linear)
            for c in range(balance(first.linear, objective.pose.near, p, pulls)):
                weights[row, first.linear.which[c]] = p.x[c]
            continue
        linearise(loops, row, objective, best, work, first)
        if restore_feasibility(loops, row, objective, best, CLOSED, work, first, p):
            closed.iterations[row] = descend(loops, row, objective, best, trial, work, first, second, p)
        linearise(loops, row, objective, best, work, first)
        store_row(loops, row, best, closed)
        for group in range(closed.gaps.shape[1]):  # the loops are looked at as a whole
            closed.gaps[row, group] = first.linear.totals[0]["gap"]
            closed.excesses[row, group] = max(first.linear.totals[0]["excess"] - objective.pose.margin, 0.0)
            closed.misses[row, group] = 0.0
