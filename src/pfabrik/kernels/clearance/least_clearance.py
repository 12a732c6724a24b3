"""The least distance between links, pose by pose, and how deep links are in each other where they overlap."""

from __future__ import annotations

import math

from ...arrays import Floats, Ints
from .._jit import routine, search
from ..vectors import Vec, add, along, copy_table, cross, dot, norm, put, scale, sub, vec
from .cores import nearest_points
from .hull_overlap import way_out_of_hull
from .solids import BOX, CAPSULE, DISC, HULL, KIND, REACH, ROUND, A, B, C, direction_of, farthest_in, square_to

# Share of the size of coordinates below which two cores count as touching: their direction is rounding.
TOUCHING = 1e-13
# Directions all around that are tried first, and halvings of the angle between two of them [rad].
AROUND, HALVINGS = 64, 40
# First and last step of the search for the direction that parts two discs [rad]: there the overlap is smooth.
FIRST, LAST = 0.3, 1e-8
# Turns of the golden angle spread directions evenly, about an axis and on a sphere [rad].
GOLDEN = 2.399963229728653


@search
def least_clearance(
    sizes: Floats, places: Floats, pairs: Ints, scratch: Floats, clearances: Floats, nearest: Ints, points: Floats
) -> None:
    """Lower the least clearances of poses by those of some pairs of solids, then fill the points of the nearest pairs.

    Parameters
    ----------
    sizes : of every solid, (s, WIDTH) or more [length], as in `solids`.
    places : where they are, (n, s, 4, 3) [length], as in `solids`.
    pairs : two solids each, (k, 2): the first `nearest` may already be among.
    scratch : the first pair to try, (1,), and space for the places of a solid, (3 per place,) behind it.
    clearances, nearest : least clearances so far, infinite at first, and the pairs that have them, -1 at first, (n,).
    points : filled with points on the surfaces of the nearest pair, (n, 2, 3); NaN where there is none.
    """
    first = int(scratch[0])
    moved = scratch[1:].reshape(-1, 3)
    for row in range(places.shape[0]):
        least, which = clearances[row], nearest[row]
        for k in range(first, pairs.shape[0]):
            i, j = pairs[k, 0], pairs[k, 1]
            apart = norm(sub(middle_of(sizes[i], places[row, i]), middle_of(sizes[j], places[row, j])))
            if apart - reach_of(sizes[i], places[row, i]) - reach_of(sizes[j], places[row, j]) >= least:
                continue
            clearance = clearance_of(sizes[i], places[row, i], sizes[j], places[row, j], moved, points[row])
            if clearance < least:
                least, which = clearance, k
        if which >= 0:
            i, j = pairs[which, 0], pairs[which, 1]
            least = clearance_of(sizes[i], places[row, i], sizes[j], places[row, j], moved, points[row])
        else:
            least = math.nan
            for end in range(2):
                put(points[row, end], (math.nan, math.nan, math.nan))
        clearances[row], nearest[row] = least, which


@routine
def middle_of(sizes: Floats, place: Floats) -> Vec:
    """The middle of a solid."""
    centre = vec(place[0])
    return scale(0.5, add(centre, vec(place[1]))) if sizes[KIND] == CAPSULE else centre


@routine
def reach_of(sizes: Floats, place: Floats) -> float:
    """How far a solid reaches from its middle."""
    if sizes[KIND] == CAPSULE:
        return 0.5 * norm(sub(vec(place[1]), vec(place[0]))) + sizes[ROUND]
    if sizes[KIND] == HULL:
        return sizes[REACH] + sizes[ROUND]
    return norm((sizes[A], sizes[B], sizes[C] if sizes[KIND] == BOX else 0.0)) + sizes[ROUND]


@routine
def clearance_of(
    sizes: Floats, place: Floats, other: Floats, other_place: Floats, scratch: Floats, points: Floats
) -> float:
    """Fill the two points (2, 3) on the surfaces of two solids that are nearest, and return their signed distance.

    Where solids overlap it is negative: by so much has one to move, along the line between the two points, until they
    touch, and no other way is shorter.
    """
    square = nearest_points(sizes, place, other, other_place, points)
    x, y = vec(points[0]), vec(points[1])
    if square > TOUCHING * TOUCHING * (dot(x, x) + dot(y, y)):
        between = math.sqrt(square)
        n = scale(1.0 / between, sub(y, x))
    elif square >= 0.0:
        n = way_out(sizes, place, other, other_place)
        between = -overlap_along(n, sizes, place, other, other_place)
        copy_table(other_place, scratch)
        put(scratch[0], along(vec(scratch[0]), -between, n))
        if other[KIND] == CAPSULE:
            put(scratch[1], along(vec(scratch[1]), -between, n))
        nearest_points(sizes, place, other, scratch, points)
        x = vec(points[0])
        y = along(vec(points[1]), between, n)
    else:
        return math.nan
    put(points[0], along(x, sizes[ROUND], n))
    put(points[1], along(y, -other[ROUND], n))
    return between - sizes[ROUND] - other[ROUND]


@routine
def overlap_along(n: Vec, sizes: Floats, place: Floats, other: Floats, other_place: Floats) -> float:
    """By how much the second core has to move along the unit vector n to leave the first."""
    return dot(n, sub(farthest_in(sizes, place, n), farthest_in(other, other_place, scale(-1.0, n))))


@routine
def better(n: Vec, best: Vec, sizes: Floats, place: Floats, other: Floats, other_place: Floats) -> Vec:
    """Of two directions, of any length, the one along which the way out is shorter, either way round."""
    length = norm(n)
    if not length > 1e-9:
        return best
    least = overlap_along(best, sizes, place, other, other_place)
    for sign in (1.0, -1.0):
        unit = scale(sign / length, n)
        overlap = overlap_along(unit, sizes, place, other, other_place)
        if overlap < least:
            least, best = overlap, unit
    return best


@routine
def way_out(sizes: Floats, place: Floats, other: Floats, other_place: Floats) -> Vec:
    """The unit vector along which the second of two overlapping cores has the shortest way out of the first.

    The faces of the difference of two boxes, or of a box and a line, are square to an axis of one or to one of each:
    the shortest way is one of these. With discs the difference is also round: a ball within touches it on a face, or
    square to one of these axes, or, between two rims, where it is curved both ways; never on an edge, which is sharp.
    """
    if sizes[KIND] == HULL or other[KIND] == HULL:
        is_first = sizes[KIND] == HULL
        if is_first:
            best = way_out_of_hull(sizes, place, other, other_place)
        else:
            best = scale(-1.0, way_out_of_hull(other, other_place, sizes, place))
        if sizes[KIND] != DISC and other[KIND] != DISC:
            return best
        axis = direction_of(other, other_place, 0) if is_first else direction_of(sizes, place, 0)
        return better_around(axis, best, sizes, place, other, other_place)
    best = (0.0, 0.0, 1.0)
    for k in range(3):
        axis, of_other = direction_of(sizes, place, k), direction_of(other, other_place, k)
        best = better(axis, best, sizes, place, other, other_place)
        best = better(of_other, best, sizes, place, other, other_place)
        if dot(axis, axis) > 0.0:
            best = better(square_to(axis), best, sizes, place, other, other_place)
        if dot(of_other, of_other) > 0.0:
            best = better(square_to(of_other), best, sizes, place, other, other_place)
        for j in range(3):
            n = cross(axis, direction_of(other, other_place, j))
            best = better(n, best, sizes, place, other, other_place)
    if sizes[KIND] != DISC and other[KIND] != DISC:
        return best
    for k in range(3):
        best = better_around(direction_of(sizes, place, k), best, sizes, place, other, other_place)
        best = better_around(direction_of(other, other_place, k), best, sizes, place, other, other_place)
    if sizes[KIND] != DISC or other[KIND] != DISC:
        return best
    for k in range(AROUND):
        height = (k + 0.5) / AROUND  # half a sphere: each direction is tried both ways
        flat = math.sqrt(1.0 - height * height)
        n = (flat * math.cos(GOLDEN * k), flat * math.sin(GOLDEN * k), height)
        best = better(n, best, sizes, place, other, other_place)
    step = FIRST
    while step > LAST:
        before = best
        for k in range(8):
            u = square_to(best)
            turned = add(scale(math.cos(GOLDEN * k), u), scale(math.sin(GOLDEN * k), cross(best, u)))
            best = better(along(best, step, turned), best, sizes, place, other, other_place)
        if best == before:
            step *= 0.5
    return best


@routine
def better_around(axis: Vec, best: Vec, sizes: Floats, place: Floats, other: Floats, other_place: Floats) -> Vec:
    """The best of all directions square to an axis, and one more: of places all around, refined by halved steps."""
    if not dot(axis, axis) > 0.0:
        return best
    u = square_to(axis)
    v = cross(axis, u)
    least, at, step = math.inf, 0.0, 2.0 * math.pi / AROUND
    for k in range(AROUND + 2 * HALVINGS):
        angle = k * step if k < AROUND else at + step
        overlap = overlap_along(along(scale(math.cos(angle), u), math.sin(angle), v), sizes, place, other, other_place)
        if overlap < least:
            least, at = overlap, angle
        if k >= AROUND:
            step *= -1.0 if (k - AROUND) % 2 == 0 else -0.5
    return better(along(scale(math.cos(at), u), math.sin(at), v), best, sizes, place, other, other_place)
