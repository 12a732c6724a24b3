"""Simplices among the differences y - x of the points of two cores, and their points nearest to the origin."""

from __future__ import annotations

import math
from typing import TypeAlias

from .._jit import routine
from ..vectors import Vec, along, cross, dot, scale, sub

# Corners of a simplex, weights of them: 0 where there is no corner.
Corners: TypeAlias = tuple[Vec, Vec, Vec, Vec]
Weights: TypeAlias = tuple[float, float, float, float]
NOTHING = (0.0, 0.0, 0.0)
NO_WEIGHTS = (0.0, 0.0, 0.0, 0.0)
OUTSIDE = (-1.0, -1.0, -1.0, -1.0)


@routine
def with_corner(corners: Corners, slot: int, x: Vec) -> Corners:
    """Corners with another one in a slot."""
    return (
        x if slot == 0 else corners[0],
        x if slot == 1 else corners[1],
        x if slot == 2 else corners[2],
        x if slot == 3 else corners[3],
    )


@routine
def combined(weights: Weights, corners: Corners) -> Vec:
    """The sum of corners with their weights."""
    v = scale(weights[0], corners[0])
    for k in range(1, 4):
        v = along(v, weights[k], corners[k])
    return v


@routine
def nearest_weights(corners: Corners, used: int, needed: int) -> Weights:
    """Weights of the point of a simplex that is nearest to the origin, by all of its faces with the corners needed.

    Corners are bits, as those of faces.
    """
    best, least = NO_WEIGHTS, math.inf
    for face in range(1, 16):
        if face & ~used or needed & ~face:
            continue
        trial = weights_in_face(corners, face)
        if min(trial) < 0.0:
            continue
        v = combined(trial, corners)
        square = dot(v, v)
        if square < least or (face == 15 and max(trial) > 0.0):
            least, best = square, trial
    return best


@routine
def weights_in_face(corners: Corners, face: int) -> Weights:
    """Weights of the point on a face's plane that is nearest to the origin; -1 where it is outside, or it is flat."""
    i = 0
    while not (face >> i) & 1:
        i += 1
    j = i + 1
    while j < 4 and not (face >> j) & 1:
        j += 1
    k = j + 1
    while k < 4 and not (face >> k) & 1:
        k += 1
    p = corners[i]
    if j > 3:
        return put_weights(i, j, k, 1.0, 0.0, 0.0, 0.0)
    q = corners[j]
    if k > 3:
        d = sub(q, p)
        t = -dot(p, d)
        return normalised(i, j, k, dot(d, d) - t, t, 0.0, 0.0)
    r = corners[k]
    if face != 15:
        n = cross(sub(q, p), sub(r, p))
        weights = normalised(i, j, k, dot(n, moment(q, r)), dot(n, moment(r, p)), dot(n, moment(p, q)), 0.0)
        if weights[i] < 0.0:
            return weights
        v, n2 = combined(weights, corners), dot(n, n)
        b = max(weights[j] - dot(cross(v, sub(r, p)), n) / n2, 0.0)
        c = max(weights[k] - dot(cross(sub(q, p), v), n) / n2, 0.0)
        return put_weights(i, j, k, max(1.0 - b - c, 0.0), b, c, 0.0)
    s = corners[3]
    sign = 1.0 if dot(sub(q, p), cross(sub(r, p), sub(s, p))) > 0.0 else -1.0
    first, second = sign * dot(q, moment(r, s)), -sign * dot(p, moment(r, s))
    return normalised(i, j, k, first, second, sign * dot(p, moment(q, s)), -sign * dot(p, moment(q, r)))


@routine
def moment(p: Vec, q: Vec) -> Vec:
    """p x q, exact too where the two are close to each other."""
    return cross(p, sub(q, p))


@routine
def normalised(i: int, j: int, k: int, a: float, b: float, c: float, d: float) -> Weights:
    """Weights of corners i, j, k and of the last one, in proportion to numbers, to a sum of 1."""
    total = a + b + c + d
    if not total > 0.0 or min(a, b, c, d) < 0.0:
        return OUTSIDE
    return put_weights(i, j, k, a / total, b / total, c / total, d / total)


@routine
def put_weights(i: int, j: int, k: int, a: float, b: float, c: float, d: float) -> Weights:
    """Weights in the order of the slots: a, b, c of slots i, j, k, and d of the last one, where it is none of them."""
    return (
        a if i == 0 else 0.0,
        a if i == 1 else (b if j == 1 else 0.0),
        a if i == 2 else (b if j == 2 else (c if k == 2 else 0.0)),
        a if i == 3 else (b if j == 3 else (c if k == 3 else d)),
    )
