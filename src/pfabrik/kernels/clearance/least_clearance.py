"""The least distance between links, pose by pose, and how deep links are in each other where they overlap."""

from __future__ import annotations

import math

from ...common.arrays import Floats, Ints
from .._jit import routine, search
from ..vectors import Vec, along, norm, put, scale, sub, vec
from .capsules import between_axes, capsule_points, square_to_axes
from .convex import Polytope, nearest_points, new_polytope, way_out
from .distance_constants import MOST_CORNERS, NEAR, TOUCHING
from .simplices import NOTHING
from .solids import CAPSULE, DISC, KIND, ROUND, Solid, middle_of, reach_of


@search
def least_clearance(
    sizes: Floats, places: Floats, pairs: Ints, first: int, clearances: Floats, nearest: Ints, points: Floats
) -> None:
    """Lower the least clearances of poses by those of some pairs of solids, then fill the points of the nearest pairs.

    Parameters
    ----------
    sizes : of every solid, (s, WIDTH) or more [length], as in `solids`.
    places : where they are, (n, s, 4, 3) [length], as in `solids`.
    pairs : two solids each, (k, 2): the first `nearest` may already be among.
    first : the first pair to try.
    clearances, nearest : least clearances so far, infinite at first, and the pairs that have them, -1 at first, (n,).
    points : filled with points on the surfaces of the nearest pair, (n, 2, 3); NaN where there is none.
    """
    polytope = new_polytope(MOST_CORNERS)
    for row in range(places.shape[0]):
        least, which = clearances[row], nearest[row]
        for k in range(first, pairs.shape[0]):
            i, j = pairs[k, 0], pairs[k, 1]
            one, other = (sizes[i], places[row, i]), (sizes[j], places[row, j])
            clearance = clearance_within(one, other, least, polytope, points[row])
            if clearance < least:
                least, which = clearance, k
        if which >= 0:
            i, j = pairs[which, 0], pairs[which, 1]
            one, other = (sizes[i], places[row, i]), (sizes[j], places[row, j])
            least = clearance_of(one, other, polytope, points[row])
        else:
            least = math.nan
            for end in range(2):
                put(points[row, end], (math.nan, math.nan, math.nan))
        clearances[row], nearest[row] = least, which


@routine
def clearance_within(one: Solid, other: Solid, farthest: float, polytope: Polytope, points: Floats) -> float:
    """As `clearance_of`; infinite, and no points, where solids are surely as far apart as `farthest`, or farther."""
    if one[0][KIND] == CAPSULE and other[0][KIND] == CAPSULE:
        distance = between_axes(vec(one[1][0]), vec(one[1][1]), vec(other[1][0]), vec(other[1][1]))
        distance -= one[0][ROUND] + other[0][ROUND]
    else:
        distance = norm(sub(middle_of(one), middle_of(other))) - reach_of(one) - reach_of(other)
    return math.inf if distance >= farthest else clearance_of(one, other, polytope, points)


@routine
def clearance_of(one: Solid, other: Solid, polytope: Polytope, points: Floats) -> float:
    """Fill the two points (2, 3) on the surfaces of two solids that are nearest, and return their signed distance.

    Where solids overlap it is negative: by so much has one to move, along the line between the two points, until they
    touch, and no other way is shorter.
    """
    size = norm(middle_of(one)) + norm(middle_of(other)) + reach_of(one) + reach_of(other)
    if one[0][KIND] == CAPSULE and other[0][KIND] == CAPSULE:
        between = capsule_points(one, other, points)
        n = direction(points, between) if between > TOUCHING * size else square_to_axes(one, other)
    else:
        between, n = nearest_points(one, other, points), NOTHING
        has_rim = one[0][KIND] == DISC or other[0][KIND] == DISC
        if between > (NEAR if has_rim else TOUCHING) * size:
            n = direction(points, between)
        elif between >= 0.0:
            n, between = way_out(one, other, polytope, points)
    if not between < math.inf:
        return math.nan
    put(points[0], along(vec(points[0]), one[0][ROUND], n))
    put(points[1], along(vec(points[1]), -other[0][ROUND], n))
    return between - one[0][ROUND] - other[0][ROUND]


@routine
def direction(points: Floats, distance: float) -> Vec:
    """The unit vector from the first to the second of two points, (2, 3), that are so far apart."""
    return scale(1.0 / distance, sub(vec(points[1]), vec(points[0])))
