"""Answers of legs in closed form, whose joint coordinates are found when asked for."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..closure.close import closure_of
from ..closure.configurations import Configurations
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
        self, rows: Rows, coordinates: Floats | Callable[[], Floats], sides: Floats, carriers: Floats | None = None
    ) -> None:
        super().__init__(rows, coordinates)
        self._sides, self.carriers = sides, carriers

    def __reduce__(self) -> tuple[Any, ...]:
        return LegAnswers, (self.rows, self.coordinates, self._sides, self.carriers)

    @cached_property
    def sides(self) -> Floats:
        """Which of its two solutions each leg takes, (n, legs)."""
        return self._sides if len(self._sides) == len(self) else np.repeat(self._sides, len(self), axis=0)

    def at(self, places: NDArray[np.intp]) -> Configurations:
        """The configurations at some places, copied."""
        rows = super().at(places).rows
        carriers = None if self.carriers is None else self.carriers[places]
        return LegAnswers(rows, lambda: self.coordinates[places], self.sides[places], carriers)


def sides_at(mechanism: Mechanism, table: LegTable, start: Configurations) -> Floats:
    """Which of its two solutions each leg takes in configurations, (n, legs), 0 where it has but one; of arms, where
    they are."""
    if isinstance(start, LegAnswers):
        return start.sides
    sides = np.repeat(table.home_sides, len(start), axis=0)
    if len(table.led_arms):
        arms = table.led_arms
        columns = [table.known["column"][table.known["leg"] == k][0] for k in arms["leg"]]
        sides[:, arms["leg"]] = arms["sense"] * start.coordinates[:, columns] / arms["unit"]
    choosing = np.flatnonzero(table.home_sides[0])
    if not len(choosing):
        return sides
    closure = closure_of(mechanism, whole=False)
    places = np.where(table.legs["kind"] == K.PIVOT, K.FOOT, K.CARRIER)
    own = [table.known[(table.known["leg"] == k) & (table.known["place"] == places[k])]["column"][0] for k in choosing]
    if set(own) <= set(closure.actuated.tolist()):
        present = np.zeros((len(start), len(closure.scale)))
        closure.put_actuators(present, start.rows.actuators)
    else:
        present = start.coordinates
    turning = closure.turning[own] > 0.0
    on_arms = table.legs["kind"][choosing] != K.ARM
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
) -> Callable[[], Floats | None]:
    """Gives the joint coordinates of a start, None for home.

    Of a start that knows its coordinates no other way, the pose and the actuators are kept, not how it was found:
    answers that start from each other would all stay in memory.
    """
    if start is None:
        return lambda: None
    if start.were_given:
        given = start.coordinates
        return lambda: given
    return partial(settled, mechanism, table, start.rows.poses, start.rows.actuators, sides, None)


def coordinates_of(
    mechanism: Mechanism,
    table: LegTable,
    rows: Rows,
    sides: Floats,
    carriers: Floats | None,
    begins: Callable[[], Floats | None],
    rest: NDArray[np.intp],
    others: Configurations | None,
) -> Floats:
    """Joint coordinates (n, columns) of answers, those of the other engine (`rest`) as it has them."""
    own = np.setdiff1d(np.arange(len(rows.status)), rest)
    begin = begins()
    if begin is not None and len(begin) > 1:
        begin = begin[own]
    found = settled(
        mechanism,
        table,
        rows.poses[own],
        rows.actuators[own],
        sides if len(sides) == 1 else sides[own],
        begin,
        None if carriers is None else carriers[own],
    )
    if others is None:
        return found
    every = np.empty((len(rows.status), found.shape[1]))
    every[own], every[rest] = found, others.coordinates
    return every
