"""Rods over a cell of poses: their platform ends, their proximal coordinates, their lines.

A proximal coordinate q solves |H - E(q)| = l, with E(q) the rod's base end. With v = H - E at the cell's centre,
q_c + sum s_i J_i, J_i = (v . h_i) / (v . E'), solves it to first order. If the rod is shorter than l with q there a
little less, and longer with q a little more (or the other way round), for every pose of the cell, then each pose has a
solution between; as there is one solution only with the same sign, it is that of the same branch. Its reach is then
proved as well. Beside a dead point v . E' is zero; there the two solutions are enclosed, if there are any.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...arrays import Floats, Record
from .._jit import routine
from ..legs.endings import turned_back
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
    put_heading,
    put_length,
    put_moved,
    put_square,
    put_unknown,
)
from .pose_cells import CHORD, CURVATURE, ROUNDING, SHIFT, PoseCell, moved_by

# Sine of the angle between rod and lever or rail below which a coordinate is enclosed as beside a dead point: its
# remainder grows with the inverse.
NEAR_DEAD_POINT = 1e-4


class LegBounds(NamedTuple):
    """Scratch memory: forms of one leg over a cell."""

    values: Floats  # (N_VALUES,): the leg at the cell's centre
    end: Floats  # (8, 3): platform end
    offset: Floats  # (8, 3): platform end from a point of its proximal joint; scratch
    span: Floats  # (8, 3): from base end to platform end
    line: Floats  # (8, 3): the span, in the body of one of its ends; scratch
    q: Floats  # (9,): proximal coordinate
    a: Floats  # (9,): scratch
    b: Floats  # (9,): scratch
    c: Floats  # (9,): scratch


def new_bounds() -> LegBounds:
    """Allocate the forms of a leg."""
    return LegBounds(
        np.zeros(N_VALUES),
        np.zeros((8, 3)),
        np.zeros((8, 3)),
        np.zeros((8, 3)),
        np.zeros((8, 3)),
        np.zeros(9),
        np.zeros(9),
        np.zeros(9),
        np.zeros(9),
    )


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
    error, away = sizes[CURVATURE] * reach + sizes[CHORD] * sizes[SHIFT], sizes[SHIFT] + sizes[CHORD] * reach
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
    error, away = sizes[CURVATURE] * reach, sizes[SHIFT] + sizes[CHORD] * reach
    rounded = ROUNDING * (norm(p) + norm(point) + norm(reference) + away)
    put_bounds(end, n, error + uncertain + rounded, away + uncertain + rounded)


@routine
def put_rod(rod: Record, side: float, n: int, uncertain: float, bounds: LegBounds) -> bool:
    """Proximal coordinate and span of a rod from its platform end; False if its reach remains to be proved."""
    kind = rod["proximal"]
    if kind != CRANK and kind != CARRIAGE:
        put_moved(bounds.end, vec(rod["base_end_point"]), n, bounds.span)
        return True
    end, q, span = bounds.end, bounds.q, bounds.span
    solve_proximal(rod, vec(end[CENTRE]), side, bounds.values)
    bounds.values[COSINE], bounds.values[SINE] = (
        (bounds.values[COSINE], bounds.values[SINE]) if kind == CRANK else (1.0, 0.0)
    )
    base_end = base_end_of(rod, rod, bounds.values)
    v, velocity = sub(vec(end[CENTRE]), base_end), base_end_velocity(rod, base_end)
    speed, bend, length = norm(velocity), norm(velocity) if kind == CRANK else 0.0, norm(v)
    D = dot(v, velocity)
    q[CENTRE] = bounds.values[Q_PROXIMAL]
    if abs(D) > NEAR_DEAD_POINT * length * speed:
        travel = 0.0
        for i in range(n):
            q[i] = dot(v, vec(end[i])) / D
            travel += abs(q[i])
        gap = abs(length - rod["length"]) * (length + rod["length"]) + 2.0 * uncertain * (length + uncertain)
        gap += ROUNDING * (1.0 + length + norm(base_end)) ** 2
        error = 0.0
        for _ in range(2):
            bent = end[BOUNDS, ERROR] + 0.5 * bend * (travel + error) * (travel + error)
            away = end[BOUNDS, AWAY] + speed * travel + bent + speed * error
            error = 0.75 * (gap + 2.0 * length * bent + away * away) / abs(D)
        bent = end[BOUNDS, ERROR] + 0.5 * bend * (travel + error) * (travel + error)
        away = end[BOUNDS, AWAY] + speed * travel + bent + speed * error
        if gap + 2.0 * length * bent + away * away < 1.9 * abs(D) * error and travel + error < 1.0:
            for i in range(n):
                put(span[i], along(vec(end[i]), -q[i], velocity))
            put(span[CENTRE], v)
            put_bounds(span, n, bent + speed * error, away)
            q[BELOW], q[ABOVE] = -error, error
            return True
    enclose_coordinate(rod, side, n, uncertain, bounds)
    for i in range(n):
        put(span[i], vec(end[i]))
    put(span[CENTRE], v)
    travel = speed * max(abs(least(q, n) - bounds.values[Q_PROXIMAL]), abs(most(q, n) - bounds.values[Q_PROXIMAL]))
    put_bounds(span, n, end[BOUNDS, ERROR] + travel, end[BOUNDS, AWAY] + travel)
    return False


@routine
def base_end_velocity(rod: Record, base_end: Vec) -> Vec:
    """Derivative of a rod's base end by its own proximal coordinate."""
    axis = vec(rod["proximal_axis"])
    if rod["proximal"] == CARRIAGE:
        return axis
    return cross(axis, sub(base_end, vec(rod["proximal_point"])))


@routine
def enclose_coordinate(rod: Record, side: float, n: int, uncertain: float, bounds: LegBounds) -> None:
    """An interval that has the proximal coordinate of every pose of the cell that the rod reaches."""
    q, a, b = bounds.q, bounds.a, bounds.b
    if rod["proximal"] == CARRIAGE:
        axis = vec(rod["proximal_axis"])
        put_moved(bounds.end, vec(rod["base_end_point"]), n, bounds.offset)
        put_across(bounds.offset, axis, n, bounds.line)
        put_length(bounds.line, n, a)
        nearest, length = max(least(a, n), 0.0), rod["length"] + uncertain
        half = math.sqrt(max(length * length - nearest * nearest, 0.0)) + ROUNDING
        put_along(bounds.offset, axis, n, a)
        low, high = least(a, n) - uncertain, most(a, n) + uncertain
        put_unknown(q, low if side > 0.0 else low - half, high + half if side > 0.0 else high)
        return
    put_crank_offset(rod, n, bounds)
    put_heading(bounds.line, vec(rod["proximal_axis"]), vec(rod["crank"]), n, a)
    low, high = least(a, n), most(a, n)
    put_length(bounds.line, n, b)
    radius, nearest, farthest = norm(vec(rod["crank"])), least(b, n), most(b, n)
    put_square(bounds.offset, n, b)
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
    """The platform end from the centre of its crank (`offset`), and the part of it across the crank's axis (`line`)."""
    put_moved(bounds.end, vec(rod["proximal_point"]), n, bounds.offset)
    put_across(bounds.offset, vec(rod["proximal_axis"]), n, bounds.line)


@routine
def put_reach(rod: Record, n: int, uncertain: float, bounds: LegBounds) -> None:
    """Numbers `a` and `b` that are positive where a rod on a proximal joint reaches its platform end.

    A carriage: the rod's length less the distance from the rail. A crank of radius r, with d the distance across its
    axis and x that from its centre: l^2 - (nearest distance of its circle)^2 = 2 r d + l^2 - r^2 - x^2, and the same
    with (farthest distance)^2 - l^2 = 2 r d - l^2 + r^2 + x^2.
    """
    a, b, length = bounds.a, bounds.b, rod["length"]
    if rod["proximal"] == CARRIAGE:
        put_moved(bounds.end, vec(rod["base_end_point"]), n, bounds.offset)
        put_across(bounds.offset, vec(rod["proximal_axis"]), n, bounds.line)
        put_length(bounds.line, n, bounds.c)
        put_unknown(a, length, length)
        combine(a, -1.0, bounds.c, n, a)
        a[BELOW] -= 2.0 * uncertain
        a[ABOVE] += 2.0 * uncertain
        put_unknown(b, 1.0, 1.0)
        return
    put_crank_offset(rod, n, bounds)
    radius = norm(vec(rod["crank"]))
    put_square(bounds.offset, n, bounds.c)
    put_length(bounds.line, n, a)
    for i in range(n):
        a[i] *= 2.0 * radius
    for i in range(CENTRE, ABOVE + 1):
        a[i] *= 2.0 * radius
    shift = length * length - radius * radius
    a[CENTRE] += shift
    combine(a, -1.0, bounds.c, n, b)
    a[CENTRE] -= 2.0 * shift
    combine(a, 1.0, bounds.c, n, a)
    slack = (
        8.0 * uncertain * (length + radius + uncertain + norm(vec(bounds.offset[CENTRE])) + bounds.offset[BOUNDS, AWAY])
    )
    for form in (a, b):
        form[BELOW] -= slack
        form[ABOVE] += slack


@routine
def put_shared_span(rod: Record, owner: Record, n: int, bounds: LegBounds) -> None:
    """The span of a rod on the proximal joint of another, whose coordinate is known."""
    base_end, q, end, span = base_end_of(rod, owner, bounds.values), bounds.q, bounds.end, bounds.span
    axis, travel = vec(owner["proximal_axis"]), q[ABOVE] + abs(q[CENTRE] - bounds.values[Q_PROXIMAL])
    for i in range(n):
        travel += abs(q[i])
    is_crank = owner["proximal"] == CRANK
    velocity = cross(axis, sub(base_end, vec(owner["proximal_point"]))) if is_crank else axis
    speed = norm(velocity)
    for i in range(n):
        put(span[i], along(vec(end[i]), -q[i], velocity))
    put(span[CENTRE], sub(vec(end[CENTRE]), base_end))
    error = end[BOUNDS, ERROR] + speed * (q[ABOVE] + abs(q[CENTRE] - bounds.values[Q_PROXIMAL]))
    error += 0.5 * speed * travel * travel if is_crank else 0.0
    put_bounds(span, n, error + ROUNDING * (1.0 + norm(base_end)), end[BOUNDS, AWAY] + speed * travel)
