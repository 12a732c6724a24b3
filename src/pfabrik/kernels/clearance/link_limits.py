"""The clearance of pairs of links as limits of a search: their excess, and what changes it."""

from __future__ import annotations

import math

import numpy as np

from .._jit import allocator, routine
from ..vectors import Vec, dot, put, scale, sub, vec
from .convex import new_polytope
from .distance_constants import MOST_CORNERS
from .least_clearance import clearance_within
from .link_records import LinkLimits
from .solids import CAPSULE, KIND


@allocator
def new_link_limits(limits: LinkLimits) -> LinkLimits:
    """Copy the links, with new memory for their places."""
    has_solids = False
    for i in range(limits.sizes.shape[0]):
        has_solids = has_solids or limits.sizes[i, KIND] != CAPSULE
    places, points, pulls = np.zeros(limits.home.shape), np.zeros((2, 3)), np.zeros((4, 6))
    kept = np.zeros(1, np.int64)
    kept[0] = limits.pairs.shape[0]
    polytope = new_polytope(MOST_CORNERS if has_solids else 0)
    return LinkLimits(
        limits.sizes, limits.home, limits.bodies, limits.pairs, limits.least, places, polytope, points, pulls, kept
    )


@routine
def pair_excess(links: LinkLimits, pair: int, near: float) -> float:
    """By how much two links are nearer than the clearance, negative where they are farther; fills `links.points`.

    Pairs that are surely farther than `near` beyond it are not measured: minus infinity.
    """
    i, j, least = links.pairs[pair, 0], links.pairs[pair, 1], links.least[0]
    one, other = (links.sizes[i], links.places[i]), (links.sizes[j], links.places[j])
    return least - clearance_within(one, other, least + near, links.polytope, links.points)


@routine
def links_excess(links: LinkLimits) -> float:
    """By how much the nearest links are nearer than the clearance, with all placed; -infinity if it is surely kept."""
    excess = -math.inf
    for pair in range(links.pairs.shape[0]):
        excess = max(excess, pair_excess(links, pair, 0.0))
    return excess


@routine
def put_pulls(links: LinkLimits, pair: int, excess: float, factor: float) -> None:
    """Fill `links.pulls` with forces whose power is a factor times the rate of the excess of the pair measured last.

    With n from the first of the nearest points to the second and v their velocities, the distance grows by
    n . (v2 - v1). A link between two bodies has a force at each end, as a lever has; one on a single body has one, at
    its nearest point.
    """
    distance = links.least[0] - excess
    n = scale(1.0 / distance if distance != 0.0 else 0.0, sub(vec(links.points[1]), vec(links.points[0])))
    for end in range(2):
        link, x, force = links.pairs[pair, end], vec(links.points[end]), scale(factor if end == 0 else -factor, n)
        share, pulls = share_of_end(links, link, x), links.pulls[2 * end : 2 * end + 2]
        put(pulls[0], vec(links.places[link, 0]) if links.bodies[link, 0] != links.bodies[link, 1] else x)
        put(pulls[1], vec(links.places[link, 1]))
        put(pulls[0, 3:], scale(1.0 - share, force))
        put(pulls[1, 3:], scale(share, force))


@routine
def share_of_end(links: LinkLimits, link: int, x: Vec) -> float:
    """Coordinate of a point along the axis of a capsule, from 0 to 1; 0 for links that move with one body."""
    if links.bodies[link, 0] == links.bodies[link, 1] or links.sizes[link, KIND] != CAPSULE:
        return 0.0
    start = vec(links.places[link, 0])
    axis = sub(vec(links.places[link, 1]), start)
    square = dot(axis, axis)
    return min(max(dot(sub(x, start), axis) / square, 0.0), 1.0) if square > 0.0 else 0.0
