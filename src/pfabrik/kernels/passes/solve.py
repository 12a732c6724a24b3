"""The paper's method: passes bring chains to targets, and unreached targets move to the ends of the chains."""

from __future__ import annotations

from ...common.arrays import Floats
from .._jit import routine, search
from ..vectors import copy_row, copy_table
from .accelerated import project_by_half_spaces
from .half_spaces import new_half_spaces
from .passes import reach_by_passes
from .plan import Configuration, PassResults, Plan, Seeds, Settings, load_seed, new_configuration
from .restrict import revise_target


@routine
def pass_over_chains(plan: Plan, config: Configuration, settings: Settings) -> tuple[float, int]:
    """Run the passes of every chain towards the present pose; return the largest end gap and the most iterations."""
    worst, iterations = 0.0, 0
    for c in range(plan.chains.shape[0]):
        gap, chain_iterations = reach_by_passes(plan, c, config, settings)
        worst, iterations = max(worst, gap), max(iterations, chain_iterations)
    return worst, iterations


@routine
def project_by_centroid(plan: Plan, config: Configuration, settings: Settings) -> tuple[float, int, int]:
    """Revise the target round by round until all chains reach it; return the largest gap, iterations and rounds."""
    gap, iterations = pass_over_chains(plan, config, settings)
    rounds = 0
    while gap > settings.tolerance and rounds < settings.max_rounds:
        revise_target(plan, config, settings)
        rounds += 1
        gap, more = pass_over_chains(plan, config, settings)
        iterations += more
    return gap, iterations, rounds


@routine
def write_row(i: int, config: Configuration, results: PassResults) -> None:
    """Write a configuration to row `i` of the results."""
    copy_table(config.pose, results.poses[i])
    copy_table(config.nodes, results.nodes[i])
    copy_row(config.trunks, results.trunks[i])


@search
def solve_by_passes(plan: Plan, targets: Floats, seeds: Seeds, settings: Settings, results: PassResults) -> None:
    """Solve for targets by plain or accelerated passes, and project unreached targets."""
    config, spaces = new_configuration(plan), new_half_spaces(plan)
    for i in range(targets.shape[0]):
        load_seed(plan, seeds, i, config)
        copy_table(targets[i], config.pose)
        if settings.is_accelerated == 1:
            gap, iterations, rounds = project_by_half_spaces(plan, config, targets[i], seeds, i, settings, spaces)
        else:
            gap, iterations, rounds = project_by_centroid(plan, config, settings)
        write_row(i, config, results)
        results.gaps[i] = gap
        results.iterations[i] = iterations
        results.rounds[i] = rounds
