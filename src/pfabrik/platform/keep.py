"""Continuation to targets whose answers left the working mode of their start, if this mode is to be kept."""

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
"""Solver for one target (1, 4, 4) around a start, in its working mode."""


def kept(
    model: Model, answers: Configurations, targets: Floats, start: Configurations, answer: Answer
) -> Configurations:
    """Replace answers in another working mode than their start by the result of continuation from the start."""
    branch = sides_at(model, start)
    has_left = (answers.rows.status <= PROJECTED) & ~_is_in_mode(model, answers, branch)
    for row in np.flatnonzero(has_left):
        place = np.array([row])
        row_start, row_branch = (start, branch) if len(start) == 1 else (start.at(place), branch[place])
        answers = answers.with_rows(place, _continue_to(model, targets[place], row_start, row_branch, answer))
    return answers


def _is_in_mode(model: Model, answers: Configurations, branch: Floats) -> Mask:
    """True where no leg with two solutions is on another branch than in `branch`, (n,)."""
    return same_branch(sides_at(model, answers), branch * (model.legs.home_sides != 0.0))


def _continue_to(model: Model, target: Floats, start: Configurations, branch: Floats, answer: Answer) -> Configurations:
    """Answer one target by continuation from the start; PROJECTED if the last feasible step ends before it."""
    start_pose, last = start.rows.poses, answer(start.rows.poses, start)

    def advance(_rows: NDArray[np.intp], shares: Floats) -> Mask:
        nonlocal last
        trial = answer(between(start_pose, target, shares), last)
        is_kept = (trial.rows.status == REACHED) & _is_in_mode(model, trial, branch)
        last = trial if is_kept[0] else last
        return np.asarray(is_kept)

    if last.rows.status[0] <= PROJECTED and continued(1, advance)[0] < 1.0:
        measures = last.rows.measures
        measures[:, POSITION_ERROR], measures[:, ROTATION_ERROR] = model.task.errors(last.rows.poses, target)
        last.rows.status[:], last.rows.counters[:, HOLD] = PROJECTED, HOLD_NOTHING
    return last
