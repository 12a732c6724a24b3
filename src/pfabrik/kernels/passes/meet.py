"""Closed-form solution of a branch of two parts: a circle or a line intersects a sphere, or comes nearest to it."""

from __future__ import annotations

import math

from ...common.arrays import Floats, Record
from .._jit import routine
from ..vectors import Vec, add, along, cross, dot, move, norm, put, scale, sub, turn, vec
from .pass_constants import BRACKETS, GOLDEN, NO_LENGTH, SECTIONS
from .passes import reach_backward, reach_forward
from .plan import Configuration, Plan, Settings
from .restrict import clamp_stroke


@routine
def is_two_part(plan: Plan, b: int) -> bool:
    """True for a rod on a rigid crank or on a rail."""
    branch = plan.branches[b]
    first, parts = branch["first"], branch["last"] - branch["first"]
    if branch["rail"] == 1:
        return parts == 1
    node = plan.nodes[first + 1] if parts == 2 else plan.nodes[first]
    return parts == 2 and plan.nodes[first]["hinge"] == 1 and node["lo"] == node["hi"]


@routine
def base_of(plan: Plan, branch: Record, config: Configuration) -> Vec:
    """Position of a branch's first node on its carrier; for a rail, of the rail's point at home."""
    return move(config.carriers[branch["carrier"]], vec(plan.nodes[branch["first"]]["home"]))


@routine
def crank_frame(branch: Record, carrier: Floats) -> tuple[Vec, Vec]:
    """Directions of a crank at home and a quarter turn on."""
    reference = turn(carrier, vec(branch["reference"]))
    return reference, cross(turn(carrier, vec(branch["normal"])), reference)


@routine
def intersection(plan: Plan, b: int, config: Configuration, t: Vec) -> tuple[float, float]:
    """Intersect the circle of a crank, or a rail, with the rod's sphere about `t`.

    Returns c and s: the inner joint is at c - s or c + s. Without an intersection the branch is stretched (s = 0) or
    folded (s = pi; 0 on a rail).
    """
    branch = plan.branches[b]
    rod, v = plan.nodes[branch["last"]], sub(t, base_of(plan, branch, config))
    if branch["rail"] == 1:
        centre = dot(vec(branch["rail_axis"]), v)
        off = norm(along(v, -centre, vec(branch["rail_axis"])))
        r = clamp_stroke(off, rod["lo"], rod["hi"])
        return centre, math.sqrt(max(r * r - off * off, 0.0))
    e, f = crank_frame(branch, config.carriers[branch["carrier"]])
    x, y, square = dot(e, v), dot(f, v), dot(v, v)
    crank, rho = plan.nodes[branch["first"] + 1]["lo"], math.hypot(x, y)
    r = clamp_stroke(math.sqrt(square), rod["lo"], rod["hi"])
    cosine = (crank * crank + square - r * r) / max(2.0 * crank * rho, NO_LENGTH)
    return math.atan2(y, x), math.acos(min(max(cosine, -1.0), 1.0))


@routine
def elbow_sign(plan: Plan, b: int, config: Configuration) -> float:
    """Inverse-kinematics branch of two parts, +1 or -1: the side of the line to the end that the inner node is on."""
    branch = plan.branches[b]
    base = base_of(plan, branch, config)
    inner = sub(vec(config.nodes[branch["last"] - 1]), base)
    end = sub(vec(config.nodes[branch["last"]]), base)
    if branch["rail"] == 1:
        offset = dot(vec(branch["rail_axis"]), sub(inner, end))
    else:
        offset = dot(turn(config.carriers[branch["carrier"]], vec(branch["normal"])), cross(end, inner))
    return 1.0 if offset >= 0.0 else -1.0


@routine
def place_rod(plan: Plan, b: int, config: Configuration, t: Vec, value: float) -> float:
    """Place two parts: the inner joint at a value, the rod towards `t`; return the distance of its end from `t`."""
    branch, nodes = plan.branches[b], config.nodes
    base, inner = base_of(plan, branch, config), branch["last"] - 1
    if branch["rail"] == 1:
        put(nodes[inner], along(base, value, vec(branch["rail_axis"])))
    else:
        e, f = crank_frame(branch, config.carriers[branch["carrier"]])
        direction = add(scale(math.cos(value), e), scale(math.sin(value), f))
        put(nodes[inner], along(base, plan.nodes[inner]["lo"], direction))
    return place_towards(plan, b, config, t)


@routine
def place_towards(plan: Plan, b: int, config: Configuration, t: Vec) -> float:
    """Pass outward with the end aimed at `t`; return the distance of the end from `t`."""
    last = plan.branches[b]["last"]
    put(config.nodes[last], t)
    reach_backward(plan, b, config)
    return norm(sub(vec(config.nodes[last]), t))


@routine
def reach_end(plan: Plan, b: int, config: Configuration, t: Vec, settings: Settings) -> tuple[float, int]:
    """Bring the end of a branch to `t`, or near it, within all limits; return the remaining distance and the passes.

    A strut is placed, two parts are intersected, a longer branch takes passes; for these `t` is the branch's target.
    """
    branch = plan.branches[b]
    if not is_two_part(plan, b):
        if branch["last"] - branch["first"] + branch["rail"] < 2:
            return place_towards(plan, b, config, t), 1
        return reach_end_by_passes(plan, b, config, t, settings)
    sign = elbow_sign(plan, b, config)
    centre, spread = intersection(plan, b, config, t)
    gap = place_rod(plan, b, config, t, centre + sign * spread)
    if gap <= settings.tolerance:
        return gap, 1
    if settings.keep_mode == 0:
        gap = place_rod(plan, b, config, t, centre - sign * spread)
        if gap <= settings.tolerance:
            return gap, 2
    return nearest_end(plan, b, config, t, centre), 1


@routine
def reach_end_by_passes(plan: Plan, b: int, config: Configuration, t: Vec, settings: Settings) -> tuple[float, int]:
    """Run FABRIK's passes on one branch; return the remaining distance and their number."""
    gap = math.inf
    for n in range(settings.max_iterations):
        reach_forward(plan, b, config)
        reach_backward(plan, b, config)
        gap = norm(sub(vec(config.nodes[plan.branches[b]["last"]]), t))
        if gap <= settings.tolerance:
            return gap, n + 1
    return gap, settings.max_iterations


@routine
def nearest_end(plan: Plan, b: int, config: Configuration, t: Vec, centre: float) -> float:
    """Place two parts with their end nearest to `t` within limits: a search over the range of the inner joint."""
    branch = plan.branches[b]
    if branch["rail"] == 1:
        v = sub(t, base_of(plan, branch, config))
        span = min(plan.nodes[branch["last"]]["hi"], 2.0 * plan.length) + norm(v)
        lo, hi = max(branch["rail_lo"], centre - span), min(branch["rail_hi"], centre + span)
    else:
        node = plan.nodes[branch["first"]]
        lo, hi = centre - math.pi, centre + math.pi
        if node["ranged"] == 1 and node["angle_hi"] - node["angle_lo"] < 2.0 * math.pi:
            lo, hi = node["angle_lo"], node["angle_hi"]
    width, best, least = (hi - lo) / BRACKETS, lo, math.inf
    for i in range(BRACKETS + 1):
        gap = place_rod(plan, b, config, t, lo + i * width)
        if gap < least:
            best, least = lo + i * width, gap
    a, z = max(best - width, lo), min(best + width, hi)
    p, q = z - GOLDEN * (z - a), a + GOLDEN * (z - a)
    at_p, at_q = place_rod(plan, b, config, t, p), place_rod(plan, b, config, t, q)
    for _section in range(SECTIONS):
        if at_p < at_q:
            z, q, at_q = q, p, at_p
            p = z - GOLDEN * (z - a)
            at_p = place_rod(plan, b, config, t, p)
        else:
            a, p, at_p = p, q, at_q
            q = a + GOLDEN * (z - a)
            at_q = place_rod(plan, b, config, t, q)
    if min(at_p, at_q) < least:
        best = p if at_p < at_q else q
    return place_rod(plan, b, config, t, best)
