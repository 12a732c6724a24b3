"""Clamps of a segment to strokes, hinges and cones, and least-squares fits of trunks and platforms to chains' ends."""

from __future__ import annotations

import math

from ...common.arrays import Floats, Record, Records
from .._jit import inlined, routine
from ..legs.complete_poses import orthonormalise, turn_pose
from ..linear import solve_spd
from ..vectors import (
    Vec,
    add,
    along,
    angle_about,
    angle_between,
    cross,
    dot,
    flatten,
    move,
    norm,
    rotate,
    scale,
    sub,
    turn,
    vec,
    wrap,
    wrap_into,
)
from .pass_constants import (
    FIT_DAMPING,
    FIT_STEPS,
    LARGEST_TURN,
    LEAST_SHARE,
    NO_LENGTH,
    NO_SIDE,
    SWEEPS,
    TURN_DAMPING,
    UNMOVED,
    WELL_INSIDE,
)
from .plan import CARRIER_CONE, PLATFORM_CONE, TRANSLATES, TURNS, Configuration, Plan, Settings, move_carriers


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
def clamp_cone(axis: Vec, half_angle: float, d: Vec, keeps_length: bool) -> Vec:
    """The vector within `half_angle` of the unit vector `axis` that is nearest to `d`, or nearest of those as long."""
    angle = angle_between(axis, d)
    if angle <= half_angle:
        return d
    length, radial = norm(d), flatten(d, axis)
    size = norm(radial)
    radial = scale(1.0 / size, radial) if size > NO_SIDE * length else any_normal(axis)
    kept = length if keeps_length else length * max(math.cos(angle - half_angle), LEAST_SHARE)
    return add(scale(kept * math.cos(half_angle), axis), scale(kept * math.sin(half_angle), radial))


@routine
def keep_in_cone(cone: Record, axis: Vec, d: Vec, keeps_length: bool) -> Vec:
    """Clamp `d` to a cone about its present axis, with a quick exit for vectors well inside."""
    if dot(axis, d) > (cone["cosine"] + WELL_INSIDE) * norm(d):
        return d
    return clamp_cone(axis, cone["half_angle"], d, keeps_length)


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
    normal, keeps_length = turn(carrier, vec(branch["normal"])), plan.is_literal == 1
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
                    kept = 1.0 if keeps_length else max(math.cos(inside - angle), LEAST_SHARE)
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
                    d = keep_in_cone(cone, axis, d, keeps_length)
            elif cone["node"] == k - 1:
                d = keep_in_cone(cone, cone_axis(cone, carrier, pose, normal, nodes), d, keeps_length)
        if norm(sub(d, start)) <= UNMOVED * norm(start):
            break
    return d


@routine
def restrict_step_inward(
    plan: Plan, branch: Records, k: int, carrier: Floats, pose: Floats, nodes: Floats, d: Vec
) -> Vec:
    """Clamp the step `d` from node k+1 to node k to the cones at both ends and to a plane fixed to the platform.

    A cone at node k is fixed to a carrier or link that this pass has not moved yet: its present axis counts. In the
    paper's text it restricts outward passes alone.
    """
    normal, keeps_length = turn(carrier, vec(branch["normal"])), plan.is_literal == 1
    at_end = k + 1 == branch["last"]
    for _sweep in range(SWEEPS):
        start = d
        for c in range(branch["cone_first"], branch["cone_last"]):
            cone = plan.cones[c]
            if plan.is_literal == 0 and cone["fixed_to"] != PLATFORM_CONE and cone["node"] == k:
                axis = scale(-1.0, cone_axis(cone, carrier, pose, normal, nodes))
                d = keep_in_cone(cone, axis, d, keeps_length)
        if at_end and branch["end_plane"] == 1:
            d = flatten(d, turn(pose, vec(branch["end_normal"])))
        for c in range(branch["cone_first"], branch["cone_last"]):
            cone = plan.cones[c]
            if cone["fixed_to"] == PLATFORM_CONE and at_end:
                d = keep_in_cone(cone, cone_axis(cone, carrier, pose, normal, nodes), d, keeps_length)
        if norm(sub(d, start)) <= UNMOVED * norm(start):
            break
    return d


@routine
def fit_trunk(plan: Plan, c: int, config: Configuration) -> None:
    """Fit a trunk, within its joint ranges, to the positions that the forward pass gave the branches' first nodes.

    Gauss-Newton on the trunk's joint values. Branches whose first node is there already count in the paper's text only.
    """
    trunk = plan.chains[c]["trunk"]
    first, last = plan.trunks[trunk]["first"], plan.trunks[trunk]["last"]
    n, base_targets, system = last - first, config.base_targets, config.system
    for _step in range(FIT_STEPS):
        for i in range(n):
            for j in range(n + 1):
                system[i, j] = 0.0
        for b in range(plan.chains[c]["first"], plan.chains[c]["last"]):
            if config.is_displaced[b] == 0 and plan.is_literal == 0:
                continue
            present = move(config.carriers[trunk + 1], vec(plan.nodes[plan.branches[b]["first"]]["home"]))
            miss = sub(vec(base_targets[b]), present)
            for i in range(n):
                rate = scale(trunk_unit(plan, first + i), point_rate(plan, config, first + i, present))
                system[i, n] += dot(rate, miss)
                for j in range(n):
                    column_rate = scale(trunk_unit(plan, first + j), point_rate(plan, config, first + j, present))
                    system[i, j] += dot(rate, column_rate)
        solve_spd(system, n, FIT_DAMPING)
        for i in range(n):
            joint = plan.trunk_joints[first + i]
            value = config.trunks[first + i] + system[i, n] * trunk_unit(plan, first + i)
            config.trunks[first + i] = min(max(value, joint["lo"]), joint["hi"])
        move_carriers(plan, config)


@routine
def trunk_unit(plan: Plan, j: int) -> float:
    """Joint motion per unit of a trunk joint's unknown, which is a length: 1 / L for a turn, 1 for a slide."""
    return float(plan.trunk_joints[j]["unit"] / plan.length)


@routine
def point_rate(plan: Plan, config: Configuration, j: int, p: Vec) -> Vec:
    """Velocity of the point `p` of a carrier per unit rate of its trunk joint `j`."""
    axis = vec(config.screws[j, 1])
    return cross(axis, sub(p, vec(config.screws[j, 0]))) if plan.trunk_joints[j]["turns"] == 1 else axis


@routine
def move_to_centroid(plan: Plan, config: Configuration) -> None:
    """Move the target by the mean gap of the ends, orientation held: the paper's projection."""
    n = plan.branches.shape[0]
    shift = (0.0, 0.0, 0.0)
    for b in range(n):
        branch = plan.branches[b]
        miss = sub(vec(config.nodes[branch["last"]]), move(config.pose, vec(branch["end"])))
        shift = along(shift, 1.0 / n, miss)
    for i in range(3):
        config.pose[i, 3] += shift[i]


@routine
def turn_to_fit(plan: Plan, config: Configuration, about_reference: bool) -> None:
    """Turn the platform by one Gauss-Newton step of the rigid best fit of its points to the ends of chains.

    The centre is the centroid of the points, which `move_to_centroid` has moved to the centroid of the ends, or the
    reference point if the position is held.
    """
    system = config.system
    for i in range(3):
        for j in range(4):
            system[i, j] = 0.0
    n = plan.branches.shape[0]
    p = (config.pose[0, 3], config.pose[1, 3], config.pose[2, 3])
    centre = (0.0, 0.0, 0.0)
    if not about_reference:
        for b in range(n):
            centre = along(centre, 1.0 / n, vec(plan.branches[b]["end"]))
    for b in range(n):
        branch = plan.branches[b]
        lever = turn(config.pose, sub(vec(branch["end"]), centre))
        miss = sub(vec(config.nodes[branch["last"]]), add(p, turn(config.pose, vec(branch["end"]))))
        moment = cross(lever, miss)
        square = dot(lever, lever)
        for i in range(3):
            system[i, 3] += moment[i]
            for j in range(3):
                system[i, j] += (square if i == j else 0.0) - lever[i] * lever[j]
    solve_spd(system, 3, TURN_DAMPING)
    w = (system[0, 3], system[1, 3], system[2, 3])
    size = norm(w)
    if size > LARGEST_TURN:
        w = scale(LARGEST_TURN / size, w)
    fixed = add(p, turn(config.pose, centre))
    turn_pose(config.pose, w)
    orthonormalise(config.pose)
    moved = sub(fixed, turn(config.pose, centre))
    for i in range(3):
        config.pose[i, 3] = moved[i]


@routine
def revise_target(plan: Plan, config: Configuration, settings: Settings) -> None:
    """Move the free components of the target towards the ends of the chains."""
    if settings.free & TRANSLATES:
        move_to_centroid(plan, config)
    if settings.free & TURNS:
        turn_to_fit(plan, config, settings.free == TURNS)
