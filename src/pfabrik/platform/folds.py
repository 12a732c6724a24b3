"""Folds: configurations in which both solutions of a leg coincide; they belong to two working modes."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, combinations, islice

import numpy as np

from ..arrays import Floats, Mask
from ..closure.configurations import Configurations, new_rows
from ..derived import derived
from ..kernels.platform.pose_constants import MOST_CHANGED
from ..model import Model
from ..rotations import nearest_turn
from ..tolerances import TOLERANCES
from .answers import LegAnswers, columns_of_sides, sides_at
from .coordinates import read_coordinates


def subsets(legs: list[int]) -> Iterator[list[int]]:
    """Iterate over the non-empty subsets of some legs, the smallest first, at most `MOST_CHANGED`."""
    all_subsets = chain.from_iterable(combinations(legs, n) for n in range(1, len(legs) + 1))
    return (list(subset) for subset in islice(all_subsets, MOST_CHANGED))


def starts_beside(model: Model, start: Configurations | None) -> list[tuple[Mask, LegAnswers]]:
    """The start, or home, in the other working modes that meet there, each with a mask of the rows on that fold."""
    return _beside(home_answer(model) if start is None else start, model)


@derived
def _beside(start: Configurations, model: Model) -> list[tuple[Mask, LegAnswers]]:
    """Compute `starts_beside`; cached with the start, which may serve many targets."""
    branch, starts = sides_at(model, start), []
    folded = _folded(model, start.rows.poses, branch)
    for changed in subsets(np.flatnonzero(folded.any(axis=0)).tolist()):
        other_branch = branch.copy()
        other_branch[:, changed] *= -1.0
        is_folded = np.asarray(folded[:, changed].all(axis=1))
        starts.append((is_folded, LegAnswers(start.rows, start.coordinates, other_branch)))
    return starts


@derived
def home_answer(model: Model) -> LegAnswers:
    """Home as an answer."""
    rows, coordinates = new_rows(model, 1), np.zeros((1, len(model.mechanism.coordinates)))
    rows.poses[:], rows.actuators[:] = model.mechanism.home_pose, model.path_closure.actuators(coordinates)
    return LegAnswers(rows, coordinates, model.legs.home_sides)


def _folded(model: Model, poses: Floats, branch: Floats) -> Mask:
    """True for legs whose two solutions coincide at poses (n, 4, 4) [length], (n, legs)."""
    table, folded = model.legs, np.zeros(branch.shape, bool)
    two_sided, columns, groups = columns_of_sides(model)
    for group in groups:
        q = np.zeros((2, len(branch), len(model.path_closure.scale)))
        for factor, values in zip((1.0, -1.0), q, strict=True):
            candidate = branch.copy()
            candidate[:, two_sided[group]] *= factor
            read_coordinates(table, poses, candidate, values)
        apart = np.subtract(*q)[:, columns]
        apart = np.where(model.path_closure.turning[columns] > 0.0, nearest_turn(apart), apart)
        folded[:, two_sided[group]] = (np.abs(apart) <= TOLERANCES.same_mode)[:, group]
    return folded
