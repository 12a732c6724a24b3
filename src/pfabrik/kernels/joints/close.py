"""Closing loops by Levenberg-Marquardt on all joint coordinates and the platform's pose at once.

The residual of a path is how its last body differs from the platform: position [L] and rotation vector [rad]. Every
group of paths has coordinates of its own, so its share of the normal equations is eliminated by itself, and six
equations in the platform's twist remain: the work grows with the number of legs, not with its cube.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ...common.arrays import Floats
from .._jit import inlined, opener, routine, search
from ..quaternions import exponential, turn_about_z, turn_ball, yaw_of
from ..search_constants import BELIEVED, CONTRACTION, FARTHEST_OPENING, NEWTON_STEP
from .joint_constants import DAMPING, FEW, LEAST_DAMPING, MOST_DAMPING, PROGRESS
from .loops import BALL, BASE_AXES, HALF_WAY, LOCKED, SLIDE, Closed, ClosureProblem, Layout, Loops
from .normal_equations import (
    add_cones,
    add_paths,
    add_ranges,
    clear,
    follow_platform,
    hold_platform,
    out_of_frame,
    pose_frame,
    turn_equations,
)
from .path_kinematics import (
    LAYOUT,
    LOOPS,
    Equations,
    State,
    copy_state,
    load_row,
    new_equations,
    new_state,
    open_layout,
    open_loops,
    store_row,
)

# Purpose of the next evaluation of the equations: of a trial step, of the best after a rejected step, of the end.
TRY, RETURN, MEASURE = 0, 1, 2


class ClosingScratch(NamedTuple):
    """Scratch memory of one thread."""

    best: State
    trial: State
    eq: Equations


def new_closing_scratch(loops: Loops, layout: Layout) -> ClosingScratch:
    """Scratch memory of one thread."""
    return ClosingScratch(new_state(loops), new_state(loops), new_equations(loops, layout))


open_scratch = opener(new_closing_scratch(LOOPS, LAYOUT))


@inlined
def store_measures(eq: Equations, row: int, closed: Closed) -> None:
    """Write gaps, excesses and misses of the present configuration to a row of the results."""
    for group in range(len(eq.gaps)):
        closed.gaps[row, group] = eq.gaps[group]
        closed.excesses[row, group] = eq.excesses[group]
        closed.misses[row, group] = eq.misses[group]


LONG, BESIDE = 48, 8
"""Coordinates of one group from which on it is factorised by rows, and rows per block."""


@routine
def factorise_long(A: Floats, size: int, damping: float, L: Floats) -> None:
    """The Cholesky factor of A + damping = L L^T, with the inverse of its diagonal on the diagonal, by rows of L^T.

    It takes the sums of `eliminate` in an order that accesses memory contiguously.
    """
    for first in range(0, size, BESIDE):
        last = min(first + BESIDE, size)
        for i in range(first, last):
            for k in range(i, size):
                L[i, k] = A[k, i]
        for j in range(first):
            for i in range(first, last):
                share = L[j, i]
                for k in range(i, size):
                    L[i, k] -= share * L[j, k]
        for i in range(first, last):
            for j in range(first, i):
                share = L[j, i]
                for k in range(i, size):
                    L[i, k] -= share * L[j, k]
            L[i, i] = 1.0 / math.sqrt(max(L[i, i] + damping, damping))
            for k in range(i + 1, size):
                L[i, k] *= L[i, i]
    for i in range(size):
        for j in range(i):
            L[i, j] = L[j, i]


@inlined
def eliminate(A: Floats, C: Floats, b: Floats, G: Floats, size: int, damping: float, L: Floats, Y: Floats) -> None:
    """Y = (A + damping)^-1 [C, -b], by Cholesky; zero for components of the platform that are held."""
    if size > LONG:
        factorise_long(A, size, damping, L)
    for i in range(size):
        for k in range(6):
            Y[i, k] = C[i, k] if G[k, k] < LOCKED else 0.0
        Y[i, 6] = -b[i]
        for j in range(i + 1 if size <= LONG else 0):
            value = A[i, j]
            for k in range(j):
                value -= L[i, k] * L[j, k]
            if j < i:
                L[i, j] = value * L[j, j]
            else:
                L[i, i] = 1.0 / math.sqrt(max(value + damping, damping))
        for k in range(7):
            if k == 6 or G[min(k, 5), min(k, 5)] < LOCKED:
                value = Y[i, k]
                for j in range(i):
                    value -= L[i, j] * Y[j, k]
                Y[i, k] = value * L[i, i]
    for i in range(size - 1, -1, -1):
        for k in range(7):
            if k == 6 or G[min(k, 5), min(k, 5)] < LOCKED:
                value = Y[i, k]
                for j in range(i + 1, size):
                    value -= L[j, i] * Y[j, k]
                Y[i, k] = value * L[i, i]


@inlined
def solve_platform(S: Floats, damping: float, twist: Floats) -> None:
    """Solve the six symmetric positive equations S (lower triangle, right-hand side last) in place."""
    for i in range(6):
        for j in range(i + 1):
            value = S[i, j]
            for k in range(j):
                value -= S[i, k] * S[j, k]
            S[i, j] = value * S[j, j] if j < i else 1.0 / math.sqrt(max(value + damping, damping))
        value = S[i, 6]
        for j in range(i):
            value -= S[i, j] * twist[j]
        twist[i] = value * S[i, i]
    for i in range(5, -1, -1):
        value = twist[i]
        for j in range(i + 1, 6):
            value -= S[j, i] * twist[j]
        twist[i] = value * S[i, i]


@inlined
def solve(layout: Layout, damping: float, eq: Equations) -> None:
    """The platform's twist, and in Y's last column the step of every free coordinate."""
    n_free = 0
    for i in range(6):
        n_free += 1 if eq.G[i, i] < LOCKED else 0
        for j in range(7):
            eq.S[i, j] = eq.G[i, j]
        eq.twist[i] = 0.0
    for group in range(len(layout.sizes)):
        size, C, Y = layout.sizes[group], eq.C[group], eq.Y[group]
        eliminate(eq.A[group], C, eq.b[group], eq.G, size, damping, eq.factor, Y)
        for i in range(6 if n_free > 0 else 0):
            for s in range(size):
                for j in range(i + 1):
                    eq.S[i, j] -= C[s, i] * Y[s, j]
                eq.S[i, 6] += C[s, i] * Y[s, 6]
    if n_free == 0:
        return
    solve_platform(eq.S, damping, eq.twist)
    for i in range(6):
        if eq.G[i, i] >= LOCKED:
            eq.twist[i] = 0.0
    for group in range(len(layout.sizes)):
        for s in range(layout.sizes[group]):
            for i in range(6):
                eq.Y[group, s, 6] += eq.Y[group, s, i] * eq.twist[i]


@inlined
def move(loops: Loops, layout: Layout, eq: Equations, state: State) -> float:
    """Apply the step, shortened if it turns too far or slides farther than the largest gap; its largest component."""
    gap = 1.0
    for group in range(len(layout.sizes)):
        gap = max(gap, eq.gaps[group] / NEWTON_STEP)
    longest = 0.0
    for i in range(6):
        longest = max(longest, abs(eq.twist[i]) / (gap if i < 3 else 1.0))
    for k in range(len(loops.kinds)):
        j = loops.columns[k]
        for i in range(3 if loops.kinds[k] == BALL else 1):
            if layout.slots[j + i] >= 0:
                part = abs(eq.Y[loops.group_of[j], layout.slots[j + i], 6])
                longest = max(longest, part / (gap if loops.kinds[k] == SLIDE else 1.0))
    scale = min(1.0, NEWTON_STEP / longest) if longest > 0.0 else 1.0
    for k in range(len(loops.kinds)):
        j = loops.columns[k]
        Y = eq.Y[loops.group_of[j]]
        if loops.kinds[k] != BALL:
            if layout.slots[j] >= 0:
                state.q[j] += scale * Y[layout.slots[j], 6]
        elif layout.slots[j] >= 0:
            s = layout.slots[j]
            turn_ball(state.balls[k], scale * Y[s, 6], scale * Y[s + 1, 6], scale * Y[s + 2, 6])
    X, V = state.X, eq.twist
    for i in range(3):
        X[i, 3] += scale * V[i]
    # the platform turns about base axes: its rotation is multiplied from the left, column by column
    w, x, y, z = exponential(scale * V[3], scale * V[4], scale * V[5])
    for j in range(3):
        a, b, c = X[0, j], X[1, j], X[2, j]
        p, q, r = y * c - z * b, z * a - x * c, x * b - y * a
        X[0, j] = a + 2.0 * (w * p + y * r - z * q)
        X[1, j] = b + 2.0 * (w * q + z * p - x * r)
        X[2, j] = c + 2.0 * (w * r + x * q - y * p)
    return scale * longest


@inlined
def is_close(problem: ClosureProblem, eq: Equations) -> bool:
    """True if gaps, misses and, if they are to be kept, excesses are within `closeness`."""
    largest = 0.0
    for group in range(len(eq.gaps)):
        largest = max(largest, eq.gaps[group], eq.misses[group])
        if problem.limits:
            largest = max(largest, eq.excesses[group])
    return largest <= problem.closeness


@inlined
def largest_gap(eq: Equations) -> float:
    """The largest gap of all groups of paths [L or rad]."""
    largest = 0.0
    for group in range(len(eq.gaps)):
        largest = max(largest, eq.gaps[group])
    return largest


@inlined
def least_damping(layout: Layout) -> float:
    """The least damping for the size of the largest group."""
    largest = FEW
    for group in range(len(layout.sizes)):
        largest = max(largest, layout.sizes[group])
    return LEAST_DAMPING * (largest / FEW) ** 3


@routine
def close_row(
    loops: Loops, layout: Layout, problem: ClosureProblem, row: int, scratch: ClosingScratch, closed: Closed
) -> int:
    """Close the loops of a row, from `scratch.trial`, into `scratch.best`; the number of steps."""
    best, trial, eq = scratch.best, scratch.trial, scratch.eq
    least = least_damping(layout)
    undamped, keeps_yaw = problem.undamped == 1, problem.frame == HALF_WAY and problem.platform[5] == LOCKED
    copy_state(trial, best)
    for group in range(closed.gaps.shape[1]):  # where no configuration is a number, none is measured
        closed.gaps[row, group] = math.inf
    cost, factor, step, idle = math.inf, 1.0, math.inf, 0
    longest_step = 0.99 * NEWTON_STEP if problem.stays == 1 else math.inf
    iterations, phase = 0, TRY
    while True:
        clear(layout, eq)
        trial_cost = 0.0
        if phase != MEASURE:
            trial_cost += add_paths(loops, layout, problem, row, trial, eq)
        if problem.limits == 1 or phase == MEASURE:
            trial_cost += add_ranges(loops, layout.slots, trial, problem.margin, eq)
            trial_cost += add_cones(loops, layout.slots, trial, problem.margin, eq)
        if phase == MEASURE:
            for group in range(len(layout.sizes)):
                closed.excesses[row, group] = eq.excesses[group]
            break
        if problem.frame != BASE_AXES:
            pose_frame(trial, problem, eq)
            turn_equations(eq.frame, layout, eq)
        hold_platform(problem, eq)
        if phase == TRY:
            idle = 0 if trial_cost < PROGRESS * cost else idle + 1
            if trial_cost < cost or undamped:
                reduction, cost = cost - trial_cost, trial_cost
                copy_state(trial, best)
                store_measures(eq, row, closed)
                factor = max(factor / 4.0, 1e-3)
                is_over = (reduction <= 1e-13 * cost and not undamped) or idle == problem.patience
                if is_close(problem, eq) or is_over:
                    phase = MEASURE
            else:
                factor *= 8.0
                phase = MEASURE if step < 1e-12 or idle == problem.patience else RETURN
                copy_state(best, trial)
        elif phase == RETURN:
            phase = TRY
        if problem.stays == 1 and iterations == 0 and largest_gap(eq) > FARTHEST_OPENING:
            phase = MEASURE
        damping = least if undamped else max(least, DAMPING * factor * min(cost, 1.0))
        if phase == TRY and (iterations == problem.max_iterations or not damping < MOST_DAMPING):
            phase = MEASURE
        if phase == TRY:
            solve(layout, damping, eq)
            if problem.frame != BASE_AXES:
                out_of_frame(eq.frame, eq.twist)
            yaw = yaw_of(trial.X) if keeps_yaw else 0.0
            step = move(loops, layout, eq, trial)
            if keeps_yaw:
                turn_about_z(trial.X, yaw - yaw_of(trial.X))  # undo the yaw of second order
            iterations += 1
            if problem.stays == 1 and not step <= longest_step:
                phase = MEASURE
            longest_step = (BELIEVED if iterations == 1 else CONTRACTION) * step
        if phase == MEASURE:
            if problem.balls_follow == 1:
                follow_platform(loops, best, eq)
            copy_state(best, trial)
    return iterations


@search
def close(machine: int, locked: int, scratch_address: int, problem: ClosureProblem, closed: Closed) -> None:
    """Close the loops of every row, by least squares.

    The iteration of a row ends when `is_close`, when steps or reductions vanish, or after `problem.max_iterations`.

    Parameters
    ----------
    machine, locked, scratch_address : addresses of `Loops`, `Layout` and `ClosingScratch`.
    """
    loops, layout, scratch = open_loops(machine), open_layout(locked), open_scratch(scratch_address)
    for row in range(len(closed.coordinates)):
        load_row(loops, row, closed, scratch.trial)
        closed.iterations[row] = close_row(loops, layout, problem, row, scratch, closed)
        store_row(loops, row, scratch.best, closed)
