"""Searches for every mode: lists of what was found, and what such a list is worth."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from numbers import Integral
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from ..answers.solution import Solution
from ..description.form_faults import shown
from ..errors import InvalidArgument
from ..tolerances import TOLERANCES

Floats = NDArray[np.float64]

BATCH = 512
"""Starts between two looks at what was found."""

LEAST_STARTS = 4096
"""Starts before a search may end: a mode that one start in 500 finds is missed by all of them once in 3600 searches."""

HITS = 10
"""How often every mode is found before a search ends: an unseen mode as rare as the rarest seen is then unlikely."""

STEPS = 80
"""Newton steps a start may take; most need fewer than 20."""

ALONG = 1e-3
"""How far a solution is moved to see whether it is one of a continuum [L or rad]: far enough to tell one from a double
root, not so far as to meet another solution."""


def as_count(name: str, value: Any, least: int) -> int:
    """A whole number of things, checked."""
    if isinstance(value, bool) or not isinstance(value, Integral) or value < least:
        raise InvalidArgument(name, shown(value), f"a whole number, at least {least}")
    return int(value)


@dataclass(frozen=True)
class Modes(Sequence[Solution]):
    """The modes that were found, nearest to home first.

    Attributes
    ----------
    modes : one Solution each: REACHED within all limits; EXCEEDED beyond some, which `active_limits` names.
    hits : how many starts led to each.
    starts : how many starts were made.
    """

    modes: tuple[Solution, ...]
    hits: tuple[int, ...]
    starts: int

    @property
    def total(self) -> int:
        """How many modes there are of all that was found."""
        return len(self.modes)

    @property
    def unseen(self) -> float:
        """Probability, about, that another start would find something new: what was found once over all starts.

        That is the estimate of Good and Turing. Where all was found more often, the 95 % bound for something not yet
        seen, three over all starts.
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


class Clusters:
    """Configurations found so far, each once, told apart by their marks: numbers that differ where modes do.

    Attributes
    ----------
    marks, coordinates : of each, (k,) [L or 1] and (columns,) [length or rad].
    hits : how often each was met.
    """

    def __init__(self) -> None:
        self.marks: list[Floats] = []
        self.coordinates: list[Floats] = []
        self.hits: list[int] = []
        self._ranks: list[tuple[float, ...]] = []

    @property
    def are_well_known(self) -> bool:
        """Whether each was met often enough for a search to end."""
        return min(self.hits, default=HITS) >= HITS

    def count(self, marks: Floats, settle: Callable[[int], tuple[Floats, Floats]]) -> NDArray[np.intp]:
        """Count rows of marks (n, k) among what is known, or as something new; the number of each row, (n,).

        Parameters
        ----------
        settle : marks and coordinates where a row that is not known really ends. Near solutions that are singular the
            loops are as good as closed some way off, and what looks new may end at something known.
        """
        places = self._known(marks, 0)
        while len(rest := np.flatnonzero(places < 0)):
            known = len(self.marks)
            mark, coordinates = settle(int(rest[0]))
            place = int(self._known(mark[None], 0)[0])
            if place < 0:
                place = known
                self.marks.append(mark)
                self.coordinates.append(coordinates)
                self.hits.append(0)
                self._ranks.append((np.inf,))
            places[rest[1:]] = self._known(marks[rest[1:]], known)
            places[rest[0]] = place
        for place in places:
            self.hits[place] += 1
        return places

    def prefer(self, place: int, coordinates: Floats, rank: tuple[float, ...]) -> None:
        """Let other coordinates stand for what is known, if their rank is less than that of those that did."""
        if rank < self._ranks[place]:
            self._ranks[place] = rank
            self.coordinates[place] = coordinates

    def _known(self, marks: Floats, first: int) -> NDArray[np.intp]:
        """What is nearest to each row, from number `first` on, (n,); -1 where nothing is near enough to be the same."""
        if len(self.marks) == first:
            return np.full(len(marks), -1)
        apart = np.abs(marks[:, None] - np.array(self.marks[first:])).max(axis=2, initial=0.0)
        nearest = apart.argmin(axis=1)
        is_same = apart[np.arange(len(marks)), nearest] <= TOLERANCES.same_mode
        return np.where(is_same, nearest + first, -1)
