"""Jacobians of answers: from the legs' slopes in closed form where they exist, else from joint coordinates."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...common.arrays import Floats
from ...common.derived import derived
from ...kernels.handle import Scratch
from ...kernels.threads import in_blocks
from ...machine.model import Model
from ...machine.motion.mobility import generic_of
from ..joints.configurations import Configurations
from ..joints.first_order import forward_map as forward_by_joints
from ..joints.first_order import inverse_map as inverse_by_joints
from ..joints.first_order import units_of
from .answers import LegAnswers
from .coordinates import NO_ROWS
from .table import TableHandle, reading_scratch, reading_table

if TYPE_CHECKING:
    from ...kernels.pose.evaluate import EvaluationScratch, JacobianTables

ROWS_A_BLOCK = 512
"""Rows of one call of the kernel."""


class ByLegs(NamedTuple):
    """Arguments of the kernels for a machine whose Jacobians follow from its legs."""

    legs: TableHandle
    reading: Scratch[EvaluationScratch]
    scratch: Scratch[JacobianTables]
    rows: int  # number of constraints of the legs
    units: tuple[Floats, Floats]  # of the inverse Jacobian (n_a, r), and of the forward one (r, n_a)


def forward_map(model: Model, configurations: Configurations) -> Floats:
    """Twists per actuator rate at configurations, (n, 6, n_a) or (n, 3, n_a) [length, rad]; NaN where they are NaN."""
    return _map(model, configurations, forward_by_joints, is_forward=1)


def inverse_map(model: Model, configurations: Configurations) -> Floats:
    """Actuator rates per twist at configurations, (n, n_a, 6) or (n, n_a, 3) [length, rad]; NaN where they are NaN."""
    return _map(model, configurations, inverse_by_joints, is_forward=0)


def actuator_slopes(model: Model, poses: Floats) -> Floats | None:
    """Actuator rates per twist at poses (n, 4, 4) of home's working mode, (n, n_a, 6) [length, rad], by legs alone.

    Closed forms only, regardless of limits. NaN near dead points and where legs do not close. None if the legs have no
    closed form, or if the pose does not determine them.
    """
    from ...kernels.pose.evaluate import evaluate_poses

    if not model.has_legs or len(model.legs.redundant):
        return None
    table, n, (twists, actuators) = model.legs, len(poses), units_of(model)
    rows = int(table.task["rows"][0])
    constraints, slopes = np.empty((n, rows)), np.empty((n, rows + len(actuators), 6))
    handle, scratch = reading_table(table).address, reading_scratch(table)

    def run(block: slice) -> None:
        sides, rows_block = table.home_sides, constraints[block]
        with np.errstate(divide="ignore", invalid="ignore"):  # at dead points, if interpreted
            evaluate_poses(handle, scratch.address, poses[block], sides, NO_ROWS, NO_ROWS, rows_block, slopes[block])

    in_blocks(run, n, ROWS_A_BLOCK)
    return np.asarray(slopes[:, rows:, : len(twists)] * (actuators[:, None] / twists))


def regular_forward_map(model: Model, configurations: Configurations) -> Floats | None:
    """Forward map away from all singularities, NaN elsewhere; None if it does not follow from the legs' slopes."""
    maps = _from_slopes(model, configurations, is_forward=1)
    return None if maps is None else maps[0]


def _map(
    model: Model,
    configurations: Configurations,
    by_joints: Callable[[Model, Floats], Floats],
    *,
    is_forward: int,
) -> Floats:
    """Jacobians from the legs' slopes where they exist, from all joint coordinates elsewhere."""
    from_slopes = _from_slopes(model, configurations, is_forward=is_forward)
    if from_slopes is None:
        return by_joints(model, configurations.coordinates)
    maps, n_unsolved = from_slopes
    if n_unsolved:
        unsolved = np.flatnonzero(np.isnan(maps[:, 0, 0]))
        maps[unsolved] = by_joints(model, configurations.coordinates_at(unsolved))
    return maps


def _from_slopes(model: Model, configurations: Configurations, *, is_forward: int) -> tuple[Floats, int] | None:
    """Jacobians from the legs' slopes, NaN near singularities, and the number of these; None without legs."""
    by_legs = _by_legs(model) if isinstance(configurations, LegAnswers) else None
    if by_legs is None:
        return None
    assert isinstance(configurations, LegAnswers)
    units = by_legs.units[is_forward]
    maps = np.zeros((len(configurations), *units.shape))
    poses, sides = configurations.rows.poses, configurations.sides
    q_proximal = NO_ROWS if configurations.q_proximal is None else configurations.q_proximal

    def run(block: slice) -> int:
        return _fill_maps(by_legs, poses[block], sides[block], q_proximal[block], is_forward, maps[block])

    n_unsolved = sum(in_blocks(run, len(configurations), ROWS_A_BLOCK))
    maps *= units
    return maps, n_unsolved


def _fill_maps(by_legs: ByLegs, poses: Floats, sides: Floats, q_proximal: Floats, is_forward: int, maps: Floats) -> int:
    """Fill Jacobians at poses (n, 4, 4) [length]; return the number of unsolved rows, which are NaN.

    Parameters
    ----------
    sides, q_proximal : see `LegAnswers`; `q_proximal` has no rows if closed forms solve all.
    """
    from ...kernels.pose.evaluate import evaluate_poses, jacobians

    n, actuators = len(poses), len(by_legs.units[0])
    rows, slopes = np.empty((n, by_legs.rows)), np.empty((n, by_legs.rows + actuators, 6))
    poses = np.require(poses, requirements=["C", "W"])
    with np.errstate(divide="ignore", invalid="ignore"):  # at dead points, if interpreted
        evaluate_poses(by_legs.legs.address, by_legs.reading.address, poses, sides, q_proximal, NO_ROWS, rows, slopes)
    return jacobians(by_legs.scratch.address, slopes, is_forward, maps)


@derived
def _by_legs(model: Model) -> ByLegs | None:
    """Arguments of the kernels; None if the Jacobians do not follow from the legs.

    They follow if the pose determines all coordinates of the legs and all actuator motions move the end effector.
    """
    from ...kernels.pose.evaluate import new_jacobian_tables

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
