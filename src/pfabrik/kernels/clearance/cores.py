"""The nearest points of two cores: of a box or a disc by its edges, its rims, and its farthest points."""

from __future__ import annotations

import math

from ...arrays import Floats
from .._jit import routine
from ..vectors import Vec, add, along, cross, dot, put, scale, sub, vec
from .hulls import nearest_to_hull
from .segments import between_segments, nearest_along
from .solids import BOX, CAPSULE, DISC, HULL, KIND, A, B, direction_of, farthest_in, nearest_in, square_to

# Places on a rim from which the nearest one is refined, and halvings of the angle between two of them.
RIM, HALVINGS = 32, 60
# Corners of the four edges along one axis of a box.
SIGNS = ((-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0))


@routine
def nearest_points(sizes: Floats, place: Floats, other: Floats, other_place: Floats, points: Floats) -> float:
    """Fill the nearest points of two cores, (2, 3), and return their squared distance; 0 where cores overlap."""
    points[0, 0] = math.inf
    if sizes[KIND] == CAPSULE and other[KIND] == CAPSULE:
        p, q, x, y = vec(place[0]), vec(place[1]), vec(other_place[0]), vec(other_place[1])
        s, t = between_segments(p, q, x, y)
        put(points[0], along(p, s, sub(q, p)))
        put(points[1], along(x, t, sub(y, x)))
        gap = sub(vec(points[1]), vec(points[0]))
        return dot(gap, gap)
    if sizes[KIND] == HULL or other[KIND] == HULL:
        return nearest_to_hull(sizes, place, other, other_place, points)
    least = try_features(sizes, place, other, other_place, points, 0, math.inf)
    return try_features(other, other_place, sizes, place, points, 1, least)


@routine
def try_point(x: Vec, other: Floats, other_place: Floats, points: Floats, at: int, least: float) -> float:
    """Keep a point of one core (row `at`) and the nearest one of the other, where they are nearer than before."""
    y = nearest_in(other, other_place, x)
    gap = sub(y, x)
    square = dot(gap, gap)
    if square < least:
        put(points[at], x)
        put(points[1 - at], y)
        return square
    return least


@routine
def try_line(p: Vec, q: Vec, other: Floats, other_place: Floats, points: Floats, at: int, least: float) -> float:
    """Keep the point of a segment of one core that is nearest to the other."""
    x = along(p, nearest_along(p, q, other, other_place), sub(q, p))
    return try_point(x, other, other_place, points, at, least)


@routine
def try_features(
    sizes: Floats, place: Floats, other: Floats, other_place: Floats, points: Floats, at: int, least: float
) -> float:
    """Keep the nearest of the points of one core at which it may be nearest to another.

    They are on its lines and rims, or farthest along an axis of the other, above a face of it. Of two discs beside
    each other they are on the common perpendicular of their axes.
    """
    centre = vec(place[0])
    if sizes[KIND] == CAPSULE:
        return try_line(centre, vec(place[1]), other, other_place, points, at, least)
    if other[KIND] == CAPSULE:
        return least  # its line is tried against the whole of this core
    for k in range(3):
        axis = direction_of(other, other_place, k)
        if dot(axis, axis) > 0.0:
            for sign in (-1.0, 1.0):
                x = farthest_in(sizes, place, scale(sign, axis))
                least = try_point(x, other, other_place, points, at, least)
    if sizes[KIND] == BOX:
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            half = scale(sizes[A + k], vec(place[1 + k]))
            for signs in SIGNS:
                middle = along(centre, signs[0] * sizes[A + i], vec(place[1 + i]))
                middle = along(middle, signs[1] * sizes[A + j], vec(place[1 + j]))
                least = try_line(sub(middle, half), add(middle, half), other, other_place, points, at, least)
        return least
    half = scale(sizes[B], vec(place[1]))
    least = try_rim(sizes, place, add(centre, half), other, other_place, points, at, least)
    least = try_rim(sizes, place, sub(centre, half), other, other_place, points, at, least)
    if other[KIND] == DISC:
        p, q = sub(centre, half), add(centre, half)
        x = along(p, nearest_along(p, q, other, other_place), sub(q, p))
        x = nearest_in(sizes, place, nearest_in(other, other_place, x))
        least = try_point(x, other, other_place, points, at, least)
    return least


@routine
def try_rim(
    sizes: Floats,
    place: Floats,
    centre: Vec,
    other: Floats,
    other_place: Floats,
    points: Floats,
    at: int,
    least: float,
) -> float:
    """Keep the point of a disc's rim that is nearest to a core: of places all around, refined by the slope's sign."""
    u = square_to(vec(place[1]))
    v = cross(vec(place[1]), u)
    u, v = scale(sizes[A], u), scale(sizes[A], v)
    step = 2.0 * math.pi / RIM
    nearest, middle = math.inf, 0.0
    for k in range(RIM):
        x = add(centre, along(scale(math.cos(k * step), u), math.sin(k * step), v))
        gap = sub(x, nearest_in(other, other_place, x))
        if dot(gap, gap) < nearest:
            nearest, middle = dot(gap, gap), k * step
    low, high = middle - step, middle + step
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        x = add(centre, along(scale(math.cos(middle), u), math.sin(middle), v))
        tangent = along(scale(-math.sin(middle), u), math.cos(middle), v)
        if dot(sub(x, nearest_in(other, other_place, x)), tangent) > 0.0:
            high = middle
        else:
            low = middle
    return try_point(x, other, other_place, points, at, least)
