"""Descent to the nearest feasible configuration: sequential quadratic programming, independent of the unknowns.

At a configuration the objective is modelled to second order, loops and limits to first. The step that minimises this
model and closes the loops is taken, and accepted if it reduces an exact penalty: the objective plus the violation times
more than the sum of all multipliers. If it does not, its violation is corrected first. Damping shortens steps where the
model is poor, and vanishes where it is good (Nocedal and Wright, chapter 18).

With g and H the gradient of the objective f and the Hessian of the Lagrangian f + sum_k m_k h_k, G the gradients of
the limits h <= 0 and M the metric of the unknowns, a step x solves the quadratic programme

    min g x + x (H + damping M) x / 2    subject to    h + G x <= 0

whose conditions of optimality (Karush, Kuhn, Tucker) are g + (H + damping M) x + G^T m = 0, m >= 0, m (h + G x) = 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..common.arrays import Floats, Ints, Record, Records
from ._jit import routine
from .qp import QP, factorise, solve_qp
from .search_constants import (
    CLOSED,
    CONVERGING,
    EXACT,
    FINE,
    FIRST_DAMPING,
    GOOD,
    HOPELESS,
    LARGE_DAMPING,
    LAST,
    LEAST_DAMPING,
    LEAST_WEIGHT,
    LONGEST_STEP,
    MOST_DAMPING,
    NEARLY_CLOSED,
    NEXT,
    OPEN,
    ROUNDING,
    SOLVABLE,
    SUFFICIENT,
)

DAMPED = 0.0
"""Damping made a step short if the damping times the squared step, times this, is more than the predicted reduction:
that this is small then ends no descent. 0: never, for in double precision predictions that end one are far smaller; 2
in single precision."""

TOTALS = np.dtype(
    [
        ("value", "f8"),  # of the objective
        ("gap", "f8"),  # largest open loop or error of the held part
        ("excess", "f8"),  # largest excess over a limit
        ("closing", "f8"),  # change of the objective by closing the loops
        ("motions", "i8"),  # number of free motions
        ("limits", "i8"),  # number of limits in the programme
        ("rank", "i8"),  # of the equations
        ("rows", "i8"),  # number of equations
    ]
)
"""Summary of a linearisation."""

CONTROL = np.dtype(
    [
        ("damping", "f8"),
        ("largest", "f8"),  # largest curvature
        ("predicted", "f8"),  # predicted reduction of the last step
        ("predicted_before", "f8"),  # and of the one before
        ("equation_multipliers", "f8"),  # sum of the multipliers of the equations
        ("weight", "f8"),  # weight of the violation in the merit
        ("steps", "i8"),  # taken
        ("is_done", "i8"),  # 1 if the descent is over
        ("is_rejected", "i8"),  # 1 if the last step was rejected
        ("is_exact", "i8"),  # 1 if its actual reduction was as predicted
        ("is_damped", "i8"),  # 1 if damping made the last step short
        ("is_restoring", "i8"),  # 1 if feasibility is restored after each step
        ("is_warm", "i8"),  # 1 if a descent goes on from where the last one ended: its multipliers are a good guess
        ("stays", "i8"),  # 1: no step is longer than what keeps a working mode
        ("linearised", "i8"),  # configurations that all searches of a row linearised
        ("bound", "i8"),  # how many they may; 0: any
        ("least", "f8"),  # distance of the nearest end of the searches before; 0: of none
        ("closed", "f8"),  # objective at the last feasible configuration
    ]
)
"""State of the step control."""


class Linearisation(NamedTuple):
    """Objective and limits to first order in the unknowns, at a configuration."""

    metric: Floats  # (n, n): of the unknowns' steps, lower triangle
    g: Floats  # (n,): gradient of the objective
    G: Floats  # (k, n): gradients of the limits
    h: Floats  # (k,): excess over each, negative inside
    drift: Floats  # (k,): change of the excess by closing the loops
    which: Ints  # (k,): numbers of the limits
    totals: Records  # (1,): TOTALS


class Hessian(NamedTuple):
    """Hessian of the Lagrangian, with the multipliers of the limits in it."""

    H: Floats  # (n, n)
    multipliers: Floats  # of all limits, by their numbers
    forces: Floats  # (2, n): gradients of the objective by position and by rotation, where these have a price


def new_linearisation(n: int, k: int) -> Linearisation:
    """Allocate a linearisation for n unknowns and k limits."""
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
    """Allocate a Hessian for n unknowns and k limits."""
    return Hessian(np.zeros((n, n)), np.zeros(k), np.zeros((2, n)))


@routine
def longest(step: Floats, n: int) -> float:
    """The largest absolute value of the first n entries."""
    most = 0.0
    for j in range(n):
        most = max(most, abs(step[j]))
    return most


@routine
def symmetrise(H: Floats, n: int) -> float:
    """Replace a matrix by the mean of itself and its transpose; the largest entry of its diagonal."""
    largest = 0.0
    for a in range(n):
        largest = max(largest, abs(H[a, a]))
        for b in range(a):
            H[a, b] = H[b, a] = 0.5 * (H[a, b] + H[b, a])
    return largest


@routine
def add_products(place: float, both: float, turn: float, hessian: Hessian, n: int) -> None:
    """Add the products of the two forces, times a factor each."""
    H, forces = hessian.H, hessian.forces
    for a in range(n):
        for b in range(n):
            H[a, b] += place * forces[0, a] * forces[0, b] + turn * forces[1, a] * forces[1, b]
            H[a, b] += both * (forces[0, a] * forces[1, b] + forces[1, a] * forces[0, b])


@routine
def sum_of_multipliers(multipliers: Floats, k: int) -> float:
    """Sum of the first k multipliers."""
    total = 0.0
    for c in range(k):
        total += multipliers[c]
    return total


@routine
def allowed_violation(control: Record, share: float) -> float:
    """Largest violation that is left after a share of the planned step."""
    return max(CLOSED, OPEN * share * control["predicted"])


@routine
def violation(linear: Linearisation) -> float:
    """The largest gap or excess; zero if it counts as closed."""
    return 0.0 if is_closed(linear, CLOSED) else max(linear.totals[0]["gap"], linear.totals[0]["excess"])


@routine
def is_closed(linear: Linearisation, tolerance: float) -> bool:
    """True if loops are closed and limits kept, to a tolerance."""
    return bool(linear.totals[0]["gap"] <= tolerance and linear.totals[0]["excess"] <= tolerance)


@routine
def solve_within(linear: Linearisation, is_feasible: bool, p: QP) -> bool:
    """Solve the programme with factorised H; False if it has no solution.

    Exceeded limits are to be met or, if that has no solution, not to be exceeded any further. The latter goes for all
    limits if the configuration is feasible: excesses are rounding then.
    """
    motions, k = linear.totals[0]["motions"], linear.totals[0]["limits"]
    for c in range(k):
        p.h[c] = min(linear.h[c], 0.0) if is_feasible else linear.h[c] + linear.drift[c]
    if solve_qp(p, motions, k):
        return True
    for c in range(k):
        p.h[c] = min(linear.h[c], 0.0)
    return solve_qp(p, motions, k)


@routine
def solve_subproblem(
    linear: Linearisation, hessian: Hessian, damping: float, largest: float, p: QP
) -> tuple[float, float]:
    """Solve the damped programme for the step, into `p.x`; the predicted reduction of the objective, and the damping.

    If H is not positive definite, curvature across active limits is added first: there is no room to move there. If
    that does not suffice, damping grows. It also grows if rounding keeps a programme from its solution: at a vertex of
    the limits, where some motions have hardly any curvature.
    """
    motions, k = linear.totals[0]["motions"], linear.totals[0]["limits"]
    is_feasible, stiff, is_solved = is_closed(linear, CLOSED), 0.0, False
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
            is_solved = solve_within(linear, is_feasible, p)
            if is_solved:
                break
            damping = max(10.0 * damping, SOLVABLE * largest)
        elif stiff == 0.0:
            stiff = 10.0 * largest
        else:
            damping = max(2.0 * damping, 1e-3 * largest)
    if not is_solved:
        return -math.inf, damping
    predicted = 0.0 if is_feasible else -linear.totals[0]["closing"]
    for a in range(motions):
        predicted -= linear.g[a] * p.x[a]
        for b in range(motions):
            predicted -= 0.5 * p.x[a] * hessian.H[max(a, b), min(a, b)] * p.x[b]
    return predicted, damping


@routine
def square_of(metric: Floats, x: Floats, n: int) -> float:
    """x M x, of the lower triangle of M."""
    total = 0.0
    for a in range(n):
        for b in range(a + 1):
            total += (1.0 if a == b else 2.0) * x[a] * metric[a, b] * x[b]
    return total


@routine
def is_last(linear: Linearisation, other: Linearisation, predicted: float, previous: float) -> bool:
    """True if a step had so small a predicted reduction that no further step is worth taking.

    If it left no violation, the prediction of the next step is extrapolated: it falls by the same factor as the last.
    """
    value = linear.totals[0]["value"]
    if predicted <= LAST * value or (previous <= FINE * value and predicted > CONVERGING * previous):
        return True
    return previous < math.inf and predicted * predicted <= NEXT * value * previous and is_closed(other, CLOSED)


@routine
def merit(linear: Linearisation, weight: float) -> float:
    """The objective plus the weighted violation: an exact penalty, its weight above the sum of all multipliers."""
    return linear.totals[0]["value"] + weight * violation(linear)


@routine
def is_sufficient(linear: Linearisation, actual: float, predicted: float, weight: float) -> bool:
    """True if the actual reduction of a step is sufficient for its predicted reduction."""
    if predicted <= FINE * linear.totals[0]["value"]:
        return actual >= -ROUNDING * linear.totals[0]["value"] - weight * CLOSED
    return actual > SUFFICIENT * predicted


@routine
def note_multipliers(linear: Linearisation, p: QP, hessian: Hessian) -> None:
    """Store the multipliers of a programme by the numbers of the limits."""
    for c in range(len(hessian.multipliers)):
        hessian.multipliers[c] = 0.0
    for c in range(linear.totals[0]["limits"]):
        hessian.multipliers[linear.which[c]] = p.multipliers[c]


@routine
def scale_objective(linear: Linearisation) -> float:
    """Scale the objective, unscaled until now, so that its gradient is of order one; the scale."""
    unit = 1.0 / max(math.sqrt(2.0 * linear.totals[0]["value"]), 1e-12)
    linear.totals[0]["value"] *= unit
    linear.totals[0]["closing"] *= unit
    for a in range(linear.totals[0]["motions"]):
        linear.g[a] *= unit
    return unit


@routine
def begin_descent(linear: Linearisation, hessian: Hessian, control: Record) -> None:
    """Initialise the step control at a feasible configuration."""
    is_warm = control["is_warm"] == 1
    for c in range(len(hessian.multipliers)):
        hessian.multipliers[c] = hessian.multipliers[c] if is_warm else 0.0
    control["damping"] = FIRST_DAMPING * longest(linear.g, linear.totals[0]["motions"]) / LONGEST_STEP
    control["predicted"], control["weight"] = math.inf, 0.0
    control["steps"] = control["is_done"] = control["is_rejected"] = control["is_exact"] = 0


@routine
def is_stuck_infeasible(linear: Linearisation, is_accepted: bool, most_steps: int, control: Record) -> bool:
    """True if no step is accepted at an infeasible configuration."""
    return not is_accepted and not is_closed(linear, NEARLY_CLOSED) and control["steps"] <= most_steps


@routine
def resume(control: Record) -> None:
    """Continue a descent after feasibility was restored."""
    control["predicted"] = math.inf
    control["is_done"] = 0


@routine
def plan_step(linear: Linearisation, hessian: Hessian, control: Record, most_steps: int, p: QP) -> bool:
    """Plan the next step, into `p.x`; False if the descent is over."""
    control["steps"] += 1
    control["predicted_before"] = control["predicted"]
    predicted, damping = solve_subproblem(linear, hessian, control["damping"], control["largest"], p)
    resisted = DAMPED * damping * square_of(linear.metric, p.x, linear.totals[0]["motions"])
    control["is_damped"] = int(max(predicted, 0.0) < resisted)
    multipliers = control["equation_multipliers"] + sum_of_multipliers(p.multipliers, linear.totals[0]["limits"])
    control["weight"] = max(LEAST_WEIGHT, 2.0 * multipliers)
    predicted += control["weight"] * violation(linear)
    control["predicted"], control["damping"] = predicted, damping
    if predicted <= 0.0 or damping > MOST_DAMPING * control["largest"] or control["steps"] > most_steps:
        control["is_done"] = 1
        return False
    note_multipliers(linear, p, hessian)
    return True


@routine
def actual_reduction(linear: Linearisation, other: Linearisation, control: Record) -> float:
    """Reduction of the merit from one configuration to another."""
    weight = control["weight"]
    return merit(linear, weight) - merit(other, weight)


@routine
def needs_correction(linear: Linearisation, other: Linearisation, share: float, control: Record) -> bool:
    """True if a share of the planned step does not reduce the merit enough, and left a violation to correct."""
    predicted = share * control["predicted"]
    actual = actual_reduction(linear, other, control)
    return not is_sufficient(linear, actual, predicted, control["weight"]) and not is_closed(
        other, allowed_violation(control, share)
    )


@routine
def judge_step(linear: Linearisation, other: Linearisation, is_feasible: bool, share: float, control: Record) -> bool:
    """True if a share of the planned step is accepted; updates damping by its actual and predicted reduction."""
    predicted, actual = share * control["predicted"], actual_reduction(linear, other, control)
    is_accepted = is_feasible and is_sufficient(linear, actual, predicted, control["weight"])
    is_damped = is_accepted and control["is_damped"] == 1
    previous = math.inf if is_damped else control["predicted_before"]
    if is_last(linear, other, predicted, previous):
        control["is_done"] = 1
    control["predicted"], control["is_exact"] = (
        predicted,
        int(is_accepted and abs(actual - predicted) < EXACT * predicted),
    )
    damping, largest = control["damping"], control["largest"]
    if not is_accepted:
        control["damping"] = max(4.0 * damping, LEAST_DAMPING * largest)
    elif (actual > GOOD * predicted and control["is_rejected"] == 0) or (
        is_damped and predicted <= FINE * linear.totals[0]["value"]
    ):
        damping *= 0.01 if damping < LARGE_DAMPING * largest and share == 1.0 and control["is_exact"] == 1 else 0.1
        control["damping"] = damping if damping > 1e-8 * largest else 0.0
    control["is_rejected"] = 0 if is_accepted else 1
    return is_accepted


@routine
def is_hopeless(deficit: float, share: float, control: Record) -> bool:
    """True if a search will not come as near as the incumbent, going by its last predicted reduction.

    Parameters
    ----------
    deficit : by how much the objective exceeds the incumbent's.
    share : of the last step taken.
    """
    is_damped = control["damping"] > LARGE_DAMPING * control["largest"]
    return bool(not is_damped and HOPELESS * control["predicted"] < share * deficit)
