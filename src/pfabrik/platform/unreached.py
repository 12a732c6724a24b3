"""Targets that legs do not reach on the sides they start on: other working modes, then the nearest feasible poses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..closure.configurations import put_rows, rows_at
from ..closure.descend import within_sight
from ..closure.projection import kept, ways_of
from ..closure.solve import STRANGE
from ..decomposition.leg_table import LegTable
from ..description.mechanism import Mechanism
from ..description.task import task_of
from ..kernels.platform.records import Found
from ..kernels.reaching import plan as P
from ..kernels.threads import in_blocks
from ..options import Options
from ..poses import are_poses, made_exact
from ..tolerances import TOLERANCES
from .nearest import in_lengths, project, starts_at
from .table import kernel_table

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


def answer_unreached(question: Question, rest: NDArray[np.intp], sides: Floats, rows: P.Rows) -> Floats:
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
    rest = rest[are_poses(targets[rest])]
    if not keep_mode:
        rest = _reach_otherwise(question, rest, sides, rows)
    if not len(rest):
        return carriers
    wanted, places = made_exact(targets[rest]), rest[:1] if len(begins) == 1 else rest
    own = starts_at(mechanism, table, begins[places % len(begins)], sides[places])
    ways = ways_of(mechanism, options.hold, options.rotation_length)
    sought = within_sight(mechanism, wanted)
    found, holds = project(mechanism, table, sought, own, ways, corners=not question.nearby, stays=keep_mode)
    placed = np.flatnonzero(np.isfinite(found.distances))
    found, rest, wanted = Found._make(array[placed] for array in found), rest[placed], wanted[placed]
    sides[rest], carriers[rest] = found.sides, found.q
    _put_projected(question, rest, wanted, found, holds[placed], rows)
    is_near = found.distances <= NEARLY
    again = np.flatnonzero(is_near | (table.task[0]["unset"] > 0))
    if len(again):
        left = _reach_again(question, rest[again], sides, rows)
        carriers[rest[again[~left]]] = np.nan
        lost = rest[again[left & is_near[again]]]
        rows.status[lost], carriers[lost] = P.PENDING, np.nan
    return carriers


def _reach_otherwise(question: Question, rest: NDArray[np.intp], sides: Floats, rows: P.Rows) -> NDArray[np.intp]:
    """Answer rows in other working modes; which are left."""
    from ..kernels.platform.otherwise import answer_otherwise

    begins, own, tried = question.begins, rows_at(rows, rest), sides[rest]
    first = begins if len(begins) == 1 else begins[rest]
    legs, targets = kernel_table(question.table), question.targets[rest]

    def run(block: slice) -> int:
        return answer_otherwise(
            legs,
            targets[block],
            first if len(first) == 1 else first[block],
            tried[block],
            own.status[block],
            own.poses[block],
            own.actuators[block],
            own.measures[block],
        )

    in_blocks(run, len(rest), ROWS_A_BLOCK)
    reached = own.status == P.REACHED
    put_rows(rows, rest[reached], rows_at(own, reached))
    sides[rest[reached]] = tried[reached]
    return np.asarray(rest[~reached])


def _reach_again(question: Question, again: NDArray[np.intp], sides: Floats, rows: P.Rows) -> NDArray[np.bool_]:
    """Answer rows exactly from where their projections ended; which stay as they are."""
    from ..kernels.legs.answer import answer

    table, own = question.table, rows_at(rows, again)
    begins = own.poses.copy()
    answer(
        table.legs,
        table.limited,
        table.cones,
        table.driven,
        table.task_within(STRANGE) if question.nearby else table.task,
        question.targets[again],
        begins,
        sides[again],
        own.status,
        own.poses,
        own.actuators,
        own.measures,
    )
    own.measures[:, [P.POSITION_ERROR, P.ROTATION_ERROR]] = 0.0
    left = own.status != P.REACHED
    put_rows(rows, again[~left], rows_at(own, ~left))
    return np.asarray(left)


def _put_projected(
    question: Question, rest: NDArray[np.intp], wanted: Floats, found: Found, holds: NDArray[np.int64], rows: P.Rows
) -> None:
    """Write configurations found for rows `rest`, and how far they are from what was wanted."""
    from ..kernels.platform.nearest import judge

    mechanism, options = question.mechanism, question.options
    own = rows_at(rows, rest)
    judge(kernel_table(question.table), found.poses, found.q, found.sides, own.actuators, own.measures)
    own.poses[:] = in_lengths(found.poses, mechanism.characteristic_length)
    own.measures[:, P.RESIDUAL] *= mechanism.characteristic_length
    position, rotation = task_of(mechanism).errors(own.poses, wanted)
    own.measures[:, P.POSITION_ERROR], own.measures[:, P.ROTATION_ERROR] = position, rotation
    own.counters[:, P.ITERATIONS] = found.steps
    own.counters[:, P.HELD] = kept(mechanism, holds, own.poses, wanted)
    is_near = position <= (options.tolerance or TOLERANCES.position * mechanism.characteristic_length)
    own.status[:] = np.where(is_near & (rotation <= options.rotation_tolerance), P.REACHED, P.PROJECTED)
    put_rows(rows, rest, own)
