"""Places of links at poses that the legs' closed forms reach."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Floats, Mask
from ...common.derived import derived
from ...kernels.clearance.link_records import BASE, PLATFORM
from ...kernels.rows import PENDING, REACHED, Rows
from ...machine.description.links import links_of
from ...machine.model import Model, model_of
from ...options import Options
from ..joints.configurations import Configurations, new_rows
from ..joints.placed_links import PlacedLinks, bodies_of_links
from .answers import leg_answers
from .legs_engine import LegsEngine
from .reach import reach

NO_NUMBERS, NO_COUNTERS = np.zeros((0, 0)), np.zeros((0, 0), np.int64)


def links_at_poses(
    model: Model, poses: Floats, start: Configurations | None, sides: Floats
) -> tuple[PlacedLinks, Mask]:
    """The links at poses (n, 4, 4) [length] in the working mode of a start, and the mask of the poses that are reached.

    Parameters
    ----------
    start : a single configuration; None for home.
    sides : of each leg there, (1, legs).
    """
    if _follow_from_poses(model):
        reached = np.full(len(poses), REACHED)
        rows = Rows(reached, NO_COUNTERS, poses, NO_NUMBERS, NO_NUMBERS)
        return PlacedLinks(model.mechanism, Configurations(rows, NO_NUMBERS), dict), reached == REACHED
    rows = new_rows(model, len(poses))
    n_unsolved, end_sides = reach(model, poses, start, sides, False, rows)
    answers: Configurations = leg_answers(model, rows, end_sides, None, start, sides)
    if n_unsolved:
        unsolved = np.flatnonzero(rows.status != REACHED)
        rows.status[unsolved] = PENDING
        free = LegsEngine(model_of(model.mechanism.with_clearance(None)))
        others = free.answer(poses[unsolved], start, Options(), keep_mode=True)
        answers = answers.with_rows(unsolved, others)
    placed = PlacedLinks(model.mechanism, answers, lambda: LegsEngine(model).points(answers))
    return placed, np.asarray(answers.rows.status == REACHED)


@derived
def _follow_from_poses(model: Model) -> bool:
    """True if links are capsules with their ends on the base and the platform, and the task sets the whole pose."""
    links, bodies = links_of(model.mechanism), bodies_of_links(model.mechanism)
    are_capsules = links.n_capsules == len(links.pairs)
    return bool(are_capsules and not model.legs.task["unset"][0] and np.isin(bodies, (BASE, PLATFORM)).all())
