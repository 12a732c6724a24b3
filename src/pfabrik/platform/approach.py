"""Searches in the pose of the platform: where they start, and the kernel asked of rows on all cores."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..arrays import Floats, Records
from ..decomposition.leg_table import LegTable
from ..description.mechanism import Mechanism
from ..kernels.closure.loops import LOCKED, PoseObjective
from ..kernels.handle import Handle
from ..kernels.legs import records as K
from ..kernels.platform.records import Aim, Found, Starts
from ..kernels.rows import LIMIT_EXCESS
from ..kernels.threads import in_blocks
from ..tolerances import TOLERANCES
from .rotation import implied_rows, without_idle_legs
from .table import OF_AIMS, machine_searched

HITS, HITS_OF_STRUTS, HITS_OF_VALUES = 4, 3, 8
"""How many searches must end at the nearest configuration, and one more for each that ends elsewhere: fewer where
struts leave the platform all its freedoms, and have no two ways to bend; more where actuators have values, which a
platform nearly has in many poses."""

HITS_OF_MANY = 8
"""The same where arms are led, or task and legs do not tell all of a pose: there are many more configurations."""

ROWS_A_BLOCK = 16


def approached(
    mechanism: Mechanism,
    table: LegTable,
    objective: PoseObjective,
    own: Starts,
    others: Starts,
    values: Floats | None = None,
    driven: Records | None = None,
    *,
    stays: bool = False,
    minds_aims: bool = False,
) -> tuple[Found, Floats]:
    """The kernel over all rows, on all cores: what was found, or what holds them where they start.

    Parameters
    ----------
    values : what coordinates, those of actuators if no others are `driven`, are to be near to; see `Aim`.
    minds_aims : keep on the way, too, to where crossed hinges can point their rods. Rows that end where they cannot are
        searched for again like this: a way that is barred ends earlier.
    """
    from ..kernels.platform.nearest import approach

    at_home = table.task[0]["rotations"] == 0 and objective.platform[3] == LOCKED and objective.max_iterations > 0
    asked = without_idle_legs(table) if at_home and not len(table.arms) else machine_searched(table)
    asked = asked if driven is None else Handle(asked.record._replace(driven=driven))
    found, legs = new_found(len(objective.targets), table), asked.record
    limits = 2 * len(legs.limited) + len(legs.cones) + len(legs.legs)
    minds_aims = minds_aims or objective.max_iterations == 0
    minded = len(legs.cones) if minds_aims else int((legs.cones["leader"] != OF_AIMS).sum())
    weights = np.zeros((len(objective.targets), limits))
    hits = _hits(table) if values is None else HITS_OF_VALUES
    implied = implied_rows(mechanism) if not len(table.arms) else 0
    near = np.zeros((0, len(legs.driven))) if values is None else values

    def run(block: slice) -> None:
        first = own if len(own.poses) == 1 else own.at(block)
        aim = Aim(objective._replace(targets=objective.targets[block]), near[block], implied)
        into = Found._make(array[block] for array in found)
        approach(asked.address, aim, first, others, hits, int(stays), minded, into, weights[block])

    in_blocks(run, len(found.distances), ROWS_A_BLOCK)
    astray = found.measures[:, LIMIT_EXCESS] > TOLERANCES.limit
    if minded < len(legs.cones) and astray.any():
        begin = own if len(own.poses) == 1 else own.at(np.flatnonzero(astray))
        again = objective._replace(targets=objective.targets[astray])
        asked_values = None if values is None else values[astray]
        pointed = approached(
            mechanism, table, again, begin, others, asked_values, driven, stays=stays, minds_aims=True
        )[0]
        for array, tried in zip(found, pointed, strict=True):
            array[astray] = tried
    return found, weights


@lru_cache(maxsize=64)
def _hits(table: LegTable) -> int:
    task = table.task[0]
    if table.leads_arms or task["unset"] + task["arms"] > task["rows"]:
        return HITS_OF_MANY
    return HITS if table.task[0]["rows"] > 0 or len(carriers_of(table)) else HITS_OF_STRUTS


def carriers_of(table: LegTable) -> Records:
    """The coordinates of carriers among those known."""
    on_rods = table.legs["kind"][table.known["leg"]] == K.ROD
    return np.asarray(table.known[on_rods & (table.known["place"] == K.CARRIER)])


def new_found(n: int, table: LegTable) -> Found:
    legs, actuators = len(table.legs), len(table.driven)
    return Found(
        np.full(n, np.inf),
        np.zeros((n, 4, 4)),
        np.zeros((n, legs)),
        np.zeros((n, legs)),
        np.zeros(n, np.int64),
        np.zeros((n, actuators)),
        np.zeros((n, 5)),
    )


def no_starts(table: LegTable) -> Starts:
    return Starts(np.zeros((0, 4, 4)), np.zeros((0, len(table.legs))), np.zeros((0, len(table.legs))))


def starts_at(mechanism: Mechanism, table: LegTable, poses: Floats, sides: Floats) -> Starts:
    """Poses (n, 4, 4) [length] with legs on given sides, (n, legs), as starts."""
    return Starts(in_lengths(poses, 1.0 / mechanism.characteristic_length), np.zeros((0, len(table.legs))), sides)


def home_start(mechanism: Mechanism, table: LegTable) -> Starts:
    """Home, as a start."""
    poses = in_lengths(mechanism.home_pose[None], 1.0 / mechanism.characteristic_length)
    return Starts(poses, np.zeros((1, len(table.legs))), table.home_sides)


def in_lengths(poses: Floats, scale: float) -> Floats:
    """Poses with their positions scaled, copied."""
    scaled = np.array(poses)
    scaled[:, :3, 3] *= scale
    return scaled
