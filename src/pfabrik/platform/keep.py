"""Answers that have left the sides of their start, where the mode is to be kept: led there in small steps instead."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Mask
from ..closure.configurations import Configurations
from ..closure.continuation import continued
from ..kernels.rows import HOLD, HOLD_NOTHING, POSITION_ERROR, PROJECTED, REACHED, ROTATION_ERROR
from ..model import Model
from ..poses import between
from .answers import sides_at
from .branch import same_branch

Answer = Callable[[Floats, Configurations], Configurations]
"""Answers one target (1, 4, 4) around a start, in its working mode."""


def kept(
    model: Model, answers: Configurations, targets: Floats, start: Configurations, answer: Answer
) -> Configurations:
    """The answers, with those on other sides than their start replaced by what small steps reach."""
    sides = sides_at(model, start)
    has_left = (answers.rows.status <= PROJECTED) & ~_same_sides(model, answers, sides)
    for row in np.flatnonzero(has_left):
        place = np.array([row])
        begin, begin_sides = (start, sides) if len(start) == 1 else (start.at(place), sides[place])
        answers = answers.with_rows(place, _led(model, targets[place], begin, begin_sides, answer))
    return answers


def _same_sides(model: Model, answers: Configurations, sides: Floats) -> Mask:
    """True where no leg with two solutions is on another side than in `sides`, (n,)."""
    return same_branch(sides_at(model, answers), sides * (model.legs.home_sides != 0.0))


def _led(model: Model, target: Floats, start: Configurations, sides: Floats, answer: Answer) -> Configurations:
    """The answer to one target as far as steps from the start lead to it, PROJECTED where they end before it."""
    begin, last = start.rows.poses, answer(start.rows.poses, start)

    def advance(_rows: NDArray[np.intp], shares: Floats) -> Mask:
        nonlocal last
        trial = answer(between(begin, target, shares), last)
        is_kept = (trial.rows.status == REACHED) & _same_sides(model, trial, sides)
        last = trial if is_kept[0] else last
        return np.asarray(is_kept)

    if last.rows.status[0] <= PROJECTED and continued(1, advance)[0] < 1.0:
        measures = last.rows.measures
        measures[:, POSITION_ERROR], measures[:, ROTATION_ERROR] = model.task.errors(last.rows.poses, target)
        last.rows.status[:], last.rows.counters[:, HOLD] = PROJECTED, HOLD_NOTHING
    return last
