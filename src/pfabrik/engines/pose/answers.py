"""Answers of legs in closed form; joint coordinates are computed on access."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...common.arrays import Floats, Mask
from ...common.batch import put, take
from ...common.derived import derived
from ...common.rotations import nearest_turn
from ...kernels.rows import Rows
from ...machine.model import Model
from ..joints.configurations import Configurations, Places, restored
from .coordinates import joint_coordinates, read_coordinates

MOST_LAYERS = 16
"""Answers that may wait for the coordinates of those in whose place they are taken: all of them stay in memory."""


class LegAnswers(Configurations):
    """Answers stored as platform poses; joint coordinates are computed on access.

    Parameters
    ----------
    sides : of each leg, (n or 1, legs).
    q_proximal : coordinates of the proximal joints, (n, legs) [L or rad], of rows that a search answered: near dead
        points closed forms are less exact. NaN for other rows; None if there are none.
    """

    def __init__(
        self,
        rows: Rows,
        coordinates: Floats | Callable[[Places], Floats],
        sides: Floats,
        q_proximal: Floats | None = None,
    ) -> None:
        super().__init__(rows, coordinates)
        self._sides, self.q_proximal = sides, q_proximal
        self._layers = 0

    def __reduce__(self) -> tuple[Any, ...]:
        return restored, (LegAnswers, self.rows, self.coordinates, self._sides, self.q_proximal)

    @cached_property
    def sides(self) -> Floats:
        """Which of its two solutions each leg takes, (n, legs)."""
        return self._sides if len(self._sides) == len(self) else np.repeat(self._sides, len(self), axis=0)

    def at(self, places: NDArray[np.intp]) -> Configurations:
        """A copy of the configurations at some places."""
        rows = super().at(places).rows
        q_proximal = None if self.q_proximal is None else self.q_proximal[places]
        answers = LegAnswers(rows, lambda block: self.coordinates_at(places[block]), self.sides[places], q_proximal)
        answers._layers = self._layers
        return answers

    def followed_by(self, others: Sequence[Configurations]) -> Configurations:
        """As of `Configurations`; answers of legs, where all of them are."""
        plain, every = super().followed_by(others), [self, *others]
        legs = [each for each in every if isinstance(each, LegAnswers)]
        if len(legs) < len(every):
            return plain
        q_proximal = [
            np.full(each.sides.shape, np.nan) if each.q_proximal is None else each.q_proximal for each in legs
        ]
        known = None if all(each.q_proximal is None for each in legs) else np.concatenate(q_proximal)
        return LegAnswers(plain.rows, plain.coordinates, np.concatenate([each.sides for each in legs]), known)

    def with_rows(self, places: NDArray[np.intp], source: Configurations) -> Configurations:
        """As of `Configurations`; of legs' answers, coordinates are computed on access.

        But after every `MOST_LAYERS` answers taken from those before them.
        """
        if len(places) == len(self) or not isinstance(source, LegAnswers):
            return super().with_rows(places, source)
        rows, sides = take(self.rows, np.arange(len(self))), self.sides.copy()
        put(rows, places, source.rows)
        sides[places] = source.sides
        q_proximal = np.full(sides.shape, np.nan) if self.q_proximal is None else self.q_proximal.copy()
        q_proximal[places] = np.nan if source.q_proximal is None else source.q_proximal
        layers = 1 + source._layers
        if layers > MOST_LAYERS:
            _, layers = source.coordinates, 1
        index = np.full(len(self), -1)
        index[places] = np.arange(len(places))

        def coordinates(block: Places) -> Floats:
            indices = np.arange(len(index))[block]
            is_other = index[indices] >= 0
            others = source.coordinates_at(index[indices[is_other]])
            values = np.empty((len(indices), others.shape[1]))
            values[~is_other], values[is_other] = self.coordinates_at(indices[~is_other]), others
            return values

        answers = LegAnswers(rows, coordinates, sides, q_proximal)
        answers._layers = layers
        return answers


def leg_answers(
    model: Model,
    rows: Rows,
    sides: Floats,
    q_proximal: Floats | None,
    start: Configurations | None,
    start_sides: Floats,
) -> LegAnswers:
    """Rows as answers, from a start, one or one for each, with the sides `start_sides`; None for home."""
    start_coordinates = _coordinates_of(model, start, start_sides)

    def coordinates(places: Places) -> Floats:
        own_sides = sides if len(sides) == 1 else sides[places]
        q = None if q_proximal is None else q_proximal[places]
        return joint_coordinates(
            model, rows.poses[places], rows.actuators[places], own_sides, start_coordinates(places), q
        )

    return LegAnswers(rows, coordinates, sides, q_proximal)


def sides_at(model: Model, start: Configurations) -> Floats:
    """The side of each leg in configurations, (n, legs): 0 if it has one solution; a redundant joint's coordinate.

    Of a leg with two solutions it is the side whose coordinate is nearer to that of the configuration.
    """
    if isinstance(start, LegAnswers):
        return start.sides
    table = model.legs
    sides = np.repeat(table.home_sides, len(start), axis=0)
    if len(table.implicit_joints):
        redundant = table.implicit_joints
        redundant_columns = [table.known["column"][table.known["leg"] == k][0] for k in redundant["leg"]]
        sides[:, redundant["leg"]] = redundant["sense"] * start.coordinates[:, redundant_columns] / redundant["unit"]
    two_sided, columns, groups = columns_of_sides(model)
    if not len(two_sided):
        return sides
    closure = model.path_closure
    if set(columns) <= set(closure.actuated.tolist()):
        q = np.zeros((len(start), len(closure.scale)))
        closure.put_actuators(q, start.rows.actuators)
    else:
        q = start.coordinates
    is_angle = closure.turning[columns] > 0.0
    for group in groups:
        errors = []
        for factor in (1.0, -1.0):
            candidate, candidate_q = sides.copy(), np.zeros_like(q)
            candidate[:, two_sided[group]] *= factor
            read_coordinates(table, start.rows.poses, candidate, candidate_q)
            difference = candidate_q[:, columns] - q[:, columns]
            errors.append(np.abs(np.where(is_angle, nearest_turn(difference), difference))[:, group])
        sides[:, two_sided[group]] *= np.where(errors[0] <= errors[1], 1.0, -1.0)
    return sides


@derived
def columns_of_sides(model: Model) -> tuple[NDArray[np.intp], list[int], tuple[Mask, Mask]]:
    """The legs with two solutions, the columns of the coordinates in which these differ, and masks of two groups.

    It is a leg's first coordinate. The first group are redundant joints: the legs on them come after them.
    """
    table = model.legs
    two_sided = np.flatnonzero(table.home_sides[0])
    known = np.sort(table.known, order=("leg", "place"))
    columns = known["column"][np.searchsorted(known["leg"], two_sided)].tolist()
    is_redundant = table.is_redundant[two_sided]
    return two_sided, columns, (is_redundant, ~is_redundant)


def _coordinates_of(model: Model, start: Configurations | None, sides: Floats) -> Callable[[Places], Floats | None]:
    """A function that gives the joint coordinates of the starts at some places, or of the single start; None for home.

    Of a start whose coordinates are computed on access, only its pose and actuators are kept. Otherwise a chain of
    answers, each started from the one before, would stay in memory.
    """
    if start is None:
        return lambda places: None
    if start.were_given:
        given = start.coordinates
        return lambda places: given if len(given) == 1 else given[places]
    poses, actuators, n = start.rows.poses, start.rows.actuators, len(start)

    def coordinates_at(places: Places) -> Floats:
        rows = slice(None) if n == 1 else places
        return joint_coordinates(model, poses[rows], actuators[rows], sides if len(sides) == 1 else sides[rows], None)

    return coordinates_at
