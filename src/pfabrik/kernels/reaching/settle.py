"""Settling: the exact step that takes nearly closed loops to closed ones, with every limit kept.

Levenberg-Marquardt on the sum of squared violations, over the free nodes, the trunk joints, the rails and (where they
are free) the platform's position and orientation.
"""

from __future__ import annotations

from .._jit import routine
from ..linear import solve_spd
from ..vectors import Vec, copy_row, copy_table, cross, dot, move, scale, sub, vec
from .frames import move_carriers, turn_pose_by_vector
from .passes import point_rate, trunk_unit
from .plan import LENGTH, SPAN, TURN, Configuration, Floats, Plan, Records, Work
from .violations import CARRIER, note_violations, trunk_excess, trunk_span

# What the platform may do: bits of `free`.
TRANSLATES, TURNS = 1, 2
# A solution is settled when no violation exceeds this share of L: three orders inside what is promised.
SETTLED = 1e-13
MAX_STEPS = 60
DAMPING_START, DAMPING_LEAST, DAMPING_MOST = 1e-4, 1e-16, 1e6
# So many steps in a row that take off less than this share of what is left: a violation that no step removes.
SLOW, PATIENCE = 0.05, 5
# Below this share of L a violation may well vanish, slowly: chains at full stretch lose rank, and gain two bits a step.
NEARLY = 1e-3
# Inner nodes and trunks may move freely, the platform should not: weight of a unit step of each in the damping.
INNER_WEIGHT = 1e-2


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
def add_node(plan: Plan, branch: Records, b: int, now: Configuration, work: Work, free: int, k: int, g: Vec) -> None:
    """Add to the row what a violation with gradient `g` at node `k` owes to the unknowns."""
    row = work.row
    if k == branch["last"]:
        if free & TRANSLATES:
            for i in range(3):
                row[i] += g[i]
        p = (now.pose[0, 3], now.pose[1, 3], now.pose[2, 3])
        add_platform_moment(plan, work, free, cross(sub(vec(now.nodes[k]), p), g))
    elif k == branch["first"]:
        if branch["rail"] == 1:
            column = work.columns[plan.nodes.shape[0] + b]
            row[column] += dot(g, vec(branch["rail_axis"]))
        add_carried(plan, branch, now, work, vec(now.nodes[k]), g)
    else:
        column = work.columns[k]
        for i in range(3):
            row[column + i] += g[i]


@routine
def add_carried(plan: Plan, branch: Records, now: Configuration, work: Work, p: Vec, g: Vec) -> None:
    """Add to the row what a gradient `g` at the point `p` of a carrier owes to its trunk."""
    if branch["carrier"] > 0:
        span = plan.trunks[branch["carrier"] - 1]
        for j in range(span["first"], span["last"]):
            work.row[trunk_column(plan, work, j)] += dot(g, point_rate(plan, now, j, p)) * trunk_unit(plan, j)


@routine
def add_carrier_moment(plan: Plan, branch: Records, now: Configuration, work: Work, moment: Vec) -> None:
    """Add to the row what a violation owes to the rotation of the carrier."""
    if branch["carrier"] > 0:
        span = plan.trunks[branch["carrier"] - 1]
        for j in range(span["first"], span["last"]):
            if plan.trunk_joints[j]["kind"] == TURN:
                turned = dot(moment, vec(now.screws[j, 1]))
                work.row[trunk_column(plan, work, j)] += turned * trunk_unit(plan, j)


@routine
def add_platform_moment(plan: Plan, work: Work, free: int, moment: Vec) -> None:
    """Add to the row what a violation owes to the rotation of the platform."""
    if free & TURNS:
        start = 3 * (free & TRANSLATES)
        for i in range(3):
            work.row[start + i] += moment[i] / plan.scalars[SPAN]


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
def add_violation(plan: Plan, now: Configuration, work: Work, free: int, n: int, entry: Floats) -> None:
    """Turn one noted violation into a row of the normal equations."""
    b, k, k_from = int(entry[1]), int(entry[2]), int(entry[3])
    branch = plan.branches[b]
    d_gradient, before_gradient = vec(entry[4:]), vec(entry[7:])
    if k >= 0:
        add_node(plan, branch, b, now, work, free, k, d_gradient)
    if k_from >= 0:
        add_node(plan, branch, b, now, work, free, k_from, sub(before_gradient, d_gradient))
        if dot(before_gradient, before_gradient) > 0.0:
            add_node(plan, branch, b, now, work, free, k_from - 1, scale(-1.0, before_gradient))
    elif k_from == CARRIER:
        foot = move(now.carriers[branch["carrier"]], vec(plan.nodes[branch["first"]]["home"]))
        add_carried(plan, branch, now, work, foot, scale(-1.0, d_gradient))
    add_carrier_moment(plan, branch, now, work, vec(entry[10:]))
    add_platform_moment(plan, work, free, vec(entry[13:]))
    commit_row(work, n, entry[0])


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
    small = (NEARLY * plan.scalars[LENGTH]) ** 2
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
            slow = slow + 1 if work.totals[0] > max((1.0 - SLOW) * cost, small) else 0
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
