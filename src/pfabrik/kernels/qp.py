"""Small convex quadratic programmes: a quadratic minimised within linear limits.

The dual active-set method of Goldfarb and Idnani: starting from the unconstrained minimum, the limit violated most is
made active, and active limits whose multipliers would become negative are dropped.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..common.arrays import Floats, Ints
from ._jit import allocator, routine
from .search_constants import DEPENDENT, KEPT, ROUNDED


class QP(NamedTuple):
    """Minimise x . H x / 2 + g . x subject to G x + h <= 0, for n unknowns and k limits, with scratch memory."""

    H: Floats  # (n, n)
    g: Floats  # (n,)
    G: Floats  # (k, n)
    h: Floats  # (k,)
    x: Floats  # (n,): the solution
    multipliers: Floats  # (k,): of the limits, >= 0; 0 for inactive ones
    factor: Floats  # (n, n): Cholesky factor of H, with the inverse of its diagonal
    pull: Floats  # (n + 1, n): H^-1 times the gradients of the active limits, and of the next one, by rows
    system: Floats  # (n + 1, n + 1): Cholesky factor of G H^-1 G^T of these, with the inverse of its diagonal
    step: Floats  # (n,)
    share: Floats  # (n,): coefficients of a limit in the active ones
    active: Ints  # (n,): indices of the active limits


@allocator
def new_qp(n: int, k: int) -> QP:
    """Allocate a programme of up to n unknowns and k limits."""
    return QP(
        np.zeros((n, n)),
        np.zeros(n),
        np.zeros((k, n)),
        np.zeros(k),
        np.zeros(n),
        np.zeros(k),
        np.zeros((n, n)),
        np.zeros((n + 1, n)),
        np.zeros((n + 1, n + 1)),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n, np.int64),
    )


@routine
def factorise(H: Floats, n: int, damping: float, L: Floats) -> bool:
    """Cholesky factor of H + damping I; False if that is not positive definite."""
    for i in range(n):
        for j in range(i + 1):
            value = H[i, j] + (damping if i == j else 0.0)
            for k in range(j):
                value -= L[i, k] * L[j, k]
            if j < i:
                L[i, j] = value * L[j, j]
            elif value > 0.0:
                L[i, i] = 1.0 / math.sqrt(value)
            else:
                return False
    return True


@routine
def apply_inverse(L: Floats, n: int, b: Floats, x: Floats) -> None:
    """x = H^-1 b."""
    for i in range(n):
        value = b[i]
        for j in range(i):
            value -= L[i, j] * x[j]
        x[i] = value * L[i, i]
    for i in range(n - 1, -1, -1):
        value = x[i]
        for j in range(i + 1, n):
            value -= L[j, i] * x[j]
        x[i] = value * L[i, i]


@routine
def worst_violated(p: QP, n: int, first: int, k: int) -> tuple[int, float]:
    """The limit violated most, of those from the first on, or -1; and its violation."""
    worst, most = -1, KEPT
    G, x = p.G, p.x
    for c in range(first, k):
        value = p.h[c]
        for i in range(n):
            value += G[c, i] * x[i]
        if value > most:
            worst, most = c, value
    return worst, most


@routine
def divide(p: QP, n: int, m: int, c: int) -> float:
    """Decompose limit `c` into the m active ones (`share`) and the direction that lowers it alone (`step`).

    Returns the rate at which it falls along that direction; 0 if it depends on the active ones.
    """
    system, pull, step, share = p.system, p.pull, p.step, p.share
    full_rate, rate = put_pull(p, n, m, c)
    for a in range(m - 1, -1, -1):
        value = system[m, a]
        for b in range(a + 1, m):
            value -= system[b, a] * share[b]
        share[a] = value * system[a, a]
    for i in range(n):
        step[i] = pull[m, i]
        for a in range(m):
            step[i] -= share[a] * pull[a, i]
    return rate if m < n and rate > DEPENDENT * full_rate else 0.0


@routine
def put_pull(p: QP, n: int, m: int, c: int) -> tuple[float, float]:
    """Fill the m-th rows of `pull` and `system` with limit `c`.

    Returns the rates at which it falls along its own natural gradient H^-1 G_c, and with the active ones kept.
    """
    G, system, pull, active = p.G, p.system, p.pull, p.active
    apply_inverse(p.factor, n, G[c], pull[m])
    full_rate = 0.0
    for i in range(n):
        full_rate += pull[m, i] * G[c, i]
    rate = full_rate
    for a in range(m):
        value = 0.0
        for i in range(n):
            value += pull[m, i] * G[active[a], i]
        for b in range(a):
            value -= system[m, b] * system[a, b]
        system[m, a] = value * system[a, a]
        rate -= system[m, a] * system[m, a]
    system[m, m] = 1.0 / math.sqrt(max(rate, 1e-300))
    return full_rate, rate


@routine
def drop(p: QP, n: int, m: int, a: int) -> None:
    """Remove the a-th of m active limits."""
    p.multipliers[p.active[a]] = 0.0
    for b in range(a, m - 1):
        p.active[b] = p.active[b + 1]
        put_pull(p, n, b, p.active[b])


@routine
def take_up(p: QP, n: int, kept: int, m: int, c: int, violation: float) -> int:
    """Make limit `c` active; the number of active limits, or -1 if it contradicts the others.

    Then the multipliers are those of the contradiction, if it is none of rounding: G^T m = 0 and h m > 0. The first
    `kept` active ones are equations, which are never dropped.
    """
    multiplier, is_rounding = 0.0, violation <= ROUNDED
    for _change in range(4 * n + 4):
        rate = divide(p, n, m, c)
        leaving, limit = -1, math.inf
        for a in range(kept, m):
            if p.share[a] > 0.0 and p.multipliers[p.active[a]] < limit * p.share[a]:
                leaving, limit = a, p.multipliers[p.active[a]] / p.share[a]
        full = violation / rate if rate > 0.0 else math.inf
        length = min(limit, full)
        if length == math.inf and is_rounding:
            return -1
        if length == math.inf:
            for a in range(m):
                p.multipliers[p.active[a]] = -p.share[a]
            p.multipliers[c] = 1.0
            return -1
        for a in range(m):
            p.multipliers[p.active[a]] -= length * p.share[a]
        multiplier += length
        if rate > 0.0:
            for i in range(n):
                p.x[i] -= length * p.step[i]
            violation -= length * rate
        if full <= limit:
            p.active[m] = c
            p.multipliers[c] = multiplier
            return m + 1
        drop(p, n, m, leaving)
        m -= 1
    return -1


@routine
def take_up_equation(p: QP, n: int, m: int, c: int) -> int:
    """Make row `c` active as an equation, as m others are; how many are then, as many as before if they imply it."""
    value = p.h[c]
    for i in range(n):
        value += p.G[c, i] * p.x[i]
    if value < 0.0:
        p.h[c] = -p.h[c]
        for i in range(n):
            p.G[c, i] = -p.G[c, i]
    return max(m, take_up(p, n, m, m, c, abs(value)))


@routine
def solve_qp(p: QP, n: int, k: int) -> bool:
    """Solve a programme with factorised H; False if no x keeps all limits."""
    return solve_with_equations(p, n, 0, k)


@routine
def solve_with_equations(p: QP, n: int, equations: int, k: int) -> bool:
    """As `solve_qp`, with G x + h = 0 for the first rows; those that contradict the ones before are left out."""
    for c in range(k):
        p.multipliers[c] = 0.0
    apply_inverse(p.factor, n, p.g, p.x)
    for i in range(n):
        p.x[i] = -p.x[i]
    kept = 0
    for c in range(equations):
        kept = take_up_equation(p, n, kept, c)
    m = kept
    for _round in range(4 * (n + k)):
        c, violation = worst_violated(p, n, equations, k)
        if c < 0:
            return True
        m = -1 if p.multipliers[c] > 0.0 else take_up(p, n, kept, m, c, violation)
        if m < 0:
            return violation <= ROUNDED
    return False
