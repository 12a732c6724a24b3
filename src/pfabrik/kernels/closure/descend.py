"""The nearest feasible configuration: a descent on joint coordinates along closed loops, within every limit.

Its unknowns are the motions that the loops leave free, found anew at each configuration; each step is brought back
onto the loops before it is judged, so that every configuration on the way is feasible.
"""

from __future__ import annotations

import math

import numpy as np

from .._jit import kernel, routine
from ..qp import Programme, apply_inverse, factorise, new_programme, solve_programme
from ..rotations import turn_ball
from ..sqp import (
    CLOSED,
    DONE,
    EXCESS,
    GAP,
    LARGEST,
    LIMITS,
    LONGEST_STEP,
    MOTIONS,
    NEARLY_CLOSED,
    PROBE,
    RANK,
    RESTORING,
    STEPS,
    VALUE,
    Slope,
    begin_descent,
    is_closed,
    judge_step,
    longest,
    plan_step,
    way_back,
)
from .linearise import Desk, View, add_cone, add_force, cone_excess, look, new_desk, new_view, walk_all
from .loops import BALL, Closed, Floats, Layout, Loops
from .path_kinematics import State, copy_state, load_row, new_state, store_row
from .pose_objective import Aim, look_at_aim

SHARING = 1e-10
"""Weight of the sum of their squares against the balance of multipliers: far below what a limit's gradient counts."""


@routine
def pull(loops: Loops, row: int, want: Aim, state: State, desk: Desk, out: Floats) -> None:
    """Gradient of the Lagrangian at a configuration, by multipliers of limits and the `balance` of the loops."""
    n, paths, multipliers = len(loops.lo), len(loops.paths) - 1, desk.curve.multipliers
    walk_all(loops, state, desk)
    _, held = look_at_aim(want, want.targets[row], state.X, desk.aim)
    for j in range(n):
        out[j] = multipliers[2 * j + 1] - multipliers[2 * j]
    for i in range(6):
        desk.force[0, i] = desk.aim.force[i]
        for path in range(1, paths):
            desk.force[path, i] = desk.balance[6 * (path - 1) + i]
            desk.force[0, i] -= desk.force[path, i]
        for k in range(held):
            desk.force[0, i] += desk.balance[6 * (paths - 1) + k] * desk.aim.holds[k, i]
    for path in range(paths):
        add_force(loops, path, desk.force[path], desk, out)
    for cone in range(len(loops.cone_angles)):
        if multipliers[2 * n + cone] != 0.0:
            cone_excess(loops, cone, want.margin, state, desk)
            add_cone(loops, cone, multipliers[2 * n + cone], desk, out)


@routine
def feel_curvature(loops: Loops, row: int, want: Aim, state: State, trial: State, desk: Desk, view: View) -> float:
    """Curvature of the objective and of the active limits along the loops, into `curve`; the largest on its diagonal.

    By differences of the gradient of the Lagrangian, whose multipliers of the loops balance it at pivot coordinates.
    """
    n, slope, H, rows = len(loops.lo), view.slope, desk.curve.H, len(desk.balance)
    motions = slope.counts[MOTIONS]
    basis, here, there, along = view.basis, desk.here, desk.there, desk.row
    for i in range(rows):
        desk.balance[i] = 0.0
    pull(loops, row, want, state, desk, desk.here)
    for r in range(slope.counts[RANK]):
        for i in range(rows):
            desk.balance[i] -= here[view.pivots[r]] * view.transform[r, i]
    pull(loops, row, want, state, desk, desk.here)
    for a in range(motions):
        probe = PROBE / math.sqrt(slope.metric[a, a])
        for j in range(n):
            along[j] = basis[j, a]
        copy_state(state, trial)
        move(loops, desk.row, probe, trial)
        pull(loops, row, want, trial, desk, desk.there)
        for b in range(motions):
            H[b, a] = 0.0
            for j in range(n):
                H[b, a] += basis[j, b] * (there[j] - here[j]) / probe
    largest = 0.0
    for a in range(motions):
        largest = max(largest, abs(H[a, a]))
        for b in range(a):
            H[a, b] = H[b, a] = 0.5 * (H[a, b] + H[b, a])
    return largest


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
def take(loops: Loops, view: View, x: Floats, state: State, desk: Desk, closing: bool) -> float:
    """Take a step of the free motions, and with it one that closes the loops; the share of it that is not too long."""
    n = len(loops.lo)
    for j in range(n):
        desk.row[j] = view.shift[j] if closing else 0.0
        for a in range(view.slope.counts[MOTIONS]):
            desk.row[j] += view.basis[j, a] * x[a]
    share = LONGEST_STEP / max(longest(desk.row, n), LONGEST_STEP)
    move(loops, desk.row, share, state)
    return share


@routine
def restore(loops: Loops, row: int, want: Aim, state: State, desk: Desk, view: View, p: Programme) -> bool:
    """Bring a configuration onto its loops and within its limits, by the shortest way; `view` is where it ends."""
    for _step in range(RESTORING):
        look(loops, row, want, state, desk, view)
        if is_closed(view.slope, CLOSED):
            return True
        if not way_back(view.slope, p):
            return False
        take(loops, view, p.x, state, desk, True)
    look(loops, row, want, state, desk, view)
    return is_closed(view.slope, NEARLY_CLOSED)


@routine
def scale_aim(loops: Loops, row: int, want: Aim, state: State, desk: Desk, view: View) -> None:
    """Choose the unit of the objective, so that its gradient is of order one, and look again."""
    desk.aim.unit[0] = 1.0
    look(loops, row, want, state, desk, view)
    desk.aim.unit[0] = 1.0 / max(math.sqrt(2.0 * view.slope.scalars[VALUE]), 1e-12)
    look(loops, row, want, state, desk, view)


@routine
def descend(
    loops: Loops,
    row: int,
    want: Aim,
    best: State,
    trial: State,
    desk: Desk,
    first: View,
    second: View,
    p: Programme,
) -> int:
    """From a feasible configuration down to the nearest; how many steps it took."""
    view, other, curve, pace = first, second, desk.curve, desk.pace
    scale_aim(loops, row, want, best, desk, view)
    begin_descent(view.slope, curve, pace)
    while pace.counts[DONE] == 0:
        pace.scalars[LARGEST] = feel_curvature(loops, row, want, best, trial, desk, view)
        led_down = False
        while not led_down and pace.counts[DONE] == 0:
            if plan_step(view.slope, curve, pace, want.max_iterations, p):
                copy_state(best, trial)
                share = take(loops, view, p.x, trial, desk, False)
                feasible = restore(loops, row, want, trial, desk, other, p)
                led_down = judge_step(view.slope, other.slope, feasible, share, pace)
                if led_down:
                    copy_state(trial, best)
                    view, other = other, view
    return int(pace.counts[STEPS])


@routine
def balance(slope: Slope, near: float, p: Programme, pulls: Floats) -> int:
    """The multipliers, into `p.x`, with which limits that are met hold the slope of the objective; how many are met.

    Of all that balance it as well, those whose squares have the least sum: limits that act as one share what they hold.
    """
    motions, k = slope.counts[MOTIONS], 0
    for c in range(slope.counts[LIMITS]):
        if slope.h[c] > -near:
            for a in range(motions):
                slope.G[k, a] = slope.G[c, a]
            slope.which[k] = slope.which[c]
            k += 1
    if not factorise(slope.metric, motions, 0.0, p.factor):
        return 0
    for c in range(k):
        apply_inverse(p.factor, motions, slope.G[c], pulls[c])
    for c in range(k):
        p.g[c] = p.h[c] = 0.0
        for a in range(motions):
            p.g[c] += pulls[c, a] * slope.g[a]
        for d in range(k):
            p.H[c, d] = SHARING if c == d else 0.0
            p.G[c, d] = -1.0 if c == d else 0.0
            for a in range(motions):
                p.H[c, d] += slope.G[c, a] * pulls[d, a]
    return k if factorise(p.H, k, 0.0, p.factor) and solve_programme(p, k, k) else 0


@kernel
def approach(loops: Loops, layout: Layout, want: Aim, closed: Closed, weights: Floats) -> None:
    """Bring every row, from a configuration that is closed within its limits or nearly so, as near as it comes.

    With no steps to take, tell instead how hard every limit holds each row back where it is, (n, 2 columns + cones):
    the multiplier of the limit, by how much nearer the target comes per unit by which it gives way; else 0.
    """
    rows = 6 * len(loops.paths)  # of all paths but the first, and six that may be held
    best, trial = new_state(loops), new_state(loops)
    first, second, desk = new_view(loops, rows), new_view(loops, rows), new_desk(loops, layout, rows)
    k = len(first.slope.h)
    p, pulls = new_programme(k, k), np.zeros((k, len(loops.lo)))
    for row in range(len(closed.coordinates)):
        load_row(loops, layout, False, row, closed, best)
        closed.iterations[row] = 0
        if want.max_iterations == 0:
            scale_aim(loops, row, want, best, desk, first)
            for c in range(balance(first.slope, want.near, p, pulls)):
                weights[row, first.slope.which[c]] = p.x[c]
            continue
        if restore(loops, row, want, best, desk, first, p):
            closed.iterations[row] = descend(loops, row, want, best, trial, desk, first, second, p)
        look(loops, row, want, best, desk, first)
        store_row(loops, row, best, closed)
        for group in range(closed.gaps.shape[1]):  # the loops are looked at as a whole
            closed.gaps[row, group] = first.slope.scalars[GAP]
            closed.excesses[row, group] = max(first.slope.scalars[EXCESS] - want.margin, 0.0)
            closed.misses[row, group] = 0.0
