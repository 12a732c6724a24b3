"""The nearest points of two cores of which one is a hull, by the algorithm of Gilbert, Johnson and Keerthi (1988)."""

from __future__ import annotations

import math
from typing import TypeAlias

from ...arrays import Floats
from .._jit import routine
from ..vectors import Vec, add, along, cross, dot, norm, put, scale, sub, vec
from .segments import nearest_along
from .solids import CAPSULE, DISC, KIND, farthest_in, nearest_in

# Corners of a simplex, weights of them: 0 where there is no corner.
Corners: TypeAlias = tuple[Vec, Vec, Vec, Vec]
Weights: TypeAlias = tuple[float, float, float, float]
NOTHING = (0.0, 0.0, 0.0)
NO_WEIGHTS = (0.0, 0.0, 0.0, 0.0)
# Most simplices: of two hulls some ten are needed, beside a rim some thirty.
MOST_SIMPLICES = 200
# Rounding of a coordinate, relative to its size: a gap as small as this tells nothing.
ROUNDING = 4e-16


@routine
def nearest_to_hull(sizes: Floats, place: Floats, other: Floats, other_place: Floats, points: Floats) -> float:
    """Fill the nearest points of two cores, (2, 3), and return their squared distance; 0 where cores overlap.

    Differences y - x of their points are a convex set; v is the one of a simplex in it that is nearest to the origin.
    The point of the set farthest along -v, w, is a new corner, until none is farther: v (v - w) bounds by how much the
    distance |v| can be too large. Corners without a weight make room.
    """
    middle = sub(centre_of(other, other_place), centre_of(sizes, place))
    x, y = farthest_in(sizes, place, middle), farthest_in(other, other_place, scale(-1.0, middle))
    ends, other_ends = (x, NOTHING, NOTHING, NOTHING), (y, NOTHING, NOTHING, NOTHING)
    corners, weights = (sub(y, x), NOTHING, NOTHING, NOTHING), (1.0, 0.0, 0.0, 0.0)
    v = sub(y, x)
    square = dot(v, v)
    for _ in range(MOST_SIMPLICES):
        x, y = farthest_in(sizes, place, v), farthest_in(other, other_place, scale(-1.0, v))
        w = sub(y, x)
        if not dot(v, sub(v, w)) > ROUNDING * math.sqrt(square) * (norm(x) + norm(y)):
            break
        slot = 0
        while slot < 4 and weights[slot] > 0.0:
            slot += 1
        trial = with_corner(corners, slot, w)
        new_weights = nearest_weights(trial, weights, slot)
        new_v = combined(new_weights, trial)
        new_square = dot(new_v, new_v)
        if not new_square < square:
            break
        corners, weights, v, square = trial, new_weights, new_v, new_square
        ends, other_ends = with_corner(ends, slot, x), with_corner(other_ends, slot, y)
        if min(weights) > 0.0:
            square = 0.0  # the origin is within four corners
            break
    put(points[0], combined(weights, ends))
    put(points[1], combined(weights, other_ends))
    if square > 0.0 and sizes[KIND] == DISC:
        return nearest_to_rim(weights, other_ends, sizes, place, points, 1, square)
    if square > 0.0 and other[KIND] == DISC:
        return nearest_to_rim(weights, ends, other, other_place, points, 0, square)
    return square


@routine
def centre_of(sizes: Floats, place: Floats) -> Vec:
    """A point within a core."""
    return scale(0.5, add(vec(place[0]), vec(place[1]))) if sizes[KIND] == CAPSULE else vec(place[0])


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
def nearest_weights(corners: Corners, weights: Weights, new: int) -> Weights:
    """Weights of the point of a simplex that is nearest to the origin, by all of its faces with the new corner."""
    used = 1 << new
    for k in range(4):
        used |= (1 << k) if weights[k] > 0.0 else 0
    best, least = NO_WEIGHTS, math.inf
    for face in range(1, 16):
        if face & ~used or not (face >> new) & 1:
            continue
        found = weights_in_face(corners, face)
        if min(found) < 0.0:
            continue
        v = combined(found, corners)
        square = dot(v, v)
        if square < least or (face == 15 and max(found) > 0.0):
            least, best = square, found
    return best


@routine
def weights_in_face(corners: Corners, face: int) -> Weights:
    """Weights of the point on a face's plane that is nearest to the origin; -1 where it is outside, or the face flat.

    Corners of the face are bits.
    """
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
        return normalised(i, j, k, dot(n, cross(q, r)), dot(n, cross(r, p)), dot(n, cross(p, q)), 0.0)
    s = corners[3]
    volume = dot(sub(q, p), cross(sub(r, p), sub(s, p)))
    sign = 1.0 if volume > 0.0 else -1.0
    first, second = sign * dot(q, cross(r, s)), -sign * dot(p, cross(r, s))
    return normalised(i, j, k, first, second, sign * dot(p, cross(q, s)), -sign * dot(p, cross(q, r)))


@routine
def normalised(i: int, j: int, k: int, a: float, b: float, c: float, d: float) -> Weights:
    """Weights of corners i, j, k and of the last one, in proportion to numbers, to a sum of 1."""
    total = a + b + c + d
    if not total > 0.0 or min(a, b, c, d) < 0.0:
        return (-1.0, -1.0, -1.0, -1.0)
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


@routine
def nearest_to_rim(
    weights: Weights, ends: Corners, disc: Floats, place: Floats, points: Floats, at: int, square: float
) -> float:
    """Make the nearest points of a hull and a disc exact, which simplices beside a rim only approach.

    The corners of the hull are right, so that its nearest point is one of them, on a line of two, or on their plane.
    """
    face = 0
    for i in range(4):
        face |= (1 << i) if weights[i] > 0.0 else 0
        for j in range(i, 4):
            if weights[i] > 0.0 and weights[j] > 0.0:
                x = along(ends[i], nearest_along(ends[i], ends[j], disc, place), sub(ends[j], ends[i]))
                square = keep_nearer(x, nearest_in(disc, place, x), points, at, square)
    if face == 7 or face == 11 or face == 13 or face == 14:
        i, k = 1 if face == 14 else 0, 2 if face == 7 else 3
        p, q, r = ends[i], ends[1 if face == 7 or face == 11 else 2], ends[k]
        n = cross(sub(q, p), sub(r, p))
        length = norm(n)
        if length > 0.0:
            n = scale((1.0 if dot(n, sub(vec(points[1 - at]), p)) > 0.0 else -1.0) / length, n)
            y = farthest_in(disc, place, scale(-1.0, n))
            x = along(y, -dot(n, sub(y, p)), n)
            around = (sub(ends[0], x), sub(ends[1], x), sub(ends[2], x), sub(ends[3], x))
            if min(weights_in_face(around, face)) >= 0.0:
                square = keep_nearer(x, y, points, at, square)
    return square


@routine
def keep_nearer(x: Vec, y: Vec, points: Floats, at: int, square: float) -> float:
    """Keep a point of each core, the first in row `at`, where they are nearer than before."""
    gap = sub(y, x)
    if dot(gap, gap) > square:
        return square
    put(points[at], x)
    put(points[1 - at], y)
    return dot(gap, gap)
