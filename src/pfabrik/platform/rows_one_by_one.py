"""Rows of targets or actuated values answered one by one, by the kernel that knows all phases of an answer."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..batch import put, take, take_each
from ..closure.configurations import Configurations
from ..kernels.platform.search_records import PoseSolutions
from ..kernels.platform.tables import IN_OTHER_MODES, Start
from ..kernels.rows import Rows
from ..kernels.threads import in_blocks
from ..model import Model
from ..options import USUAL, Options
from .links_of_legs import links_of_legs
from .tables import handle_of, home_of, question_of, scratch_of_answers

ROWS_A_BLOCK, ROWS_A_RUN = 16, 1024


class Answers(NamedTuple):
    """Answers of a batch."""

    rows: Rows
    q: Floats  # (n, legs): proximal coordinates found by a search, where closed forms are less exact; else NaN
    sides: Floats  # (n, legs): the side of each leg at the answer; at the start of rows that are not answered


class Request(NamedTuple):
    """A machine, with the options common to all rows."""

    model: Model
    options: Options
    start: Start  # one for all rows or one for each
    has_start: bool  # it was given, and is not home
    keep_mode: bool  # answers are in its working mode, or its assembly mode
    nearby: bool  # searches stay around it, as along a path
    tolerance: float | None = None  # of actuated values that are asked for [L or rad]; None where targets are


def request_from(
    model: Model,
    options: Options,
    start: Configurations | None,
    sides: Floats,
    keep_mode: bool,
    nearby: bool,
    tolerance: float | None = None,
) -> Request:
    """What is asked of rows from a start, one or one for each, with legs on some sides; None for home."""
    own = home_of(model)
    if start is not None:
        own = Start(start.rows.poses, sides, np.require(start.rows.actuators, requirements=["C", "W"]))
    return Request(model, options, own, start is not None, keep_mode, nearby, tolerance)


def answer_phases(
    request: Request, asked: Floats, answers: Answers, places: NDArray[np.intp], first: int, last: int
) -> None:
    """Answer targets (n, 4, 4), or values (n, n_a), at some places by some of the phases of `answer_row`."""
    model, options, start, has_start, keep_mode, nearby, tolerance = request
    if len(places) < len(asked):
        block, start = take(answers, places), take_each(start, places)
        answer_phases(request._replace(start=start), asked[places], block, np.arange(len(places)), first, last)
        put(answers, places, block)
        return
    from ..kernels.platform.answer_rows import answer_rows

    has_seeds = last > IN_OTHER_MODES and (tolerance is not None or not nearby)  # values may fit in another mode alone
    tables = handle_of(model, options, with_seeds=has_seeds)
    most_steps = options.most_steps or 0
    question = question_of(
        tolerance is not None, first, last, has_start, keep_mode, nearby, most_steps, tolerance or 0.0
    )
    scratch, distances, rows = scratch_of_answers(tables), np.empty(len(asked)), answers.rows
    found = rows.counters, rows.actuators, rows.measures, rows.status
    outputs = PoseSolutions(distances, rows.poses, answers.q, answers.sides, *found)
    given = asked if tolerance is None else asked[:, None]

    def run(given: Floats, *arrays: Any) -> int:
        return answer_rows(tables.address, scratch.address, question.address, given, *arrays)

    if len(asked) <= ROWS_A_BLOCK:
        run(given, *start, *outputs)
    else:
        in_blocks(
            lambda part: run(given[part], *take_each(start, part), *take(outputs, part)), len(asked), ROWS_A_BLOCK
        )


def mark_near(model: Model, rows: Rows, sides: Floats) -> int:
    """Make rows TOO_NEAR that legs reach on sides (n or 1, legs), but with links nearer than the clearance; how many.

    None where searches in joint coordinates keep the links apart.
    """
    if not len(links_of_legs(model).pairs):
        return 0
    from ..kernels.platform.answer_rows import mark_near as mark

    tables = handle_of(model, USUAL, with_seeds=False)
    scratch = scratch_of_answers(tables)

    def run(block: slice) -> int:
        own = sides if len(sides) == 1 else sides[block]
        return mark(tables.address, scratch.address, rows.poses[block], own, rows.status[block])

    return sum(in_blocks(run, len(rows.status), ROWS_A_RUN))


def step_redundant_joints(model: Model, targets: Floats, sides: Floats) -> None:
    """Move redundant joints, (n, legs), by the least steps that keep the limits of the legs on them.

    A step keeps limits to first order, and few suffice. Where they do not, or no trunk has these joints, limits stay
    exceeded: rows are solved only if legs say so.
    """
    from ..kernels.platform.answer_rows import step_rows

    tables = handle_of(model, Options(), with_seeds=False)
    scratch = scratch_of_answers(tables)
    in_blocks(
        lambda part: step_rows(tables.address, scratch.address, targets[part], sides[part]), len(sides), ROWS_A_BLOCK
    )
