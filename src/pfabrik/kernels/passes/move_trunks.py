"""Trunks moved, from where they are, by the least steps that let the branches on them reach."""

from __future__ import annotations

from ...arrays import Floats
from .._jit import routine
from ..vectors import copy_row, copy_table, move, put, vec
from .accelerated import reach_from_start
from .half_spaces import LeastStep
from .moving_frames import move_carriers
from .pass_constants import PATIENT
from .plan import Configuration, Plan, Settings


@routine
def stand_as_at_home(plan: Plan, config: Configuration) -> None:
    """Place the nodes of all branches as their carriers have them at home: legs of two parts on the sides of home."""
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
    """Move trunks (n_trunk_joints,), deviations from home, until their branches reach the target, if they can.

    Every chain has a trunk. Where its branches reach already it stays; where it is caught, it is left there.

    Parameters
    ----------
    margin : how far inside limits steps aim [length].
    """
    copy_table(target, config.pose)
    copy_row(trunks, config.trunks)
    move_carriers(plan, config)
    stand_as_at_home(plan, config)
    for k in range(spaces.normals.shape[0]):
        for j in range(spaces.normals.shape[1]):
            spaces.normals[k, j] = 0.0
    for c in range(plan.chains.shape[0]):
        reach_from_start(plan, c, config, settings, spaces, margin, PATIENT, True)
    copy_row(config.trunks, trunks)
