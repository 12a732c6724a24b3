"""Targets that legs do not reach on the sides of the start: other modes, then the nearest feasible poses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..batch import put, take, take_each
from ..kernels.handle import Handle
from ..kernels.platform.search_records import PoseSolutions
from ..kernels.platform.tables import EXACTLY, IN_OTHER_ASSEMBLIES, IN_OTHER_MODES, Start, Tables
from ..kernels.rows import OPEN, Rows
from ..kernels.threads import in_blocks
from ..model import Model
from ..options import Options
from .tables import handle_of, has_seeds, question, scratch_of_answers

ROWS_A_BLOCK = 16


class Answers(NamedTuple):
    """Answers of a batch."""

    rows: Rows
    q: Floats  # (n, legs): proximal coordinates found by a search, where closed forms are less exact; else NaN
    sides: Floats  # (n, legs): the side of each leg at the answer; at the start of rows that are not answered


def answer_unreached(
    model: Model,
    options: Options,
    targets: Floats,
    start: Start,
    answers: Answers,
    places: NDArray[np.intp],
    *,
    has_start: bool,
    keep_mode: bool,
    nearby: bool,
) -> None:
    """Answer targets (n, 4, 4) at some places in other working modes, or by the nearest feasible poses.

    With `keep_mode` in the working mode of the start, with `nearby`, as along a path, by searches around it alone. Rows
    may stay PENDING or UNSURE. Seeds are not looked for where other modes answer all rows.
    """
    first, asked = IN_OTHER_MODES, {"has_start": has_start, "keep_mode": keep_mode, "nearby": nearby}
    if not (keep_mode or has_seeds(model)) and model.legs.has_sides:
        answer_phases(model, options, targets, start, answers, places, first, first, **asked)
        first, places = IN_OTHER_ASSEMBLIES, places[answers.rows.status[places] == OPEN]
    if len(places):
        answer_phases(model, options, targets, start, answers, places, first, EXACTLY, **asked)


def answer_phases(
    model: Model,
    options: Options,
    targets: Floats,
    start: Start,
    answers: Answers,
    places: NDArray[np.intp],
    first: int,
    last: int,
    *,
    has_start: bool,
    keep_mode: bool,
    nearby: bool,
) -> None:
    """Answer targets at some places by some of the phases of `answer_row`, from one start for all or one for each."""
    with_seeds = not nearby and last > IN_OTHER_MODES
    tables = handle_of(model, options, with_seeds=with_seeds)
    asked = question(first, last, has_start=has_start, keeps_mode=keep_mode, is_nearby=nearby)
    if len(places) == len(targets):
        _run(tables, asked.address, targets, start, answers)
    else:
        block = take(answers, places)
        _run(tables, asked.address, targets[places], take_each(start, places), block)
        put(answers, places, block)


def _run(tables: Handle[Tables], asked: int, targets: Floats, start: Start, answers: Answers) -> None:
    """Answer targets on all cores."""
    from ..kernels.platform.answer_row import answer_rows

    distances, scratch = np.empty(len(targets)), scratch_of_answers(tables)

    def run(block: slice) -> int:
        rows, q, sides = take(answers, block)
        outputs = PoseSolutions(
            distances[block], rows.poses, q, sides, rows.counters, rows.actuators, rows.measures, rows.status
        )
        return answer_rows(tables.address, scratch.address, asked, targets[block], *take_each(start, block), *outputs)

    in_blocks(run, len(targets), ROWS_A_BLOCK)
