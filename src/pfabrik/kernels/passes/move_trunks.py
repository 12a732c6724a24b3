"""Moves of trunks to where their branches reach a target, nearest to where they were."""

from __future__ import annotations

from ...arrays import Floats
from .._jit import routine
from ..vectors import copy_row, copy_table, move, put, vec
from .accelerated import reach_from_start
from .half_spaces import LeastStep
from .pass_constants import PATIENT
from .plan import Configuration, Plan, Settings, move_carriers


@routine
def place_at_home(plan: Plan, config: Configuration) -> None:
    """Place the nodes of all branches relative to their carriers as at home, and so in home's working mode."""
    for b in range(plan.branches.shape[0]):
        branch = plan.branches[b]
        for k in range(branch["first"], branch["last"] + 1):
            put(config.nodes[k], move(config.carriers[branch["carrier"]], vec(plan.nodes[k]["home"])))


@routine
def move_trunk(
    plan: Plan,
    target: Floats,
    trunks: Floats,
    settings: Settings,
    margin: float,
    config: Configuration,
    spaces: LeastStep,
) -> None:
    """Move trunks (n_trunk_joints,), deviations from home, to where their branches reach the target.

    Every chain has a trunk. A trunk whose branches already reach stays. A search that fails ends where it stalled.

    Parameters
    ----------
    margin : distance inside the limits at which steps aim [length].
    """
    copy_table(target, config.pose)
    copy_row(trunks, config.trunks)
    move_carriers(plan, config)
    place_at_home(plan, config)
    for k in range(spaces.normals.shape[0]):
        for j in range(spaces.normals.shape[1]):
            spaces.normals[k, j] = 0.0
    for c in range(plan.chains.shape[0]):
        reach_from_start(plan, c, config, settings, spaces, margin, PATIENT, True)
    copy_row(config.trunks, trunks)
