"""Where links are at poses that the legs' closed forms reach."""

from __future__ import annotations

from functools import partial

import numpy as np

from ..arrays import Floats, Mask
from ..closure.configurations import Configurations, new_rows
from ..derived import derived
from ..description.links import links_of
from ..kernels.rows import PENDING, REACHED, Rows
from ..model import Model
from ..options import Options
from ..platform.answers import LegAnswers, answer_coordinates, start_coordinates_of
from ..platform.legs_engine import LegsEngine
from ..platform.reach import reach
from .placed_links import PlacedLinks

NOWHERE = np.zeros(0, np.intp)
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
    if follow_from_poses(model):
        reached = np.full(len(poses), REACHED)
        rows = Rows(reached, NO_COUNTERS, poses, NO_NUMBERS, NO_NUMBERS)
        return PlacedLinks(model.mechanism, Configurations(rows, NO_NUMBERS), dict), reached == REACHED
    rows = new_rows(model, len(poses))
    n_unsolved, end_sides = reach(model, poses, start, sides, False, rows)
    starts = start_coordinates_of(model, start, sides)
    coordinates = partial(answer_coordinates, model, rows, end_sides, None, starts, NOWHERE, None)
    by_legs = LegAnswers(rows, coordinates, end_sides)
    answers: Configurations = by_legs
    if n_unsolved:
        unsolved = np.flatnonzero(rows.status != REACHED)
        rows.status[unsolved] = PENDING
        others = LegsEngine(model).answer(poses[unsolved], start, Options(), keep_mode=True)
        answers = by_legs.with_others(unsolved, others)
    placed = PlacedLinks(model.mechanism, answers, lambda: LegsEngine(model).points(answers))
    return placed, np.asarray(answers.rows.status == REACHED)


@derived
def follow_from_poses(model: Model) -> bool:
    """True if links follow from the pose of the platform alone: all end on it or on the base, and the task sets it."""
    mechanism, joints = model.mechanism, links_of(model.mechanism).joints
    ends = {mechanism.base, mechanism.end_effector}
    alone = {shape.body for shape, names in zip(mechanism.shapes, joints, strict=True) if not names}
    if model.legs.task["unset"][0] or mechanism.end_effector_is_joint or not alone <= ends:
        return False
    return all(ends.intersection(mechanism.joint(name).connects) for between in joints for name in between)
