"""The shortest way out of a hull, over all faces of the difference of two cores."""

from __future__ import annotations

import math
from typing import TypeAlias

from ...arrays import Floats
from .._jit import routine
from ..vectors import Vec, add, along, dot, norm, scale, sub, vec
from .solids import (
    BOX,
    DISC,
    HULL,
    KIND,
    VERTICES,
    A,
    B,
    C,
    direction_of,
    farthest_in,
    farthest_vertex,
    point_of_hull,
    turned_in,
    turned_out,
)

# A direction, and how far the second core has to move along it.
Way: TypeAlias = tuple[Vec, float]
# Places on the arc between two faces that are tried first, and halvings of the step between them.
ALONG, HALVINGS = 6, 40


@routine
def way_out_of_hull(sizes: Floats, place: Floats, other: Floats, other_place: Floats) -> Vec:
    """The unit vector along which a core has the shortest way out of a hull that it overlaps.

    Faces of the difference of two polyhedra are faces of one, or of an edge of each; an edge and a direction make one
    where the normals of the edge's two faces point to either side of the direction. With a disc the difference has
    round parts too, of an edge and a rim: there the way out is the shortest on the arc between the two normals.
    """
    way = ((0.0, 0.0, 1.0), math.inf)
    first = VERTICES + 3 * int(sizes[A])
    for at in range(first, first + 3 * int(sizes[B]), 3):
        way = shorter(turned_out(place, vec(sizes[at : at + 3])), way, sizes, place, other, other_place)
    if other[KIND] == HULL:
        first = VERTICES + 3 * int(other[A])
        for at in range(first, first + 3 * int(other[B]), 3):
            n = scale(-1.0, turned_out(other_place, vec(other[at : at + 3])))
            way = shorter(n, way, sizes, place, other, other_place)
        return past_two_edges(way, sizes, place, other, other_place)[0]
    for k in range(3):
        d = direction_of(other, other_place, k)
        if dot(d, d) > 0.0:
            if other[KIND] == BOX or other[KIND] == DISC:
                way = shorter(d, way, sizes, place, other, other_place)
                way = shorter(scale(-1.0, d), way, sizes, place, other, other_place)
            way = past_edges(d, way, sizes, place, other, other_place)
    return past_rim(way, sizes, place, other, other_place)[0] if other[KIND] == DISC else way[0]


@routine
def shorter(n: Vec, way: Way, sizes: Floats, place: Floats, other: Floats, other_place: Floats) -> Way:
    """The shorter of a way and that along a unit vector."""
    length = dot(n, sub(farthest_vertex(sizes, place, n), farthest_in(other, other_place, scale(-1.0, n))))
    return (n, length) if length < way[1] else way


@routine
def first_edge(sizes: Floats) -> int:
    """Where the edges of a hull begin."""
    return VERTICES + 3 * int(sizes[A]) + 3 * int(sizes[B])


@routine
def normal_beside(sizes: Floats, edge: int, side: int) -> Vec:
    """The normal of one of the two faces beside an edge, in the axes of the hull."""
    at = VERTICES + 3 * int(sizes[A]) + 3 * int(sizes[edge + 2 + side])
    return vec(sizes[at : at + 3])


@routine
def vertex_of(sizes: Floats, place: Floats, edge: int, end: int) -> Vec:
    """An end of an edge."""
    return point_of_hull(sizes, place, VERTICES + 3 * int(sizes[edge + end]))


@routine
def past_edges(d: Vec, way: Way, sizes: Floats, place: Floats, other: Floats, other_place: Floats) -> Way:
    """The shorter of a way and those square to a direction and to an edge of a hull."""
    local = turned_in(place, d)
    first = first_edge(sizes)
    for edge in range(first, first + 4 * int(sizes[C]), 4):
        one, two = normal_beside(sizes, edge, 0), normal_beside(sizes, edge, 1)
        s, t = dot(one, local), dot(two, local)
        if s * t < 0.0:
            n = add(scale(math.fabs(t), one), scale(math.fabs(s), two))
            length = norm(n)
            if length > 0.0:
                n = turned_out(place, scale(1.0 / length, n))
                way = shorter(n, way, sizes, place, other, other_place)
    return way


@routine
def past_two_edges(way: Way, sizes: Floats, place: Floats, other: Floats, other_place: Floats) -> Way:
    """The shorter of a way and those square to an edge of each of two hulls."""
    first, first_of_other = first_edge(sizes), first_edge(other)
    for opposite in range(first_of_other, first_of_other + 4 * int(other[C]), 4):
        p, q = vertex_of(other, other_place, opposite, 0), vertex_of(other, other_place, opposite, 1)
        d = turned_in(place, sub(q, p))
        beyond = turned_in(place, turned_out(other_place, normal_beside(other, opposite, 0)))
        beyond_too = turned_in(place, turned_out(other_place, normal_beside(other, opposite, 1)))
        for edge in range(first, first + 4 * int(sizes[C]), 4):
            one, two = normal_beside(sizes, edge, 0), normal_beside(sizes, edge, 1)
            s, t = dot(one, d), dot(two, d)
            if s * t < 0.0:
                n = add(scale(math.fabs(t), one), scale(math.fabs(s), two))
                at, to = VERTICES + 3 * int(sizes[edge]), VERTICES + 3 * int(sizes[edge + 1])
                e = sub(vec(sizes[to : to + 3]), vec(sizes[at : at + 3]))
                length = norm(n)
                is_between = dot(beyond, e) * dot(beyond_too, e) < 0.0 and dot(n, add(beyond, beyond_too)) < 0.0
                if is_between and length > 0.0:
                    n = turned_out(place, scale(1.0 / length, n))
                    way = shorter(n, way, sizes, place, other, other_place)
    return way


@routine
def past_rim(way: Way, sizes: Floats, place: Floats, disc: Floats, disc_place: Floats) -> Way:
    """The shorter of a way and those from an edge of a hull over the rim of a disc."""
    first = first_edge(sizes)
    for edge in range(first, first + 4 * int(sizes[C]), 4):
        one = turned_out(place, normal_beside(sizes, edge, 0))
        two = turned_out(place, normal_beside(sizes, edge, 1))
        p = vertex_of(sizes, place, edge, 0)
        across = sub(two, scale(dot(one, two), one))
        sine = norm(across)
        angle = math.atan2(sine, dot(one, two))
        across = scale(1.0 / sine if sine > 0.0 else 0.0, across)
        reach = norm(sub(p, vec(disc_place[0]))) + disc[A] + disc[B]  # at most so much the way changes per radian
        best, least, step = 0.0, math.inf, angle / ALONG
        for k in range(ALONG + 1 + 2 * HALVINGS):
            t = k * step if k <= ALONG else min(max(best + step, 0.0), angle)
            n = along(scale(math.cos(t), one), math.sin(t), across)
            length = dot(n, sub(p, farthest_in(disc, disc_place, scale(-1.0, n))))
            if length < least:
                best, least = t, length
            if k > ALONG:
                step *= -1.0 if (k - ALONG) % 2 == 1 else -0.5
            elif k == ALONG and not least < way[1] + 0.5 * step * reach:
                break  # all of the arc is longer
        if least < way[1]:
            n = along(scale(math.cos(best), one), math.sin(best), across)
            way = shorter(n, way, sizes, place, disc, disc_place)
    return way
