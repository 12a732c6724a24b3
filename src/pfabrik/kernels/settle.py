"""Settling: the exact step that takes nearly closed loops to closed ones, with every limit kept.

Levenberg-Marquardt on the sum of squared violations, over the free nodes, the trunk joints, the rails and (where they
are free) the platform's position and orientation. Equalities are violated by any deviation, limits only beyond their
bounds. Angles enter as lengths, multiplied by L.
"""

from __future__ import annotations

import math

from ._jit import routine
from .frames import move_carriers, turn_pose_by_vector
from .linear import solve_spd
from .measure import cone_step
from .plan import (
    CARRIER_CONE,
    LENGTH,
    PLATFORM_CONE,
    SPAN,
    TURN,
    Configuration,
    Floats,
    Plan,
    Records,
    Work,
)
from .reach import point_rate
from .restrict import NO_LENGTH, cone_axis, end_hinge_angle, hinge_angle
from .vectors import Vec, add, angle_between, copy_row, copy_table, cross, dot, move, norm, scale, sub, turn, vec

# What the platform may do: bits of `free`.
TRANSLATES, TURNS = 1, 2
# What a moment acts on.
NO_FRAME, CARRIER_FRAME, PLATFORM_FRAME = 0, 1, 2
# A solution is settled when no violation exceeds this share of L: three orders inside what is promised.
SETTLED = 1e-13
MAX_STEPS = 60
DAMPING_START, DAMPING_LEAST, DAMPING_MOST = 1e-4, 1e-16, 1e6
# So many steps in a row that take off less than this share of what is left: a violation that no step removes.
SLOW, PATIENCE = 0.05, 5
# Inner nodes and trunks may move freely, the platform should not: weight of a unit step of each in the damping.
INNER_WEIGHT = 1e-2

_ZERO = (0.0, 0.0, 0.0)


@routine
def assign_columns(plan: Plan, c0: int, c1: int, free: int, work: Work) -> int:
    """Number the unknowns of chains c0 ... c1 - 1: platform, then rails, inner nodes and trunk joints."""
    n_nodes, n_branches = plan.nodes.shape[0], plan.branches.shape[0]
    for i in range(work.columns.shape[0]):
        work.columns[i] = -1
    n = 3 * (free & 1) + 3 * (free >> 1)
    for i in range(n):
        work.weights[i] = 1.0
    start = n
    for c in range(c0, c1):
        for b in range(plan.chains[c]["first"], plan.chains[c]["last"]):
            branch = plan.branches[b]
            if branch["rail"] == 1:
                work.columns[n_nodes + b] = n
                n += 1
            for k in range(branch["first"] + 1, branch["last"]):
                work.columns[k] = n
                n += 3
        trunk = plan.chains[c]["trunk"]
        if trunk >= 0:
            for j in range(plan.trunks[trunk]["first"], plan.trunks[trunk]["last"]):
                work.columns[n_nodes + n_branches + j] = n
                n += 1
    for i in range(start, n):
        work.weights[i] = INNER_WEIGHT
    return n


@routine
def trunk_column(plan: Plan, work: Work, j: int) -> int:
    return int(work.columns[plan.nodes.shape[0] + plan.branches.shape[0] + j])


@routine
def trunk_unit(plan: Plan, j: int) -> float:
    """Size of one unit step of a trunk joint's unknown: unknowns are lengths."""
    return 1.0 / plan.scalars[LENGTH] if plan.trunk_joints[j]["kind"] == TURN else 1.0


@routine
def add_node(plan: Plan, branch: Records, b: int, now: Configuration, work: Work, free: int, k: int, g: Vec) -> None:
    """Add to the row what a violation with gradient `g` at node `k` owes to the unknowns."""
    row = work.row
    if k == branch["last"]:
        if free & TRANSLATES:
            for i in range(3):
                row[i] += g[i]
        if free & TURNS:
            p = (now.pose[0, 3], now.pose[1, 3], now.pose[2, 3])
            moment = cross(sub(vec(now.nodes[k]), p), g)
            add_moment(plan, branch, now, work, free, PLATFORM_FRAME, moment)
    elif k == branch["first"]:
        if branch["rail"] == 1:
            column = work.columns[plan.nodes.shape[0] + b]
            row[column] += dot(g, vec(branch["rail_axis"]))
        if branch["carrier"] > 0:
            span = plan.trunks[branch["carrier"] - 1]
            for j in range(span["first"], span["last"]):
                rate = point_rate(plan, now, j, vec(now.nodes[k]))
                row[trunk_column(plan, work, j)] += dot(g, rate) * trunk_unit(plan, j)
    else:
        column = work.columns[k]
        for i in range(3):
            row[column + i] += g[i]


@routine
def add_moment(plan: Plan, branch: Records, now: Configuration, work: Work, free: int, frame: int, moment: Vec) -> None:
    """Add to the row what a violation owes to the rotation of the carrier or of the platform."""
    if frame == PLATFORM_FRAME and free & TURNS:
        start = 3 * (free & TRANSLATES)
        for i in range(3):
            work.row[start + i] += moment[i] / plan.scalars[SPAN]
    elif frame == CARRIER_FRAME and branch["carrier"] > 0:
        span = plan.trunks[branch["carrier"] - 1]
        for j in range(span["first"], span["last"]):
            if plan.trunk_joints[j]["kind"] == TURN:
                turned = dot(moment, vec(now.screws[j, 1]))
                work.row[trunk_column(plan, work, j)] += turned * trunk_unit(plan, j)


@routine
def commit_row(work: Work, n: int, value: float) -> None:
    """Add the row to the normal equations and clear it."""
    row, normal = work.row, work.normal
    for i in range(n):
        if row[i] != 0.0:
            for j in range(i + 1):
                normal[i, j] += row[i] * row[j]
            normal[i, n] -= row[i] * value
    for i in range(n):
        row[i] = 0.0


@routine
def enter(
    work: Work,
    b: int,
    value: float,
    k: int,
    d_gradient: Vec,
    k_from: int,
    before_gradient: Vec,
    frame: int,
    moment: Vec,
) -> None:
    """Note one violation of branch `b` that depends on the step from node `k_from` to node `k`.

    `before_gradient` is its gradient in the step that ends at `k_from` (zero for most), `moment` its derivative in a
    rotation of `frame`. A node of -1 stands for no step.
    """
    entry = work.violations[int(work.totals[2])]
    work.totals[0] += value * value
    work.totals[1] = max(work.totals[1], abs(value))
    work.totals[2] += 1.0
    entry[0] = value
    entry[1] = b
    entry[2] = k
    entry[3] = k_from
    entry[4] = frame
    for i in range(3):
        entry[5 + i] = d_gradient[i]
        entry[8 + i] = before_gradient[i]
        entry[11 + i] = moment[i]


@routine
def add_violation(plan: Plan, now: Configuration, work: Work, free: int, n: int, entry: Floats) -> None:
    """Turn one noted violation into a row of the normal equations."""
    b, k, k_from = int(entry[1]), int(entry[2]), int(entry[3])
    branch = plan.branches[b]
    d_gradient, before_gradient, moment = vec(entry[5:]), vec(entry[8:]), vec(entry[11:])
    if k >= 0:
        add_node(plan, branch, b, now, work, free, k, d_gradient)
    if k_from >= 0:
        add_node(plan, branch, b, now, work, free, k_from, sub(before_gradient, d_gradient))
        if dot(before_gradient, before_gradient) > 0.0:
            add_node(plan, branch, b, now, work, free, k_from - 1, scale(-1.0, before_gradient))
    add_moment(plan, branch, now, work, free, int(entry[4]), moment)
    commit_row(work, n, entry[0])


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
            enter(work, b, value, k, scale(1.0 / size, d), k - 1, _ZERO, NO_FRAME, _ZERO)
        if plan.nodes[k - 1]["hinge"] == 1:
            moment = cross(normal, d)
            enter(work, b, dot(normal, d), k, normal, k - 1, _ZERO, CARRIER_FRAME, moment)
            if plan.nodes[k - 1]["ranged"] == 1:
                angle = hinge_angle(plan, branch, k - 1, carrier, normal, now.nodes, d)
                value = beyond(angle, plan.nodes[k - 1]["angle_lo"], plan.nodes[k - 1]["angle_hi"])
                if value != 0.0:
                    g = scale(length / (size * size), cross(normal, d))
                    if k - 1 == branch["first"]:
                        moment = scale(-length, normal)
                        enter(work, b, length * value, k, g, k - 1, _ZERO, CARRIER_FRAME, moment)
                    else:
                        e = sub(vec(now.nodes[k - 1]), vec(now.nodes[k - 2]))
                        g_before = scale(-length / dot(e, e), cross(normal, e))
                        enter(work, b, length * value, k, g, k - 1, g_before, NO_FRAME, _ZERO)


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
        sine = max(math.sin(angle), 1e-9)
        g = scale(-length / (size * sine), sub(axis, scale(math.cos(angle), u)))
        g_axis = scale(-length / sine, sub(u, scale(math.cos(angle), axis)))
        value = length * (angle - cone["half_angle"])
        k = cone["node"]
        moment = cross(axis, g_axis)
        if cone["kind"] == PLATFORM_CONE:
            enter(work, b, value, k - 1, g, k, _ZERO, PLATFORM_FRAME, moment)
        elif cone["kind"] == CARRIER_CONE:
            enter(work, b, value, k + 1, g, k, _ZERO, CARRIER_FRAME, moment)
        else:
            link = sub(vec(now.nodes[k]), vec(now.nodes[k - 1]))
            link_size = max(norm(link), NO_LENGTH)
            e = scale(1.0 / link_size, link)
            g_link = add(scale(cone["axis"][0], g_axis), scale(cone["axis"][1], cross(g_axis, normal)))
            g_link = scale(1.0 / link_size, sub(g_link, scale(dot(g_link, e), e)))
            enter(work, b, value, k + 1, g, k, g_link, NO_FRAME, _ZERO)


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
            enter(work, b, miss[i], last, unit, -1, _ZERO, NO_FRAME, _ZERO)
    if branch["rail"] == 1:
        axis = vec(branch["rail_axis"])
        slide = dot(sub(vec(now.nodes[first]), vec(plan.nodes[first]["home"])), axis)
        value = beyond(slide, branch["rail_lo"], branch["rail_hi"])
        if value != 0.0:
            enter(work, b, value, first, axis, -1, _ZERO, NO_FRAME, _ZERO)
    end_normal = turn(now.pose, vec(branch["end_normal"]))
    if branch["align"] == 1:
        miss = sub(end_normal, turn(carrier, vec(branch["normal"])))
        for i in range(3):
            unit = (1.0 if i == 0 else 0.0, 1.0 if i == 1 else 0.0, 1.0 if i == 2 else 0.0)
            moment = scale(length, cross(end_normal, unit))
            enter(work, b, length * miss[i], -1, _ZERO, -1, _ZERO, PLATFORM_FRAME, moment)
    if last > first:
        d = sub(vec(now.nodes[last - 1]), vec(now.nodes[last]))
        if branch["end_plane"] == 1:
            moment = cross(end_normal, d)
            value = dot(end_normal, d)
            enter(work, b, value, last - 1, end_normal, last, _ZERO, PLATFORM_FRAME, moment)
        if branch["end_ranged"] == 1:
            value = beyond(end_hinge_angle(branch, now.pose, d), branch["end_angle_lo"], branch["end_angle_hi"])
            if value != 0.0:
                g = scale(length / max(dot(d, d), NO_LENGTH), cross(end_normal, d))
                moment = scale(-length, end_normal)
                enter(work, b, length * value, last - 1, g, last, _ZERO, PLATFORM_FRAME, moment)


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


@routine
def assemble(plan: Plan, c0: int, c1: int, free: int, now: Configuration, work: Work, n: int) -> None:
    """The normal equations of the violations last noted."""
    for i in range(n):
        work.row[i] = 0.0
        for j in range(n + 1):
            work.normal[i, j] = 0.0
    for v in range(int(work.totals[2])):
        add_violation(plan, now, work, free, n, work.violations[v])
    for c in range(c0, c1):
        for j in trunk_span(plan, c):
            value = trunk_excess(plan, j, now)
            if value != 0.0:
                work.row[trunk_column(plan, work, j)] = 1.0
                commit_row(work, n, value)


@routine
def apply_step(plan: Plan, c0: int, c1: int, free: int, now: Configuration, work: Work, n: int) -> None:
    """Move every unknown by the solved step, and what hangs on it along."""
    x = work.system[:, n]
    if free & TRANSLATES:
        for i in range(3):
            now.pose[i, 3] += x[i]
    if free & TURNS:
        start, span = 3 * (free & TRANSLATES), plan.scalars[SPAN]
        turn_pose_by_vector(now.pose, (x[start] / span, x[start + 1] / span, x[start + 2] / span))
    for j in range(plan.trunk_joints.shape[0]):
        column = trunk_column(plan, work, j)
        if column >= 0:
            now.trunks[j] += x[column] * trunk_unit(plan, j)
    move_carriers(plan, now)
    for c in range(c0, c1):
        for b in range(plan.chains[c]["first"], plan.chains[c]["last"]):
            branch = plan.branches[b]
            carrier = now.carriers[branch["carrier"]]
            first, last = branch["first"], branch["last"]
            if branch["rail"] == 1:
                slide = x[work.columns[plan.nodes.shape[0] + b]]
                for i in range(3):
                    now.nodes[first, i] += slide * branch["rail_axis"][i]
            elif first != last:
                base = move(carrier, vec(plan.nodes[first]["home"]))
                for i in range(3):
                    now.nodes[first, i] = base[i]
            for k in range(first + 1, last):
                for i in range(3):
                    now.nodes[k, i] += x[work.columns[k] + i]
            end = move(now.pose, vec(branch["end"]))
            for i in range(3):
                now.nodes[last, i] = end[i]


@routine
def keep(now: Configuration, work: Work) -> None:
    """Remember the configuration."""
    copy_table(now.pose, work.pose)
    copy_table(now.nodes, work.nodes)
    copy_row(now.trunks, work.trunks)


@routine
def restore(plan: Plan, now: Configuration, work: Work) -> None:
    """Return to the configuration last kept."""
    copy_table(work.pose, now.pose)
    copy_table(work.nodes, now.nodes)
    copy_row(work.trunks, now.trunks)
    move_carriers(plan, now)


@routine
def settle(plan: Plan, c0: int, c1: int, free: int, now: Configuration, work: Work) -> bool:
    """Close the loops of chains c0 ... c1 - 1 within their limits, moving the platform as `free` allows.

    The configuration to start from must have its first and last nodes in place. True when no violation is left; the
    configuration is the best one found either way, a least-squares compromise where the loops cannot be closed.
    """
    n = assign_columns(plan, c0, c1, free, work)
    enough = SETTLED * plan.scalars[LENGTH]
    note_violations(plan, c0, c1, now, work)
    damping, fresh, slow = DAMPING_START, True, 0
    for _step in range(MAX_STEPS):
        cost = work.totals[0]
        if work.totals[1] <= enough:
            return True
        if n == 0:
            return False
        if fresh:
            assemble(plan, c0, c1, free, now, work, n)
        for i in range(n):
            for j in range(n + 1):
                work.system[i, j] = work.normal[i, j]
            work.system[i, i] += damping * work.weights[i]
        keep(now, work)
        solve_spd(work.system, n, 0.0)
        apply_step(plan, c0, c1, free, now, work, n)
        note_violations(plan, c0, c1, now, work)
        fresh = work.totals[0] < cost
        if fresh:
            damping = max(0.02 * damping, DAMPING_LEAST)
            slow = slow + 1 if work.totals[0] > (1.0 - SLOW) * cost else 0
            if slow >= PATIENCE:
                return False
        else:
            restore(plan, now, work)
            work.totals[0] = cost
            work.totals[1] = 2.0 * enough
            damping *= 30.0
            if damping > DAMPING_MOST:
                return False
    return work.totals[1] <= enough
