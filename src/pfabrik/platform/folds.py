"""Folds: configurations in which both solutions of a leg coincide, and which so belong to both of its working modes."""

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
    """The subsets of some legs but the empty one, the smallest first, up to `MOST_CHANGED`."""
    every = chain.from_iterable(combinations(legs, n) for n in range(1, len(legs) + 1))
    return (list(subset) for subset in islice(every, MOST_CHANGED))


def starts_beside(model: Model, start: Configurations | None) -> list[tuple[Mask, LegAnswers]]:
    """A start, or home, on the other sides that legs may take there, and which of its rows are on such a fold."""
    return _beside(home_answer(model) if start is None else start, model)


@derived
def _beside(start: Configurations, model: Model) -> list[tuple[Mask, LegAnswers]]:
    """As `starts_beside`; kept with the start, from which many targets may be asked for."""
    sides, found = sides_at(model, start), []
    folded = _folded(model, start.rows.poses, sides)
    for changed in subsets(np.flatnonzero(folded.any(axis=0)).tolist()):
        others = sides.copy()
        others[:, changed] *= -1.0
        is_folded = np.asarray(folded[:, changed].all(axis=1))
        found.append((is_folded, LegAnswers(start.rows, start.coordinates, others)))
    return found


@derived
def home_answer(model: Model) -> LegAnswers:
    """Home as an answer."""
    rows, coordinates = new_rows(model, 1), np.zeros((1, len(model.mechanism.coordinates)))
    rows.poses[:], rows.actuators[:] = model.mechanism.home_pose, model.path_closure.actuators(coordinates)
    return LegAnswers(rows, coordinates, model.legs.home_sides)


def _folded(model: Model, poses: Floats, sides: Floats) -> Mask:
    """True for legs whose two solutions coincide at poses (n, 4, 4) [length], (n, legs)."""
    table, folded = model.legs, np.zeros(sides.shape, bool)
    two_sided, columns, groups = columns_of_sides(model)
    for group in groups:
        q = np.zeros((2, len(sides), len(model.path_closure.scale)))
        for factor, values in zip((1.0, -1.0), q, strict=True):
            candidate = sides.copy()
            candidate[:, two_sided[group]] *= factor
            read_coordinates(table, poses, candidate, values)
        apart = np.subtract(*q)[:, columns]
        apart = np.where(model.path_closure.turning[columns] > 0.0, nearest_turn(apart), apart)
        folded[:, two_sided[group]] = (np.abs(apart) <= TOLERANCES.same_mode)[:, group]
    return folded
