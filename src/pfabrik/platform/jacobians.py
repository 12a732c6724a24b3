"""Jacobians of answers: of legs in closed form by the legs' own slopes, of all others by their joint coordinates."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..arrays import Floats
from ..closure.configurations import Configurations
from ..closure.first_order import forward_map as forward_by_joints
from ..closure.first_order import inverse_map as inverse_by_joints
from ..closure.first_order import units_of
from ..derived import derived
from ..kernels.handle import Scratch
from ..kernels.threads import in_blocks
from ..model import Model
from ..motion.mobility import generic_of
from .answers import LegAnswers
from .coordinates import NO_ROWS
from .table import TableHandle, reading_scratch, reading_table

if TYPE_CHECKING:
    from ..kernels.platform.evaluate import EvaluationScratch
    from ..kernels.platform.jacobians import JacobianTables

ROWS_A_BLOCK = 512
"""Rows of one call of the kernel."""


class ByLegs(NamedTuple):
    """A machine whose Jacobians follow from its legs, as the kernels take it."""

    legs: TableHandle
    reading: Scratch[EvaluationScratch]
    scratch: Scratch[JacobianTables]
    rows: int  # how many constraints the legs have
    units: tuple[Floats, Floats]  # of the inverse Jacobian (n_a, r), and of the forward one (r, n_a)


def forward_map(model: Model, found: Configurations) -> Floats:
    """Twists per actuator rate at configurations: (n, 6, n_a) or (n, 3, n_a) [length, rad]; NaN where these are."""
    return _map(model, found, forward_by_joints, is_forward=1)


def inverse_map(model: Model, found: Configurations) -> Floats:
    """Actuator rates per twist at configurations: (n, n_a, 6) or (n, n_a, 3) [length, rad]; NaN where these are."""
    return _map(model, found, inverse_by_joints, is_forward=0)


def actuator_slopes(model: Model, poses: Floats) -> Floats | None:
    """Actuator rates per twist at poses (n, 4, 4) of home's working mode, (n, n_a, 6) [length, rad], by legs alone.

    Nothing is searched for, and no limit is asked. NaN near dead points, and where legs do not close. None if the legs
    have no closed form, or the pose does not determine them.
    """
    from ..kernels.platform.evaluate import evaluate_poses

    if not model.has_legs or len(model.legs.redundant):
        return None
    table, n, (twists, actuators) = model.legs, len(poses), units_of(model)
    rows = int(table.task["rows"][0])
    constraints, slopes = np.empty((n, rows)), np.empty((n, rows + len(actuators), 6))
    handle, scratch = reading_table(table).address, reading_scratch(table)

    def run(block: slice) -> None:
        sides, given, rows_block = table.home_sides, NO_ROWS, constraints[block]
        with np.errstate(divide="ignore", invalid="ignore"):  # at dead points, if interpreted
            evaluate_poses(handle, scratch.address, poses[block], sides, given, NO_ROWS, rows_block, slopes[block])

    in_blocks(run, n, ROWS_A_BLOCK)
    return np.asarray(slopes[:, rows:, : len(twists)] * (actuators[:, None] / twists))


def regular_forward_map(model: Model, found: Configurations) -> Floats | None:
    """`forward_map` away from all singularities, NaN elsewhere; None if it does not follow from the legs' slopes."""
    maps = _from_slopes(model, found, is_forward=1)
    return None if maps is None else maps[0]


def _map(
    model: Model,
    found: Configurations,
    by_joints: Callable[[Model, Floats], Floats],
    *,
    is_forward: int,
) -> Floats:
    """Jacobians from the legs' slopes where they exist, from all joint coordinates elsewhere."""
    from_slopes = _from_slopes(model, found, is_forward=is_forward)
    if from_slopes is None:
        return by_joints(model, found.coordinates)
    maps, n_unsolved = from_slopes
    if n_unsolved:
        rest = np.flatnonzero(np.isnan(maps[:, 0, 0]))
        maps[rest] = by_joints(model, found.coordinates_at(rest))
    return maps


def _from_slopes(model: Model, found: Configurations, *, is_forward: int) -> tuple[Floats, int] | None:
    """Jacobians from the legs' slopes, NaN near singularities, and how many are; None if legs do not tell them."""
    by_legs = _by_legs(model) if isinstance(found, LegAnswers) else None
    if by_legs is None:
        return None
    assert isinstance(found, LegAnswers)
    units = by_legs.units[is_forward]
    maps = np.zeros((len(found), *units.shape))
    given = NO_ROWS if found.q_proximal is None else found.q_proximal

    def run(block: slice) -> int:
        return _put_maps(by_legs, found.rows.poses[block], found.sides[block], given[block], is_forward, maps[block])

    unsolved = in_blocks(run, len(found), ROWS_A_BLOCK)
    maps *= units
    return maps, sum(unsolved)


def _put_maps(own: ByLegs, poses: Floats, sides: Floats, q_proximal: Floats, is_forward: int, maps: Floats) -> int:
    """Fill Jacobians at poses (n, 4, 4) [length]; return how many are not solved, which are NaN.

    Parameters
    ----------
    sides, q_proximal : of `LegAnswers`; no rows of these if closed forms solve all.
    """
    from ..kernels.platform.evaluate import evaluate_poses
    from ..kernels.platform.jacobians import jacobians

    n, actuators = len(poses), len(own.units[0])
    rows, slopes = np.empty((n, own.rows)), np.empty((n, own.rows + actuators, 6))
    poses = np.require(poses, requirements=["C", "W"])
    with np.errstate(divide="ignore", invalid="ignore"):  # at dead points, if interpreted
        evaluate_poses(own.legs.address, own.reading.address, poses, sides, q_proximal, NO_ROWS, rows, slopes)
    return jacobians(own.scratch.address, slopes, is_forward, maps)


@derived
def _by_legs(model: Model) -> ByLegs | None:
    """A machine as the kernels take it; None if its Jacobians do not follow from its legs.

    They do if the pose determines all coordinates of the legs, and all motions of actuators move the end effector.
    """
    from ..kernels.platform.jacobians import new_jacobian_tables

    counts = generic_of(model.mechanism).mobility
    if not model.has_legs or len(model.legs.redundant) or counts.internal or counts.uncontrolled:
        return None
    table, (twists, actuators) = model.legs, units_of(model)
    rows, rank = int(table.task["rows"][0]), len(twists) - counts.platform
    if not counts.platform > 0 or rank > rows:
        return None
    scratch = Scratch(new_jacobian_tables, rows, rank, len(twists), len(actuators))
    units = actuators[:, None] / twists, twists[:, None] / actuators
    return ByLegs(reading_table(table), reading_scratch(table), scratch, rows, units)
