"""Reaching: FABRIK's forward and backward passes on one branch, and the chains made of branches."""

from __future__ import annotations

from ...arrays import Records
from .._jit import routine
from ..vectors import Vec, along, dot, flatten, move, norm, put, sub, turn, vec
from .fit import fit_trunk
from .frames import move_carriers
from .plan import PLATFORM_CONE, Configuration, Plan, Settings
from .restrict import NO_LENGTH, clamp_cone, clamp_stroke, cone_axis, restrict_step

# A rail that leaves the plane of its branch by more than this sine moves the plane along.
OBLIQUE = 1e-6


@routine
def reach_forward(plan: Plan, b: int, now: Configuration) -> None:
    """From the target toward the base: each node at its allowed distance from the one before it."""
    branch, nodes = plan.branches[b], now.nodes
    carrier = now.carriers[branch["carrier"]]
    first, last = branch["first"], branch["last"]
    put(nodes[last], move(now.pose, vec(branch["end"])))
    normal = turn(carrier, vec(branch["normal"]))
    base = move(carrier, vec(plan.nodes[first]["home"]))
    oblique = branch["rail"] == 1 and abs(dot(normal, vec(branch["rail_axis"]))) > OBLIQUE
    for k in range(last - 1, first - 1, -1):
        d = sub(vec(nodes[k]), vec(nodes[k + 1]))
        if k + 1 == last:
            d = restrict_end_step(plan, branch, now, d)
        length = norm(d)
        if length <= NO_LENGTH:
            d = turn(carrier, sub(vec(plan.nodes[k]["home"]), vec(plan.nodes[k + 1]["home"])))
            length = norm(d)
        reach = clamp_stroke(length, plan.nodes[k + 1]["lo"], plan.nodes[k + 1]["hi"])
        p = along(vec(nodes[k + 1]), reach / length, d)
        if branch["planar"] > 0 and k - first <= branch["planar"] and not oblique:
            p = along(p, -dot(normal, sub(p, base)), normal)
        put(nodes[k], p)


@routine
def restrict_end_step(plan: Plan, branch: Records, now: Configuration, d: Vec) -> Vec:
    """The first step inward, as the platform's own joint allows it."""
    if branch["end_plane"] == 1:
        d = flatten(d, turn(now.pose, vec(branch["end_normal"])))
    carrier = now.carriers[branch["carrier"]]
    normal = turn(carrier, vec(branch["normal"]))
    for c in range(branch["cone_first"], branch["cone_last"]):
        cone = plan.cones[c]
        if cone["kind"] == PLATFORM_CONE:
            d = clamp_cone(cone_axis(cone, carrier, now.pose, normal, now.nodes), cone["half_angle"], d)
    return d


@routine
def reach_backward(plan: Plan, b: int, now: Configuration) -> None:
    """From the base out to the end: each node at its allowed distance and direction from the one before it."""
    branch, nodes = plan.branches[b], now.nodes
    carrier = now.carriers[branch["carrier"]]
    first, last = branch["first"], branch["last"]
    base = move(carrier, vec(plan.nodes[first]["home"]))
    if branch["rail"] == 1:
        axis = vec(branch["rail_axis"])
        slide = dot(axis, sub(vec(nodes[first]), base))
        base = along(base, clamp_stroke(slide, branch["rail_lo"], branch["rail_hi"]), axis)
    put(nodes[first], base)
    for k in range(first + 1, last + 1):
        d = sub(vec(nodes[k]), vec(nodes[k - 1]))
        if norm(d) <= NO_LENGTH:
            d = turn(carrier, sub(vec(plan.nodes[k]["home"]), vec(plan.nodes[k - 1]["home"])))
        d = restrict_step(plan, branch, k, carrier, now.pose, nodes, d)
        length = norm(d)
        reach = clamp_stroke(length, plan.nodes[k]["lo"], plan.nodes[k]["hi"])
        put(nodes[k], along(vec(nodes[k - 1]), reach / length, d))


@routine
def end_gap(plan: Plan, b: int, now: Configuration) -> float:
    """Distance between a branch's end and its target."""
    branch = plan.branches[b]
    return norm(sub(vec(now.nodes[branch["last"]]), move(now.pose, vec(branch["end"]))))


@routine
def pass_over_chain(plan: Plan, c: int, now: Configuration) -> float:
    """One iteration, forward and backward, of all branches of a chain; the largest end gap it leaves."""
    chain = plan.chains[c]
    for b in range(chain["first"], chain["last"]):
        reach_forward(plan, b, now)
        put(now.wanted[b], vec(now.nodes[plan.branches[b]["first"]]))
    if chain["trunk"] >= 0:
        fit_trunk(plan, c, now)
    return pass_outward(plan, c, now)


@routine
def pass_outward(plan: Plan, c: int, now: Configuration) -> float:
    """From the base to the ends of a chain, each joint within its limits; the largest end gap."""
    chain, gap = plan.chains[c], 0.0
    if chain["trunk"] >= 0:
        for j in range(plan.trunks[chain["trunk"]]["first"], plan.trunks[chain["trunk"]]["last"]):
            now.trunks[j] = min(max(now.trunks[j], plan.trunk_joints[j]["lo"]), plan.trunk_joints[j]["hi"])
        move_carriers(plan, now)
    for b in range(chain["first"], chain["last"]):
        reach_backward(plan, b, now)
        gap = max(gap, end_gap(plan, b, now))
    return gap


@routine
def reach_by_passes(plan: Plan, c: int, now: Configuration, settings: Settings) -> tuple[float, int]:
    """Forward and backward passes until the ends are within E, or K iterations are spent; the gap left, and how many.

    With no iterations, chains stay as they are: one pass outward puts all they miss at their ends.
    """
    if settings.max_iterations == 0:
        return pass_outward(plan, c, now), 0
    gap = pass_over_chain(plan, c, now)
    for iteration in range(1, settings.max_iterations):
        if gap <= settings.enough:
            return gap, iteration
        gap = pass_over_chain(plan, c, now)
    return gap, settings.max_iterations
