"""What stands between a configuration and a closed loop with every limit kept, one violation after the other.

Equalities (rigid lengths, planes, the platform joints) are violated by any deviation, limits only beyond their bounds.
Angles enter as lengths, multiplied by L. Each violation is noted with its gradient in positions; `settle` turns these
into equations for its unknowns.
"""

from __future__ import annotations

import math

from .._jit import routine
from ..vectors import Vec, add, angle_between, cross, dot, move, norm, scale, sub, turn, vec
from .measure import cone_step
from .passes import trunk_unit
from .plan import CARRIER_CONE, LENGTH, PLATFORM_CONE, Configuration, Plan, Work
from .restrict import NO_LENGTH, cone_axis, end_hinge_angle, hinge_angle

# What a step may depend on beside nodes.
NO_NODE, CARRIER = -1, -2

# A line opposite to its cone's axis has no direction to turn; its gradient is kept finite.
LEAST_SINE = 1e-9

_ZERO = (0.0, 0.0, 0.0)


@routine
def enter(
    work: Work,
    b: int,
    value: float,
    k: int,
    d_gradient: Vec,
    k_from: int,
    before_gradient: Vec,
    carrier_moment: Vec,
    platform_moment: Vec,
) -> None:
    """Note one violation of branch `b` that depends on the step from node `k_from` to node `k`.

    `before_gradient` is its gradient in the step that ends at `k_from` (zero for most); moments are its derivatives
    in rotations of carrier and platform that leave the nodes where they are. Instead of a node, NO_NODE stands for no
    step, and CARRIER for the place of the branch's first node on its carrier.
    """
    entry = work.violations[int(work.totals[2])]
    work.totals[0] += value * value
    work.totals[1] = max(work.totals[1], abs(value))
    work.totals[2] += 1.0
    entry[0] = value
    entry[1] = b
    entry[2] = k
    entry[3] = k_from
    for i in range(3):
        entry[4 + i] = d_gradient[i]
        entry[7 + i] = before_gradient[i]
        entry[10 + i] = carrier_moment[i]
        entry[13 + i] = platform_moment[i]


@routine
def beyond(value: float, lo: float, hi: float) -> float:
    """Signed excess of `value` over [lo, hi]; 0 inside."""
    if value > hi:
        return value - hi
    if value < lo:
        return value - lo
    return 0.0


@routine
def enter_segments(plan: Plan, b: int, now: Configuration, work: Work) -> None:
    """Lengths, planes and ranges of hinges along one branch."""
    branch = plan.branches[b]
    carrier = now.carriers[branch["carrier"]]
    normal = turn(carrier, vec(branch["normal"]))
    length = plan.scalars[LENGTH]
    for k in range(branch["first"] + 1, branch["last"] + 1):
        d = sub(vec(now.nodes[k]), vec(now.nodes[k - 1]))
        size = max(norm(d), NO_LENGTH)
        value = beyond(size, plan.nodes[k]["lo"], plan.nodes[k]["hi"])
        if value != 0.0:
            enter(work, b, value, k, scale(1.0 / size, d), k - 1, _ZERO, _ZERO, _ZERO)
        if plan.nodes[k - 1]["hinge"] == 1:
            moment = cross(normal, d)
            enter(work, b, dot(normal, d), k, normal, k - 1, _ZERO, moment, _ZERO)
            if plan.nodes[k - 1]["ranged"] == 1:
                angle = hinge_angle(plan, branch, k - 1, carrier, normal, now.nodes, d)
                value = beyond(angle, plan.nodes[k - 1]["angle_lo"], plan.nodes[k - 1]["angle_hi"])
                if value != 0.0:
                    g = scale(length / (size * size), cross(normal, d))
                    if k - 1 == branch["first"]:
                        moment = scale(-length, normal)
                        enter(work, b, length * value, k, g, k - 1, _ZERO, moment, _ZERO)
                    else:
                        e = sub(vec(now.nodes[k - 1]), vec(now.nodes[k - 2]))
                        g_before = scale(-length / dot(e, e), cross(normal, e))
                        enter(work, b, length * value, k, g, k - 1, g_before, _ZERO, _ZERO)


@routine
def enter_cones(plan: Plan, b: int, now: Configuration, work: Work) -> None:
    """Cones at the joints of one branch."""
    branch = plan.branches[b]
    carrier = now.carriers[branch["carrier"]]
    normal = turn(carrier, vec(branch["normal"]))
    length = plan.scalars[LENGTH]
    for c in range(branch["cone_first"], branch["cone_last"]):
        cone = plan.cones[c]
        axis = cone_axis(cone, carrier, now.pose, normal, now.nodes)
        d = cone_step(cone, now.nodes)
        angle = angle_between(axis, d)
        if angle <= cone["half_angle"]:
            continue
        size = max(norm(d), NO_LENGTH)
        u = scale(1.0 / size, d)
        sine = max(math.sin(angle), LEAST_SINE)
        g = scale(-length / (size * sine), sub(axis, scale(math.cos(angle), u)))
        g_axis = scale(-length / sine, sub(u, scale(math.cos(angle), axis)))
        value = length * (angle - cone["half_angle"])
        k = cone["node"]
        moment = cross(axis, g_axis)
        if cone["kind"] == PLATFORM_CONE:
            enter(work, b, value, k - 1, g, k, _ZERO, _ZERO, moment)
        elif cone["kind"] == CARRIER_CONE:
            enter(work, b, value, k + 1, g, k, _ZERO, moment, _ZERO)
        else:
            link = sub(vec(now.nodes[k]), vec(now.nodes[k - 1]))
            link_size = max(norm(link), NO_LENGTH)
            e = scale(1.0 / link_size, link)
            g_link = add(scale(cone["axis"][0], g_axis), scale(cone["axis"][1], cross(g_axis, normal)))
            g_link = scale(1.0 / link_size, sub(g_link, scale(dot(g_link, e), e)))
            g_normal = add(scale(cone["axis"][1], cross(e, g_axis)), scale(cone["axis"][2], g_axis))
            enter(work, b, value, k + 1, g, k, g_link, cross(normal, g_normal), _ZERO)


@routine
def enter_ends(plan: Plan, b: int, now: Configuration, work: Work) -> None:
    """What ties one branch to its rail and to the platform."""
    branch = plan.branches[b]
    carrier = now.carriers[branch["carrier"]]
    first, last = branch["first"], branch["last"]
    length = plan.scalars[LENGTH]
    if first == last:
        miss = sub(vec(now.nodes[last]), move(carrier, vec(plan.nodes[first]["home"])))
        for i in range(3):
            unit = (1.0 if i == 0 else 0.0, 1.0 if i == 1 else 0.0, 1.0 if i == 2 else 0.0)
            enter(work, b, miss[i], last, unit, CARRIER, _ZERO, _ZERO, _ZERO)
    if branch["rail"] == 1:
        axis = vec(branch["rail_axis"])
        slide = dot(sub(vec(now.nodes[first]), vec(plan.nodes[first]["home"])), axis)
        value = beyond(slide, branch["rail_lo"], branch["rail_hi"])
        if value != 0.0:
            enter(work, b, value, first, axis, NO_NODE, _ZERO, _ZERO, _ZERO)
    end_normal = turn(now.pose, vec(branch["end_normal"]))
    if branch["align"] == 1:
        normal = turn(carrier, vec(branch["normal"]))
        miss = sub(end_normal, normal)
        for i in range(3):
            unit = (1.0 if i == 0 else 0.0, 1.0 if i == 1 else 0.0, 1.0 if i == 2 else 0.0)
            turned_back = scale(-length, cross(normal, unit))
            moment = scale(length, cross(end_normal, unit))
            enter(work, b, length * miss[i], NO_NODE, _ZERO, NO_NODE, _ZERO, turned_back, moment)
    if last > first:
        d = sub(vec(now.nodes[last - 1]), vec(now.nodes[last]))
        if branch["end_plane"] == 1:
            moment = cross(end_normal, d)
            value = dot(end_normal, d)
            enter(work, b, value, last - 1, end_normal, last, _ZERO, _ZERO, moment)
        if branch["end_ranged"] == 1:
            value = beyond(end_hinge_angle(branch, now.pose, d), branch["end_angle_lo"], branch["end_angle_hi"])
            if value != 0.0:
                g = scale(length / max(dot(d, d), NO_LENGTH), cross(end_normal, d))
                moment = scale(-length, end_normal)
                enter(work, b, length * value, last - 1, g, last, _ZERO, _ZERO, moment)


@routine
def note_violations(plan: Plan, c0: int, c1: int, now: Configuration, work: Work) -> None:
    """Note every violation of chains c0 ... c1 - 1; sum and largest go to `work.totals`."""
    for i in range(3):
        work.totals[i] = 0.0
    for c in range(c0, c1):
        for b in range(plan.chains[c]["first"], plan.chains[c]["last"]):
            enter_segments(plan, b, now, work)
            enter_cones(plan, b, now, work)
            enter_ends(plan, b, now, work)
        for j in trunk_span(plan, c):
            value = trunk_excess(plan, j, now)
            work.totals[0] += value * value
            work.totals[1] = max(work.totals[1], abs(value))


@routine
def trunk_span(plan: Plan, c: int) -> range:
    """Indices of the trunk joints of a chain."""
    trunk = plan.chains[c]["trunk"]
    if trunk < 0:
        return range(0)
    return range(plan.trunks[trunk]["first"], plan.trunks[trunk]["last"])


@routine
def trunk_excess(plan: Plan, j: int, now: Configuration) -> float:
    """How far a trunk joint is beyond its range, as a length."""
    joint = plan.trunk_joints[j]
    return beyond(now.trunks[j], joint["lo"], joint["hi"]) / trunk_unit(plan, j)
