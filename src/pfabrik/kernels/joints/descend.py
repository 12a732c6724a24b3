"""The nearest feasible configuration by a descent in joint coordinates along closed loops, within every limit.

The unknowns are the motions that the loops leave free, computed anew at each configuration. Each step is restored onto
the loops before it is accepted, so that every accepted configuration is feasible.
"""

from __future__ import annotations

import math

from ...common.arrays import Floats
from .._jit import routine, search
from ..clearance.link_limits import pair_excess
from ..free_motions import FreeMotions, project, put_multipliers, put_step, restoring_step
from ..holding import limit_multipliers
from ..legs.complete_poses import turn_pose
from ..quaternions import turn_ball
from ..rows import HOLD_NOTHING
from ..search_constants import CLOSED, LONGEST_IN_MODE, LONGEST_STEP, NEARLY_CLOSED, PROBE, RESTORING
from ..sqp import (
    add_products,
    allowed_violation,
    begin_descent,
    is_closed,
    is_hopeless,
    is_stuck_infeasible,
    judge_step,
    longest,
    plan_step,
    resume,
    scale_objective,
    symmetrise,
)
from ..vectors import Vec, along, copy_table, cross, dot, vec
from .linearise_loops import (
    DescentScratch,
    add_anchors,
    add_cone,
    add_force,
    begin_pricing,
    cone_excess,
    is_on_edge,
    linearise,
    open_scratch,
    pose_gradient,
    price_curvature,
    steps_left,
    walk_all,
)
from .loops import BALL, LOCKED, Closed, Loops, Objective
from .path_kinematics import State, add_pair_slope, copy_state, load_row, open_loops, place_links, store_row


@routine
def lagrangian_gradient(
    loops: Loops, row: int, objective: Objective, state: State, scratch: DescentScratch, out: Floats
) -> None:
    """Gradient of the Lagrangian at a configuration, with multipliers of limits and, in `balance`, of the loops."""
    walk_all(loops, state, scratch)
    _, held = pose_gradient(objective.pose, objective.pose.targets[row], state.X, scratch.gradient, True)
    for j in range(len(loops.lo)):
        out[j] = 0.0
    add_anchors(row, objective, state, scratch.gradient.unit[0], out)
    put_forces(len(loops.paths) - 1, held, scratch)
    for path in range(len(loops.paths) - 1):
        add_force(loops, path, scratch.force[path], scratch, out)
    add_limits(loops, objective.pose.margin, state, scratch, out)


@routine
def put_forces(paths: int, held: int, scratch: DescentScratch) -> None:
    """Fill force and moment at the end of each path: of the objective and of the multipliers in `balance`."""
    force, balance = scratch.force, scratch.balance
    for i in range(6):
        force[0, i] = scratch.gradient.force[i]
        for path in range(1, paths):
            force[path, i] = balance[6 * (path - 1) + i]
            force[0, i] -= force[path, i]
        for k in range(held):
            force[0, i] += balance[6 * (paths - 1) + k] * scratch.gradient.holds[k, i]


@routine
def add_limits(loops: Loops, margin: float, state: State, scratch: DescentScratch, out: Floats) -> None:
    """Add the gradients of all limits, times their multipliers, to `out`."""
    n, multipliers = len(loops.lo), scratch.hessian.multipliers
    for j in range(n):
        out[j] += multipliers[2 * j + 1] - multipliers[2 * j]
    for cone in range(len(loops.cone_angles)):
        if multipliers[2 * n + cone] != 0.0:
            cone_excess(loops, cone, margin, state, scratch)
            add_cone(loops, cone, multipliers[2 * n + cone], scratch, out)
    offset, links, is_placed = 2 * n + len(loops.cone_angles), scratch.links, False
    for pair in range(links.kept[0]):
        if multipliers[offset + pair] != 0.0:
            if not is_placed:
                place_links(scratch.ways, state, scratch.way_eq, scratch.links)
            is_placed = True
            over, multiplier = pair_excess(scratch.links, pair, math.inf), multipliers[offset + pair]
            add_pair_slope(scratch.ways, scratch.links, pair, over, multiplier, scratch.way_eq, out)


@routine
def lagrangian_hessian(
    loops: Loops, row: int, objective: Objective, scratch: DescentScratch, reduced: FreeMotions
) -> float:
    """Reduced Hessian of the Lagrangian at `scratch.best`; its largest diagonal entry.

    Of loops and the end effector from their screws; of cones and links that hold, by differences of their gradients.
    The multipliers of the loops make the gradient zero at pivot coordinates. What a price bends is added.
    """
    n, linear, H, full = len(loops.lo), reduced.linear, scratch.hessian.H, scratch.full
    motions, basis, here, there = linear.totals[0]["motions"], reduced.basis, scratch.here, scratch.there
    for i in range(scratch.balance.shape[0]):
        scratch.balance[i] = 0.0
    lagrangian_gradient(loops, row, objective, scratch.best, scratch, scratch.here)
    scratch.control[0]["equation_multipliers"] = put_multipliers(scratch.here, reduced, scratch.balance)
    is_priced = objective.pose.price > 0.0
    if is_priced:
        put_priced_forces(loops, scratch, reduced)
    held = linear.totals[0]["rows"] - 6 * (len(loops.paths) - 2)
    put_forces(len(loops.paths) - 1, held, scratch)
    put_turning(row, objective, held, scratch)
    put_curvature(loops, objective, scratch)
    bends = has_bent_limits(loops, scratch)
    for j in range(n):
        here[j] = 0.0
    if bends:
        add_limits(loops, objective.pose.margin, scratch.best, scratch, scratch.here)
    for a in range(motions):
        for j in range(n):
            there[j] = full[j, reduced.free[a]]
            for r in range(linear.totals[0]["rank"]):
                there[j] += full[j, reduced.pivots[r]] * basis[reduced.pivots[r], a]
        if bends:
            add_differences(loops, a, objective.pose.margin, scratch, reduced)
        project(there, reduced, H[a])
    if is_priced:
        place, both, turn = price_curvature(objective.pose, False, scratch.gradient)
        add_products(place, both, turn, scratch.hessian, motions)
    return symmetrise(H, motions)


@routine
def put_curvature(loops: Loops, objective: Objective, scratch: DescentScratch) -> None:
    """Fill the second derivatives of the objective and the loops by all coordinates, of what was walked last.

    With the screws (v, w) of motions on a path, i before j, those of its end change by dv_j = w_i x v_j and
    dw_j = w_i x w_j as i moves, and dv_i = w_i x v_j as j does. So force f and moment m there have the derivative
    w_i . (v_j x f + w_j x m / 2), whose other half is that of the twist's own axes. The motions of one ball do not turn
    each other's axes.
    """
    full, rows, turning, force = scratch.full, scratch.eq.rows, scratch.turning, scratch.force
    for j in range(full.shape[0]):
        for i in range(full.shape[0]):
            full[j, i] = 0.0
        if j < objective.weights.shape[0]:
            full[j, j] = scratch.gradient.unit[0] * objective.weights[j]
    place = scratch.gradient.unit[0] * (scratch.gradient.pricing[0]["by_place"] if objective.pose.price > 0.0 else 1.0)
    for path in range(len(loops.paths) - 1):
        f, m = vec(force[path]), vec(force[path, 3:])
        for visit in range(loops.paths[path], loops.paths[path + 1]):
            begin = loops.visit_rows[visit]
            for r in range(begin, loops.visit_rows[visit + 1]):
                v, w, b = vec(rows[r]), vec(rows[r, 3:]), loops.row_columns[r]
                bend = cross(v, f)
                wholly = along(bend, 0.5, cross(w, m))
                pushed, turned = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
                if path == 0:
                    pushed = weighted(objective.pose.platform, place, v)
                    turned = (dot(vec(turning[0]), w), dot(vec(turning[1]), w), dot(vec(turning[2]), w))
                for i in range(loops.visit_rows[loops.paths[path]], r + 1):
                    u, t, a = vec(rows[i]), vec(rows[i, 3:]), loops.row_columns[i]
                    share = dot(t, wholly) if i < begin else 0.5 * (dot(t, bend) + dot(w, cross(u, f)))
                    share += dot(u, pushed) + dot(t, turned)
                    full[a, b] += share
                    if i < r:
                        full[b, a] += share


@routine
def weighted(platform: Floats, unit: float, v: Vec) -> Vec:
    """A velocity times the weights of positions, where these are not held."""
    x, y, z = platform[0], platform[1], platform[2]
    x, y, z = 0.0 if x == LOCKED else x, 0.0 if y == LOCKED else y, 0.0 if z == LOCKED else z
    return (unit * x * v[0], unit * y * v[1], unit * z * v[2])


@routine
def put_turning(row: int, objective: Objective, held: int, scratch: DescentScratch) -> None:
    """Fill the symmetric derivative of the end effector's moment by rotations.

    By differences: with a price, the factors by which it scales forces are kept.
    """
    X, gradient, turning, force, paths = scratch.trial.X, scratch.gradient, scratch.turning, scratch.force, 0
    paths = force.shape[0]
    gradient.pricing[0]["is_fixed"] = 1
    for k in range(3):
        copy_table(scratch.best.X, X)
        turn_pose(X, (PROBE if k == 0 else 0.0, PROBE if k == 1 else 0.0, PROBE if k == 2 else 0.0))
        pose_gradient(objective.pose, objective.pose.targets[row], X, gradient, True)
        for i in range(3):
            moment = gradient.force[3 + i]
            for path in range(paths):
                moment -= force[path, 3 + i]
            for c in range(held):
                moment += scratch.balance[6 * (paths - 1) + c] * gradient.holds[c, 3 + i]
            turning[i, k] = moment / PROBE
    gradient.pricing[0]["is_fixed"] = 0
    symmetrise(turning, 3)


@routine
def has_bent_limits(loops: Loops, scratch: DescentScratch) -> bool:
    """True if a limit that is no range has a multiplier."""
    multipliers = scratch.hessian.multipliers
    for c in range(2 * len(loops.lo), multipliers.shape[0]):
        if multipliers[c] != 0.0:
            return True
    return False


@routine
def add_differences(loops: Loops, a: int, margin: float, scratch: DescentScratch, reduced: FreeMotions) -> None:
    """Add the derivative of the limits' gradients, which `scratch.here` has, along a free motion to `scratch.there`."""
    row, probe = scratch.row, PROBE / math.sqrt(reduced.linear.metric[a, a])
    copy_state(scratch.best, scratch.trial)
    for j in range(len(loops.lo)):
        row[j] = reduced.basis[j, a]
    move(loops, scratch.row, probe, scratch.trial)
    for j in range(len(loops.lo)):
        row[j] = 0.0
    add_limits(loops, margin, scratch.trial, scratch, scratch.row)
    for j in range(len(loops.lo)):
        scratch.there[j] += (row[j] - scratch.here[j]) / probe


@routine
def put_priced_forces(loops: Loops, scratch: DescentScratch, reduced: FreeMotions) -> None:
    """Fill the gradients by position and by rotation of the objective of the end effector posed last."""
    force, there = scratch.force[0], scratch.there
    for part in range(2):
        for j in range(there.shape[0]):
            there[j] = 0.0
        for i in range(6):
            force[i] = scratch.gradient.force[i] if i // 3 == part else 0.0
        add_force(loops, 0, force, scratch, scratch.there)
        project(there, reduced, scratch.hessian.forces[part])


@routine
def move(loops: Loops, step: Floats, share: float, state: State) -> None:
    """Add a share of a step to a configuration."""
    for k in range(len(loops.kinds)):
        j = loops.columns[k]
        if loops.kinds[k] == BALL:
            turn_ball(state.balls[k], share * step[j], share * step[j + 1], share * step[j + 2])
        else:
            state.q[j] += share * step[j]


@routine
def take_step(loops: Loops, reduced: FreeMotions, x: Floats, state: State, scratch: DescentScratch) -> float:
    """Take a step of the free motions, with the one that closes the loops to first order; the share that was taken."""
    put_step(x, reduced, scratch.row)
    most = LONGEST_IN_MODE if scratch.control[0]["stays"] == 1 else LONGEST_STEP
    share = most / max(longest(scratch.row, len(loops.lo)), most)
    move(loops, scratch.row, share, state)
    return share


@routine
def restore_feasibility(
    loops: Loops,
    row: int,
    objective: Objective,
    state: State,
    tolerance: float,
    scratch: DescentScratch,
    reduced: FreeMotions,
) -> bool:
    """Restore a configuration, linearised in `reduced`, onto its loops and within its limits by shortest steps.

    True if both hold to the tolerance, or after all steps, if rounding prevents that, to `NEARLY_CLOSED`.
    """
    for _step in range(RESTORING):
        if is_closed(reduced.linear, tolerance):
            return True
        if not restoring_step(reduced, False, scratch.p):  # using all motions, steps jump over wrist singularities
            return False
        take_step(loops, reduced, scratch.p.x, state, scratch)
        linearise(loops, row, objective, state, scratch, reduced)
    return is_closed(reduced.linear, max(tolerance, NEARLY_CLOSED))


@routine
def descend(loops: Loops, row: int, objective: Objective, scratch: DescentScratch) -> int:
    """Descend from a feasible `scratch.best`, linearised in `scratch.first`, to a local minimum; the steps."""
    reduced, trial_reduced, best, trial, p = scratch.first, scratch.second, scratch.best, scratch.trial, scratch.p
    hessian, control, most = scratch.hessian, scratch.control[0], objective.pose.max_iterations
    scratch.gradient.unit[0] = scale_objective(reduced.linear)
    begin_descent(reduced.linear, hessian, control)
    nearest = math.inf if control["least"] == 0.0 else 0.5 * scratch.gradient.unit[0] * control["least"] ** 2
    control["is_done"] = int(is_on_edge(objective.pose, scratch.gradient))
    while control["is_done"] == 0 and steps_left(control) > RESTORING + 2:
        control["largest"] = lagrangian_hessian(loops, row, objective, scratch, reduced)
        is_accepted = False
        while not is_accepted and control["is_done"] == 0 and steps_left(control) > RESTORING + 2:
            if plan_step(reduced.linear, hessian, control, most, p):
                copy_state(best, trial)
                share = take_step(loops, reduced, p.x, trial, scratch)
                linearise(loops, row, objective, trial, scratch, trial_reduced)
                tolerance = allowed_violation(control, share)
                feasible = restore_feasibility(loops, row, objective, trial, tolerance, scratch, trial_reduced)
                is_accepted = judge_step(reduced.linear, trial_reduced.linear, feasible, share, control)
                if is_accepted:
                    copy_state(trial, best)
                    reduced, trial_reduced = trial_reduced, reduced
                    deficit = reduced.linear.totals[0]["value"] - nearest
                    if is_on_edge(objective.pose, scratch.gradient) or is_hopeless(deficit, share, control):
                        control["is_done"] = 1
            if is_stuck_infeasible(reduced.linear, is_accepted, most, control):
                if restore_feasibility(loops, row, objective, best, CLOSED, scratch, reduced):
                    resume(control)
                is_accepted = True
    restore_feasibility(loops, row, objective, best, CLOSED, scratch, reduced)
    return int(control["steps"])


@routine
def nearest_of(
    loops: Loops, row: int, objective: Objective, scratch: DescentScratch, closed: Closed, weights: Floats
) -> None:
    """Minimise the objective of a row; see `nearest_configuration`."""
    best, first = scratch.best, scratch.first
    load_row(loops, row, closed, best)
    closed.iterations[row] = 0
    begin_pricing(scratch.gradient)
    scratch.gradient.unit[0] = 1.0
    linearise(loops, row, objective, best, scratch, first)
    if objective.pose.max_iterations == 0:
        scale_objective(first.linear)
        for c in range(limit_multipliers(first.linear, objective.pose.near, scratch.p, scratch.pulls)):
            weights[row, first.linear.which[c]] = scratch.p.x[c]
        return
    if restore_feasibility(loops, row, objective, best, CLOSED, scratch, first):
        closed.iterations[row] = descend(loops, row, objective, scratch)
    linearise(loops, row, objective, best, scratch, first)
    if objective.pose.hold != HOLD_NOTHING and objective.pose.price == 0.0:
        scratch.gradient.pricing[0]["cost"] = cost_of_hold(loops, row, objective, scratch)
    store_row(loops, row, best, closed)
    for group in range(closed.gaps.shape[1]):  # the measures of the whole mechanism, for every group
        closed.gaps[row, group] = first.linear.totals[0]["gap"]
        closed.excesses[row, group] = max(first.linear.totals[0]["excess"] - objective.pose.margin, 0.0)
        closed.misses[row, group] = 0.0


@routine
def cost_of_hold(loops: Loops, row: int, objective: Objective, scratch: DescentScratch) -> float:
    """What holding a part costs at `scratch.best`, linearised in `scratch.first` with the multipliers of a descent.

    The size of the multipliers of the held components, relative to the distance.
    """
    balance, totals, held, unit = scratch.balance, scratch.first.linear.totals[0], 0.0, scratch.gradient.unit[0]
    if not totals["value"] > 0.0:
        return 0.0
    for i in range(balance.shape[0]):
        balance[i] = 0.0
    lagrangian_gradient(loops, row, objective, scratch.best, scratch, scratch.here)
    put_multipliers(scratch.here, scratch.first, scratch.balance)
    for k in range(6 * (len(loops.paths) - 2), totals["rows"]):
        held = math.hypot(held, balance[k])
    return held / math.sqrt(2.0 * unit * totals["value"])


@search
def nearest_configuration(
    machine: int, scratch_address: int, objective: Objective, closed: Closed, weights: Floats
) -> None:
    """Minimise the objective of every row, from a configuration that is closed within its limits or nearly so.

    With `max_iterations` 0, write instead the multipliers of the limits of each row, (n, 2 columns + cones + pairs of
    links): the decrease of the distance per unit by which the limit is relaxed; 0 for limits that are not active.

    Parameters
    ----------
    machine, scratch_address : addresses of `Loops` and `DescentScratch`.
    """
    loops, scratch = open_loops(machine), open_scratch(scratch_address)
    for row in range(len(closed.coordinates)):
        nearest_of(loops, row, objective, scratch, closed, weights)
