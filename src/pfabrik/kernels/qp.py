"""Small convex quadratic programmes: where a quadratic is least, within linear limits.

The dual active-set method of Goldfarb and Idnani: from the free minimum, violated limits are taken up one after the
other, the worst first, and those that a new one makes needless are dropped again.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..arrays import Floats, Ints
from ._jit import routine

# A limit violated by no more counts as kept, and one that rounding alone violates by no more ends the search; a
# gradient that has no more of its square left beside the active ones depends on them.
KEPT, ROUNDED, DEPENDENT = 1e-14, 1e-9, 1e-12


class QP(NamedTuple):
    """Least x . H x / 2 + g . x with G x + h <= 0, for n unknowns and k limits, and room to solve it."""

    H: Floats  # (n, n)
    g: Floats  # (n,)
    G: Floats  # (k, n)
    h: Floats  # (k,)
    x: Floats  # (n,): the solution
    multipliers: Floats  # (k,): of the limits, >= 0; 0 for those that do not matter
    factor: Floats  # (n, n): Cholesky factor, one over its diagonal there
    pull: Floats  # (n + 1, n): H^-1 times the gradients of the active limits, and of the next, one a row
    system: Floats  # (n + 1, n + 1): Cholesky factor of these times the gradients, one over its diagonal there
    step: Floats  # (n,)
    share: Floats  # (n,)
    active: Ints  # (n,)


def new_qp(n: int, k: int) -> QP:
    """Memory for up to n unknowns and k limits."""
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
    """Cholesky factor of H + damping; False if that is not positive."""
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
def worst_violated(p: QP, n: int, k: int) -> tuple[int, float]:
    """The limit violated most, or -1; and by how much."""
    worst, most = -1, KEPT
    G, x = p.G, p.x
    for c in range(k):
        value = p.h[c]
        for i in range(n):
            value += G[c, i] * x[i]
        if value > most:
            worst, most = c, value
    return worst, most


@routine
def divide(p: QP, n: int, m: int, c: int) -> float:
    """How limit `c` is made of the m active ones (`share`), and the direction that lowers it alone (`step`).

    Returns how fast it falls along that direction; 0 where it depends on the active ones.
    """
    system, pull, step, share = p.system, p.pull, p.step, p.share
    own, rate = put_pull(p, n, m, c)
    for a in range(m - 1, -1, -1):
        value = system[m, a]
        for b in range(a + 1, m):
            value -= system[b, a] * share[b]
        share[a] = value * system[a, a]
    for i in range(n):
        step[i] = pull[m, i]
        for a in range(m):
            step[i] -= share[a] * pull[a, i]
    return rate if m < n and rate > DEPENDENT * own else 0.0


@routine
def put_pull(p: QP, n: int, m: int, c: int) -> tuple[float, float]:
    """Fill the m-th row of `pull` and of `system` with limit `c`; how fast it falls along what its own gradient asks
    for, and how fast with the active ones kept."""
    G, system, pull, active = p.G, p.system, p.pull, p.active
    apply_inverse(p.factor, n, G[c], pull[m])
    own = 0.0
    for i in range(n):
        own += pull[m, i] * G[c, i]
    rate = own
    for a in range(m):
        value = 0.0
        for i in range(n):
            value += pull[m, i] * G[active[a], i]
        for b in range(a):
            value -= system[m, b] * system[a, b]
        system[m, a] = value * system[a, a]
        rate -= system[m, a] * system[m, a]
    system[m, m] = 1.0 / math.sqrt(max(rate, 1e-300))
    return own, rate


@routine
def drop(p: QP, n: int, m: int, a: int) -> None:
    """Take the a-th of m active limits out."""
    p.multipliers[p.active[a]] = 0.0
    for b in range(a, m - 1):
        p.active[b] = p.active[b + 1]
        put_pull(p, n, b, p.active[b])


@routine
def take_up(p: QP, n: int, m: int, c: int, violation: float) -> int:
    """Make limit `c` active; how many are active then, -1 if it contradicts the others."""
    multiplier = 0.0
    for _change in range(4 * n + 4):
        rate = divide(p, n, m, c)
        first, limit = -1, math.inf
        for a in range(m):
            if p.share[a] > 0.0 and p.multipliers[p.active[a]] < limit * p.share[a]:
                first, limit = a, p.multipliers[p.active[a]] / p.share[a]
        full = violation / rate if rate > 0.0 else math.inf
        length = min(limit, full)
        if length == math.inf:
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
        drop(p, n, m, first)
        m -= 1
    return -1


@routine
def solve_qp(p: QP, n: int, k: int) -> bool:
    """Solve a programme whose H is factorised; False where no x keeps all limits."""
    for c in range(k):
        p.multipliers[c] = 0.0
    apply_inverse(p.factor, n, p.g, p.x)
    for i in range(n):
        p.x[i] = -p.x[i]
    m = 0
    for _round in range(4 * (n + k)):
        c, violation = worst_violated(p, n, k)
        if c < 0:
            return True
        m = -1 if p.multipliers[c] > 0.0 else take_up(p, n, m, c, violation)
        if m < 0:
            return violation <= ROUNDED
    return False
