"""Rods over a cell of poses: their platform ends, proximal coordinates, and lines in the bodies at their ends.

The coordinate of a carriage is in closed form. That of a crank, q, solves |H - E(q)| = l, with E(q) the rod's base end;
Newton's method bounds it closer than its closed form. With v = H - E at the cell's centre,
q_c + sum s_i J_i, J_i = (v . h_i) / (v . E'), solves it to first order. If the rod is shorter than l with q there a
little less, and longer with q a little more (or the other way round), for every pose of the cell, then each pose has a
solution between; as there is one solution only with the same sign, it is that of the same branch. Its reach is then
proved as well. Beside a dead point v . E' is zero; there the two solutions are enclosed, if there are any.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Record
from .._jit import routine
from ..legs.endings import turned, turned_back
from ..legs.records import CARRIAGE, COSINE, CRANK, FROM_BASE, N_VALUES, Q_PROXIMAL, SINE
from ..legs.rods import base_end_of, solve_proximal
from ..vectors import Vec, add, along, cross, dot, norm, put, scale, sub, turn, vec, wrap
from .affine_forms import (
    ABOVE,
    AWAY,
    BELOW,
    BOUNDS,
    CENTRE,
    ERROR,
    combine,
    least,
    most,
    put_across,
    put_along,
    put_bounds,
    put_difference,
    put_fixed,
    put_heading,
    put_length,
    put_moved,
    put_root,
    put_square,
    put_turned,
    put_unknown,
)
from .pose_cells import BEND, CHORD, CURVATURE, ROUNDING, SHIFT, PoseCell, moved_by

# Sine of the angle between rod and lever or rail below which a coordinate is enclosed as beside a dead point: its
# remainder grows with the inverse.
NEAR_DEAD_POINT = 1e-4


class LegBounds(NamedTuple):
    """Scratch memory: forms of one leg over a cell."""

    values: Floats  # (N_VALUES,): the leg at the cell's centre
    end: Floats  # (8, 3): platform end
    span: Floats  # (8, 3): from base end to platform end
    v: Floats  # (8, 3): scratch
    w: Floats  # (8, 3): scratch
    q: Floats  # (9,): proximal coordinate
    length: Floats  # (9,): of the span
    a: Floats  # (9,): scratch
    b: Floats  # (9,): scratch
    c: Floats  # (9,): scratch


def new_bounds() -> LegBounds:
    """Allocate the forms of a leg."""
    vectors, numbers = [np.zeros((8, 3)) for _ in range(4)], [np.zeros(9) for _ in range(5)]
    return LegBounds(np.zeros(N_VALUES), *vectors, *numbers)


@routine
def put_end(leg: Record, reference: Vec, cell: PoseCell, n: int, uncertain: float, end: Floats) -> None:
    """The platform end of a leg, in the body of its base end."""
    pose, sizes, point = cell.pose, cell.sizes, vec(leg["platform_end_point"])
    if leg["frame"] == FROM_BASE:
        put_platform_point(point, reference, cell, n, uncertain, end)
        return
    p = (pose[0, 3], pose[1, 3], pose[2, 3])
    lever = sub(point, p)
    reach = norm(lever)
    for i in range(n):
        put(end[i], scale(-1.0, turned_back(pose, moved_by(cell.motions[i], lever))))
    put(end[CENTRE], add(turned_back(pose, lever), reference))
    error = sizes[CURVATURE] * reach + sizes[CHORD] * sizes[SHIFT] + sizes[BEND]
    away = sizes[SHIFT] + sizes[CHORD] * reach
    rounded = ROUNDING * (norm(p) + norm(point) + norm(reference) + away)
    put_bounds(end, n, error + uncertain + rounded, away + uncertain + rounded)


@routine
def put_platform_point(point: Vec, reference: Vec, cell: PoseCell, n: int, uncertain: float, end: Floats) -> None:
    """A point of the platform, given at home from the reference point."""
    pose, sizes = cell.pose, cell.sizes
    p, lever = (pose[0, 3], pose[1, 3], pose[2, 3]), turn(pose, point)
    reach = norm(lever)
    for i in range(n):
        put(end[i], moved_by(cell.motions[i], lever))
    put(end[CENTRE], add(lever, p))
    error, away = sizes[CURVATURE] * reach + sizes[BEND], sizes[SHIFT] + sizes[CHORD] * reach
    rounded = ROUNDING * (norm(p) + norm(point) + norm(reference) + away)
    put_bounds(end, n, error + uncertain + rounded, away + uncertain + rounded)


@routine
def put_rod(rod: Record, side: float, n: int, uncertain: float, bounds: LegBounds) -> bool:
    """Proximal coordinate and span of a rod from its platform end; False if its reach remains to be proved."""
    is_proved = True
    if rod["proximal"] == CRANK:
        solve_proximal(rod, vec(bounds.end[CENTRE]), side, bounds.values)
        is_proved = put_crank(rod, n, uncertain, bounds)
        if not is_proved:
            enclose_crank(rod, side, n, uncertain, bounds)
    elif rod["proximal"] == CARRIAGE:
        is_proved = put_carriage(rod, side, n, uncertain, bounds)
    put_span(rod, rod, n, bounds)
    if rod["proximal"] == CRANK or rod["proximal"] == CARRIAGE:
        put_unknown(bounds.length, rod["length"] - uncertain, rod["length"] + uncertain)
    return is_proved


@routine
def put_span(rod: Record, owner: Record, n: int, bounds: LegBounds) -> None:
    """Span and length of a rod on the proximal joint of `owner`, whose coordinate is known."""
    put_proximal_point(owner, vec(rod["base_end_point"]), n, 0.0, bounds, bounds.v)
    put_difference(bounds.end, bounds.v, n, bounds.span)
    put_length(bounds.span, n, bounds.length)


@routine
def put_proximal_point(owner: Record, at: Vec, n: int, uncertain: float, bounds: LegBounds, point: Floats) -> None:
    """A point on a leg's crank or carriage, given at home, by its coordinate; without one a point of the base."""
    q, values, axis, centre = bounds.q, bounds.values, vec(owner["proximal_axis"]), vec(owner["proximal_point"])
    put_fixed(at, uncertain + ROUNDING * (1.0 + norm(at) + norm(centre)), n, point)
    error = point[BOUNDS, ERROR]
    if owner["proximal"] == CRANK:
        put_turned(sub(at, centre), axis, values[COSINE], values[SINE], values[Q_PROXIMAL], q, n, point)
        put(point[CENTRE], add(vec(point[CENTRE]), centre))
        put_bounds(point, n, point[BOUNDS, ERROR] + error, point[BOUNDS, AWAY] + error)
    elif owner["proximal"] == CARRIAGE:
        for i in range(n):
            put(point[i], scale(q[i], axis))
        put(point[CENTRE], along(at, q[CENTRE], axis))
        put_bounds(point, n, max(-q[BELOW], q[ABOVE]) + error, math.inf)


@routine
def put_carriage(rod: Record, side: float, n: int, uncertain: float, bounds: LegBounds) -> bool:
    """Coordinate of a carriage, axis . x + side root(l^2 - |part of x across the axis|^2), as `solve_proximal` does.

    False if the root may be zero: `a` is positive where the rod reaches its platform end.
    """
    axis, length, a = vec(rod["proximal_axis"]), rod["length"], bounds.a
    put_moved(bounds.end, vec(rod["base_end_point"]), n, bounds.v)
    put_across(bounds.v, axis, n, bounds.w)
    put_square(bounds.w, n, bounds.b)
    slack = uncertain * (2.0 * length + uncertain)
    put_unknown(a, length * length - slack, length * length + slack)
    combine(a, -1.0, bounds.b, n, a)
    is_proved = put_root(a, (NEAR_DEAD_POINT * length) ** 2, n, bounds.b)
    put_along(bounds.v, axis, n, bounds.c)
    combine(bounds.c, side, bounds.b, n, bounds.q)
    return is_proved


@routine
def put_crank(rod: Record, n: int, uncertain: float, bounds: LegBounds) -> bool:
    """Coordinate of a crank, from that at the cell's centre; False if it is not proved to be that of each pose."""
    end, q = bounds.end, bounds.q
    base_end = base_end_of(rod, rod, bounds.values)
    v, velocity = (
        sub(vec(end[CENTRE]), base_end),
        cross(vec(rod["proximal_axis"]), sub(base_end, vec(rod["proximal_point"]))),
    )
    speed, length = norm(velocity), norm(v)
    D = dot(v, velocity)
    if not abs(D) > NEAR_DEAD_POINT * length * speed:
        return False
    travel, square = 0.0, 0.0
    for i in range(n):
        q[i] = dot(v, vec(end[i])) / D
        travel += abs(q[i])
        put(bounds.span[i], along(vec(end[i]), -q[i], velocity))
        for j in range(i):
            square += 2.0 * abs(dot(vec(bounds.span[i]), vec(bounds.span[j])))
        square += dot(vec(bounds.span[i]), vec(bounds.span[i]))
    linear = math.sqrt(square) * (1.0 + ROUNDING)
    gap = abs(length - rod["length"]) * (length + rod["length"]) + 2.0 * uncertain * (length + uncertain)
    gap += ROUNDING * (1.0 + length + norm(base_end)) ** 2
    error, bent, away = 0.0, 0.0, 0.0
    for step in range(3):
        bent = end[BOUNDS, ERROR] + 0.5 * speed * (travel + error) * (travel + error)
        away = min(end[BOUNDS, AWAY] + speed * travel, linear) + bent + speed * error
        if step < 2:
            error = 0.75 * (gap + 2.0 * length * bent + away * away) / abs(D)
    q[CENTRE], q[BELOW], q[ABOVE] = bounds.values[Q_PROXIMAL], -error, error
    return gap + 2.0 * length * bent + away * away < 1.9 * abs(D) * error and travel + error < 1.0


@routine
def enclose_crank(rod: Record, side: float, n: int, uncertain: float, bounds: LegBounds) -> None:
    """An interval that has the coordinate of a crank at every pose of the cell that its rod reaches."""
    q, a, b = bounds.q, bounds.a, bounds.b
    put_crank_offset(rod, n, bounds)
    put_heading(bounds.w, vec(rod["proximal_axis"]), vec(rod["crank"]), n, a)
    low, high = least(a, n), most(a, n)
    put_length(bounds.w, n, b)
    radius, nearest, farthest = norm(vec(rod["crank"])), least(b, n), most(b, n)
    put_square(bounds.v, n, b)
    shift = 0.5 * (radius * radius - rod["length"] * rod["length"])
    C_low, C_high = 0.5 * least(b, n) + shift, 0.5 * most(b, n) + shift
    if uncertain > 0.0 or not nearest > 0.0 or not low > -math.inf:
        put_unknown(q, -math.inf, math.inf)
        return
    C_low = C_low / (radius * (nearest if C_low < 0.0 else farthest)) - ROUNDING
    C_high = C_high / (radius * (farthest if C_high < 0.0 else nearest)) + ROUNDING
    wide, narrow = math.acos(min(max(C_low, -1.0), 1.0)), math.acos(min(max(C_high, -1.0), 1.0))
    low, high = (low + narrow, high + wide) if side > 0.0 else (low - wide, high - narrow)
    shift = wrap(0.5 * (low + high), bounds.values[Q_PROXIMAL]) - 0.5 * (low + high)
    put_unknown(q, low + shift, high + shift)


@routine
def put_crank_offset(rod: Record, n: int, bounds: LegBounds) -> None:
    """The platform end from the centre of its crank (`v`), and the part of it across the crank's axis (`w`)."""
    put_moved(bounds.end, vec(rod["proximal_point"]), n, bounds.v)
    put_across(bounds.v, vec(rod["proximal_axis"]), n, bounds.w)


@routine
def put_reach_of_crank(rod: Record, n: int, uncertain: float, bounds: LegBounds) -> None:
    """Numbers `a` and `b` that are positive where a rod on a crank reaches its platform end.

    With r the crank's radius, d the distance across its axis and x that from its centre: l^2 - (nearest distance of its
    circle)^2 = 2 r d + l^2 - r^2 - x^2, and the same with (farthest distance)^2 - l^2 = 2 r d - l^2 + r^2 + x^2.
    """
    a, b, length = bounds.a, bounds.b, rod["length"]
    put_crank_offset(rod, n, bounds)
    radius = norm(vec(rod["crank"]))
    put_square(bounds.v, n, bounds.c)
    put_length(bounds.w, n, a)
    for i in range(n):
        a[i] *= 2.0 * radius
    for i in range(CENTRE, ABOVE + 1):
        a[i] *= 2.0 * radius
    shift = length * length - radius * radius
    a[CENTRE] += shift
    combine(a, -1.0, bounds.c, n, b)
    a[CENTRE] -= 2.0 * shift
    combine(a, 1.0, bounds.c, n, a)
    slack = 8.0 * uncertain * (length + radius + uncertain + norm(vec(bounds.v[CENTRE])) + bounds.v[BOUNDS, AWAY])
    for form in (a, b):
        form[BELOW] -= slack
        form[ABOVE] += slack


@routine
def put_base_line(rod: Record, owner: Record, n: int, bounds: LegBounds) -> None:
    """The span in the body at its base end: on a crank, Rot(-q) (H - centre) less the lever at home."""
    line, q, values, point = bounds.v, bounds.q, bounds.values, vec(rod["base_end_point"])
    if owner["proximal"] != CRANK:
        put_moved(bounds.span, (0.0, 0.0, 0.0), n, line)
        return
    axis, cosine, sine, centre = vec(owner["proximal_axis"]), values[COSINE], values[SINE], vec(owner["proximal_point"])
    put_moved(bounds.end, centre, n, bounds.w)
    c = vec(bounds.w[CENTRE])
    aside, linear, still = cross(axis, c), 0.0, max(-q[BELOW], q[ABOVE]) + abs(q[CENTRE] - values[Q_PROXIMAL])
    for i in range(n):
        put(line[i], turned(along(vec(bounds.w[i]), -q[i], aside), axis, cosine, -sine))
        linear += abs(q[i])
    put(line[CENTRE], sub(turned(c, axis, cosine, -sine), sub(point, centre)))
    travel = linear + still
    chord, speed, away = min(travel, 2.0), norm(aside), bounds.w[BOUNDS, AWAY]
    rounded = ROUNDING * (norm(c) + norm(point) + norm(centre))
    error = bounds.w[BOUNDS, ERROR] + chord * away + speed * min(still + 0.5 * travel * travel, chord + linear)
    put_bounds(line, n, error + rounded, away + speed * chord + rounded)


@routine
def put_platform_line(rod: Record, cell: PoseCell, n: int, bounds: LegBounds) -> None:
    """The span in the body at its platform end."""
    span, line, pose, sizes = bounds.span, bounds.v, cell.pose, cell.sizes
    v = vec(span[CENTRE])
    length = norm(v)
    if rod["frame"] != FROM_BASE:  # from the body at the base end, the platform, into the base
        base_v = turn(pose, v)
        put(line[CENTRE], base_v)
        for i in range(n):
            put(line[i], add(turn(pose, vec(span[i])), cross(vec(cell.motions[i, 3:]), base_v)))
    else:
        put(line[CENTRE], turned_back(pose, v))
        for i in range(n):
            put(line[i], turned_back(pose, sub(vec(span[i]), cross(vec(cell.motions[i, 3:]), v))))
    error = span[BOUNDS, ERROR] + sizes[CURVATURE] * length + sizes[CHORD] * span[BOUNDS, AWAY] + ROUNDING * length
    put_bounds(line, n, error, span[BOUNDS, AWAY] + sizes[CHORD] * length + ROUNDING * length)


@routine
def put_direction(frame: int, v: Vec, cell: PoseCell, n: int, w: Floats) -> None:
    """A direction of the body at a leg's platform end, in the body of its base end: R v, or R^T v of a reversed leg."""
    pose, sizes, length = cell.pose, cell.sizes, norm(v)
    is_forward = frame == FROM_BASE
    put(w[CENTRE], turn(pose, v) if is_forward else turned_back(pose, v))
    c = vec(w[CENTRE])
    for i in range(n):
        spin = vec(cell.motions[i, 3:])
        put(w[i], cross(spin, c) if is_forward else scale(-1.0, turned_back(pose, cross(spin, v))))
    rounded = ROUNDING * length
    put_bounds(w, n, sizes[CURVATURE] * length + rounded, sizes[CHORD] * length + rounded)
