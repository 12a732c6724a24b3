"""Forward kinematics of legs in closed form."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Mask
from ..batch import put, take, take_each
from ..closure.assemble import NOISE, is_over_determined
from ..closure.configurations import Configurations, new_rows
from ..closure.parasitic import differences
from ..derived import derived
from ..kernels.handle import Handle
from ..kernels.platform.search_records import Starts
from ..kernels.rows import (
    ACTUATOR_ERROR,
    EXCEEDED,
    ITERATIONS,
    PENDING,
    POSITION_ERROR,
    PROJECTED,
    REACHED,
    ROTATION_ERROR,
    Rows,
)
from ..kernels.threads import in_blocks
from ..model import Model
from ..tolerances import TOLERANCES
from .nearest import nearest_actuators
from .nearest_pose import home_start, no_starts, starts_at
from .seeds import seeds_of
from .single import AssemblyOutputs, scratch_of
from .table import search_table

ROWS_A_BLOCK = 256

WAY_HALVINGS = 12
"""Halvings that find the last configuration of an assembly mode on the way to values beyond."""


def forward_kinematics(
    model: Model,
    values: Floats,
    start: Configurations | None,
    sides: Floats,
    tolerance: float,
    given: tuple[Rows, AssemblyOutputs] | None,
    *,
    keep_mode: bool,
) -> tuple[Rows, Floats, Floats]:
    """Configurations within all limits at actuated values (n, n_a); rows without one are PENDING.

    Rows that do not assemble in the assembly mode of the start are projected. In any mode, rows that do not assemble
    from home are assembled from seeds before. Rows that do not assemble from a given start are projected first; where
    that misses their values, they are assembled from home and from seeds, unless they assemble in the mode of the
    start, but beyond a limit.

    Parameters
    ----------
    sides : of each leg at the start, (n or 1, legs).
    keep_mode : stay in the assembly mode of the start. Readings of more actuators than freedoms, which fit nowhere
        else, are looked for everywhere.
    given : the outputs of a single row whose assembly from the start failed already.

    Returns
    -------
    The rows, the coordinates of proximal joints (n, legs) [L or rad], and the sides of the answers (n, legs).
    """
    is_cold = start is None
    starts = home_start(model) if start is None else starts_at(model, start.rows.poses, sides)
    rows, (wanted_values, *outputs) = given or _assembled_from(model, values, starts)
    solution, is_missed = Starts(rows.poses, *outputs), rows.status == PENDING
    assemble_missed = partial(_assemble_missed, model, values, rows, wanted_values, solution)
    if not np.count_nonzero(rows.status):
        return rows, solution.q, solution.sides
    keep_mode = keep_mode and not is_over_determined(model.closure)
    if is_cold and not keep_mode:
        assemble_missed(starts, seeds_of, np.flatnonzero(rows.status != REACHED))
    unsolved = np.flatnonzero(rows.status != REACHED)
    if not len(unsolved):
        return rows, solution.q, solution.sides
    rows.status[unsolved] = PENDING
    _project(model, wanted_values, starts, unsolved, rows, solution, anywhere=is_cold)
    if keep_mode:
        home = np.array([[drive.home for drive in model.mechanism.drives]])
        begin = home if start is None else start.rows.actuators
        _return_to_mode(model, values, wanted_values, begin, starts, unsolved, rows, solution, tolerance)
    nearby = unsolved[rows.measures[unsolved, ACTUATOR_ERROR] <= tolerance]
    rows.status[nearby[rows.status[nearby] == PROJECTED]] = REACHED
    is_missed &= rows.status != REACHED
    if is_cold or keep_mode or not np.count_nonzero(is_missed):
        return rows, solution.q, solution.sides
    if is_over_determined(model.closure):
        is_missed &= (rows.status == PENDING) | (rows.measures[:, ACTUATOR_ERROR] > NOISE)
    assemble_missed(starts, _starts_elsewhere, np.flatnonzero(is_missed))
    assemble_missed(home_start(model), seeds_of, np.flatnonzero(is_missed & (rows.status != REACHED)))
    missed = np.flatnonzero(is_missed & (rows.status != REACHED))
    if len(missed):
        _project_elsewhere(model, wanted_values, starts, missed, rows, values, solution, tolerance)
    return rows, solution.q, solution.sides


def project_values(
    model: Model, values: Floats, start: Configurations | None, sides: Floats, tolerance: float
) -> tuple[Rows, Floats, Floats]:
    """The feasible configurations whose actuators are nearest to values (n, n_a); the rest as `forward_kinematics`."""
    starts = home_start(model) if start is None else starts_at(model, start.rows.poses, sides)
    rows, (wanted_values, *outputs) = _assembled_from(model, values, starts)
    solution, every = Starts(rows.poses, *outputs), np.arange(len(values))
    rows.status[:] = PENDING
    _project(model, wanted_values, starts, every, rows, solution, anywhere=start is None)
    is_near = (rows.status == PROJECTED) & (rows.measures[:, ACTUATOR_ERROR] <= tolerance)
    rows.status[is_near] = REACHED
    return rows, solution.q, solution.sides


@derived
def _starts_elsewhere(model: Model) -> Starts:
    """Home, then the seeds."""
    home = home_start(model)
    return Starts(*(np.concatenate(both) for both in zip(home, seeds_of(model), strict=True)))


def _assemble_missed(
    model: Model,
    values: Floats,
    rows: Rows,
    nearest_values: Floats,
    solution: Starts,
    starts: Starts,
    other_starts: Callable[[Model], Starts],
    places: NDArray[np.intp],
) -> None:
    """Assemble missed rows from other starts, the nearest to their own first; rows reached replace their outputs.

    From their own start actuators are led to their values by continuation; `starts` may be home for that.
    """
    if not len(places):
        return
    outputs, values_here = [rows.status, nearest_values, *solution, rows.measures], values[places]
    block = [array[places] for array in outputs]
    _assemble(model, take_each(starts, places), other_starts(model), [values_here, *block])
    is_reached = block[0] == REACHED
    for array, block_array in zip(outputs, block, strict=True):
        array[places[is_reached]] = block_array[is_reached]
    rows.actuators[places[is_reached]] = values_here[is_reached]
    rows.measures[places[is_reached], ACTUATOR_ERROR] = 0.0


def _return_to_mode(
    model: Model,
    values: Floats,
    wanted_values: Floats,
    begin: Floats,
    starts: Starts,
    places: NDArray[np.intp],
    rows: Rows,
    solution: Starts,
    tolerance: float,
) -> None:
    """Replace projections that are in another assembly mode than their starts: by those of searches from the starts
    alone, or by the last configurations within limits on the way from there, with actuators `begin`, to the values."""
    places = places[_is_elsewhere(model, starts, places, rows, tolerance)]
    if not len(places):
        return
    rows.status[places], rows.actuators[places] = PENDING, values[places]
    _project(model, wanted_values, starts, places, rows, solution, anywhere=False)
    places = places[_is_elsewhere(model, starts, places, rows, tolerance)]
    asked, own_starts, share = values[places], take_each(starts, places), np.zeros(len(places))
    begin = begin if len(begin) == 1 else begin[places]
    rows.status[places] = PENDING
    for halving in (0.0, *0.5 ** np.arange(1.0, WAY_HALVINGS)):
        block, outputs = _assembled_from(model, begin + (share + halving)[:, None] * (asked - begin), own_starts)
        reached = np.flatnonzero(block.status == REACHED)
        share[reached] += halving
        block.status[:] = PROJECTED
        errors = np.abs(block.actuators - asked)[:, model.legs.driven["column"]] / model.legs.driven["unit"]
        block.measures[:, ACTUATOR_ERROR] = errors.max(axis=1, initial=0.0)
        here = places[reached]
        put(rows, here, take(block, reached))
        solution.q[here], solution.sides[here] = outputs.q[reached], outputs.sides[reached]


def _is_elsewhere(model: Model, starts: Starts, places: NDArray[np.intp], rows: Rows, tolerance: float) -> Mask:
    """True for rows that are not what their start assembles to at their values, (n,).

    Values to which the mode of the start does not lead count as elsewhere if they are those asked for; else they are on
    the border of what assembles.
    """
    own, _ = _assembled_from(model, rows.actuators[places], take_each(starts, places))
    away = differences(model.closure, own.poses, rows.poses[places]) > TOLERANCES.stretched
    is_asked_for = (rows.status[places] == PROJECTED) & (rows.measures[places, ACTUATOR_ERROR] <= tolerance)
    return np.asarray(np.where(own.status == PENDING, is_asked_for, (own.status == EXCEEDED) | away))


def _project_elsewhere(
    model: Model,
    wanted_values: Floats,
    starts: Starts,
    places: NDArray[np.intp],
    rows: Rows,
    values: Floats,
    solution: Starts,
    tolerance: float,
) -> None:
    """Project rows from seeds too; rows that have their values then replace their outputs."""
    block = take(rows, places)
    block_solution = Starts(block.poses, solution.q[places], solution.sides[places])
    block.actuators[:] = values[places]
    _project(
        model,
        wanted_values[places],
        take_each(starts, places),
        np.arange(len(places)),
        block,
        block_solution,
        anywhere=True,
    )
    is_reached = (block.status == PROJECTED) & (block.measures[:, ACTUATOR_ERROR] <= tolerance)
    block.status[is_reached] = REACHED
    for array, block_array in zip(
        (*rows, solution.q, solution.sides), (*block, block_solution.q, block_solution.sides), strict=True
    ):
        array[places[is_reached]] = block_array[is_reached]


def _assembled_from(model: Model, values: Floats, starts: Starts) -> tuple[Rows, AssemblyOutputs]:
    """Rows assembled at actuated values (n, n_a) from one start each, or one for all; PENDING where that fails."""
    rows, shape = new_rows(model, len(values)), (len(values), len(model.legs.legs))
    outputs = AssemblyOutputs(np.zeros_like(values), np.zeros(shape), np.zeros(shape))
    rows.actuators[:] = values
    arrays = rows.status, outputs.values, rows.poses, outputs.q, outputs.sides, rows.measures
    _assemble(model, starts, no_starts(model.legs), (rows.actuators, *arrays))
    return rows, outputs


def _project(
    model: Model,
    values: Floats,
    starts: Starts,
    places: NDArray[np.intp],
    rows: Rows,
    solution: Starts,
    *,
    anywhere: bool,
) -> None:
    """Answer rows by the feasible configurations whose actuators are nearest to their values.

    The search takes angles modulo whole turns. Rows whose nearest turn is out of range stay PENDING.
    """
    block_starts = take_each(starts, places)
    nearest = nearest_actuators(model, values[places], block_starts, seeds=anywhere)
    solved = np.flatnonzero(np.isfinite(nearest.distances))
    nearest, places = take(nearest, solved), places[solved]
    block_values, actuators, measures = rows.actuators[places], nearest.actuators, nearest.measures
    measures[:, [POSITION_ERROR, ROTATION_ERROR]] = 0.0
    is_turned = np.zeros(len(places), bool)
    for driven in model.legs.driven:
        column = driven["column"]
        column_values = actuators[:, column]  # a view
        if driven["turns"] == 1 and driven["hi"] - driven["lo"] > 2.0 * np.pi:
            nearest_turn = column_values + 2.0 * np.pi * np.round(
                (block_values[:, column] - column_values) / (2.0 * np.pi)
            )
            is_inside = (nearest_turn >= driven["home"] + driven["lo"]) & (
                nearest_turn <= driven["home"] + driven["hi"]
            )
            column_values[:] = np.where(is_inside, nearest_turn, column_values)
            is_turned |= ~is_inside
        error = np.abs(column_values - block_values[:, column]) / driven["unit"]
        measures[:, ACTUATOR_ERROR] = np.maximum(measures[:, ACTUATOR_ERROR], error)
    rows.actuators[places], rows.measures[places] = actuators, measures
    rows.status[places] = np.where(is_turned, PENDING, PROJECTED)
    rows.counters[places, ITERATIONS] = nearest.counters[:, ITERATIONS]
    rows.poses[places], solution.q[places], solution.sides[places] = nearest.poses, nearest.q, nearest.sides


def _assemble(model: Model, starts: Starts, other_starts: Starts, arrays: Sequence[NDArray[Any]]) -> None:
    """Assemble rows on all cores; the arrays are the actuators, then the outputs of the kernel."""
    from ..kernels.platform.forward import assemble

    legs, scratch, others_handle = search_table(model.legs), scratch_of(model), Handle(other_starts)

    def run(block: slice) -> None:
        block_starts, (values, *outputs) = Handle(take_each(starts, block)), (array[block] for array in arrays)
        assemble(legs.address, scratch.address, values, block_starts.address, others_handle.address, *outputs)

    in_blocks(run, len(arrays[0]), ROWS_A_BLOCK)
