"""Targets that legs do not reach on the sides they start on: other working modes, then the nearest feasible poses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Ints, Mask
from ..closure.configurations import put_rows, rows_at
from ..closure.projection import kept, ways_of
from ..decomposition.leg_table import LegTable
from ..description.mechanism import Mechanism
from ..kernels.platform.records import Found
from ..kernels.rows import HOLD, ITERATIONS, PENDING, POSITION_ERROR, PROJECTED, REACHED, ROTATION_ERROR, Rows
from ..kernels.threads import in_blocks
from ..options import Options
from ..tolerances import TOLERANCES
from .approach import in_lengths, starts_at
from .corners import assembled_otherwise
from .nearest import project
from .table import Machine, machine, machine_nearby

ROWS_A_BLOCK = 64

NEARLY = 1e-4
"""Distance at which a projection is as good as reached, and is to be so exactly [L]."""


class Question(NamedTuple):
    """What is asked: targets (n, 4, 4) [length], to be reached from poses (n or 1, 4, 4).

    With `keep_mode` in the working mode of the start; `nearby`, as along a path, about the start alone.
    """

    mechanism: Mechanism
    table: LegTable
    targets: Floats
    begins: Floats
    options: Options
    keep_mode: bool
    nearby: bool


def answer_unreached(question: Question, rest: NDArray[np.intp], sides: Floats, rows: Rows) -> Floats:
    """Answer the rows `rest` in other working modes, or by the nearest feasible poses; some may stay PENDING.

    Parameters
    ----------
    sides : which of its two solutions each leg starts on, (n, legs); those of the answers are written into it.

    Returns
    -------
    Coordinates of the legs' carriers (n, legs) [L or rad] where closed forms tell them less exactly; else NaN.
    """
    mechanism, table, targets, begins, options, keep_mode, _ = question
    carriers = np.full(sides.shape, np.nan)
    if not keep_mode and table.home_sides.any():
        rest = _reach_otherwise(question, rest, sides, rows)
    if not keep_mode and len(rest) and table.task[0]["unset"] + table.task[0]["led"] > 0:
        rest = _reach_from_corners(question, rest, sides, rows)
    if not len(rest):
        return carriers
    places = rest[:1] if len(begins) == 1 else rest
    own = starts_at(mechanism, table, begins[places % len(begins)], sides[places])
    ways = ways_of(mechanism, options.hold, options.rotation_length)
    found, holds = project(mechanism, table, targets[rest], own, ways, corners=not question.nearby, stays=keep_mode)
    placed = np.isfinite(found.distances)
    if not placed.all():
        found, rest, holds = Found._make(array[placed] for array in found), rest[placed], holds[placed]
    sides[rest], carriers[rest] = found.sides, found.q
    _put_projected(question, rest, found, holds, rows)
    is_near = found.distances <= NEARLY
    again = np.flatnonzero(is_near | (table.task[0]["unset"] > 0))
    if len(again):
        left = _reach_again(question, rest[again], sides, rows)
        carriers[rest[again[~left]]] = np.nan
        lost = rest[again[left & is_near[again]]]
        rows.status[lost], carriers[lost] = PENDING, np.nan
    return carriers


def _reach_otherwise(question: Question, rest: NDArray[np.intp], sides: Floats, rows: Rows) -> NDArray[np.intp]:
    """Answer rows in other working modes; which are left, but for those that wait for another engine: closed forms tell
    too little of a leg at a dead point."""
    from ..kernels.platform.otherwise import UNSURE, answer_otherwise

    begins, own, tried = question.begins, rows_at(rows, rest), sides[rest]
    first = begins if len(begins) == 1 else begins[rest]
    legs, targets = machine(question.table), question.targets[rest]

    def run(block: slice) -> int:
        return answer_otherwise(
            legs.address,
            targets[block],
            first if len(first) == 1 else first[block],
            tried[block],
            own.status[block],
            own.poses[block],
            own.actuators[block],
            own.measures[block],
        )

    in_blocks(run, len(rest), ROWS_A_BLOCK)
    reached = own.status == REACHED
    if reached.any():
        put_rows(rows, rest[reached], rows_at(own, reached))
        sides[rest[reached]] = tried[reached]
    left: NDArray[np.intp] = rest[~reached & (own.status != UNSURE)]
    return left


def _reach_from_corners(question: Question, rest: NDArray[np.intp], sides: Floats, rows: Rows) -> NDArray[np.intp]:
    """Answer rows in other ways of assembly, completed from corners, the nearest first; which are left."""
    length = question.mechanism.characteristic_length
    corners, targets = assembled_otherwise(question.mechanism), in_lengths(question.targets[rest], 1.0 / length)
    poses = in_lengths(corners.poses, length)
    away = np.square((corners.poses[:, None] - targets)[:, :, :3]).sum(axis=(2, 3))
    for places in np.argsort(away, axis=0):
        waiting = np.flatnonzero(rows.status[rest] != REACHED)
        if not len(waiting):
            break
        begins, ends = poses[places[waiting]], corners.sides[places[waiting]]
        _complete(question, machine(question.table), rest[waiting], begins, ends, sides, rows)
    left: NDArray[np.intp] = rest[rows.status[rest] != REACHED]
    return left


def _reach_again(question: Question, again: NDArray[np.intp], sides: Floats, rows: Rows) -> Mask:
    """Answer rows exactly from where their projections ended; which stay as they are."""
    asked = (machine_nearby if question.nearby else machine)(question.table)
    return _complete(question, asked, again, rows.poses[again], sides[again], sides, rows)


def _complete(
    question: Question, asked: Machine, some: NDArray[np.intp], begins: Floats, ends: Floats, sides: Floats, rows: Rows
) -> Mask:
    """Answer some rows from as many poses (m, 4, 4) [length], on sides (m, legs); which stay as they are."""
    from ..kernels.legs.answer import answer

    own = rows_at(rows, some)
    answer(asked.address, question.targets[some], begins, ends, own.status, own.poses, own.actuators, own.measures)
    own.measures[:, [POSITION_ERROR, ROTATION_ERROR]] = 0.0
    left = own.status != REACHED
    if not left.all():
        put_rows(rows, some[~left], rows_at(own, ~left))
        sides[some[~left]] = ends[~left]
    return np.asarray(left)


def _put_projected(question: Question, rest: NDArray[np.intp], found: Found, holds: Ints, rows: Rows) -> None:
    """Write configurations found for rows `rest`."""
    mechanism, options = question.mechanism, question.options
    position, rotation = found.measures[:, POSITION_ERROR], found.measures[:, ROTATION_ERROR]
    is_near = position <= (options.tolerance or TOLERANCES.position * mechanism.characteristic_length)
    rows.status[rest] = np.where(is_near & (rotation <= options.rotation_tolerance), REACHED, PROJECTED)
    rows.poses[rest], rows.actuators[rest], rows.measures[rest] = found.poses, found.actuators, found.measures
    rows.counters[rest, ITERATIONS] = found.steps
    rows.counters[rest, HOLD] = kept(mechanism, holds, position, rotation)
