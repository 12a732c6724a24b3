"""Multipliers of the limits that hold a configuration where it is."""

from __future__ import annotations

from ..common.arrays import Floats
from ._jit import routine
from .qp import QP, apply_inverse, factorise, solve_qp
from .search_constants import REGULARISATION
from .sqp import Linearisation


@routine
def limit_multipliers(linear: Linearisation, near: float, p: QP, natural_gradients: Floats) -> int:
    """Fill `p.x` with the multipliers of active limits that best balance the gradient of the objective; their number.

    The multipliers m >= 0 minimise |g + G^T m|^2 in the inverse metric; of equally good ones, those with the least sum
    of squares, so that limits with equal gradients share the load. Gradients of active limits are moved to the first
    rows of `linear.G`, times the inverse metric into `natural_gradients`.
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
        apply_inverse(p.factor, motions, linear.G[c], natural_gradients[c])
    for c in range(k):
        p.g[c] = p.h[c] = 0.0
        for a in range(motions):
            p.g[c] += natural_gradients[c, a] * linear.g[a]
        for d in range(k):
            p.H[c, d] = REGULARISATION if c == d else 0.0
            p.G[c, d] = -1.0 if c == d else 0.0
            for a in range(motions):
                p.H[c, d] += linear.G[c, a] * natural_gradients[d, a]
    return k if factorise(p.H, k, 0.0, p.factor) and solve_qp(p, k, k) else 0
