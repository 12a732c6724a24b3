"""Targets that legs do not reach on the sides of the start: other modes, then the nearest feasible poses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..kernels.platform.tables import EXACTLY, IN_OTHER_ASSEMBLIES, IN_OTHER_MODES, Start
from ..kernels.rows import OPEN
from ..model import Model
from ..options import Options
from .rows_one_by_one import Answers, answer_places
from .tables import handle_of, has_seeds, question


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
    from ..kernels.platform.answer_row import answer_rows

    with_seeds = not nearby and last > IN_OTHER_MODES
    tables = handle_of(model, options, with_seeds=with_seeds)
    asked = question(first, last, 0.0, has_start=has_start, keeps_mode=keep_mode, is_nearby=nearby)
    answer_places(answer_rows, tables, asked, targets, start, answers, places)
