"""Descending to the nearest feasible configuration: what every such search does, whatever its unknowns are.

Sequential quadratic programming: at a configuration the distance is modelled to second order, loops and limits to
first; the step that this asks for, and that closes what is open, is taken, and kept if it led down in an exact penalty:
the distance, and what is open times more than all multipliers. Where it did not, what it left open is closed first.
Damping shortens steps where the model is poor, and vanishes where it is good (Nocedal and Wright, chapter 18).

With g and H the gradient of the objective f and the Hessian of the Lagrangian f + sum_k m_k h_k, G the gradients of
the limits h <= 0 and M the metric of the unknowns, a step x solves the quadratic programme

    min g x + x (H + damping M) x / 2    subject to    h + G x <= 0

whose conditions of optimality (Karush, Kuhn, Tucker) are g + (H + damping M) x + G^T m = 0, m >= 0, m (h + G x) = 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..arrays import Floats, Ints, Record, Records
from ._jit import routine
from .qp import QP, factorise, solve_qp

LONGEST_STEP, AT_FIRST = 0.4, 0.1
"""Longest step of any unknown [rad or L]: beyond it the quadratic model says little. And the damping to begin with, as
a share of what would make the first step so long."""

REACH = 1.0
"""Limits farther away than this are left out of a programme [rad or L]: no step comes near them."""

CLOSED, NEARLY_CLOSED = 1e-13, 1e-10
"""Gaps and excesses of a feasible configuration, and of one that nothing makes more so [rad or L]: loops that are
overconstrained close no better than their description is exact. The second is a tenth of what is promised."""

OPEN = 0.01
"""Share of what a step promises to which what it left open is closed: where it did not lead down, and on joint
coordinates always, for there a step may end where loops no longer close."""

FINE, ROUNDING = 1e-11, 1e-13
"""Shares of the objective: of a step that promises less than the first it is not asked whether it led down, only that
it did not lead up by more than the second, or than it costs to close what counts as closed: it is known no better."""

LAST, NEXT, CONVERGING = 1e-18, 1e-20, 1e-2
"""Share of the objective that the last step promises: its length is a billionth of the distance. That a step after it
would promise. And, of a fine step, share of what the one before promised: if it is more, what moves is rounding."""

PROBE = 1e-6
"""How far curvature is felt for along each motion [rad or L]."""

RESTORING, CORRECTIONS = 8, 1
"""Steps to bring a configuration back within its limits; and to close what a step left open that did not lead down."""

LEAST_WEIGHT = 1.0
"""What the penalty counts a gap at least, in units of the gradient: where the objective has none along an equation, its
multiplier says nothing of how much may be left open."""

ENOUGH, GOOD, EXACT = 1e-4, 0.5, 0.1
"""Shares of what a step promised that make it worth keeping, and the model good enough for less damping; and by how
much it may be off where the model, at the end of a whole step, is good enough for far less."""

WORTH, MUCH = 0.01, 0.1
"""Damping, in units of curvature: at least, after a step that did not lead down; and more than a good step takes back
at once."""

SOLVABLE = 1e-8
"""Damping, in units of curvature, for a programme that is not solved: rounding then weighs less than what it asks."""

STEEPEST = 1e8
"""Damping, in units of curvature, that ends a search: no step however short leads down."""

TOTALS = np.dtype(
    [
        ("value", "f8"),  # of the objective
        ("gap", "f8"),  # the largest of a loop, or of what is held
        ("excess", "f8"),  # the largest over a limit
        ("closing", "f8"),  # what closing the loops adds to the objective
        ("motions", "i8"),  # how many are free
        ("limits", "i8"),  # how many are noted
        ("rank", "i8"),  # of the equations
        ("rows", "i8"),  # how many equations
    ]
)
"""A configuration in numbers."""

CONTROL = np.dtype(
    [
        ("damping", "f8"),
        ("largest", "f8"),  # curvature
        ("predicted", "f8"),  # what the last step promised
        ("predicted_before", "f8"),  # and the one before
        ("equation_multipliers", "f8"),  # sum of the multipliers of the equations
        ("weight", "f8"),  # what the penalty counts the largest gap or excess
        ("steps", "i8"),  # taken
        ("is_done", "i8"),  # 1 where none is worth taking any more
        ("is_rejected", "i8"),  # 1 where the last did not lead down
        ("is_exact", "i8"),  # 1 where it gained what it promised
        ("is_restoring", "i8"),  # 1 where steps that left something open were lost
    ]
)
"""Step control: how long the next step may be, and whether there is one."""


class Linearisation(NamedTuple):
    """What the unknowns do to first order at a configuration."""

    metric: Floats  # (n, n): squares of their steps, lower triangle
    g: Floats  # (n,): of the objective
    G: Floats  # (k, n): of the limits
    h: Floats  # (k,): excess over each, negative inside
    drift: Floats  # (k,): what closing the loops adds to it
    which: Ints  # (k,): its number
    totals: Records  # (1,): TOTALS


class Hessian(NamedTuple):
    """What they do to second order, and what of the limits enters there."""

    H: Floats  # (n, n)
    multipliers: Floats  # one for every limit, by its number


def new_linearisation(n: int, k: int) -> Linearisation:
    """Room for n unknowns and k limits."""
    return Linearisation(
        np.zeros((n, n)),
        np.zeros(n),
        np.zeros((k, n)),
        np.zeros(k),
        np.zeros(k),
        np.zeros(k, np.int64),
        np.zeros(1, TOTALS),
    )


def new_hessian(n: int, k: int) -> Hessian:
    return Hessian(np.zeros((n, n)), np.zeros(k))


@routine
def longest(step: Floats, n: int) -> float:
    """The largest of the first n entries."""
    most = 0.0
    for j in range(n):
        most = max(most, abs(step[j]))
    return most


@routine
def symmetrise(H: Floats, n: int) -> float:
    """Take the mean of a matrix and its transpose; the largest on its diagonal."""
    largest = 0.0
    for a in range(n):
        largest = max(largest, abs(H[a, a]))
        for b in range(a):
            H[a, b] = H[b, a] = 0.5 * (H[a, b] + H[b, a])
    return largest


@routine
def sum_of(multipliers: Floats, k: int) -> float:
    """The sum of the first k."""
    total = 0.0
    for c in range(k):
        total += multipliers[c]
    return total


@routine
def allowed_violation(control: Record, share: float) -> float:
    """How far loops may be open after a share of the step planned."""
    return max(CLOSED, OPEN * share * control["predicted"])


@routine
def violation(linear: Linearisation) -> float:
    """How far loops are open, or limits exceeded; nothing where that counts as closed."""
    return 0.0 if is_closed(linear, CLOSED) else max(linear.totals[0]["gap"], linear.totals[0]["excess"])


@routine
def is_closed(linear: Linearisation, tolerance: float) -> bool:
    """Whether loops are closed and limits kept."""
    return bool(linear.totals[0]["gap"] <= tolerance and linear.totals[0]["excess"] <= tolerance)


@routine
def solve_within(linear: Linearisation, closed: bool, p: QP) -> bool:
    """Solve the programme whose H is factorised: what limits are exceeded by is closed or, where it cannot be, taken as
    if it were just met; as is what is open by rounding where all is `closed`."""
    motions, k = linear.totals[0]["motions"], linear.totals[0]["limits"]
    for c in range(k):
        p.h[c] = min(linear.h[c], 0.0) if closed else linear.h[c] + linear.drift[c]
    if solve_qp(p, motions, k):
        return True
    for c in range(k):
        p.h[c] = min(linear.h[c], 0.0)
    return solve_qp(p, motions, k)


@routine
def solve_subproblem(
    linear: Linearisation, hessian: Hessian, damping: float, largest: float, p: QP
) -> tuple[float, float]:
    """The step that the damped programme asks for, into `p.x`: what it takes from the objective, and the damping.

    Where curvature is not positive, that across active limits counts more: there is no room to move there. Where that
    is not enough, damping grows. So it does where rounding keeps a programme from its solution: at a corner, where some
    motions have hardly any curvature.
    """
    motions, k = linear.totals[0]["motions"], linear.totals[0]["limits"]
    closed, stiff, is_solved = is_closed(linear, CLOSED), 0.0, False
    for c in range(k):
        for a in range(motions):
            p.G[c, a] = linear.G[c, a]
    for _attempt in range(60):
        for a in range(motions):
            p.g[a] = linear.g[a]
            for b in range(a + 1):
                p.H[a, b] = hessian.H[a, b] + max(damping, 1e-12 * largest) * linear.metric[a, b]
        for c in range(k):
            if stiff > 0.0 and hessian.multipliers[linear.which[c]] > 0.0:
                for a in range(motions):
                    for b in range(a + 1):
                        p.H[a, b] += stiff * p.G[c, a] * p.G[c, b]
        if factorise(p.H, motions, 1e-300, p.factor):
            is_solved = solve_within(linear, closed, p)
            if is_solved:
                break
            damping = max(10.0 * damping, SOLVABLE * largest)
        elif stiff == 0.0:
            stiff = 10.0 * largest
        else:
            damping = max(2.0 * damping, 1e-3 * largest)
    if not is_solved:
        return -math.inf, damping
    predicted = 0.0 if closed else -linear.totals[0]["closing"]
    for a in range(motions):
        predicted -= linear.g[a] * p.x[a]
        for b in range(motions):
            predicted -= 0.5 * p.x[a] * hessian.H[max(a, b), min(a, b)] * p.x[b]
    return predicted, damping


@routine
def is_last(linear: Linearisation, other: Linearisation, predicted: float, before: float) -> bool:
    """Whether a step from one linear to another promised so little that none is worth taking after it.

    Where it left nothing open, the next is taken to promise less by the factor by which this one promised less than the
    one `predicted_before`.
    """
    value = linear.totals[0]["value"]
    if predicted <= LAST * value or (before <= FINE * value and predicted > CONVERGING * before):
        return True
    return before < math.inf and predicted * predicted <= NEXT * value * before and is_closed(other, CLOSED)


@routine
def merit(linear: Linearisation, weight: float) -> float:
    """The objective, and what it would cost to close what is open: an exact penalty, whose weight is more than the sum
    of all multipliers."""
    return linear.totals[0]["value"] + weight * violation(linear)


@routine
def is_sufficient(linear: Linearisation, actual: float, predicted: float, weight: float) -> bool:
    """Whether a step that promised so much gained enough."""
    if predicted <= FINE * linear.totals[0]["value"]:
        return actual >= -ROUNDING * linear.totals[0]["value"] - weight * CLOSED
    return actual > ENOUGH * predicted


@routine
def note_multipliers(linear: Linearisation, p: QP, hessian: Hessian) -> None:
    """Keep the multipliers of a programme by the limits' own numbers."""
    for c in range(len(hessian.multipliers)):
        hessian.multipliers[c] = 0.0
    for c in range(linear.totals[0]["limits"]):
        hessian.multipliers[linear.which[c]] = p.multipliers[c]


@routine
def scale_objective(linear: Linearisation) -> float:
    """Choose the unit of the objective, 1 until now, so that its gradient is of order one; the unit."""
    unit = 1.0 / max(math.sqrt(2.0 * linear.totals[0]["value"]), 1e-12)
    linear.totals[0]["value"] *= unit
    linear.totals[0]["closing"] *= unit
    for a in range(linear.totals[0]["motions"]):
        linear.g[a] *= unit
    return unit


@routine
def begin_descent(linear: Linearisation, hessian: Hessian, control: Record) -> None:
    """Start at a feasible configuration."""
    for c in range(len(hessian.multipliers)):
        hessian.multipliers[c] = 0.0
    control["damping"] = AT_FIRST * longest(linear.g, linear.totals[0]["motions"]) / LONGEST_STEP
    control["predicted"], control["weight"] = math.inf, 0.0
    control["steps"] = control["is_done"] = control["is_rejected"] = control["is_exact"] = 0


@routine
def is_stuck_infeasible(linear: Linearisation, is_accepted: bool, most_steps: int, control: Record) -> bool:
    """Whether no step leads down where something is open."""
    return not is_accepted and not is_closed(linear, NEARLY_CLOSED) and control["steps"] <= most_steps


@routine
def resume(control: Record) -> None:
    """Ask anew whether a step is worth taking, now that what was open is closed."""
    control["predicted"] = math.inf
    control["is_done"] = 0


@routine
def plan_step(linear: Linearisation, hessian: Hessian, control: Record, most_steps: int, p: QP) -> bool:
    """The next step to try, into `p.x`; False where none is worth trying."""
    control["steps"] += 1
    control["predicted_before"] = control["predicted"]
    predicted, damping = solve_subproblem(linear, hessian, control["damping"], control["largest"], p)
    multipliers = control["equation_multipliers"] + sum_of(p.multipliers, linear.totals[0]["limits"])
    control["weight"] = max(LEAST_WEIGHT, 2.0 * multipliers)
    predicted += control["weight"] * violation(linear)
    control["predicted"], control["damping"] = predicted, damping
    if predicted <= 0.0 or damping > STEEPEST * control["largest"] or control["steps"] > most_steps:
        control["is_done"] = 1
        return False
    note_multipliers(linear, p, hessian)
    return True


@routine
def actual_reduction(linear: Linearisation, other: Linearisation, control: Record) -> float:
    """By how much the penalty is less at another configuration."""
    weight = control["weight"]
    return merit(linear, weight) - merit(other, weight)


@routine
def needs_correction(linear: Linearisation, other: Linearisation, share: float, control: Record) -> bool:
    """Whether a share of the step planned did not lead down, perhaps for what it left open."""
    predicted = share * control["predicted"]
    actual = actual_reduction(linear, other, control)
    return not is_sufficient(linear, actual, predicted, control["weight"]) and not is_closed(
        other, allowed_violation(control, share)
    )


@routine
def judge_step(linear: Linearisation, other: Linearisation, feasible: bool, share: float, control: Record) -> bool:
    """Whether a share of the step planned led from one linear down to another; damping follows how well it did."""
    predicted, actual = share * control["predicted"], actual_reduction(linear, other, control)
    is_accepted = feasible and is_sufficient(linear, actual, predicted, control["weight"])
    if is_last(linear, other, predicted, control["predicted_before"]):
        control["is_done"] = 1
    control["predicted"], control["is_exact"] = (
        predicted,
        int(is_accepted and abs(actual - predicted) < EXACT * predicted),
    )
    damping, largest = control["damping"], control["largest"]
    if not is_accepted:
        control["damping"] = max(4.0 * damping, WORTH * largest)
    elif actual > GOOD * predicted and control["is_rejected"] == 0:
        damping *= 0.01 if damping < MUCH * largest and share == 1.0 and control["is_exact"] == 1 else 0.1
        control["damping"] = damping if damping > 1e-8 * largest else 0.0
    control["is_rejected"] = 0 if is_accepted else 1
    return is_accepted
