"""Solids as the kernels see them: a core with a rounding radius, where it is, its nearest and its farthest points.

A solid is a row of sizes, `KIND, ROUND, A, B, C`, and a table of places, (4, 3): of a capsule both ends (a sphere's
coincide); of a box its centre and three unit axes; of a disc, a flat cylinder, its centre and its unit axis; of a hull,
a convex polyhedron, the origin and the axes of its vertices.
The sizes of a box are half its edges, of a disc its radius and half its height. Those of a hull are how many vertices,
faces and edges it has. Behind them come its reach, and what it is made of: three numbers a vertex, three a face, its
unit normal, and four an edge, the indices of its two vertices and of the two faces beside it. Rows of other solids are
as long as those of hulls where there are some.
"""

from __future__ import annotations

import math

from ...arrays import Floats
from .._jit import routine
from ..vectors import Vec, add, along, cross, dot, flatten, norm, scale, sub, vec

CAPSULE, BOX, DISC, HULL = 0, 1, 2, 3
KIND, ROUND, A, B, C, WIDTH = 0, 1, 2, 3, 4, 5
REACH, VERTICES = 5, 6


@routine
def clamp(x: float, low: float, high: float) -> float:
    return min(max(x, low), high)


@routine
def nearest_in(sizes: Floats, place: Floats, x: Vec) -> Vec:
    """The point of a core that is nearest to x: x itself if it is inside."""
    centre = vec(place[0])
    offset = sub(x, centre)
    if sizes[KIND] == CAPSULE:
        line = sub(vec(place[1]), centre)
        square = dot(line, line)
        return along(centre, clamp(dot(offset, line) / square, 0.0, 1.0) if square > 0.0 else 0.0, line)
    if sizes[KIND] == BOX:
        y = centre
        for k in range(3):
            axis = vec(place[1 + k])
            y = along(y, clamp(dot(offset, axis), -sizes[A + k], sizes[A + k]), axis)
        return y
    axis = vec(place[1])
    height = dot(offset, axis)
    flat = along(offset, -height, axis)
    radius = norm(flat)
    flat = scale(sizes[A] / radius, flat) if radius > sizes[A] else flat
    return along(add(centre, flat), clamp(height, -sizes[B], sizes[B]), axis)


@routine
def farthest_in(sizes: Floats, place: Floats, n: Vec) -> Vec:
    """The point of a core that is farthest along n."""
    centre = vec(place[0])
    if sizes[KIND] == CAPSULE:
        end = vec(place[1])
        return end if dot(n, end) > dot(n, centre) else centre
    if sizes[KIND] == BOX:
        y = centre
        for k in range(3):
            axis = vec(place[1 + k])
            y = along(y, sizes[A + k] if dot(n, axis) > 0.0 else -sizes[A + k], axis)
        return y
    if sizes[KIND] == HULL:
        return farthest_vertex(sizes, place, n)
    axis = vec(place[1])
    height = dot(n, axis)
    flat = flatten(flatten(n, axis), axis)  # twice: of n along the axis the first leaves rounding in any direction
    radius = norm(flat)
    y = along(centre, sizes[A] / radius if radius > 0.0 else 0.0, flat)
    return along(y, sizes[B] if height > 0.0 else -sizes[B], axis)


@routine
def farthest_vertex(sizes: Floats, place: Floats, n: Vec) -> Vec:
    """The vertex of a hull that is farthest along n."""
    u, v, w = dot(n, vec(place[1])), dot(n, vec(place[2])), dot(n, vec(place[3]))
    most, first = -math.inf, VERTICES
    for at in range(VERTICES, VERTICES + 3 * int(sizes[A]), 3):
        height = sizes[at] * u + sizes[at + 1] * v + sizes[at + 2] * w
        if height > most:
            most, first = height, at
    return point_of_hull(sizes, place, first)


@routine
def point_of_hull(sizes: Floats, place: Floats, at: int) -> Vec:
    """The point of a hull whose three coordinates begin in a place of its row."""
    return add(vec(place[0]), turned_out(place, vec(sizes[at : at + 3])))


@routine
def turned_out(place: Floats, a: Vec) -> Vec:
    """A vector in the axes of a solid, in base axes."""
    return along(along(scale(a[0], vec(place[1])), a[1], vec(place[2])), a[2], vec(place[3]))


@routine
def turned_in(place: Floats, a: Vec) -> Vec:
    """A vector in base axes, in the axes of a solid."""
    return (dot(a, vec(place[1])), dot(a, vec(place[2])), dot(a, vec(place[3])))


@routine
def direction_of(sizes: Floats, place: Floats, k: int) -> Vec:
    """The k-th of the directions that shape a core, of unit length: of a box 3, a hull none, others 1; zero beyond."""
    if sizes[KIND] == HULL:
        return (0.0, 0.0, 0.0)
    if sizes[KIND] != CAPSULE:
        return vec(place[1 + k]) if k == 0 or sizes[KIND] == BOX else (0.0, 0.0, 0.0)
    line = sub(vec(place[1]), vec(place[0]))
    length = norm(line)
    return scale(1.0 / length, line) if k == 0 and length > 0.0 else (0.0, 0.0, 0.0)


@routine
def square_to(n: Vec) -> Vec:
    """A unit vector square to a unit vector."""
    x, y, z = math.fabs(n[0]), math.fabs(n[1]), math.fabs(n[2])
    axis = (1.0, 0.0, 0.0) if x <= y and x <= z else ((0.0, 1.0, 0.0) if y <= z else (0.0, 0.0, 1.0))
    found = cross(n, axis)
    return scale(1.0 / norm(found), found)
