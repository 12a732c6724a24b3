"""What a configuration is worth: its loop gaps and its limit excesses, measured, never assumed."""

from __future__ import annotations

from .._jit import inlined, routine
from ..vectors import Vec, angle_between, dot, flatten, move, norm, scale, sub, turn, vec
from .frames import rotation_between
from .plan import (
    END_HINGE,
    HINGE,
    LENGTH,
    PLATFORM_CONE,
    POINT_END,
    RAIL,
    SLIDE,
    STROKE,
    Configuration,
    Floats,
    Plan,
    Records,
)
from .restrict import cone_axis, end_hinge_angle, hinge_angle

# Components beyond this have squares that come near the largest number.
OVERFLOWING = 1e100
LARGEST = 1.7e308


@inlined
def cone_step(cone: Records, nodes: Floats) -> Vec:
    """The line a cone limits: outward from its joint, or inward from the platform."""
    k = cone["node"]
    if cone["kind"] == PLATFORM_CONE:
        return sub(vec(nodes[k - 1]), vec(nodes[k]))
    return sub(vec(nodes[k + 1]), vec(nodes[k]))


@inlined
def measure_branch(plan: Plan, b: int, now: Configuration) -> tuple[float, float]:
    """Largest gap [length] of one branch, and its largest limit excess [L or rad]."""
    branch = plan.branches[b]
    carrier = now.carriers[branch["carrier"]]
    first, last = branch["first"], branch["last"]
    normal = turn(carrier, vec(branch["normal"]))
    gap = norm(sub(vec(now.nodes[last]), move(now.pose, vec(branch["end"]))))
    excess = 0.0
    base = sub(vec(now.nodes[first]), move(carrier, vec(plan.nodes[first]["home"])))
    gap = max(gap, norm(flatten(base, vec(branch["rail_axis"])) if branch["rail"] == 1 else base))
    for k in range(first + 1, last + 1):
        d = sub(vec(now.nodes[k]), vec(now.nodes[k - 1]))
        length = norm(d)
        over = max(plan.nodes[k]["lo"] - length, length - plan.nodes[k]["hi"])
        if plan.nodes[k]["lo"] == plan.nodes[k]["hi"]:
            gap = max(gap, over)
        else:
            excess = max(excess, over / plan.scalars[LENGTH])
        before = plan.nodes[k - 1]
        if before["hinge"] == 1:
            gap = max(gap, abs(dot(normal, d)))
            if before["ranged"] == 1:
                angle = hinge_angle(plan, branch, k - 1, carrier, normal, now.nodes, d)
                excess = max(excess, max(before["angle_lo"] - angle, angle - before["angle_hi"]))
    return measure_ends(plan, branch, now, gap, excess)


@inlined
def measure_ends(plan: Plan, branch: Records, now: Configuration, gap: float, excess: float) -> tuple[float, float]:
    """The rest of `measure_branch`: rail, platform hinge, cones."""
    carrier = now.carriers[branch["carrier"]]
    first, last = branch["first"], branch["last"]
    if branch["rail"] == 1:
        slide = dot(sub(vec(now.nodes[first]), vec(plan.nodes[first]["home"])), vec(branch["rail_axis"]))
        excess = max(excess, max(branch["rail_lo"] - slide, slide - branch["rail_hi"]) / plan.scalars[LENGTH])
    normal = turn(carrier, vec(branch["normal"]))
    if branch["end_plane"] == 1 or branch["align"] == 1:
        end_normal = turn(now.pose, vec(branch["end_normal"]))
        if branch["align"] == 1:
            gap = max(gap, plan.scalars[LENGTH] * norm(sub(end_normal, normal)))
        if last > first:
            d = sub(vec(now.nodes[last - 1]), vec(now.nodes[last]))
            if branch["end_plane"] == 1:
                gap = max(gap, abs(dot(end_normal, d)))
            if branch["end_ranged"] == 1:
                angle = end_hinge_angle(branch, now.pose, d)
                over = max(branch["end_angle_lo"] - angle, angle - branch["end_angle_hi"])
                excess = max(excess, float(over))
    for c in range(branch["cone_first"], branch["cone_last"]):
        cone = plan.cones[c]
        axis = cone_axis(cone, carrier, now.pose, normal, now.nodes)
        step = cone_step(cone, now.nodes)
        if dot(axis, step) < cone["cosine"] * norm(step):
            excess = max(excess, angle_between(axis, step) - cone["half_angle"])
    return gap, excess


@inlined
def measure_trunk(plan: Plan, trunk: int, now: Configuration) -> float:
    """Largest excess of the joints of a trunk over their ranges [L or rad]; 0 for no trunk (-1)."""
    excess = 0.0
    if trunk >= 0:
        for j in range(plan.trunks[trunk]["first"], plan.trunks[trunk]["last"]):
            joint = plan.trunk_joints[j]
            over = max(joint["lo"] - now.trunks[j], now.trunks[j] - joint["hi"])
            excess = max(excess, over / plan.scalars[LENGTH] if joint["kind"] == SLIDE else over)
    return excess


@routine
def measure_chain(plan: Plan, c: int, now: Configuration) -> tuple[float, float]:
    """Largest gap [length] and largest limit excess [L or rad] of one chain."""
    chain = plan.chains[c]
    gap, excess = 0.0, measure_trunk(plan, chain["trunk"], now)
    for b in range(chain["first"], chain["last"]):
        branch_gap, branch_excess = measure_branch(plan, b, now)
        gap, excess = max(gap, branch_gap), max(excess, branch_excess)
    return gap, excess


@routine
def measure_all(plan: Plan, now: Configuration) -> tuple[float, float]:
    """Largest gap [length] and largest limit excess [L or rad] of the whole mechanism."""
    gap, excess = 0.0, 0.0
    for c in range(plan.chains.shape[0]):
        chain_gap, chain_excess = measure_chain(plan, c, now)
        gap, excess = max(gap, chain_gap), max(excess, chain_excess)
    return gap, excess


@inlined
def pose_errors(plan: Plan, pose: Floats, wanted: Floats, target: Floats) -> tuple[float, float]:
    """Distance [length] and angle [rad] between a pose and its target.

    `wanted` is the target as solved for: its rotation orthonormal, or home's where the end effector has none.
    """
    d = (pose[0, 3] - target[0, 3], pose[1, 3] - target[1, 3], pose[2, 3] - target[2, 3])
    largest = max(abs(d[0]), abs(d[1]), abs(d[2]))
    distance = largest * min(norm(scale(1.0 / largest, d)), LARGEST / largest) if largest > OVERFLOWING else norm(d)
    angle = 0.0
    if plan.scalars[POINT_END] == 0.0:
        angle = norm(rotation_between(pose, wanted))
    return distance, angle


@inlined
def read_coordinate(plan: Plan, i: int, now: Configuration) -> float:
    """The value of coordinate `i`, as the description counts it."""
    coordinate = plan.coordinates[i]
    kind, at = coordinate["kind"], coordinate["index"]
    branch = plan.branches[coordinate["branch"]]
    carrier = now.carriers[branch["carrier"]]
    if kind == STROKE:
        value = norm(sub(vec(now.nodes[at]), vec(now.nodes[at - 1])))
    elif kind == RAIL:
        value = dot(sub(vec(now.nodes[at]), vec(plan.nodes[at]["home"])), vec(branch["rail_axis"]))
    elif kind == HINGE:
        normal = turn(carrier, vec(branch["normal"]))
        value = hinge_angle(
            plan, branch, at, carrier, normal, now.nodes, sub(vec(now.nodes[at + 1]), vec(now.nodes[at]))
        )
    elif kind == END_HINGE:
        value = end_hinge_angle(branch, now.pose, sub(vec(now.nodes[at - 1]), vec(now.nodes[at])))
    else:
        value = now.trunks[at]
    return coordinate["offset"] + coordinate["sign"] * value
