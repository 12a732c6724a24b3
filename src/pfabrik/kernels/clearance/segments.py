"""Distances of line segments, the axes of capsules, in closed form."""

from __future__ import annotations

import math

from ...arrays import Floats
from .._jit import inlined, routine
from ..vectors import Vec, along, cross, dot, norm, put, scale, sub, vec
from .distance_constants import PARALLEL
from .solids import Solid, square_to


@inlined
def between_segments(p: Vec, q: Vec, x: Vec, y: Vec) -> tuple[float, float]:
    """Parameters s, t in [0, 1] of the nearest points p + s (q - p) and x + t (y - x) of two segments.

    With d = q - p, e = y - x, w = x - p and n = d x e, the common perpendicular has s = (w x e) n / n^2. Of nearly
    parallel segments that is far more exact than by d^2 e^2 - (d e)^2, from which digits cancel: an error in s then
    moves the points by no more than it moves along both. Clamped s gives t, and clamped t gives s once more
    (Ericson, Real-Time Collision Detection, 5.1.9). Segments may be parallel, or points. Without branches: loops over
    rows vectorise.
    """
    d, e, w = sub(q, p), sub(y, x), sub(x, p)
    n = cross(d, e)
    n2, d2, e2 = dot(n, n), dot(d, d), dot(e, e)
    s = dot(cross(w, e), n) / (n2 if n2 > 0.0 else 1.0)
    s = 0.0 if s < 0.0 else (1.0 if s > 1.0 else s)
    t = (s * dot(d, e) - dot(w, e)) / (e2 if e2 > 0.0 else 1.0)
    t = 0.0 if t < 0.0 else (1.0 if t > 1.0 else t)
    s = (t * dot(d, e) + dot(w, d)) / (d2 if d2 > 0.0 else 1.0)
    s = 0.0 if s < 0.0 else (1.0 if s > 1.0 else s)
    return s, t


@inlined
def between_axes(p: Vec, q: Vec, x: Vec, y: Vec) -> float:
    """The distance of two segments."""
    s, t = between_segments(p, q, x, y)
    u = p[0] + s * (q[0] - p[0]) - x[0] - t * (y[0] - x[0])
    v = p[1] + s * (q[1] - p[1]) - x[1] - t * (y[1] - x[1])
    w = p[2] + s * (q[2] - p[2]) - x[2] - t * (y[2] - x[2])
    return math.sqrt(u * u + v * v + w * w)


@routine
def capsule_points(one: Solid, other: Solid, points: Floats) -> float:
    """Fill the nearest points of the axes of two capsules, (2, 3), and return their distance."""
    p, q, x, y = vec(one[1][0]), vec(one[1][1]), vec(other[1][0]), vec(other[1][1])
    s, t = between_segments(p, q, x, y)
    put(points[0], along(p, s, sub(q, p)))
    put(points[1], along(x, t, sub(y, x)))
    return norm(sub(vec(points[1]), vec(points[0])))


@routine
def square_to_axes(one: Solid, other: Solid) -> Vec:
    """A unit vector square to the axes of two capsules that touch each other: any way out is as short."""
    d, e = sub(vec(one[1][1]), vec(one[1][0])), sub(vec(other[1][1]), vec(other[1][0]))
    n = cross(d, e)
    length = norm(n)
    if length > PARALLEL * norm(d) * norm(e):
        return scale(1.0 / length, n)
    return square_to(d if dot(d, d) > dot(e, e) else e)
