"""Adaptive target projection: an unreachable target moves to where the chains' ends agree; then the loops close."""

from __future__ import annotations

from .._jit import routine
from ..linear import solve_spd
from ..vectors import add, along, copy_row, copy_table, cross, dot, move, norm, scale, sub, turn, vec
from .exact import branch_mode, reach_exact
from .frames import move_carriers, orthonormalise, place_ends, rotation_between, turn_pose, turn_pose_by_vector
from .measure import measure_all
from .passes import end_gap, pass_over_chain, reach_backward, reach_by_passes
from .plan import HOLD_ORIENTATION, HOLD_POSITION, LENGTH, POINT_END, STRUT, Configuration, Floats, Plan, Settings, Work
from .settle import TRANSLATES, TURNS, settle
from .violations import trunk_span

# Rounds and exact step are tried so often.
TRIES = 3
# Steps tried on the way back from an infeasible pose to a feasible one, and the share of the way not worth a try.
TRIALS = 60
SHORTEST_STEP = 1e-9
# A best fit turns by one linear step a round: at most so far [rad], and damped for points on a line, whose turn about
# it is free.
LARGEST_TURN, FIT_DAMPING = 0.5, 1e-9


@routine
def reach_pose(plan: Plan, now: Configuration, work: Work, settings: Settings) -> tuple[float, int]:
    """Let every chain reach for the present pose; the largest end gap left, and the most iterations."""
    worst, iterations = 0.0, 0
    for c in range(plan.chains.shape[0]):
        if settings.exact == 1:
            gap, chain_iterations = reach_nearest(plan, c, now, work), 1
        else:
            gap, chain_iterations = reach_by_passes(plan, c, now, work.wanted, work.system, settings)
        worst, iterations = max(worst, gap), max(iterations, chain_iterations)
    return worst, iterations


@routine
def is_struts(plan: Plan, c: int) -> bool:
    """Whether one pass brings the ends of a chain as near as they come: single segments on the base."""
    for b in range(plan.chains[c]["first"], plan.chains[c]["last"]):
        if plan.branches[b]["kind"] != STRUT:
            return False
    return bool(plan.chains[c]["trunk"] < 0)


@routine
def reach_nearest(plan: Plan, c: int, now: Configuration, work: Work) -> float:
    """Bring the ends of a chain that cannot reach as near to their targets as its limits allow; the gap left.

    The least-squares compromise of the exact step, then one pass outward, which puts the whole miss at the ends: of
    struts the pass alone does that.
    """
    if is_struts(plan, c):
        return pass_over_chain(plan, c, now, work.wanted, work.system)
    place_ends(plan, c, now)
    settle(plan, c, c + 1, 0, now, work)
    for j in trunk_span(plan, c):
        now.trunks[j] = min(max(now.trunks[j], plan.trunk_joints[j]["lo"]), plan.trunk_joints[j]["hi"])
    move_carriers(plan, now)
    gap = 0.0
    for b in range(plan.chains[c]["first"], plan.chains[c]["last"]):
        reach_backward(plan, b, now)
        gap = max(gap, end_gap(plan, b, now))
    return gap


@routine
def move_to_centroid(plan: Plan, now: Configuration) -> None:
    """The paper's projection: the target moves by the mean of what the ends miss, its orientation held."""
    n = plan.branches.shape[0]
    shift = (0.0, 0.0, 0.0)
    for b in range(n):
        branch = plan.branches[b]
        miss = sub(vec(now.nodes[branch["last"]]), move(now.pose, vec(branch["end"])))
        shift = along(shift, 1.0 / n, miss)
    for i in range(3):
        now.pose[i, 3] += shift[i]


@routine
def turn_to_fit(plan: Plan, now: Configuration, work: Work, about_reference: bool) -> None:
    """One Gauss-Newton step of the rigid best fit of the platform's points to the ends: the rotation.

    About the centroid of the points, which `move_to_centroid` has brought to that of the ends, or about the
    reference point where the position is held.
    """
    system = work.system
    for i in range(3):
        for j in range(4):
            system[i, j] = 0.0
    n = plan.branches.shape[0]
    p = (now.pose[0, 3], now.pose[1, 3], now.pose[2, 3])
    centre = (0.0, 0.0, 0.0)
    if not about_reference:
        for b in range(n):
            centre = along(centre, 1.0 / n, vec(plan.branches[b]["end"]))
    for b in range(n):
        branch = plan.branches[b]
        arm = turn(now.pose, sub(vec(branch["end"]), centre))
        miss = sub(vec(now.nodes[branch["last"]]), add(p, turn(now.pose, vec(branch["end"]))))
        moment = cross(arm, miss)
        square = dot(arm, arm)
        for i in range(3):
            system[i, 3] += moment[i]
            for j in range(3):
                system[i, j] += (square if i == j else 0.0) - arm[i] * arm[j]
    solve_spd(system, 3, FIT_DAMPING)
    w = (system[0, 3], system[1, 3], system[2, 3])
    size = norm(w)
    if size > LARGEST_TURN:
        w = scale(LARGEST_TURN / size, w)
    fixed = add(p, turn(now.pose, centre))
    turn_pose_by_vector(now.pose, w)
    moved = sub(fixed, turn(now.pose, centre))
    for i in range(3):
        now.pose[i, 3] = moved[i]


@routine
def return_to_modes(plan: Plan, now: Configuration, work: Work, settings: Settings) -> None:
    """Put branches that have crossed into their other mode back into their own, at the pose they have settled to."""
    for b in range(plan.branches.shape[0]):
        if branch_mode(plan, b, now) == -work.modes[b]:
            reach_exact(plan, b, now, work.modes[b], settings.slack)


@routine
def project_target(plan: Plan, hold: int, now: Configuration, work: Work, settings: Settings) -> tuple[bool, int, int]:
    """Revise the target round by round, then settle; True with a feasible configuration in `now`."""
    iterations, rounds = 0, 0
    free = TRANSLATES | TURNS
    if hold == HOLD_ORIENTATION or plan.scalars[POINT_END] == 1.0:
        free = TRANSLATES
    elif hold == HOLD_POSITION:
        free = TURNS
    feasible = False
    for _try in range(TRIES):
        for _round in range(settings.max_rounds):
            gap, more = reach_pose(plan, now, work, settings)
            iterations += more
            if gap <= settings.enough:
                break
            rounds += 1
            if free & TRANSLATES:
                move_to_centroid(plan, now)
            if free & TURNS:
                turn_to_fit(plan, now, work, hold == HOLD_POSITION)
        for c in range(plan.chains.shape[0]):
            place_ends(plan, c, now)
        settle(plan, 0, plan.chains.shape[0], free, now, work)
        return_to_modes(plan, now, work, settings)
        gap, excess = measure_all(plan, now)
        feasible = gap <= settings.slack and excess * plan.scalars[LENGTH] <= settings.slack
        if feasible:
            break
    return feasible, iterations, rounds


@routine
def step_back(
    plan: Plan, safe: Configuration, wanted: Floats, now: Configuration, work: Work, settings: Settings
) -> None:
    """Walk from the feasible configuration `safe` toward the pose `wanted`, as far as every chain follows.

    Both configurations end at the last feasible one.
    """
    step = 1.0
    for _trial in range(TRIALS):
        copy_configuration(plan, safe, now)
        turned = rotation_between(safe.pose, wanted)
        angle = norm(turned)
        if angle > 0.0:
            turn_pose(now.pose, scale(1.0 / angle, turned), step * angle)
            orthonormalise(now.pose)
        for i in range(3):
            now.pose[i, 3] += step * (wanted[i, 3] - safe.pose[i, 3])
        reach_pose(plan, now, work, settings)
        for c in range(plan.chains.shape[0]):
            place_ends(plan, c, now)
        settle(plan, 0, plan.chains.shape[0], 0, now, work)
        gap, excess = measure_all(plan, now)
        if gap <= settings.slack and excess * plan.scalars[LENGTH] <= settings.slack:
            copy_configuration(plan, now, safe)
        else:
            step *= 0.5
            if step < SHORTEST_STEP:
                break
    copy_configuration(plan, safe, now)


@routine
def copy_configuration(plan: Plan, source: Configuration, to: Configuration) -> None:
    copy_table(source.pose, to.pose)
    copy_table(source.nodes, to.nodes)
    copy_row(source.trunks, to.trunks)
    move_carriers(plan, to)
