"""FABRIK's forward and backward passes on one branch, and on the chains made of branches."""

from __future__ import annotations

from .._jit import routine
from ..vectors import along, dot, move, norm, put, sub, turn, vec
from .pass_constants import CONTENT, NO_LENGTH, OBLIQUE
from .plan import Configuration, Plan, Settings, move_carriers
from .restrict import clamp_stroke, fit_trunk, restrict_step, restrict_step_inward


@routine
def reach_forward(plan: Plan, b: int, config: Configuration) -> None:
    """Pass from the target to the base: place each node at an allowed distance from the node after it."""
    branch, nodes = plan.branches[b], config.nodes
    carrier = config.carriers[branch["carrier"]]
    first, last = branch["first"], branch["last"]
    put(nodes[last], move(config.pose, vec(branch["end"])))
    normal = turn(carrier, vec(branch["normal"]))
    base = move(carrier, vec(plan.nodes[first]["home"]))
    oblique = branch["rail"] == 1 and abs(dot(normal, vec(branch["rail_axis"]))) > OBLIQUE
    for k in range(last - 1, first - 1, -1):
        d = sub(vec(nodes[k]), vec(nodes[k + 1]))
        d = restrict_step_inward(plan, branch, k, carrier, config.pose, nodes, d)
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
def reach_backward(plan: Plan, b: int, config: Configuration) -> None:
    """Pass from the base to the end: place each node at an allowed distance and direction from the node before it."""
    branch, nodes = plan.branches[b], config.nodes
    carrier = config.carriers[branch["carrier"]]
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
        d = restrict_step(plan, branch, k, carrier, config.pose, nodes, d)
        length = norm(d)
        reach = clamp_stroke(length, plan.nodes[k]["lo"], plan.nodes[k]["hi"])
        put(nodes[k], along(vec(nodes[k - 1]), reach / length, d))


@routine
def end_gap(plan: Plan, b: int, config: Configuration) -> float:
    """Distance between a branch's end and its target."""
    branch = plan.branches[b]
    return norm(sub(vec(config.nodes[branch["last"]]), move(config.pose, vec(branch["end"]))))


@routine
def pass_inward(plan: Plan, c: int, config: Configuration) -> None:
    """Pass from the targets of a chain's ends to its base, or to its trunk, which is told where branches want it."""
    chain = plan.chains[c]
    for b in range(chain["first"], chain["last"]):
        first = plan.branches[b]["first"]
        present = move(config.carriers[plan.branches[b]["carrier"]], vec(plan.nodes[first]["home"]))
        reach_forward(plan, b, config)
        base_target = vec(config.nodes[first])
        put(config.base_targets[b], base_target)
        config.is_displaced[b] = 1 if norm(sub(base_target, present)) > CONTENT * plan.length else 0


@routine
def pass_over_chain(plan: Plan, c: int, config: Configuration) -> float:
    """Run one iteration, forward and backward, of a chain; return the largest end gap."""
    pass_inward(plan, c, config)
    if plan.chains[c]["trunk"] >= 0:
        fit_trunk(plan, c, config)
    return pass_outward(plan, c, config)


@routine
def pass_outward(plan: Plan, c: int, config: Configuration) -> float:
    """Pass from the base to the ends of a chain, each joint within its limits; return the largest end gap."""
    chain, gap = plan.chains[c], 0.0
    if chain["trunk"] >= 0:
        for j in range(plan.trunks[chain["trunk"]]["first"], plan.trunks[chain["trunk"]]["last"]):
            config.trunks[j] = min(max(config.trunks[j], plan.trunk_joints[j]["lo"]), plan.trunk_joints[j]["hi"])
        move_carriers(plan, config)
    for b in range(chain["first"], chain["last"]):
        reach_backward(plan, b, config)
        gap = max(gap, end_gap(plan, b, config))
    return gap


@routine
def reach_by_passes(plan: Plan, c: int, config: Configuration, settings: Settings) -> tuple[float, int]:
    """Run passes until the ends are within E, at most K iterations; return the gap and the iterations.

    With K = 0 there is a single pass outward, after which all gaps are at the ends.
    """
    if settings.max_iterations == 0:
        return pass_outward(plan, c, config), 0
    gap = pass_over_chain(plan, c, config)
    for iteration in range(1, settings.max_iterations):
        if gap <= settings.tolerance:
            return gap, iteration
        gap = pass_over_chain(plan, c, config)
    return gap, settings.max_iterations
