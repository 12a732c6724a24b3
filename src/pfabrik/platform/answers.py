"""Answers of legs in closed form, whose joint coordinates are found when asked for."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..closure.close import closure_of
from ..closure.configurations import Configurations, Places, put_rows, rows_at
from ..decomposition.leg_table import LegTable
from ..description.mechanism import Mechanism
from ..kernels.legs import records as K
from ..kernels.rows import Rows
from .coordinates import read_into, settled


class LegAnswers(Configurations):
    """Configurations of legs that are told by their platforms.

    Parameters
    ----------
    sides : which of its two solutions each leg takes, (n or 1, legs).
    carriers : coordinates of the legs' carriers, (n, legs) [L or rad], where closed forms tell them less exactly: near
        dead points; NaN elsewhere, None where nowhere.
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
        """The configurations at some places, copied."""
        rows = super().at(places).rows
        q_proximal = None if self.q_proximal is None else self.q_proximal[places]
        return LegAnswers(rows, lambda own: self.coordinates_at(places[own]), self.sides[places], q_proximal)

    def with_rows(self, places: NDArray[np.intp], others: Configurations) -> Configurations:
        """These configurations with as many others at some places; coordinates stay to be found where they are."""
        if not isinstance(others, LegAnswers):
            return super().with_rows(places, others)
        rows, sides = rows_at(self.rows, np.arange(len(self))), self.sides.copy()
        put_rows(rows, places, others.rows)
        sides[places] = others.sides
        q_proximal = np.full(sides.shape, np.nan) if self.q_proximal is None else self.q_proximal.copy()
        q_proximal[places] = np.nan if others.q_proximal is None else others.q_proximal
        which = np.full(len(self), -1)
        which[places] = np.arange(len(places))

        def coordinates(own: Places) -> Floats:
            at = np.arange(len(which))[own]
            found, is_other = self.coordinates_at(at), which[at] >= 0
            found[is_other] = others.coordinates_at(which[at[is_other]])
            return found

        return LegAnswers(rows, coordinates, sides, q_proximal)


def sides_at(mechanism: Mechanism, table: LegTable, start: Configurations) -> Floats:
    """Which of its two solutions each leg takes in configurations, (n, legs), 0 where it has but one; of arms, where
    they are."""
    if isinstance(start, LegAnswers):
        return start.sides
    sides = np.repeat(table.home_sides, len(start), axis=0)
    if len(table.implicit_joints):
        redundant = table.implicit_joints
        columns = [table.known["column"][table.known["leg"] == k][0] for k in redundant["leg"]]
        sides[:, redundant["leg"]] = redundant["sense"] * start.coordinates[:, columns] / redundant["unit"]
    choosing = np.flatnonzero(table.home_sides[0])
    if not len(choosing):
        return sides
    closure = closure_of(mechanism, whole=False)
    places = np.where(table.legs["kind"] == K.PIVOT, K.BASE_END, K.Q_PROXIMAL)
    own = [table.known[(table.known["leg"] == k) & (table.known["place"] == places[k])]["column"][0] for k in choosing]
    if set(own) <= set(closure.actuated.tolist()):
        present = np.zeros((len(start), len(closure.scale)))
        closure.put_actuators(present, start.rows.actuators)
    else:
        present = start.coordinates
    turning = closure.turning[own] > 0.0
    on_arms = table.legs["kind"][choosing] != K.REDUNDANT
    for some in (~on_arms, on_arms):  # where arms are decides where the legs on them are
        off = []
        for factor in (1.0, -1.0):
            tried, found = sides.copy(), np.zeros_like(present)
            tried[:, choosing[some]] *= factor
            read_into(table, start.rows.poses, tried, found)
            away = found[:, own] - present[:, own]
            off.append(np.abs(np.where(turning, np.remainder(away + np.pi, 2.0 * np.pi) - np.pi, away))[:, some])
        sides[:, choosing[some]] *= np.where(off[0] <= off[1], 1.0, -1.0)
    return sides


def begins_of(
    mechanism: Mechanism, table: LegTable, start: Configurations | None, sides: Floats
) -> Callable[[Places], Floats | None]:
    """Gives the joint coordinates of starts at some places, or of the one for all; None for home.

    Of a start that knows its coordinates no other way, the pose and the actuators are kept, not how it was found:
    answers that start from each other would all stay in memory.
    """
    if start is None:
        return lambda places: None
    if start.were_given:
        given = start.coordinates
        return lambda places: given if len(given) == 1 else given[places]
    poses, actuators, n = start.rows.poses, start.rows.actuators, len(start)

    def settle(places: Places) -> Floats:
        own = slice(None) if n == 1 else places
        return settled(mechanism, table, poses[own], actuators[own], sides if len(sides) == 1 else sides[own], None)

    return settle


def coordinates_of(
    mechanism: Mechanism,
    table: LegTable,
    rows: Rows,
    sides: Floats,
    q_proximal: Floats | None,
    begins: Callable[[Places], Floats | None],
    rest: NDArray[np.intp],
    others: Configurations | None,
    places: Places,
) -> Floats:
    """Joint coordinates (n, columns) of the answers at some places, those of the other engine (`rest`) as it has
    them."""
    at = np.arange(len(rows.status))[places]
    elsewhere = np.full(len(rows.status), -1)
    elsewhere[rest] = np.arange(len(rest))
    is_own = elsewhere[at] < 0
    own = at[is_own]
    found = settled(
        mechanism,
        table,
        rows.poses[own],
        rows.actuators[own],
        sides if len(sides) == 1 else sides[own],
        begins(own),
        None if q_proximal is None else q_proximal[own],
    )
    if others is None:
        return found
    every = np.empty((len(at), found.shape[1]))
    every[is_own], every[~is_own] = found, others.coordinates[elsewhere[at[~is_own]]]
    return every
