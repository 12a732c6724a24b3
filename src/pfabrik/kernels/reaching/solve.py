"""The kernel of the paper's method: chains reach for targets by passes, and targets move to where they reach."""

from __future__ import annotations

import numpy as np

from ...arrays import Floats
from .._jit import allocator, routine, search
from ..vectors import along, copy_row, copy_table, move, put, sub, vec
from .fit import turn_to_fit
from .frames import move_carriers, place_ends
from .passes import reach_by_passes
from .plan import TRANSLATES, TURNS, Configuration, PassResults, Plan, Seeds, Settings


@routine
def reach_pose(plan: Plan, now: Configuration, settings: Settings) -> tuple[float, int]:
    """Let every chain reach for the present pose; the largest end gap left, and the most iterations."""
    worst, iterations = 0.0, 0
    for c in range(plan.chains.shape[0]):
        gap, chain_iterations = reach_by_passes(plan, c, now, settings)
        worst, iterations = max(worst, gap), max(iterations, chain_iterations)
    return worst, iterations


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
def project_target(plan: Plan, now: Configuration, settings: Settings) -> tuple[float, int, int]:
    """Revise the target round by round until every chain reaches it; the gap left, iterations and rounds."""
    gap, iterations = reach_pose(plan, now, settings)
    rounds = 0
    while gap > settings.enough and rounds < settings.max_rounds:
        if settings.free & TRANSLATES:
            move_to_centroid(plan, now)
        if settings.free & TURNS:
            turn_to_fit(plan, now, settings.free == TURNS)
        rounds += 1
        gap, more = reach_pose(plan, now, settings)
        iterations += more
    return gap, iterations, rounds


@allocator
def new_configuration(plan: Plan) -> Configuration:
    unknowns = max(plan.trunk_joints.shape[0], 3)
    return Configuration(
        np.zeros((4, 4)),
        np.zeros((plan.nodes.shape[0], 3)),
        np.zeros(plan.trunk_joints.shape[0]),
        np.zeros((plan.trunks.shape[0] + 1, 3, 4)),
        np.zeros((plan.trunk_joints.shape[0], 2, 3)),
        np.zeros((plan.branches.shape[0], 3)),
        np.zeros((unknowns, unknowns + 1)),
    )


@routine
def load_seed(plan: Plan, seeds: Seeds, i: int, now: Configuration) -> None:
    """Take up seed `i` (or the only one); the nodes that are not stored follow from the pose and the trunks."""
    row = i if seeds.poses.shape[0] > 1 else 0
    copy_table(seeds.poses[row], now.pose)
    copy_row(seeds.trunks[row], now.trunks)
    move_carriers(plan, now)
    for k in range(plan.nodes.shape[0]):
        if plan.nodes[k]["stored"] >= 0:
            put(now.nodes[k], vec(seeds.nodes[row, plan.nodes[k]["stored"]]))
    for c in range(plan.chains.shape[0]):
        place_ends(plan, c, now)


@routine
def write_row(plan: Plan, i: int, now: Configuration, reached: PassResults) -> None:
    """The configuration that answers row `i`."""
    copy_table(now.pose, reached.poses[i])
    copy_row(now.trunks, reached.trunks[i])
    for k in range(plan.nodes.shape[0]):
        if plan.nodes[k]["stored"] >= 0:
            put(reached.nodes[i, plan.nodes[k]["stored"]], vec(now.nodes[k]))


@search
def solve_by_passes(plan: Plan, targets: Floats, seeds: Seeds, settings: Settings, reached: PassResults) -> None:
    """Let chains reach for every target, and move those they do not reach."""
    now = new_configuration(plan)
    for i in range(targets.shape[0]):
        load_seed(plan, seeds, i, now)
        copy_table(targets[i], now.pose)
        gap, iterations, rounds = project_target(plan, now, settings)
        write_row(plan, i, now, reached)
        reached.gaps[i] = gap
        reached.iterations[i] = iterations
        reached.rounds[i] = rounds
