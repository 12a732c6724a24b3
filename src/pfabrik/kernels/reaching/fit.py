"""Least-squares fits: a trunk's pose to where its branches would have it, a platform's rotation to its chains' ends."""

from __future__ import annotations

from .._jit import routine
from ..legs.poses import orthonormalise, turn_pose
from ..linear import solve_spd
from ..vectors import Vec, add, along, cross, dot, move, norm, scale, sub, turn, vec
from .frames import move_carriers
from .plan import SLIDE, TURN, Configuration, Plan

# Two Gauss-Newton steps fit a trunk well enough for one pass; damped where a joint moves no branch joint.
FIT_STEPS, FIT_DAMPING = 2, 1e-12
# A platform turns by one such step a round: at most so far [rad], and damped for points on a line, whose turn about it
# is free.
LARGEST_TURN, TURN_DAMPING = 0.5, 1e-9


@routine
def fit_trunk(plan: Plan, c: int, now: Configuration) -> None:
    """Give the common body the pose, within its joints' ranges, that fits its branch joints best.

    Gauss-Newton on the trunk's joint values; `now.wanted` holds where each branch would have its first node.
    """
    trunk = plan.chains[c]["trunk"]
    first, last = plan.trunks[trunk]["first"], plan.trunks[trunk]["last"]
    n, wanted, system = last - first, now.wanted, now.system
    for _step in range(FIT_STEPS):
        for i in range(n):
            for j in range(n + 1):
                system[i, j] = 0.0
        for b in range(plan.chains[c]["first"], plan.chains[c]["last"]):
            present = move(now.carriers[trunk + 1], vec(plan.nodes[plan.branches[b]["first"]]["home"]))
            miss = sub(vec(wanted[b]), present)
            for i in range(n):
                rate = scale(trunk_unit(plan, first + i), point_rate(plan, now, first + i, present))
                system[i, n] += dot(rate, miss)
                for j in range(n):
                    other = scale(trunk_unit(plan, first + j), point_rate(plan, now, first + j, present))
                    system[i, j] += dot(rate, other)
        solve_spd(system, n, FIT_DAMPING)
        for i in range(n):
            joint = plan.trunk_joints[first + i]
            value = now.trunks[first + i] + system[i, n] * trunk_unit(plan, first + i)
            now.trunks[first + i] = min(max(value, joint["lo"]), joint["hi"])
        move_carriers(plan, now)


@routine
def trunk_unit(plan: Plan, j: int) -> float:
    """Size of one unit step of a trunk joint's unknown: unknowns are lengths."""
    return 1.0 / plan.length if plan.trunk_joints[j]["kind"] == TURN else 1.0


@routine
def point_rate(plan: Plan, now: Configuration, j: int, p: Vec) -> Vec:
    """Velocity of the point `p` of a carrier per unit rate of its trunk joint `j`."""
    axis = vec(now.screws[j, 1])
    return axis if plan.trunk_joints[j]["kind"] == SLIDE else cross(axis, sub(p, vec(now.screws[j, 0])))


@routine
def turn_to_fit(plan: Plan, now: Configuration, about_reference: bool) -> None:
    """One Gauss-Newton step of the rigid best fit of the platform's points to the ends: the rotation.

    About the centroid of the points, which `move_to_centroid` has brought to that of the ends, or about the
    reference point where the position is held.
    """
    system = now.system
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
    solve_spd(system, 3, TURN_DAMPING)
    w = (system[0, 3], system[1, 3], system[2, 3])
    size = norm(w)
    if size > LARGEST_TURN:
        w = scale(LARGEST_TURN / size, w)
    fixed = add(p, turn(now.pose, centre))
    turn_pose(now.pose, w)
    orthonormalise(now.pose)
    moved = sub(fixed, turn(now.pose, centre))
    for i in range(3):
        now.pose[i, 3] = moved[i]
