"""The distance of two convex cores and their nearest points, by their farthest points alone.

Differences y - x of their points are a convex set: its point nearest to the origin is the shortest way from the first
core to the second (Gilbert, Johnson and Keerthi, 1988); where the origin is within, the nearest point of its boundary
is the shortest way out (van den Bergen, 2001).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints
from .._jit import allocator, routine
from ..vectors import Vec, along, cross, dot, flatten, norm, put, scale, sub, vec
from .distance_constants import CLOSE, FLAT, MOST_SIMPLICES, MOST_STALLED, ROUNDING
from .simplices import NOTHING, Weights, combined, nearest_weights, with_corner
from .solids import DISC, KIND, Solid, farthest_in, middle_of, square_to


class Polytope(NamedTuple):
    """A polytope within the differences of two cores: triangles around the origin; memory of `way_out`."""

    corners: Floats  # (c, 6): differences, and the points of the first core that they are from
    planes: Floats  # (2 c, 4): the unit normal of each triangle, outward, and its distance from the origin
    triangles: Ints  # (2 c, 3): their corners
    edges: Ints  # (3 c, 2): around the triangles that a new corner is beyond


@allocator
def new_polytope(most_corners: int) -> Polytope:
    """Memory for a polytope of so many corners."""
    faces = 2 * most_corners
    corners, planes = np.zeros((most_corners, 6)), np.zeros((faces, 4))
    return Polytope(corners, planes, np.zeros((faces, 3), np.int64), np.zeros((3 * most_corners, 2), np.int64))


@routine
def nearest_points(one: Solid, other: Solid, points: Floats) -> float:
    """Fill the nearest points of two cores, (2, 3), and return their distance; 0 where cores overlap.

    v is the point of a simplex in the differences that is nearest to the origin. The difference farthest along -v, w,
    is a new corner, until none is farther: v (v - w) / |v| bounds the error of the distance |v|. Corners without a
    weight make room.
    """
    middle = sub(middle_of(other), middle_of(one))
    x, y = farthest_in(one, middle), farthest_in(other, scale(-1.0, middle))
    v = sub(y, x)
    starts, ends = (x, NOTHING, NOTHING, NOTHING), (y, NOTHING, NOTHING, NOTHING)
    corners, weights = (v, NOTHING, NOTHING, NOTHING), (1.0, 0.0, 0.0, 0.0)
    square, n_stalled = dot(v, v), 0
    for _ in range(MOST_SIMPLICES):
        x, y = farthest_in(one, v), farthest_in(other, scale(-1.0, v))
        w = sub(y, x)
        if not dot(v, sub(v, w)) > ROUNDING * math.sqrt(square) * (norm(x) + norm(y)):
            break
        slot = 0
        while slot < 4 and weights[slot] > 0.0:
            slot += 1
        trial, new = with_corner(corners, slot, w), 1 << slot
        new_weights = nearest_weights(trial, bits_of(weights) | new, new)
        new_v = combined(new_weights, trial)
        new_square = dot(new_v, new_v)
        n_stalled += 0 if new_square < square else 1
        if n_stalled > MOST_STALLED or not new_square <= square * (1.0 + ROUNDING):
            break
        corners, weights, v, square = trial, new_weights, new_v, new_square
        starts, ends = with_corner(starts, slot, x), with_corner(ends, slot, y)
        if min(weights) > 0.0:
            return 0.0  # the origin is within four corners
    put(points[0], combined(weights, starts))
    put(points[1], combined(weights, ends))
    return math.sqrt(square)


@routine
def bits_of(weights: Weights) -> int:
    """The corners with a weight, as bits."""
    used = 0
    for k in range(4):
        used |= (1 << k) if weights[k] > 0.0 else 0
    return used


@routine
def way_out(one: Solid, other: Solid, polytope: Polytope, points: Floats) -> tuple[Vec, float]:
    """The unit vector from the first of two overlapping cores to the second, and their distance, which is negative.

    So far has one to move until they touch, and no way is shorter. The polytope grows where it is nearest to the
    origin, by the difference farthest along the normal n there, until that is no farther than the face: so long is the
    way out along n. Fills the points of both cores that touch then, (2, 3).
    """
    size, n_faces = put_tetrahedron(one, other, polytope), 4
    planes, way, least = polytope.planes, NOTHING, math.inf
    for new in range(4, polytope.corners.shape[0]):
        nearest = 0
        for face in range(1, n_faces):
            nearest = face if planes[face, 3] < planes[nearest, 3] else nearest
        n = vec(planes[nearest])
        length = dot(n, put_corner(one, other, n, polytope, new))
        is_last = length - planes[nearest, 3] <= CLOSE * size
        if length < least or is_last:
            way, least = n, length
            put_point(polytope, n_faces, planes[nearest, 3] + CLOSE * size, points)
        if is_last:
            break
        n_faces = put_beyond(polytope, n_faces, nearest, new, FLAT * size)
        if n_faces == 0:
            break
    for solid in (one, other):  # all around a disc ways may be as long: the polytope has them only nearly square to it
        flat = flatten(way, vec(solid[1][1]))
        if solid[0][KIND] == DISC and norm(flat) > 0.5:
            n = scale(1.0 / norm(flat), flat)
            length = dot(n, sub(farthest_in(other, n), farthest_in(one, scale(-1.0, n))))
            way, least = n if length < least else way, min(length, least)
    way = scale(-1.0, way)
    put(points[1], along(vec(points[0]), -least, way))
    return way, -least


@routine
def put_corner(one: Solid, other: Solid, n: Vec, polytope: Polytope, at: int) -> Vec:
    """Fill a corner with the difference that is farthest along n; the corner."""
    x, y = farthest_in(one, scale(-1.0, n)), farthest_in(other, n)
    put(polytope.corners[at], sub(y, x))
    put(polytope.corners[at, 3:], x)
    return sub(y, x)


@routine
def put_tetrahedron(one: Solid, other: Solid, polytope: Polytope) -> float:
    """Fill four corners, each the farthest from those before, and their triangles; the longest edge of the first."""
    p = put_corner(one, other, (1.0, 0.0, 0.0), polytope, 0)
    q = put_corner(one, other, (-1.0, 0.0, 0.0), polytope, 1)
    r = put_farther(one, other, square_to(sub(q, p)), p, polytope, 2)
    n = cross(sub(q, p), sub(r, p))
    s = put_farther(one, other, scale(1.0 / norm(n), n), p, polytope, 3)
    is_turned = dot(n, sub(s, p)) > 0.0
    for face in range(4):
        i, j, k = (face + 1) % 4, (face + 2) % 4, (face + 3) % 4
        is_even = (face % 2 == 0) == is_turned
        put_triangle(polytope, face, i, j if is_even else k, k if is_even else j)
    return norm(sub(q, p)) + norm(sub(r, p)) + norm(sub(s, p))


@routine
def put_farther(one: Solid, other: Solid, n: Vec, p: Vec, polytope: Polytope, at: int) -> Vec:
    """Fill a corner with the difference that is farthest from p along n, either way round; the corner."""
    w = put_corner(one, other, n, polytope, at)
    ahead = dot(n, sub(w, p))
    w = put_corner(one, other, scale(-1.0, n), polytope, at)
    return put_corner(one, other, n, polytope, at) if ahead > -dot(n, sub(w, p)) else w


@routine
def put_triangle(polytope: Polytope, face: int, i: int, j: int, k: int) -> None:
    """Fill a triangle of three corners, counter-clockwise from outside, and its plane."""
    corners, triangle = polytope.corners, polytope.triangles[face]
    triangle[0], triangle[1], triangle[2] = i, j, k
    p = vec(corners[i])
    n = cross(sub(vec(corners[j]), p), sub(vec(corners[k]), p))
    length = norm(n)
    n = scale(1.0 / length if length > 0.0 else 0.0, n)
    put(polytope.planes[face], n)
    polytope.planes[face, 3] = dot(n, p) if length > 0.0 else math.inf


@routine
def put_beyond(polytope: Polytope, n_faces: int, nearest: int, new: int, beyond: float) -> int:
    """Replace the triangles that a new corner is beyond, the nearest first, by those from the edges around them.

    Returns how many there are then, 2 c - 4 of c corners; 0 where rounding leaves no such polytope.
    """
    planes, edges = polytope.planes, polytope.edges
    w, n_edges, is_changed = vec(polytope.corners[new]), 0, True
    for k in range(3):
        edges[k, 0], edges[k, 1] = polytope.triangles[nearest, k], polytope.triangles[nearest, (k + 1) % 3]
    n_edges, n_faces = 3, without_face(polytope, n_faces, nearest)
    while is_changed:
        is_changed, face = False, 0
        while face < n_faces:
            if dot(vec(planes[face]), w) - planes[face, 3] > beyond and is_beside(polytope, face, n_edges):
                for k in range(3):
                    triangle = polytope.triangles[face]
                    n_edges = with_edge(edges, n_edges, triangle[k], triangle[(k + 1) % 3])
                n_faces, is_changed = without_face(polytope, n_faces, face), True
            else:
                face += 1
    if n_faces + n_edges != 2 * (new + 1) - 4:
        return 0
    for edge in range(n_edges):
        put_triangle(polytope, n_faces + edge, edges[edge, 0], edges[edge, 1], new)
    return n_faces + n_edges


@routine
def without_face(polytope: Polytope, n_faces: int, face: int) -> int:
    """Put the last triangle in the place of another; how many are left."""
    for k in range(3):
        polytope.triangles[face, k] = polytope.triangles[n_faces - 1, k]
    for k in range(4):
        polytope.planes[face, k] = polytope.planes[n_faces - 1, k]
    return n_faces - 1


@routine
def is_beside(polytope: Polytope, face: int, n_edges: int) -> bool:
    """True if a triangle has one of some edges, the other way round."""
    triangle = polytope.triangles[face]
    for edge in range(n_edges):
        start, end = polytope.edges[edge, 1], polytope.edges[edge, 0]
        for k in range(3):
            if triangle[k] == start and triangle[(k + 1) % 3] == end:
                return True
    return False


@routine
def with_edge(edges: Ints, n_edges: int, start: int, end: int) -> int:
    """Add an edge, or take it away where it is there the other way round: it is inside then; how many there are."""
    for edge in range(n_edges):
        if edges[edge, 0] == end and edges[edge, 1] == start:
            edges[edge, 0], edges[edge, 1] = edges[n_edges - 1, 0], edges[n_edges - 1, 1]
            return n_edges - 1
    edges[n_edges, 0], edges[n_edges, 1] = start, end
    return n_edges + 1


@routine
def put_point(polytope: Polytope, n_faces: int, farthest: float, points: Floats) -> None:
    """Fill the first core's point for the point nearest to the origin of the triangles whose planes are nearest."""
    corners, least = polytope.corners, math.inf
    for face in range(n_faces):
        if polytope.planes[face, 3] <= farthest:
            triangle = polytope.triangles[face]
            p, q, r = corners[triangle[0]], corners[triangle[1]], corners[triangle[2]]
            differences = (vec(p), vec(q), vec(r), NOTHING)
            weights = nearest_weights(differences, 7, 0)
            v = combined(weights, differences)
            if dot(v, v) < least:
                least = dot(v, v)
                put(points[0], combined(weights, (vec(p[3:]), vec(q[3:]), vec(r[3:]), NOTHING)))
