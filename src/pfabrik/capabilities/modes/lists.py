"""Lists of modes, the clusters of a search, and the estimate of how complete a list is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, overload

import numpy as np
from numpy.typing import NDArray

from ...answers.solution import Solution
from ...answers.words import by_bound, exceeded
from ...common.arrays import Floats
from ...common.printed import Printed, ResultTable
from ...errors import counted
from ...machine.description.mechanism import Mechanism
from ...tolerances import TOLERANCES

BATCH = 512
"""Starts between two tests whether a search is done."""

LEAST_STARTS = 4096
"""Least number of starts: a mode that one start in 500 finds is missed once in 3600 searches."""

HITS = 10
"""Starts that must find every mode before a search ends: an unseen mode as rare as the rarest is then unlikely."""

STEPS = 80
"""Most Newton steps of a start; fewer than 20 are usual."""

ALONG = 1e-3
"""Step that tests whether a solution is part of a continuum [L or rad]: large enough to distinguish it from a double
root, too small to reach another solution."""


@dataclass(frozen=True)
class Modes(Printed, Sequence[Solution]):
    """Modes found by a search, nearest to home first.

    Attributes
    ----------
    modes : tuple of Solution
        A Solution per mode: REACHED within all limits; EXCEEDED beyond those in `active_limits`.
    hits : tuple of int
        Number of starts that found each mode.
    starts : int
        Number of starts.
    """

    kind: ClassVar[str]

    modes: tuple[Solution, ...]
    hits: tuple[int, ...]
    starts: int

    @property
    def total(self) -> int:
        """Number of modes found."""
        return len(self.modes)

    @property
    def unseen(self) -> float:
        """Estimated probability that another start finds something new: n_1 / n, by Good and Turing.

        n_1 is the number of modes found once, n that of starts. With n_1 < 3 it is the 95 % bound for a mode not yet
        seen, 3 / n.
        """
        return max(3, self._found_once) / self.starts

    @property
    def _found_once(self) -> int:
        return sum(hits == 1 for hits in self.hits)

    @overload
    def __getitem__(self, index: int) -> Solution: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Solution, ...]: ...
    def __getitem__(self, index: int | slice) -> Solution | tuple[Solution, ...]:
        return self.modes[index]

    def __len__(self) -> int:
        return len(self.modes)

    @staticmethod
    def _columns(mechanism: Mechanism) -> list[str]:
        """Names of the table columns that distinguish modes."""
        raise NotImplementedError

    @staticmethod
    def _cells(mode: Solution) -> list[str]:
        """Cells of a mode in these columns."""
        raise NotImplementedError

    def table(self) -> ResultTable:
        """Tabulate the modes with the limits that they exceed, and the probability of finding another."""
        chance = f"another one would find a new mode with a probability of about {self.unseen:.2%}"
        searched = f"{counted(self.starts, 'start')}; {chance}"
        if not self.modes:
            return ResultTable(f"No {self.kind} mode", [f"no {self.kind} mode found"], remarks=[searched])
        mechanism, kept = self.modes[0].mechanism, sum(map(bool, self)) or "none"
        count = f"{counted(self.total, f'{self.kind} mode')}, "
        count += f"of the {len(self)} nearest to home " if self.total > len(self) else ""
        rows = [
            [str(place), *self._cells(mode), str(hits), by_bound(exceeded(mode)) or "nothing"]
            for place, (mode, hits) in enumerate(zip(self.modes, self.hits, strict=True), 1)
        ]
        header = ["mode", *self._columns(mechanism), "starts", "exceeds"]
        return ResultTable(mechanism.name, [f"{count}{kept} within all limits"], header, rows, [searched])

    def to_dict(self) -> dict[str, Any]:
        """Modes and counts as plain numbers, lists and dicts, ready for JSON."""
        modes = [mode.to_dict() for mode in self.modes]
        counts = {"total": self.total, "hits": list(self.hits), "starts": self.starts, "unseen": self.unseen}
        return {"modes": modes, **counts}


class Clusters:
    """Clusters of configurations, one per mode; marks are numbers that differ between modes.

    Attributes
    ----------
    marks, coordinates : per cluster, marks (k,) [L or 1] and joint coordinates (columns,) [length or rad].
    hits : number of configurations in each.
    """

    def __init__(self) -> None:
        self.marks: list[Floats] = []
        self.coordinates: list[Floats] = []
        self.hits: list[int] = []
        self._ranks: list[tuple[float, ...]] = []

    @property
    def are_well_known(self) -> bool:
        """True if every cluster has enough configurations for a search to end."""
        return min(self.hits, default=HITS) >= HITS

    def count(self, marks: Floats, polish: Callable[[int], tuple[Floats, Floats]]) -> NDArray[np.intp]:
        """Assign rows of marks (n, k) to existing or new clusters; return the cluster of each row, (n,).

        Parameters
        ----------
        polish : marks and coordinates of a row after iterating to convergence. Near a singular solution loops are
            almost closed at some distance from it, so a row that seems new may converge to a known solution.
        """
        places = self._nearest(marks, 0)
        while len(unassigned := np.flatnonzero(places < 0)):
            n_known = len(self.marks)
            mark, coordinates = polish(int(unassigned[0]))
            place = int(self._nearest(mark[None], 0)[0])
            if place < 0:
                place = n_known
                self.marks.append(mark)
                self.coordinates.append(coordinates)
                self.hits.append(0)
                self._ranks.append((np.inf,))
            places[unassigned[1:]] = self._nearest(marks[unassigned[1:]], n_known)
            places[unassigned[0]] = place
        for place in places:
            self.hits[place] += 1
        return places

    def prefer(self, place: int, coordinates: Floats, rank: tuple[float, ...]) -> None:
        """Replace the coordinates of a cluster if the new rank is less than the present one."""
        if rank < self._ranks[place]:
            self._ranks[place] = rank
            self.coordinates[place] = coordinates

    def _nearest(self, marks: Floats, first: int) -> NDArray[np.intp]:
        """The cluster nearest to each row, from number `first` on, (n,); -1 if none is within `same_mode`."""
        if len(self.marks) == first:
            return np.full(len(marks), -1)
        apart = np.abs(marks[:, None] - np.array(self.marks[first:])).max(axis=2, initial=0.0)
        nearest = apart.argmin(axis=1)
        is_same = apart[np.arange(len(marks)), nearest] <= TOLERANCES.same_mode
        return np.where(is_same, nearest + first, -1)
