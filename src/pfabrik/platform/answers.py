"""Answers of legs in closed form; joint coordinates are computed on access."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..batch import put, take
from ..closure.configurations import Configurations, Places
from ..derived import derived
from ..kernels.legs import records as K
from ..kernels.rows import Rows
from ..model import Model
from .coordinates import joint_coordinates, read_coordinates


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

    def __reduce__(self) -> tuple[Any, ...]:
        return LegAnswers, (self.rows, self.coordinates, self._sides, self.q_proximal)

    @cached_property
    def sides(self) -> Floats:
        """Which of its two solutions each leg takes, (n, legs)."""
        return self._sides if len(self._sides) == len(self) else np.repeat(self._sides, len(self), axis=0)

    def at(self, places: NDArray[np.intp]) -> Configurations:
        """A copy of the configurations at some places."""
        rows = super().at(places).rows
        q_proximal = None if self.q_proximal is None else self.q_proximal[places]
        return LegAnswers(rows, lambda block: self.coordinates_at(places[block]), self.sides[places], q_proximal)

    def with_others(self, places: NDArray[np.intp], others: Configurations) -> Configurations:
        """A copy with the rows at some places replaced by others; coordinates are still computed on access."""
        if not isinstance(others, LegAnswers):
            return super().with_rows(places, others)
        rows, sides = take(self.rows, np.arange(len(self))), self.sides.copy()
        put(rows, places, others.rows)
        sides[places] = others.sides
        q_proximal = np.full(sides.shape, np.nan) if self.q_proximal is None else self.q_proximal.copy()
        q_proximal[places] = np.nan if others.q_proximal is None else others.q_proximal
        index = np.full(len(self), -1)
        index[places] = np.arange(len(places))

        def coordinates(block: Places) -> Floats:
            indices = np.arange(len(index))[block]
            values, is_other = self.coordinates_at(indices), index[indices] >= 0
            values[is_other] = others.coordinates_at(index[indices[is_other]])
            return values

        return LegAnswers(rows, coordinates, sides, q_proximal)


def replaced(answers: Configurations, rows: NDArray[np.intp], others: Configurations) -> Configurations:
    """Answers with others in some rows."""
    if len(rows) == len(answers):
        return others
    return answers.with_others(rows, others) if isinstance(answers, LegAnswers) else answers.with_rows(rows, others)


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
    two_sided, columns = columns_of_sides(model)
    if not len(two_sided):
        return sides
    closure = model.path_closure
    if set(columns) <= set(closure.actuated.tolist()):
        q = np.zeros((len(start), len(closure.scale)))
        closure.put_actuators(q, start.rows.actuators)
    else:
        q = start.coordinates
    is_angle = closure.turning[columns] > 0.0
    is_on_redundant = table.legs["kind"][two_sided] != K.REDUNDANT
    for group in (~is_on_redundant, is_on_redundant):  # legs on redundant joints come after these joints
        errors = []
        for factor in (1.0, -1.0):
            candidate, candidate_q = sides.copy(), np.zeros_like(q)
            candidate[:, two_sided[group]] *= factor
            read_coordinates(table, start.rows.poses, candidate, candidate_q)
            difference = candidate_q[:, columns] - q[:, columns]
            errors.append(
                np.abs(np.where(is_angle, np.remainder(difference + np.pi, 2.0 * np.pi) - np.pi, difference))[:, group]
            )
        sides[:, two_sided[group]] *= np.where(errors[0] <= errors[1], 1.0, -1.0)
    return sides


@derived
def columns_of_sides(model: Model) -> tuple[NDArray[np.intp], list[int]]:
    """The legs with two solutions, and the column of the coordinate in which these differ."""
    table = model.legs
    two_sided = np.flatnonzero(table.home_sides[0])
    places = np.where(table.legs["kind"] == K.PIVOT, K.BASE_END, K.Q_PROXIMAL)
    columns = [
        table.known[(table.known["leg"] == k) & (table.known["place"] == places[k])]["column"][0] for k in two_sided
    ]
    return two_sided, columns


def start_coordinates_of(
    model: Model, start: Configurations | None, sides: Floats
) -> Callable[[Places], Floats | None]:
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


def answer_coordinates(
    model: Model,
    rows: Rows,
    sides: Floats,
    q_proximal: Floats | None,
    start_coordinates: Callable[[Places], Floats | None],
    unsolved: NDArray[np.intp],
    fallback: Configurations | None,
    places: Places,
) -> Floats:
    """Joint coordinates (n, columns) of the answers at some places.

    Parameters
    ----------
    unsolved : the rows that legs did not solve; their coordinates are those of `fallback`, row by row.
    """
    indices = np.arange(len(rows.status))[places]
    fallback_index = np.full(len(rows.status), -1)
    fallback_index[unsolved] = np.arange(len(unsolved))
    by_legs = fallback_index[indices] < 0
    leg_rows = indices[by_legs]
    coordinates = joint_coordinates(
        model,
        rows.poses[leg_rows],
        rows.actuators[leg_rows],
        sides if len(sides) == 1 else sides[leg_rows],
        start_coordinates(leg_rows),
        None if q_proximal is None else q_proximal[leg_rows],
    )
    if fallback is None:
        return coordinates
    all_coordinates = np.empty((len(indices), coordinates.shape[1]))
    all_coordinates[by_legs], all_coordinates[~by_legs] = (
        coordinates,
        fallback.coordinates[fallback_index[indices[~by_legs]]],
    )
    return all_coordinates
