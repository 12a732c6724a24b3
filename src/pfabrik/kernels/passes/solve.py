"""The kernel of the paper's method: passes bring chains to targets, and unreached targets move to the chains' ends."""

from __future__ import annotations

import numpy as np

from ...arrays import Floats
from .._jit import allocator, routine, search
from ..vectors import along, copy_row, copy_table, move, put, sub, vec
from .fit import turn_to_fit
from .moving_frames import move_carriers, place_ends
from .passes import reach_by_passes
from .plan import TRANSLATES, TURNS, Configuration, PassResults, Plan, Seeds, Settings


@routine
def reach_pose(plan: Plan, config: Configuration, settings: Settings) -> tuple[float, int]:
    """Run the passes of every chain towards the present pose; the largest end gap, and the most iterations."""
    worst, iterations = 0.0, 0
    for c in range(plan.chains.shape[0]):
        gap, chain_iterations = reach_by_passes(plan, c, config, settings)
        worst, iterations = max(worst, gap), max(iterations, chain_iterations)
    return worst, iterations


@routine
def move_to_centroid(plan: Plan, config: Configuration) -> None:
    """The paper's projection: move the target by the mean gap of the ends, with its orientation held."""
    n = plan.branches.shape[0]
    shift = (0.0, 0.0, 0.0)
    for b in range(n):
        branch = plan.branches[b]
        miss = sub(vec(config.nodes[branch["last"]]), move(config.pose, vec(branch["end"])))
        shift = along(shift, 1.0 / n, miss)
    for i in range(3):
        config.pose[i, 3] += shift[i]


@routine
def project_target(plan: Plan, config: Configuration, settings: Settings) -> tuple[float, int, int]:
    """Revise the target round by round until every chain reaches it; the largest gap, iterations and rounds."""
    gap, iterations = reach_pose(plan, config, settings)
    rounds = 0
    while gap > settings.enough and rounds < settings.max_rounds:
        if settings.free & TRANSLATES:
            move_to_centroid(plan, config)
        if settings.free & TURNS:
            turn_to_fit(plan, config, settings.free == TURNS)
        rounds += 1
        gap, more = reach_pose(plan, config, settings)
        iterations += more
    return gap, iterations, rounds


@allocator
def new_configuration(plan: Plan) -> Configuration:
    """Allocate a configuration."""
    unknowns = max(plan.trunk_joints.shape[0], 3)
    return Configuration(
        np.zeros((4, 4)),
        np.zeros((plan.nodes.shape[0], 3)),
        np.zeros(plan.trunk_joints.shape[0]),
        np.zeros((plan.trunks.shape[0] + 1, 3, 4)),
        np.zeros((plan.trunk_joints.shape[0], 2, 3)),
        np.zeros((plan.branches.shape[0], 3)),
        np.zeros(plan.branches.shape[0], np.int64),
        np.zeros((unknowns, unknowns + 1)),
    )


@routine
def load_seed(plan: Plan, seeds: Seeds, i: int, config: Configuration) -> None:
    """Load seed `i`, or the only one; nodes that are not stored follow from the pose and the trunks."""
    row = i if seeds.poses.shape[0] > 1 else 0
    copy_table(seeds.poses[row], config.pose)
    copy_row(seeds.trunks[row], config.trunks)
    move_carriers(plan, config)
    for k in range(plan.nodes.shape[0]):
        if plan.nodes[k]["stored"] >= 0:
            put(config.nodes[k], vec(seeds.nodes[row, plan.nodes[k]["stored"]]))
    for c in range(plan.chains.shape[0]):
        place_ends(plan, c, config)


@routine
def write_row(plan: Plan, i: int, config: Configuration, results: PassResults) -> None:
    """Write a configuration to row `i` of the results."""
    copy_table(config.pose, results.poses[i])
    copy_row(config.trunks, results.trunks[i])
    for k in range(plan.nodes.shape[0]):
        if plan.nodes[k]["stored"] >= 0:
            put(results.nodes[i, plan.nodes[k]["stored"]], vec(config.nodes[k]))


@search
def solve_by_passes(plan: Plan, targets: Floats, seeds: Seeds, settings: Settings, results: PassResults) -> None:
    """Run passes towards every target, and move targets that are not reached."""
    config = new_configuration(plan)
    for i in range(targets.shape[0]):
        load_seed(plan, seeds, i, config)
        copy_table(targets[i], config.pose)
        gap, iterations, rounds = project_target(plan, config, settings)
        write_row(plan, i, config, results)
        results.gaps[i] = gap
        results.iterations[i] = iterations
        results.rounds[i] = rounds
