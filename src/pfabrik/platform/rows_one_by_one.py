"""Rows answered one by one by a kernel, on all cores."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..batch import put, take, take_each
from ..kernels.handle import Handle
from ..kernels.platform.search_records import PoseSolutions
from ..kernels.platform.tables import Question, Start, Tables
from ..kernels.rows import Rows
from ..kernels.threads import in_blocks
from .tables import scratch_of_answers

ROWS_A_BLOCK = 16


class Answers(NamedTuple):
    """Answers of a batch."""

    rows: Rows
    q: Floats  # (n, legs): proximal coordinates found by a search, where closed forms are less exact; else NaN
    sides: Floats  # (n, legs): the side of each leg at the answer; at the start of rows that are not answered


def answer_places(
    kernel: Callable[..., int],
    tables: Handle[Tables],
    question: Handle[Question],
    asked: Floats,
    start: Start,
    answers: Answers,
    places: NDArray[np.intp],
) -> None:
    """Answer some rows of what is asked: targets by `answer_rows`, or values by `assemble_rows`.

    Parameters
    ----------
    start : one for all rows or one for each.
    """
    if len(places) < len(asked):
        block = take(answers, places)
        answer_places(kernel, tables, question, asked[places], take_each(start, places), block, np.arange(len(places)))
        put(answers, places, block)
        return
    distances, scratch = np.empty(len(asked)), scratch_of_answers(tables)

    def run(part: slice) -> int:
        rows, q, sides = take(answers, part)
        found = rows.counters, rows.actuators, rows.measures, rows.status
        outputs = PoseSolutions(distances[part], rows.poses, q, sides, *found)
        own = take_each(start, part)
        return kernel(tables.address, scratch.address, question.address, asked[part], *own, *outputs)

    in_blocks(run, len(asked), ROWS_A_BLOCK)
