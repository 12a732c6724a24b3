"""The least distance between capsules and spheres: axes against axes, in closed form, for rows of poses at once."""

from __future__ import annotations

import math

from ...arrays import Floats, Ints
from .._jit import inlined, kernel
from ..vectors import Vec
from .segments import between_segments


@kernel
def capsule_clearance(rounds: Floats, ends: Floats, pairs: Ints, clearances: Floats, nearest: Floats) -> None:
    """Lower the least clearances of poses by those of pairs of capsules.

    Parameters
    ----------
    rounds : radii, (s,) [length].
    ends : ends of their axes, (s, 6, n) [length], of a sphere twice the same.
    pairs : two capsules each, (k, 2).
    clearances, nearest : least clearances so far, infinite at first, and the places of the pairs that have them, (n,).
    """
    for k in range(pairs.shape[0]):
        one, other, size = ends[pairs[k, 0]], ends[pairs[k, 1]], rounds[pairs[k, 0]] + rounds[pairs[k, 1]]
        for row in range(ends.shape[2]):
            p, q, x, y = end(one, 0, row), end(one, 3, row), end(other, 0, row), end(other, 3, row)
            clearance = between_axes(p, q, x, y) - size
            is_less = clearance < clearances[row]
            clearances[row] = clearance if is_less else clearances[row]
            nearest[row] = k if is_less else nearest[row]


@inlined
def end(ends: Floats, first: int, row: int) -> Vec:
    return (ends[first, row], ends[first + 1, row], ends[first + 2, row])


@inlined
def between_axes(p: Vec, q: Vec, x: Vec, y: Vec) -> float:
    """The distance of two segments."""
    s, t = between_segments(p, q, x, y)
    u = p[0] + s * (q[0] - p[0]) - x[0] - t * (y[0] - x[0])
    v = p[1] + s * (q[1] - p[1]) - x[1] - t * (y[1] - x[1])
    w = p[2] + s * (q[2] - p[2]) - x[2] - t * (y[2] - x[2])
    return math.sqrt(u * u + v * v + w * w)
