"""Jacobians of answers: of legs in closed form by the legs' own slopes, of all others by their joint coordinates."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..arrays import Floats
from ..closure.configurations import Configurations
from ..closure.first_order import forward_map as forward_by_joints
from ..closure.first_order import inverse_map as inverse_by_joints
from ..decomposition.leg_table import LegTable, leg_table
from ..description.mechanism import Mechanism
from ..kernels.handle import Scratch
from ..kernels.threads import in_blocks
from ..motion.mobility import generic_of
from .answers import LegAnswers
from .table import Machine, reading_table

if TYPE_CHECKING:
    from ..kernels.platform.jacobians import JacobianTables

ROWS_A_BLOCK = 512
"""Rows of one call of the kernel."""


class ByLegs(NamedTuple):
    """What the kernel is given of a machine, and the shape of its forward Jacobian."""

    legs: Machine
    scratch: Scratch[JacobianTables]
    shape: tuple[int, int]


def forward_map(mechanism: Mechanism, found: Configurations) -> Floats:
    """Twists per actuator rate at configurations: (n, 6, n_a) or (n, 3, n_a) [length, rad]; NaN where these are."""
    return _map(mechanism, found, forward_by_joints, is_forward=1)


def inverse_map(mechanism: Mechanism, found: Configurations) -> Floats:
    """Actuator rates per twist at configurations: (n, n_a, 6) or (n, n_a, 3) [length, rad]; NaN where these are."""
    return _map(mechanism, found, inverse_by_joints, is_forward=0)


def _map(
    mechanism: Mechanism,
    found: Configurations,
    by_joints: Callable[[Mechanism, Floats], Floats],
    *,
    is_forward: int,
) -> Floats:
    """Jacobians by the legs where these tell them, by all joint coordinates elsewhere."""
    own = by_legs(mechanism) if isinstance(found, LegAnswers) else None
    if own is None:
        return by_joints(mechanism, found.coordinates)
    from ..kernels.platform.jacobians import jacobians

    assert isinstance(found, LegAnswers)
    n, sides = len(found), found.sides
    poses = np.require(found.rows.poses, requirements=["C", "W"])
    maps, is_told = np.empty((n, *own.shape[:: 1 if is_forward else -1])), np.empty(n, np.bool_)

    def run(block: slice) -> int:
        machine, scratch = own.legs.address, own.scratch.address
        return jacobians(machine, scratch, poses[block], sides[block], is_forward, maps[block], is_told[block])

    if sum(in_blocks(run, n, ROWS_A_BLOCK)):
        rest = np.flatnonzero(~is_told)
        maps[rest] = by_joints(mechanism, found.coordinates_at(rest))
    return maps


@lru_cache(maxsize=64)
def by_legs(mechanism: Mechanism) -> ByLegs | None:
    """What the kernel is given; None where legs do not tell Jacobians.

    They do where the pose tells all coordinates of the legs, and all motions of actuators move the end effector.
    """
    table, counts = leg_table(mechanism), generic_of(mechanism).mobility
    twists, actuators = 3 if mechanism.end_effector_is_joint else 6, len(mechanism.actuator_names)
    if not isinstance(table, LegTable) or len(table.redundant) or counts.internal or counts.uncontrolled:
        return None
    rank = twists - counts.platform
    if counts.platform == 0 or rank > table.task["rows"][0]:
        return None
    from ..kernels.platform.jacobians import new_jacobian_tables

    legs = reading_table(table)
    return ByLegs(legs, Scratch(new_jacobian_tables, legs.record, rank, twists), (twists, actuators))
