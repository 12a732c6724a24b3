"""Which limits hold a configuration where it is, and how hard."""

from __future__ import annotations

from ..arrays import Floats
from ._jit import routine
from .qp import QP, apply_inverse, factorise, solve_qp
from .sqp import Linearisation

SHARING = 1e-10
"""Weight of the sum of their squares against the balance of multipliers: far below what a limit's gradient counts."""


@routine
def balance(linear: Linearisation, near: float, p: QP, pulls: Floats) -> int:
    """The multipliers, into `p.x`, with which limits that are met hold the linear of the objective; how many are met.

    Of all that balance it as well, those whose squares have the least sum: limits that act as one share what they hold.
    """
    motions, k = linear.totals[0]["motions"], 0
    for c in range(linear.totals[0]["limits"]):
        if linear.h[c] > -near:
            for a in range(motions):
                linear.G[k, a] = linear.G[c, a]
            linear.which[k] = linear.which[c]
            k += 1
    if not factorise(linear.metric, motions, 0.0, p.factor):
        return 0
    for c in range(k):
        apply_inverse(p.factor, motions, linear.G[c], pulls[c])
    for c in range(k):
        p.g[c] = p.h[c] = 0.0
        for a in range(motions):
            p.g[c] += pulls[c, a] * linear.g[a]
        for d in range(k):
            p.H[c, d] = SHARING if c == d else 0.0
            p.G[c, d] = -1.0 if c == d else 0.0
            for a in range(motions):
                p.H[c, d] += linear.G[c, a] * pulls[d, a]
    return k if factorise(p.H, k, 0.0, p.factor) and solve_qp(p, k, k) else 0
