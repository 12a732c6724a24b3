"""Least-squares fits: of a trunk to the base nodes of its branches, and of the platform to the ends of chains."""

from __future__ import annotations

from .._jit import routine
from ..legs.complete_poses import orthonormalise, turn_pose
from ..linear import solve_spd
from ..vectors import Vec, add, along, cross, dot, move, norm, scale, sub, turn, vec
from .moving_frames import move_carriers
from .pass_constants import FIT_DAMPING, FIT_STEPS, LARGEST_TURN, TURN_DAMPING
from .plan import TRANSLATES, TURNS, Configuration, Plan, Settings


@routine
def fit_trunk(plan: Plan, c: int, config: Configuration) -> None:
    """Fit a trunk, within its joint ranges, to the positions that the forward pass gave the branches' first nodes.

    Gauss-Newton on the trunk's joint values. Branches whose first node is there already do not count.
    """
    trunk = plan.chains[c]["trunk"]
    first, last = plan.trunks[trunk]["first"], plan.trunks[trunk]["last"]
    n, base_targets, system = last - first, config.base_targets, config.system
    for _step in range(FIT_STEPS):
        for i in range(n):
            for j in range(n + 1):
                system[i, j] = 0.0
        for b in range(plan.chains[c]["first"], plan.chains[c]["last"]):
            if config.is_displaced[b] == 0:
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
