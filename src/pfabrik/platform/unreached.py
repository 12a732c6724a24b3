"""Targets that legs do not reach on the sides they start on: other working modes, then the nearest feasible poses."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Mask
from ..closure.close import in_lengths
from ..closure.configurations import new_rows, put_rows, rows_at
from ..closure.parasitic import is_flipped
from ..decomposition.leg_table import LegTable
from ..description.mechanism import Mechanism
from ..kernels.platform.records import Found, Starts
from ..kernels.rows import PENDING, POSITION_ERROR, PROJECTED, REACHED, ROTATION_ERROR, UNSURE, Rows
from ..kernels.threads import in_blocks
from ..options import Options
from .nearest import project
from .nearest_pose import starts_at
from .seeds import seeds_of_other_assemblies
from .table import Machine, local_table, machine

ROWS_A_BLOCK = 64

NEARLY = 1e-4
"""Distance at which a projection is as good as reached, and is to be so exactly [L]."""


class Question(NamedTuple):
    """What is asked of all targets.

    With `keep_mode` in the working mode of the start; `nearby`, as along a path, about the start alone.
    """

    mechanism: Mechanism
    table: LegTable
    options: Options
    keep_mode: bool
    nearby: bool


class Unreached(NamedTuple):
    """Targets that are not reached, and what is told of them."""

    targets: Floats  # (n, 4, 4) [length]
    begins: Floats  # (n or 1, 4, 4) [length]: poses that they are to be reached from
    sides: Floats  # (n, legs): which of its two solutions each leg starts on; of an answer, which it takes
    q_proximal: Floats  # (n, legs) [L or rad]: of an answer, where closed forms tell them less exactly; else NaN
    rows: Rows

    def at(self, places: Mask | NDArray[np.intp] | slice) -> Unreached:
        """Those at some places, copied but for those of a slice."""
        begins = self.begins if len(self.begins) == 1 else self.begins[places]
        arrays = self.targets[places], begins, self.sides[places], self.q_proximal[places]
        return Unreached(*arrays, rows_at(self.rows, places))

    def put(self, places: Mask | NDArray[np.intp], others: Unreached) -> None:
        """Write what is told of others at some places."""
        self.sides[places], self.q_proximal[places] = others.sides, others.q_proximal
        put_rows(self.rows, places, others.rows)

    def answer(self, which: Mask, answer: Callable[[Unreached], None]) -> None:
        """Have some of them answered; where that is all, without a copy."""
        n = np.count_nonzero(which)
        if n == len(which):
            answer(self)
        elif n:
            others = self.at(which)
            answer(others)
            self.put(which, others)


@cache
def _answer() -> Callable[..., int]:
    from ..kernels.legs.answer import answer

    return answer


@cache
def _answer_otherwise() -> Callable[..., int]:
    from ..kernels.platform.otherwise import answer_otherwise

    return answer_otherwise


def answer_unreached(question: Question, some: Unreached) -> None:
    """Answer targets in other working modes, or by the nearest feasible poses; some may stay PENDING or UNSURE."""
    table = question.table
    if question.keep_mode or not table.has_sides:
        _answer_completed(question, some)
    else:
        some.answer(_reach_otherwise(table, some), partial(_answer_completed, question))


def _answer_completed(question: Question, some: Unreached) -> None:
    """Answer targets in other ways of assembly, where poses are completed, or by the nearest feasible poses."""
    if question.keep_mode or not question.table.is_completed:
        _project(question, some)
        return
    seeds = seeds_of_other_assemblies(question.mechanism)
    if len(seeds.poses):
        some.answer(_reach_from(seeds, question, some), partial(_project, question))
    else:
        _project(question, some)


def _reach_otherwise(table: LegTable, some: Unreached) -> Mask:
    """Answer rows in other working modes; which are left, but for those that wait for another engine: closed forms tell
    too little of a leg at a dead point."""
    targets, begins, sides, _, rows = some
    legs, tried, status = machine(table), sides.copy(), np.empty_like(rows.status)
    told, answer = (tried, status, rows.poses, rows.actuators, rows.measures), _answer_otherwise()

    def run(block: slice) -> int:
        begin = begins if len(begins) == 1 else begins[block]
        return answer(legs.address, targets[block], begin, *(array[block] for array in told))

    if len(targets) <= ROWS_A_BLOCK:
        left = answer(legs.address, targets, begins, *told)
    else:
        left = sum(in_blocks(run, len(targets), ROWS_A_BLOCK))
    if left < len(targets):
        reached = status == REACHED
        rows.status[reached], sides[reached] = REACHED, tried[reached]
    return np.asarray(status == PENDING)


def _reach_from(seeds: Starts, question: Question, some: Unreached) -> Mask:
    """Answer rows in other ways of assembly, completed from the nearest corner that leads to one; which are left."""
    length, legs, k = question.mechanism.characteristic_length, machine(question.table), len(seeds.poses)
    poses = in_lengths(seeds.poses, length)

    def reach(block: slice) -> Mask:
        own = some.at(block)
        n = len(own.targets)
        begins, ends = np.concatenate([poses] * n), np.concatenate([seeds.sides] * n)
        targets, rows = np.repeat(own.targets, k, axis=0), new_rows(question.mechanism, n * k)
        every = Unreached(targets, begins, ends, np.empty_like(ends), rows)
        _complete(legs, begins, ends, every)
        reached = rows.status == REACHED
        reached[reached] = ~is_flipped(question.mechanism, rows.poses[reached])
        reached = reached.reshape(n, k)
        found = reached.any(axis=1)
        if np.count_nonzero(found):
            wanted = in_lengths(own.targets, 1.0 / length)[:, None]
            scale = np.abs(wanted).max(axis=(1, 2, 3), initial=1.0)  # squares of what is farther may be infinite
            away = np.square((seeds.poses - wanted)[:, :, :3] / scale[:, None, None, None]).sum(axis=(2, 3))
            nearest = np.where(reached, away, np.inf).argmin(axis=1)
            own.put(found, every.at((np.arange(0, n * k, k) + nearest)[found]))
        return np.asarray(~found)

    return np.concatenate(in_blocks(reach, len(some.targets), ROWS_A_BLOCK))


def _project(question: Question, some: Unreached) -> None:
    """Answer rows by the nearest feasible poses, and exactly from there where these are as good as reached, or the task
    leaves some of the pose open. Those as good as reached that are not, and not certain to be the nearest, are UNSURE.
    """
    mechanism, table, options, keep_mode, nearby = question
    targets, begins, sides, q_proximal, rows = some
    n, own = len(targets), starts_at(mechanism, table, begins, sides[: len(begins)])
    ends = rows.poses, np.empty_like(q_proximal), np.empty_like(sides)
    found = Found(np.empty(n), *ends, rows.counters, rows.actuators, rows.measures, rows.status)
    left = project(mechanism, options, targets, own, found, seeds=not nearby, stays=keep_mode)
    if left == n:
        return
    placed = slice(None) if left == 0 else found.distances < np.inf
    sides[placed], q_proximal[placed] = found.sides[placed], found.q[placed]
    is_near = (found.distances <= NEARLY) & ~(rows.certain & (rows.status == PROJECTED))
    if np.count_nonzero(is_near):
        rows.status[is_near] = UNSURE
    asked = (local_table if nearby else machine)(table)
    some.answer(found.distances < np.inf if table.is_partial else is_near, partial(_reach_again, asked))


def _reach_again(asked: Machine, some: Unreached) -> None:
    """Answer rows exactly from where their projections ended; others stay as they are."""
    _complete(asked, some.rows.poses.copy(), some.sides.copy(), some)


def _complete(asked: Machine, begins: Floats, ends: Floats, some: Unreached) -> None:
    """Answer rows from as many poses (n, 4, 4) [length], on sides (n, legs); others stay as they are."""
    targets, _, sides, q_proximal, rows = some
    status = np.empty_like(rows.status)
    told = status, rows.poses, rows.actuators, rows.measures
    if _answer()(asked.address, targets, begins, ends, *told) < len(targets):
        reached = status == REACHED
        rows.status[reached], sides[reached], q_proximal[reached] = REACHED, ends[reached], np.nan
        rows.measures[reached, POSITION_ERROR] = rows.measures[reached, ROTATION_ERROR] = 0.0
