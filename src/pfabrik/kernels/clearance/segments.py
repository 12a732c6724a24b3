"""Distances of line segments: from each other in closed form, from convex solids by one root of a rising function."""

from __future__ import annotations

from ...arrays import Floats
from .._jit import inlined, routine
from ..vectors import Vec, along, cross, dot, sub
from .solids import nearest_in

# Most steps to the root: where the slope is smooth about eight suffice, and each four halve the interval at least.
MOST_STEPS = 200


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


@routine
def nearest_along(p: Vec, q: Vec, sizes: Floats, place: Floats) -> float:
    """Parameter in [0, 1] of the point of a segment that is nearest to a convex core.

    Half the squared distance of x(t) = p + t d is convex in t, with the slope (x - nearest(x)) d, which rises: its
    root, between the ends or at one of them, by the false position of Illinois.
    """
    d = sub(q, p)
    low, high = 0.0, 1.0
    at_low = dot(sub(p, nearest_in(sizes, place, p)), d)
    at_high = dot(sub(q, nearest_in(sizes, place, q)), d)
    if at_low >= 0.0:
        return 0.0
    if at_high <= 0.0:
        return 1.0
    t, side = 0.0, 0
    for step in range(MOST_STEPS):
        before = t
        t = high - at_high * (high - low) / (at_high - at_low) if step % 4 < 3 else 0.5 * (low + high)
        x = along(p, t, d)
        slope = dot(sub(x, nearest_in(sizes, place, x)), d)
        if slope == 0.0 or t == before or not low < t < high:
            break
        if slope > 0.0:
            high, at_high = t, slope
            at_low = 0.5 * at_low if side == 1 else at_low
            side = 1
        else:
            low, at_low = t, slope
            at_high = 0.5 * at_high if side == -1 else at_high
            side = -1
    return t
