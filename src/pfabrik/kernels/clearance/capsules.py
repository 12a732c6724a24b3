"""The least distance between capsules and spheres, in closed form: axes against axes, for rows of poses at once."""

from __future__ import annotations

import math

from ...common.arrays import Floats, Ints
from .._jit import inlined, kernel, routine
from ..vectors import Vec, along, cross, dot, norm, put, scale, sub, vec
from .distance_constants import PARALLEL
from .link_records import BASE, PLATFORM
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


@kernel
def place_ends(home: Floats, bodies: Ints, poses: Floats, ends: Floats) -> None:
    """Fill the ends of the axes of capsules that are on the base or the platform.

    Parameters
    ----------
    home : ends of their axes, (s, 2, 3) [length], of a sphere twice the same: of those on the platform from its
        reference point, along its axes.
    bodies : that the ends are on, (s, 2): BASE, PLATFORM or others.
    poses : of the platform, (n, 4, 4) [length].
    ends : ends of the axes, (s, 6, n) [length]; those on other bodies are left.
    """
    for i in range(bodies.shape[0]):
        for e in range(2):
            if bodies[i, e] == PLATFORM or bodies[i, e] == BASE:
                place_end(home[i, e], bodies[i, e], poses, ends[i, 3 * e : 3 * e + 3])


@kernel
def capsule_clearance(rounds: Floats, ends: Floats, pairs: Ints, clearances: Floats, nearest: Floats) -> None:
    """Lower the least clearances of poses by those of pairs of capsules.

    Parameters
    ----------
    rounds : radii, (s,) [length].
    ends : ends of their axes, (s, 6, n) [length], of a sphere twice the same.
    pairs : two capsules each, (k, 2).
    clearances, nearest : least clearances so far, infinite at first, and the places of the pairs that have them, (n,).
    """
    for k in range(pairs.shape[0]):
        one, other, size = ends[pairs[k, 0]], ends[pairs[k, 1]], rounds[pairs[k, 0]] + rounds[pairs[k, 1]]
        for row in range(ends.shape[2]):
            p, q, x, y = end(one, 0, row), end(one, 3, row), end(other, 0, row), end(other, 3, row)
            clearance = between_axes(p, q, x, y) - size
            is_less = clearance < clearances[row]
            clearances[row] = clearance if is_less else clearances[row]
            nearest[row] = k if is_less else nearest[row]


@routine
def place_end(home: Floats, body: int, poses: Floats, end: Floats) -> None:
    """Fill a point of the base or of the platform at all poses, (3, n)."""
    for i in range(3):
        for row in range(poses.shape[0] if body == BASE else 0):
            end[i, row] = home[i]
        for row in range(poses.shape[0] if body == PLATFORM else 0):
            pose = poses[row, i]
            end[i, row] = pose[0] * home[0] + pose[1] * home[1] + pose[2] * home[2] + pose[3]


@inlined
def end(ends: Floats, first: int, row: int) -> Vec:
    return (ends[first, row], ends[first + 1, row], ends[first + 2, row])
