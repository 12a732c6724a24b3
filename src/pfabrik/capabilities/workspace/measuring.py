"""Measures many points in blocks, here or on the workers of an executor, and reports progress."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import closing
from typing import Any

import numpy as np

from ...common.arrays import Floats, Ints
from ...common.batch import joined, take, take_each
from ...common.executors import SLOWER, Result, Workers, slices
from ...common.telling import OnProgress
from ...kinematics import Starts
from .verdicts import MapQuestion

LOOKS, LOOKS_GROWN, LOOKS_ONE_BY_ONE = 0.25, 0.75, 3.0
"""Time to locate the border in a cell, as a share of that to halve one: by margins, by searches, by answers."""


POINTS_A_CELL = {2: 4.0, 3: 9.0}
"""Points that halving a cell at the border takes, before any was halved, by the number of coordinates."""


class Measure:
    """Measures the points of a question, and reports progress.

    Attributes
    ----------
    progress : how far the map is.
    fewest : number of cells across the shortest side of the map that is wanted, at least.
    """

    def __init__(
        self, question: MapQuestion, executor: Executor | None, on_progress: OnProgress | None, fewest: int = 0
    ) -> None:
        self.question, self.fewest = question, fewest
        looks = LOOKS if question.has_margins else LOOKS_GROWN if question.is_grown else LOOKS_ONE_BY_ONE
        self.progress = MapProgress(on_progress, len(question.space.names), looks)
        self._workers = Workers(executor, question)
        self._cost = (1 if question.has_margins else SLOWER) * len(question.turns)

    def __call__(
        self, points: Floats, known: Starts | None = None, *, anew: bool = False
    ) -> tuple[Floats, Ints, Starts]:
        """Margins and bindings of points (n, d), and configurations at or nearest to them, as of `MapQuestion.look`."""
        known = self.question.first_start if known is None else known
        blocks = [(points[block], take_each(known, block), anew) for block in slices(len(points), self._cost)]
        if not len(points):
            return np.zeros(0), np.zeros(0, np.int64), take(known, slice(0))
        margins, bindings, ends = zip(*self._measured(MapQuestion.look, blocks), strict=True)
        return np.concatenate(margins), np.concatenate(bindings), joined(ends)

    def name_limits(self, points: Floats, known: Starts) -> Ints:
        """The limits that points (n, d) just beyond the border exceed, as of `MapQuestion.name_limits`."""
        blocks = [(points[block], take_each(known, block)) for block in slices(len(points), self._cost)]
        if not len(points):
            return np.zeros(0, np.int64)
        return np.concatenate(self._measured(MapQuestion.name_limits, blocks, counts=False))

    def halvings(self, across: Floats) -> int:
        """How often cells must be halved for enough of them, where there are so many along each coordinate, (d,)."""
        return math.ceil(math.log2(max(self.fewest / float(across.min()), 1.0)))

    def _measured(self, method: Callable[..., Result], blocks: list[Any], *, counts: bool = True) -> list[Result]:
        """What a method of the question gives for blocks: points, and what else it takes; counted if they are new."""
        with closing(self._workers.results(method, blocks)) as results:
            return [
                self._counted(result, counts * len(block[0])) for result, block in zip(results, blocks, strict=True)
            ]

    def _counted(self, measured: Result, n: int) -> Result:
        self.progress.add(n)
        return measured


class MapProgress:
    """The points measured, and about how many there are in all: so that their ratio is the share of the time.

    Halving the cells at the border takes as long for each as at the level before. Per halving there are twice as many
    in a plane, and four times as many in space.

    Parameters
    ----------
    looks : time to locate the border in one of the smallest cells, as a share of that to halve a cell.
    """

    def __init__(self, on_progress: OnProgress | None, d: int, looks: float) -> None:
        self._on_progress, self._d, self._looks = on_progress, d, looks
        self._done, self._began = 0, time.monotonic()
        self._first_total: float | None = 0.0  # points in all, while the first cells are measured
        self._a_cell = 0.0  # seconds
        self._level: tuple[float, float] | None = None  # cells, and when their level began
        self._ahead, self._later = 0.0, 0.0  # seconds from there on, and those after this level

    def begin(self, points: int, cells: float, levels: int) -> None:
        """Expect first cells with so many points, and so many of them at the border."""
        self._level = None
        if self._first_total is not None:
            halved = sum(cells * self._growth**level for level in range(levels))
            last = self._looks * cells * self._growth**levels
            self._first_total = points + POINTS_A_CELL[self._d] * (halved + last)

    def expect(self, crossed: int, halved: list[float], halvings: int) -> None:
        """Expect work on so many cells.

        Parameters
        ----------
        crossed : number of cells at the border.
        halved : number of cells that are halved at each level ahead.
        halvings : how much smaller the cells of a map are that follows, if any.
        """
        now = time.monotonic()
        if self._level is not None:
            before, began = self._level
            self._a_cell = (now - began) / max(before, 1.0)
        elif self._first_total is not None:
            self._a_cell = POINTS_A_CELL[self._d] * (now - self._began) / max(self._done, 1)
        smallest = crossed * self._growth ** len(halved)
        works = [*halved, self._looks * smallest]
        if halvings:
            works.append(smallest * self._growth**halvings * (self._looks + 1.0 / (self._growth - 1)))
        self._first_total, self._level = None, (works[0], now)
        self._ahead, self._later = self._a_cell * sum(works), self._a_cell * sum(works[1:])

    def add(self, n: int) -> None:
        """Report n more points."""
        self._done += n
        if self._on_progress is None:
            return
        if self._first_total is not None:
            total = self._first_total
        else:
            now, began = time.monotonic(), self._level[1] if self._level is not None else self._began
            on_level, level = now - began, max(self._ahead - self._later, 1e-9)
            left = max(self._ahead - on_level, self._later * on_level / level)  # a slow level makes later ones slow
            total = self._done * (1.0 + left / max(now - self._began, 1e-9))
        self._on_progress(self._done, max(self._done, math.ceil(total)))

    def end(self) -> None:
        """Report that all is done."""
        if self._on_progress is not None:
            self._on_progress(self._done, self._done)

    @property
    def _growth(self) -> int:
        """Factor by which the number of cells at the border grows where they are halved."""
        return 1 << (self._d - 1)
