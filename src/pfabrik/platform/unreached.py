"""Targets that legs do not reach in the working mode of the start: other modes, then the nearest feasible poses."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Mask
from ..batch import put, take
from ..closure.close import in_lengths
from ..closure.configurations import new_rows
from ..closure.parasitic import is_flipped
from ..decomposition.leg_table import LegTable
from ..kernels.platform.search_records import PoseSolutions, Starts
from ..kernels.rows import PENDING, POSITION_ERROR, PROJECTED, REACHED, ROTATION_ERROR, UNSURE, Rows
from ..kernels.threads import in_blocks
from ..model import Model
from ..options import Options
from .nearest import nearest_poses
from .nearest_pose import starts_at
from .seeds import seeds_of_other_assemblies
from .table import TableHandle, local_table, table_handle

ROWS_A_BLOCK = 64

NEARLY = 1e-4
"""Distance below which a projection is close enough to its target to try to reach it exactly [L]."""


class Request(NamedTuple):
    """The machine, and the options that hold for all targets of a batch.

    With `keep_mode` answers are in the working mode of the start. With `nearby`, as along a path, searches stay around
    the start. With `has_start` it was given, and is not home.
    """

    model: Model
    options: Options
    keep_mode: bool
    nearby: bool
    has_start: bool


class Unreached(NamedTuple):
    """A batch of targets that are not reached yet, and the outputs for them."""

    targets: Floats  # (n, 4, 4) [length]
    start_poses: Floats  # (n or 1, 4, 4) [length]
    sides: Floats  # (n, legs): the side of each leg at the start; once solved, at the answer
    q_proximal: Floats  # (n, legs) [L or rad]: found by a search, where closed forms are less exact; else NaN
    rows: Rows

    def at(self, places: Mask | NDArray[np.intp] | slice) -> Unreached:
        """A part of the batch: copied, or views where `places` is a slice."""
        start_poses = self.start_poses if len(self.start_poses) == 1 else self.start_poses[places]
        arrays = self.targets[places], start_poses, self.sides[places], self.q_proximal[places]
        return Unreached(*arrays, take(self.rows, places))

    def put(self, places: Mask | NDArray[np.intp], block: Unreached) -> None:
        """Write the outputs of a part of the batch."""
        self.sides[places], self.q_proximal[places] = block.sides, block.q_proximal
        put(self.rows, places, block.rows)

    def answer(self, mask: Mask, answer: Callable[[Unreached], None]) -> None:
        """Call `answer` on the masked rows and store its outputs; no copy is made where these are all rows."""
        n = np.count_nonzero(mask)
        if n == len(mask):
            answer(self)
        elif n:
            block = self.at(mask)
            answer(block)
            self.put(mask, block)


@cache
def _answer_kernel() -> Callable[..., int]:
    from ..kernels.legs.answer import answer

    return answer


@cache
def _answer_otherwise_kernel() -> Callable[..., int]:
    from ..kernels.platform.any_mode import answer_in_any_mode

    return answer_in_any_mode


def answer_unreached(request: Request, unreached: Unreached) -> None:
    """Answer targets in other working modes, or by the nearest feasible poses. Rows may stay PENDING or UNSURE."""
    table = request.model.legs
    if request.keep_mode or not table.has_sides:
        _answer_completed(request, unreached)
    else:
        unreached.answer(reach_in_other_modes(table, unreached), partial(_answer_completed, request))


def _answer_completed(request: Request, unreached: Unreached) -> None:
    """Answer targets in other assemblies, where poses are completed, or by the nearest feasible poses."""
    if request.keep_mode or not request.model.legs.is_completed:
        _project(request, unreached)
        return
    seeds = seeds_of_other_assemblies(request.model)
    if len(seeds.poses):
        unreached.answer(reach_from_seeds(seeds, request, unreached), partial(_project, request))
    else:
        _project(request, unreached)


def reach_in_other_modes(table: LegTable, unreached: Unreached) -> Mask:
    """Answer rows in other working modes; return the mask of rows still to be projected.

    Rows with a leg at a dead point are not among these: closed forms are too inexact there, and another engine answers.
    """
    targets, start_poses, sides, _, rows = unreached
    legs, other_sides, status = table_handle(table), sides.copy(), np.empty_like(rows.status)
    outputs, answer = (other_sides, status, rows.poses, rows.actuators, rows.measures), _answer_otherwise_kernel()

    def run(block: slice) -> int:
        block_poses = start_poses if len(start_poses) == 1 else start_poses[block]
        return answer(legs.address, targets[block], block_poses, *(array[block] for array in outputs))

    if len(targets) <= ROWS_A_BLOCK:
        n_unsolved = answer(legs.address, targets, start_poses, *outputs)
    else:
        n_unsolved = sum(in_blocks(run, len(targets), ROWS_A_BLOCK))
    if n_unsolved < len(targets):
        reached = status == REACHED
        rows.status[reached], sides[reached] = REACHED, other_sides[reached]
    return np.asarray(status == PENDING)


def reach_from_seeds(seeds: Starts, request: Request, unreached: Unreached) -> Mask:
    """Answer rows in other assemblies, completed from the nearest seed that leads to one; return the unsolved mask."""
    length, legs, k = request.model.length, table_handle(request.model.legs), len(seeds.poses)
    poses = in_lengths(seeds.poses, length)

    def reach(part: slice) -> Mask:
        block = unreached.at(part)
        n = len(block.targets)
        start_poses, end_sides = np.concatenate([poses] * n), np.concatenate([seeds.sides] * n)
        targets, rows = np.repeat(block.targets, k, axis=0), new_rows(request.model, n * k)
        candidates = Unreached(targets, start_poses, end_sides, np.empty_like(end_sides), rows)
        reach_from_poses(legs, start_poses, end_sides, candidates)
        is_reached = rows.status == REACHED
        is_reached[is_reached] = ~is_flipped(request.model.path_closure, rows.poses[is_reached])
        is_reached = is_reached.reshape(n, k)
        is_solved = is_reached.any(axis=1)
        if np.count_nonzero(is_solved):
            poses_of_targets = in_lengths(block.targets, 1.0 / length)[:, None]
            # relative to the largest coordinate: squares of far targets may be infinite
            scale = np.abs(poses_of_targets).max(axis=(1, 2, 3), initial=1.0)
            distances = np.square((seeds.poses - poses_of_targets)[:, :, :3] / scale[:, None, None, None]).sum(
                axis=(2, 3)
            )
            nearest = np.where(is_reached, distances, np.inf).argmin(axis=1)
            block.put(is_solved, candidates.at((np.arange(0, n * k, k) + nearest)[is_solved]))
        return np.asarray(~is_solved)

    return np.concatenate(in_blocks(reach, len(unreached.targets), ROWS_A_BLOCK))


def _project(request: Request, unreached: Unreached) -> None:
    """Answer rows by the nearest feasible poses.

    From a pose within `NEARLY` of its target, and from every pose where the task leaves some of it open, legs then try
    to reach the target exactly. A row within `NEARLY` that stays unreached, and has no certificate, is UNSURE.
    """
    distances, rows, legs = project(request, unreached), unreached.rows, request.model.legs
    is_near = distances <= NEARLY
    if np.count_nonzero(is_near):
        is_near &= ~(rows.certain & (rows.status == PROJECTED))
        rows.status[is_near] = UNSURE
    handle = (local_table if request.nearby else table_handle)(legs)
    unreached.answer(distances < np.inf if legs.is_partial else is_near, partial(_reach_exactly, handle))


def project(request: Request, unreached: Unreached) -> Floats:
    """Answer rows by the nearest feasible poses alone; their distances (n,) [L], infinite where none is found."""
    model, options, keep_mode, nearby, has_start = request
    targets, start_poses, sides, q_proximal, rows = unreached
    n, starts = len(targets), starts_at(model, start_poses, sides[: len(start_poses)])
    end_state = rows.poses, np.empty_like(q_proximal), np.empty_like(sides)
    solution = PoseSolutions(np.empty(n), *end_state, rows.counters, rows.actuators, rows.measures, rows.status)
    n_unsolved = nearest_poses(
        model, options, targets, starts, solution, seeds=not nearby, keep_mode=keep_mode, has_start=has_start
    )
    if n_unsolved < n:
        solved = slice(None) if n_unsolved == 0 else solution.distances < np.inf
        sides[solved], q_proximal[solved] = solution.sides[solved], solution.q[solved]
    return solution.distances


def _reach_exactly(legs: TableHandle, unreached: Unreached) -> None:
    """Reach targets exactly from the poses of their projections; rows not reached keep their outputs."""
    reach_from_poses(legs, unreached.rows.poses.copy(), unreached.sides.copy(), unreached)


def reach_from_poses(legs: TableHandle, start_poses: Floats, end_sides: Floats, unreached: Unreached) -> None:
    """Reach targets from poses (n, 4, 4) [length] on sides (n, legs); rows not reached keep their outputs."""
    targets, _, sides, q_proximal, rows = unreached
    status = np.empty_like(rows.status)
    outputs = status, rows.poses, rows.actuators, rows.measures
    if _answer_kernel()(legs.address, targets, start_poses, end_sides, *outputs) < len(targets):
        is_reached = status == REACHED
        rows.status[is_reached], sides[is_reached], q_proximal[is_reached] = REACHED, end_sides[is_reached], np.nan
        rows.measures[is_reached, POSITION_ERROR] = rows.measures[is_reached, ROTATION_ERROR] = 0.0
