"""How far a map is: by the time that its levels took, and what those ahead are expected to take."""

from __future__ import annotations

import math
import time

from ..telling import OnProgress

POINTS_A_CELL = {2: 4.0, 3: 9.0}
"""Points that halving a cell at the border takes, before any was halved, by the number of coordinates."""


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
            left = max(self._ahead - (now - began), self._later)
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
