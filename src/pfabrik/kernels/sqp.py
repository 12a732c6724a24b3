"""Descending to the nearest feasible configuration: what every such search does, whatever its unknowns are.

Sequential quadratic programming: at a feasible configuration the distance is modelled to second order and the limits
to first, the step that this asks for is taken, brought back within the limits, and kept if it led down. Damping
shortens steps where the model is poor, and vanishes where it is good (Nocedal and Wright, chapter 18).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ._jit import allocator, routine
from .closure.loops import Floats, Ints
from .qp import Programme, factorise, solve_programme

LONGEST_STEP = 0.3
"""Longest step of any unknown [rad or L]: beyond it the quadratic model says little."""

REACH = 1.0
"""Limits farther away than this are left out of a programme [rad or L]: no step comes near them."""

CLOSED, NEARLY_CLOSED = 1e-13, 1e-10
"""Gaps and excesses of a feasible configuration, and of one that nothing makes more so [rad or L]: loops that are
overconstrained close no better than their description is exact. The second is a tenth of what is promised."""

FINE, ROUNDING = 1e-11, 1e-13
"""Shares of the objective: of a step that promises less than the first it is not asked whether it led down, only that
it did not lead up by more than the second, for the objective itself is known no better."""

LAST, CONVERGING = 1e-18, 1e-2
"""Share of the objective that the last step promises: its length is a billionth of the distance. And, of a fine step,
share of what the one before promised: if it is more, what moves is rounding."""

PROBE = 1e-6
"""How far curvature is felt for along each motion [rad or L]."""

RESTORING = 8
"""Steps to bring a configuration back within its limits."""

ENOUGH, GOOD = 1e-4, 0.5
"""Shares of what a step promised that make it worth keeping, and the model good enough for less damping."""

STEEPEST = 1e8
"""Damping, in units of curvature, that ends a search: no step however short leads down."""

# Scalars and counts of a pace.
DAMPING, LARGEST, PROMISE, BEFORE = 0, 1, 2, 3
STEPS, DONE = 0, 1

# Scalars of a slope: the objective, the largest gap of a loop, the largest excess. Counts: unknowns, limits, rank.
VALUE, GAP, EXCESS = 0, 1, 2
MOTIONS, LIMITS, RANK = 0, 1, 2


class Slope(NamedTuple):
    """What the unknowns do to first order at a configuration."""

    metric: Floats  # (n, n): squares of their steps, lower triangle
    g: Floats  # (n,): of the objective
    G: Floats  # (k, n): of the limits
    h: Floats  # (k,): excess over each, negative inside
    drift: Floats  # (k,): what closing the loops adds to it
    which: Ints  # (k,): its number
    scalars: Floats  # (3,)
    counts: Ints  # (3,)


class Pace(NamedTuple):
    """How a search goes on."""

    scalars: Floats  # (4,): damping, the largest curvature, what the last step promised, and the one before
    counts: Ints  # (2,): steps taken, and 1 where none is worth taking any more


class Curve(NamedTuple):
    """What they do to second order, and what of the limits enters there."""

    H: Floats  # (n, n)
    multipliers: Floats  # one for every limit, by its number


@allocator
def new_slope(n: int, k: int) -> Slope:
    """Room for n unknowns and k limits."""
    return Slope(
        np.zeros((n, n)),
        np.zeros(n),
        np.zeros((k, n)),
        np.zeros(k),
        np.zeros(k),
        np.zeros(k, np.int64),
        np.zeros(3),
        np.zeros(3, np.int64),
    )


@allocator
def new_curve(n: int, k: int) -> Curve:
    return Curve(np.zeros((n, n)), np.zeros(k))


@allocator
def new_pace() -> Pace:
    return Pace(np.zeros(4), np.zeros(2, np.int64))


@routine
def longest(step: Floats, n: int) -> float:
    """The largest of the first n entries."""
    most = 0.0
    for j in range(n):
        most = max(most, abs(step[j]))
    return most


@routine
def is_closed(slope: Slope, tolerance: float) -> bool:
    """Whether loops are closed and limits kept."""
    return bool(slope.scalars[GAP] <= tolerance and slope.scalars[EXCESS] <= tolerance)


@routine
def way_back(slope: Slope, p: Programme) -> bool:
    """The shortest step within all limits, into `p.x`; False where there is none."""
    motions, k = slope.counts[MOTIONS], slope.counts[LIMITS]
    for a in range(motions):
        p.g[a] = 0.0
    for c in range(k):
        p.h[c] = slope.h[c] + slope.drift[c]
        for a in range(motions):
            p.G[c, a] = slope.G[c, a]
    return factorise(slope.metric, motions, 0.0, p.factor) and solve_programme(p, motions, k)


@routine
def propose(slope: Slope, curve: Curve, damping: float, largest: float, p: Programme) -> tuple[float, float]:
    """The step that the damped programme asks for, into `p.x`: what it promises, and the damping it took.

    Where curvature is not positive, that across active limits counts more: there is no room to move there. Where that
    is not enough, damping grows. A programme without a solution promises less than nothing.
    """
    motions, k = slope.counts[MOTIONS], slope.counts[LIMITS]
    for c in range(k):
        p.h[c] = min(slope.h[c], 0.0)
        for a in range(motions):
            p.G[c, a] = slope.G[c, a]
    stiff = 0.0
    for attempt in range(60):
        for a in range(motions):
            p.g[a] = slope.g[a]
            for b in range(a + 1):
                p.H[a, b] = curve.H[a, b] + max(damping, 1e-12 * largest) * slope.metric[a, b]
        for c in range(k):
            if stiff > 0.0 and curve.multipliers[slope.which[c]] > 0.0:
                for a in range(motions):
                    for b in range(a + 1):
                        p.H[a, b] += stiff * p.G[c, a] * p.G[c, b]
        if factorise(p.H, motions, 1e-300, p.factor):
            break
        if attempt == 0:
            stiff = 10.0 * largest
        else:
            damping = max(2.0 * damping, 1e-3 * largest)
    if not solve_programme(p, motions, k):
        return -1.0, damping
    promise = 0.0
    for a in range(motions):
        promise -= slope.g[a] * p.x[a]
        for b in range(motions):
            promise -= 0.5 * p.x[a] * curve.H[max(a, b), min(a, b)] * p.x[b]
    return promise, damping


@routine
def is_last(slope: Slope, promise: float, before: float) -> bool:
    """Whether a step promises so little that none is worth taking after it; `before` is what the last one promised."""
    fine = FINE * slope.scalars[VALUE]
    return bool(promise <= LAST * slope.scalars[VALUE] or (before <= fine and promise > CONVERGING * before))


@routine
def leads_down(slope: Slope, other: Slope, promise: float) -> bool:
    """Whether a step that promised so much led to something better."""
    gain = slope.scalars[VALUE] - other.scalars[VALUE]
    if promise <= FINE * slope.scalars[VALUE]:
        return gain >= -ROUNDING * slope.scalars[VALUE]
    return gain > ENOUGH * promise


@routine
def note_multipliers(slope: Slope, p: Programme, curve: Curve) -> None:
    """Keep the multipliers of a programme by the limits' own numbers."""
    for c in range(len(curve.multipliers)):
        curve.multipliers[c] = 0.0
    for c in range(slope.counts[LIMITS]):
        curve.multipliers[slope.which[c]] = p.multipliers[c]


@routine
def begin_descent(slope: Slope, curve: Curve, pace: Pace) -> None:
    """Start at a feasible configuration."""
    for c in range(len(curve.multipliers)):
        curve.multipliers[c] = 0.0
    pace.scalars[DAMPING] = longest(slope.g, slope.counts[MOTIONS]) / LONGEST_STEP
    pace.scalars[PROMISE] = math.inf
    pace.counts[STEPS] = pace.counts[DONE] = 0


@routine
def plan_step(slope: Slope, curve: Curve, pace: Pace, most_steps: int, p: Programme) -> bool:
    """The next step to try, into `p.x`; False where none is worth trying."""
    pace.counts[STEPS] += 1
    pace.scalars[BEFORE] = pace.scalars[PROMISE]
    promise, damping = propose(slope, curve, pace.scalars[DAMPING], pace.scalars[LARGEST], p)
    pace.scalars[PROMISE], pace.scalars[DAMPING] = promise, damping
    if promise <= 0.0 or damping > STEEPEST * pace.scalars[LARGEST] or pace.counts[STEPS] > most_steps:
        pace.counts[DONE] = 1
        return False
    note_multipliers(slope, p, curve)
    return True


@routine
def judge_step(slope: Slope, other: Slope, feasible: bool, share: float, pace: Pace) -> bool:
    """Whether a share of the step planned led from one slope down to another; damping follows how well it did."""
    promise = pace.scalars[PROMISE] = share * pace.scalars[PROMISE]
    led_down = feasible and leads_down(slope, other, promise)
    if is_last(slope, promise, pace.scalars[BEFORE]):
        pace.counts[DONE] = 1
    damping, largest = pace.scalars[DAMPING], pace.scalars[LARGEST]
    if not led_down:
        pace.scalars[DAMPING] = max(4.0 * damping, 1e-3 * largest)
    elif slope.scalars[VALUE] - other.scalars[VALUE] > GOOD * promise:
        damping *= 0.1
        pace.scalars[DAMPING] = damping if damping > 1e-8 * largest else 0.0
    return led_down
