"""Vectors and numbers over a cell of poses: affine in its parameters, with a bound on all that is not.

A vector v over a cell is c + sum s_i l_i + e with |e| <= `ERROR`, and |v - c| <= `AWAY`; an array (8, 3) with l_i in
rows 0 to 5, c in row 6. A number is c + sum s_i l_i + e with e in [`BELOW`, `ABOVE`]; an array (9,). All results
contain the roundings of their own computation, which stay below `ROUNDING` times the magnitude of what enters.
"""

from __future__ import annotations

import math

from ...common.arrays import Floats
from .._jit import routine
from ..legs.endings import turned
from ..vectors import Vec, along, cross, dot, norm, put, scale, sub, vec
from .pose_cells import N_PARAMETERS, ROUNDING

# Of a vector: row of its centre, and the row that holds the two bounds. Of a number: places of centre and bounds.
CENTRE, BOUNDS = 6, 7
ERROR, AWAY = 0, 1
BELOW, ABOVE = 7, 8
# Largest cosine of an angle that counts as regular: nearer to 1 the arc cosine loses its digits.
REGULAR = 1.0 - 1e-9


@routine
def put_bounds(v: Floats, n: int, error: float, away: float) -> None:
    """Set the bounds of a vector: `away` by its linear part if that is less.

    Of the linear part, |sum s_i l_i|^2 is at most the sum of all |l_i . l_j|.
    """
    square = 0.0
    for i in range(n):
        x = vec(v[i])
        square += dot(x, x)
        for j in range(i):
            square += 2.0 * abs(dot(x, vec(v[j])))
    v[BOUNDS, ERROR] = error
    v[BOUNDS, AWAY] = min(away, (math.sqrt(square) + error) * (1.0 + ROUNDING))


@routine
def least(a: Floats, n: int) -> float:
    """Lower bound of a number over its cell."""
    total = a[CENTRE] + a[BELOW]
    for i in range(n):
        total -= abs(a[i])
    return total - ROUNDING * (abs(a[CENTRE]) + abs(total))


@routine
def most(a: Floats, n: int) -> float:
    """Upper bound of a number over its cell."""
    total = a[CENTRE] + a[ABOVE]
    for i in range(n):
        total += abs(a[i])
    return total + ROUNDING * (abs(a[CENTRE]) + abs(total))


@routine
def put_unknown(a: Floats, lowest: float, highest: float) -> None:
    """A number of which only the ends of an interval are known."""
    for i in range(N_PARAMETERS):
        a[i] = 0.0
    a[CENTRE] = 0.0
    a[BELOW], a[ABOVE] = lowest, highest
    if lowest > -math.inf and highest < math.inf:
        a[CENTRE] = 0.5 * (lowest + highest)
        a[ABOVE] = 0.5 * (highest - lowest) + ROUNDING * (abs(lowest) + abs(highest))
        a[BELOW] = -a[ABOVE]


@routine
def put_length(v: Floats, n: int, a: Floats) -> None:
    """|v|. It is convex: |c + d| = |c| + u . d + t, 0 <= t <= |d|^2 / (2 |c|), u = c / |c|."""
    length, away, error = norm(vec(v[CENTRE])), v[BOUNDS, AWAY], v[BOUNDS, ERROR]
    rounded = ROUNDING * (length + away)
    if not away < 0.5 * length:
        put_unknown(a, max(length - away, 0.0) - rounded, length + away + rounded)
        return
    u = scale(1.0 / length, vec(v[CENTRE]))
    for i in range(n):
        a[i] = dot(u, vec(v[i]))
    a[CENTRE], a[BELOW], a[ABOVE] = length, -error - rounded, error + 0.5 * away * away / length + rounded


@routine
def put_square(v: Floats, n: int, a: Floats) -> None:
    """|v|^2 = |c|^2 + 2 c . d + |d|^2."""
    c, away, error = vec(v[CENTRE]), v[BOUNDS, AWAY], v[BOUNDS, ERROR]
    length = norm(c)
    for i in range(n):
        a[i] = 2.0 * dot(c, vec(v[i]))
    slack = 2.0 * length * error + ROUNDING * (length + away) * (length + away)
    a[CENTRE], a[BELOW], a[ABOVE] = length * length, -slack, slack + away * away


@routine
def put_along(v: Floats, axis: Vec, n: int, a: Floats) -> None:
    """axis . v."""
    for i in range(n):
        a[i] = dot(axis, vec(v[i]))
    a[CENTRE] = dot(axis, vec(v[CENTRE]))
    slack = norm(axis) * (v[BOUNDS, ERROR] + ROUNDING * (norm(vec(v[CENTRE])) + v[BOUNDS, AWAY]))
    a[BELOW], a[ABOVE] = -slack, slack


@routine
def put_cosine(v: Floats, axis: Vec, cosine: float, shortest: float, longest: float, n: int, a: Floats) -> None:
    """Cosine of the angle between v and a unit vector, less another one: x / |v|, x = axis . v - cosine |v|.

    By `put_length`, x = (axis - cosine u) . v - cosine t. The bounds are those of |v|.
    """
    c, away = vec(v[CENTRE]), v[BOUNDS, AWAY]
    length = norm(c)
    if not away < math.inf or not shortest > 0.1 * longest or not length > 0.0:
        put_unknown(a, -1.0 - cosine, 1.0 - cosine)
        return
    put_along(v, along(axis, -cosine / length, c), n, a)
    bend = 0.5 * cosine * away * away / length
    a[BELOW], a[ABOVE] = a[BELOW] - max(bend, 0.0), a[ABOVE] - min(bend, 0.0)
    lowest, highest, spread = min(least(a, n), 0.0), max(most(a, n), 0.0), 1.0 / shortest - 1.0 / longest
    for i in range(n):
        a[i] /= longest
    a[CENTRE] /= longest
    a[BELOW] = a[BELOW] / longest + lowest * spread - 4.0 * ROUNDING
    a[ABOVE] = a[ABOVE] / longest + highest * spread + 4.0 * ROUNDING


@routine
def put_heading(v: Floats, axis: Vec, reference: Vec, n: int, a: Floats) -> None:
    """Angle of v about a unit vector, from a reference; components along the axis are ignored.

    In the plane across the axis, log(c + d) - log(c) = d / c - ..., whose error is at most s^2 / (2 (1 - s)), s = |d /
    c|.
    """
    start = along(reference, -dot(axis, reference), axis)
    c = along(vec(v[CENTRE]), -dot(axis, vec(v[CENTRE])), axis)
    distance, away = norm(c), v[BOUNDS, AWAY]
    if not away < 0.5 * distance or not norm(start) > 0.0:
        put_unknown(a, -math.inf, math.inf)
        return
    ahead = scale(1.0 / (distance * distance), cross(axis, c))
    for i in range(n):
        a[i] = dot(ahead, vec(v[i]))
    share = away / distance
    slack = 0.5 * share * share / (1.0 - share) + v[BOUNDS, ERROR] / distance
    slack += ROUNDING * (4.0 + norm(vec(v[CENTRE])) / distance)
    a[CENTRE] = math.atan2(dot(axis, cross(start, c)), dot(start, c))
    a[BELOW], a[ABOVE] = -slack, slack


@routine
def put_root(a: Floats, least_square: float, n: int, b: Floats) -> bool:
    """b = square root of a number; False if that may be below `least_square`, where b is of what is positive.

    The root is concave: above its chords, and below its tangents.
    """
    lowest, highest, c = least(a, n), most(a, n), a[CENTRE]
    if not lowest > least_square:
        rounded = ROUNDING * (1.0 + abs(highest))
        put_unknown(b, math.sqrt(max(lowest, 0.0)) - rounded, math.sqrt(max(highest, 0.0)) + rounded)
        return False
    root = math.sqrt(c)
    slope = 0.5 / root
    for i in range(n):
        b[i] = slope * a[i]
    bend = max(root + slope * (lowest - c) - math.sqrt(lowest), root + slope * (highest - c) - math.sqrt(highest))
    rounded = ROUNDING * (root + slope * (c + highest))
    b[CENTRE], b[BELOW], b[ABOVE] = root, slope * a[BELOW] - bend - rounded, slope * a[ABOVE] + rounded
    return True


@routine
def put_arc_cosine(a: Floats, n: int, b: Floats) -> bool:
    """b = arc cosine of a number; False if that may be beyond -1 or 1, where b is of what lies between them.

    |acos''| = |y| / (1 - y^2)^1.5, which grows with |y|.
    """
    lowest, highest = least(a, n), most(a, n)
    y, farthest = a[CENTRE], max(-lowest, highest)
    if not farthest < REGULAR:
        put_unknown(b, math.acos(min(max(highest, -1.0), 1.0)), math.acos(min(max(lowest, -1.0), 1.0)))
        return False
    slope = -1.0 / math.sqrt(1.0 - y * y)
    for i in range(n):
        b[i] = slope * a[i]
    away = max(highest - y, y - lowest)
    bend = 0.5 * away * away * farthest / (1.0 - farthest * farthest) ** 1.5
    rounded = -ROUNDING * (4.0 + 1.0 / (1.0 - farthest)) * slope
    b[CENTRE] = math.acos(y)
    b[BELOW], b[ABOVE] = slope * a[ABOVE] - bend - rounded, slope * a[BELOW] + bend + rounded
    return True


@routine
def combine(a: Floats, share: float, b: Floats, n: int, c: Floats) -> None:
    """c = a + share b, which may be one of the two."""
    for i in range(n):
        c[i] = a[i] + share * b[i]
    below, above = (b[BELOW], b[ABOVE]) if share >= 0.0 else (b[ABOVE], b[BELOW])
    rounded = ROUNDING * (abs(a[CENTRE]) + abs(share * b[CENTRE]))
    below, above = a[BELOW] + share * below - rounded, a[ABOVE] + share * above + rounded
    c[CENTRE] = a[CENTRE] + share * b[CENTRE]
    c[BELOW], c[ABOVE] = below, above


@routine
def put_across(v: Floats, axis: Vec, n: int, w: Floats) -> None:
    """The part of a vector across a unit vector."""
    for i in range(n):
        x = vec(v[i])
        put(w[i], along(x, -dot(axis, x), axis))
    c = vec(v[CENTRE])
    put(w[CENTRE], along(c, -dot(axis, c), axis))
    put_bounds(w, n, v[BOUNDS, ERROR] + ROUNDING * norm(c), v[BOUNDS, AWAY])


@routine
def put_moved(v: Floats, by: Vec, n: int, w: Floats) -> None:
    """The vector less a fixed one."""
    for i in range(n):
        put(w[i], vec(v[i]))
    c = vec(v[CENTRE])
    put(w[CENTRE], sub(c, by))
    put_bounds(w, n, v[BOUNDS, ERROR] + ROUNDING * (norm(c) + norm(by)), v[BOUNDS, AWAY])


@routine
def put_difference(v: Floats, w: Floats, n: int, x: Floats) -> None:
    """x = v - w."""
    for i in range(n):
        put(x[i], sub(vec(v[i]), vec(w[i])))
    put(x[CENTRE], sub(vec(v[CENTRE]), vec(w[CENTRE])))
    rounded = ROUNDING * (norm(vec(v[CENTRE])) + norm(vec(w[CENTRE])) + v[BOUNDS, AWAY] + w[BOUNDS, AWAY])
    put_bounds(x, n, v[BOUNDS, ERROR] + w[BOUNDS, ERROR] + rounded, v[BOUNDS, AWAY] + w[BOUNDS, AWAY] + rounded)


@routine
def put_fixed(at: Vec, error: float, n: int, v: Floats) -> None:
    """A vector known to an error."""
    for i in range(n):
        put(v[i], (0.0, 0.0, 0.0))
    put(v[CENTRE], at)
    put_bounds(v, n, error, error)


@routine
def put_turned(v: Vec, axis: Vec, cosine: float, sine: float, at: float, q: Floats, n: int, w: Floats) -> None:
    """A fixed vector turned about a unit vector by the number q; cosine and sine are those of `at`, near its centre.

    A chord is at most as long as its arc, and as the diameter.
    """
    c = turned(v, axis, cosine, sine)
    ahead = cross(axis, c)
    speed, linear, unknown = norm(ahead), 0.0, max(-q[BELOW], q[ABOVE]) + abs(q[CENTRE] - at)
    for i in range(n):
        put(w[i], scale(q[i], ahead))
        linear += abs(q[i])
    put(w[CENTRE], c)
    travel = linear + unknown
    chord, rounded = min(travel, 2.0), ROUNDING * norm(v)
    error = min(unknown + 0.5 * travel * travel, chord + linear)
    put_bounds(w, n, speed * error + rounded, speed * chord + rounded)
