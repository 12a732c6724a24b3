"""Solids as the kernels see them: a convex core with a rounding radius, where it is, and its farthest points.

A solid is a row of sizes, `KIND, ROUND, A, B, C`, and a table of places, (4, 3): of a capsule both ends (a sphere's
coincide); of a box its centre and three unit axes; of a disc, a flat cylinder, its centre and its unit axis; of a hull,
a convex polyhedron, the origin and the axes of its vertices.
The sizes of a box are half its edges, of a disc its radius and half its height. Those of a hull are how many vertices
it has, and its reach; behind them come three numbers a vertex. Rows of other solids are as long as those of hulls where
there are some.
"""

from __future__ import annotations

import math
from typing import TypeAlias

from ...common.arrays import Floats
from .._jit import routine
from ..vectors import Vec, add, along, cross, dot, flatten, norm, scale, sub, vec
from .distance_constants import ALONG_AXIS

CAPSULE, BOX, DISC, HULL = 0, 1, 2, 3
KIND, ROUND, A, B, C, WIDTH = 0, 1, 2, 3, 4, 5
REACH, VERTICES = B, 5

# Its row of sizes, and its place.
Solid: TypeAlias = tuple[Floats, Floats]


@routine
def farthest_in(solid: Solid, n: Vec) -> Vec:
    """The point of a core that is farthest along n."""
    sizes, place = solid
    centre = vec(place[0])
    if sizes[KIND] == CAPSULE:
        end = vec(place[1])
        return end if dot(n, sub(end, centre)) > 0.0 else centre
    if sizes[KIND] == BOX:
        y = centre
        for k in range(3):
            axis = vec(place[1 + k])
            y = along(y, sizes[A + k] if dot(n, axis) > 0.0 else -sizes[A + k], axis)
        return y
    if sizes[KIND] == HULL:
        u, v, w = dot(n, vec(place[1])), dot(n, vec(place[2])), dot(n, vec(place[3]))
        most, farthest = -math.inf, VERTICES
        for at in range(VERTICES, VERTICES + 3 * int(sizes[A]), 3):
            height = sizes[at] * u + sizes[at + 1] * v + sizes[at + 2] * w
            if height > most:
                most, farthest = height, at
        y = along(along(centre, sizes[farthest], vec(place[1])), sizes[farthest + 1], vec(place[2]))
        return along(y, sizes[farthest + 2], vec(place[3]))
    axis = vec(place[1])
    height = dot(n, axis)
    flat = flatten(flatten(n, axis), axis)  # twice: of n nearly along the axis the first leaves rounding along it
    radius = norm(flat)
    y = along(centre, sizes[A] / radius if radius > ALONG_AXIS * norm(n) else 0.0, flat)
    return along(y, sizes[B] if height > 0.0 else -sizes[B], axis)


@routine
def middle_of(solid: Solid) -> Vec:
    """The middle of a solid."""
    sizes, place = solid
    centre = vec(place[0])
    return scale(0.5, add(centre, vec(place[1]))) if sizes[KIND] == CAPSULE else centre


@routine
def reach_of(solid: Solid) -> float:
    """Largest distance of a solid's points from its middle."""
    sizes, place = solid
    if sizes[KIND] == CAPSULE:
        return 0.5 * norm(sub(vec(place[1]), vec(place[0]))) + sizes[ROUND]
    if sizes[KIND] == HULL:
        return sizes[REACH] + sizes[ROUND]
    return norm((sizes[A], sizes[B], sizes[C] if sizes[KIND] == BOX else 0.0)) + sizes[ROUND]


@routine
def square_to(n: Vec) -> Vec:
    """A unit vector square to a vector."""
    x, y, z = math.fabs(n[0]), math.fabs(n[1]), math.fabs(n[2])
    axis = (1.0, 0.0, 0.0) if x <= y and x <= z else ((0.0, 1.0, 0.0) if y <= z else (0.0, 0.0, 1.0))
    square = cross(n, axis)
    length = norm(square)
    return scale(1.0 / length, square) if length > 0.0 else axis
