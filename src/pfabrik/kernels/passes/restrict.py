"""Clamps of segments to strokes, hinge ranges and cones."""

from __future__ import annotations

import math

from ...arrays import Floats, Record, Records
from .._jit import inlined, routine
from ..vectors import (
    Vec,
    add,
    angle_about,
    angle_between,
    cross,
    dot,
    flatten,
    norm,
    rotate,
    scale,
    sub,
    turn,
    vec,
    wrap,
    wrap_into,
)
from .pass_constants import LEAST_SHARE, NO_LENGTH, NO_SIDE, SWEEPS, UNMOVED, WELL_INSIDE
from .plan import CARRIER_CONE, PLATFORM_CONE, Plan


@routine
def clamp_stroke(length: float, lo: float, hi: float) -> float:
    """Clamp a length to its limits."""
    return min(max(length, lo), hi)


@routine
def any_normal(a: Vec) -> Vec:
    """A unit vector normal to `a`."""
    helper = (1.0, 0.0, 0.0) if abs(a[0]) < 0.6 * norm(a) else (0.0, 1.0, 0.0)
    n = cross(a, helper)
    return scale(1.0 / norm(n), n)


@routine
def clamp_cone(axis: Vec, half_angle: float, d: Vec) -> Vec:
    """The nearest vector to `d` within `half_angle` of the unit vector `axis`."""
    angle = angle_between(axis, d)
    if angle <= half_angle:
        return d
    length, radial = norm(d), flatten(d, axis)
    size = norm(radial)
    radial = scale(1.0 / size, radial) if size > NO_SIDE * length else any_normal(axis)
    kept = length * max(math.cos(angle - half_angle), LEAST_SHARE)
    return add(scale(kept * math.cos(half_angle), axis), scale(kept * math.sin(half_angle), radial))


@routine
def keep_in_cone(cone: Record, axis: Vec, d: Vec) -> Vec:
    """Clamp `d` to a cone about its present axis, with a quick exit for vectors well inside."""
    if dot(axis, d) > (cone["cosine"] + WELL_INSIDE) * norm(d):
        return d
    return clamp_cone(axis, cone["half_angle"], d)


@inlined
def hinge_angle(plan: Plan, branch: Records, k: int, carrier: Floats, normal: Vec, nodes: Floats, d: Vec) -> float:
    """Angle from home of the hinge at node `k`, with next segment `d`."""
    node = plan.nodes[k]
    if k == branch["first"]:
        angle = angle_about(normal, turn(carrier, vec(branch["reference"])), d)
    else:
        angle = angle_about(normal, sub(vec(nodes[k]), vec(nodes[k - 1])), d) - node["angle_home"]
    return wrap_into(angle, node["angle_lo"], node["angle_hi"]) if node["ranged"] == 1 else wrap(angle, 0.0)


@inlined
def cone_axis(cone: Records, carrier: Floats, pose: Floats, normal: Vec, nodes: Floats) -> Vec:
    """The present direction of a cone's axis."""
    a = vec(cone["axis"])
    if cone["fixed_to"] == CARRIER_CONE:
        return turn(carrier, a)
    if cone["fixed_to"] == PLATFORM_CONE:
        return turn(pose, a)
    k = cone["node"]
    link = sub(vec(nodes[k]), vec(nodes[k - 1]))
    link = scale(1.0 / max(norm(link), NO_LENGTH), link)
    return add(add(scale(a[0], link), scale(a[1], cross(normal, link))), scale(a[2], normal))


@routine
def restrict_step(plan: Plan, branch: Records, k: int, carrier: Floats, pose: Floats, nodes: Floats, d: Vec) -> Vec:
    """Clamp the step `d` from node k-1 to node k to the hinges and cones at both ends."""
    normal = turn(carrier, vec(branch["normal"]))
    before = plan.nodes[k - 1]
    at_end = k == branch["last"]
    for _sweep in range(SWEEPS):
        start = d
        if before["hinge"] == 1:
            d = flatten(d, normal)
            if norm(d) <= NO_LENGTH:
                d = turn(carrier, vec(branch["reference"]))
            if before["ranged"] == 1:
                angle = hinge_angle(plan, branch, k - 1, carrier, normal, nodes, d)
                inside = min(max(angle, before["angle_lo"]), before["angle_hi"])
                if inside != angle:
                    kept = max(math.cos(inside - angle), LEAST_SHARE)
                    d = scale(kept, rotate(d, normal, inside - angle))
        if branch["cone_first"] == branch["cone_last"] and branch["end_plane"] == 0:
            break
        if at_end and branch["end_plane"] == 1:
            d = flatten(d, turn(pose, vec(branch["end_normal"])))
        for c in range(branch["cone_first"], branch["cone_last"]):
            cone = plan.cones[c]
            if cone["fixed_to"] == PLATFORM_CONE:
                if at_end:
                    axis = scale(-1.0, cone_axis(cone, carrier, pose, normal, nodes))
                    d = keep_in_cone(cone, axis, d)
            elif cone["node"] == k - 1:
                d = keep_in_cone(cone, cone_axis(cone, carrier, pose, normal, nodes), d)
        if norm(sub(d, start)) <= UNMOVED * norm(start):
            break
    return d


@routine
def restrict_step_inward(
    plan: Plan, branch: Records, k: int, carrier: Floats, pose: Floats, nodes: Floats, d: Vec
) -> Vec:
    """Clamp the step `d` from node k+1 to node k to the cones at both ends and to a plane fixed to the platform.

    A cone at node k is fixed to a carrier or link that this pass has not moved yet: its present axis counts.
    """
    normal = turn(carrier, vec(branch["normal"]))
    at_end = k + 1 == branch["last"]
    for _sweep in range(SWEEPS):
        start = d
        for c in range(branch["cone_first"], branch["cone_last"]):
            cone = plan.cones[c]
            if cone["fixed_to"] != PLATFORM_CONE and cone["node"] == k:
                axis = scale(-1.0, cone_axis(cone, carrier, pose, normal, nodes))
                d = keep_in_cone(cone, axis, d)
        if at_end and branch["end_plane"] == 1:
            d = flatten(d, turn(pose, vec(branch["end_normal"])))
        for c in range(branch["cone_first"], branch["cone_last"]):
            cone = plan.cones[c]
            if cone["fixed_to"] == PLATFORM_CONE and at_end:
                d = keep_in_cone(cone, cone_axis(cone, carrier, pose, normal, nodes), d)
        if norm(sub(d, start)) <= UNMOVED * norm(start):
            break
    return d
