"""A lattice of positions that count in whatever orientation, searched for from their neighbours' configurations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Floats, Ints
from ..batch import take
from ..kernels.platform.search_records import Starts
from .lines_across import lines_between, narrow
from .measuring import Measure
from .numbering import Numbering
from .sampled_lattice import Lattice, Neighbours, offsets, places_of
from .verdicts import INSIDE, OUTSIDE


class Crossed(NamedTuple):
    """Edges that were crossed: their keys, the crossings, the limits exceeded next, and the configurations there."""

    edges: Numbering
    vertices: Floats
    limits: Ints
    within: Starts

    def with_more(self, keys: Ints, vertices: Floats, limits: Ints, within: Starts) -> Crossed:
        """These edges and others, none of which is among these."""
        self.edges.number(keys)
        return Crossed(
            self.edges,
            np.concatenate([self.vertices, vertices]),
            np.concatenate([self.limits, limits]),
            joined([self.within, within]),
        )


class PositionLattice(Lattice):
    """Lattice points with configurations at them, or nearest to them.

    A point is within reach if a search from the first start, from one of the machine's seeds or from the configuration
    of a neighbour ends there. A search that ends elsewhere also says that nothing nearer is within reach.
    """

    def __init__(self, origin: Floats, step: Floats, measure: Measure) -> None:
        super().__init__(origin, step, measure)
        self._first = measure.question.first_start
        self._configurations = [self._first]
        self._place = np.zeros(0, np.int64)
        self._crossed = Crossed(Numbering(), np.zeros((0, self.d)), np.zeros(0, np.int64), take(self._first, slice(0)))
        self._clear = np.zeros(0)  # radius of the ball about each point that is beyond reach [L]

    @property
    def neighbours(self) -> Neighbours:
        """The configurations of all points, and of all crossings."""
        self._configurations = [joined(self._configurations)]
        return Neighbours(self._configurations[0], self._place, self._crossed.within)

    def crossings(self, numbers: Ints, neighbours: Ints, close: float) -> tuple[Floats, Ints]:
        """As `Lattice.crossings`, from the configurations at both ends and from those of neighbouring edges.

        Edges that consist of two, one of which was crossed before, are crossed where that was.
        """
        known = self._crossed.edges.find(self._halves(numbers))
        is_new = known < 0
        if is_new.any():
            place = np.cumsum(is_new) - 1
            pairs = place[neighbours[is_new[neighbours].all(axis=1)]]
            known[is_new] = len(self._crossed.edges) + place[is_new]
            self._crossed = self._crossed.with_more(*self._cross(numbers[:, is_new], pairs, close))
        return self._crossed.vertices[known], self._crossed.limits[known]

    def _cross(self, numbers: Ints, neighbours: Ints, close: float) -> tuple[Ints, Floats, Ints, Starts]:
        """Keys of edges, their crossings, the limits exceeded next, and the configurations at the crossings."""
        codes = self.points.codes[numbers]
        inner, outer = (self.coordinates(places_of(each, self.d)) for each in codes)
        within, beyond = map(self.neighbours.at, numbers)
        lines = lines_between(self.measure, inner, outer, within, beyond)
        narrow(self.measure, lines, neighbours, close)
        rows = np.arange(len(lines.near))
        limits = self.measure.name_limits_near(lines.at(rows, lines.far), lines.beyond)
        return codes.sum(axis=0), lines.at(rows, lines.near), limits, lines.within

    def _halves(self, numbers: Ints) -> Ints:
        """Keys of the halves of edges (2, e) that the border crosses: the sums of the codes of their ends, (e,)."""
        inner, outer = self.points.codes[numbers]
        middle = (inner + outer) // 2
        number = self.points.find(middle)
        is_within = (number >= 0) & (self.margins[number] >= 0.0)
        return np.asarray(np.where(is_within, middle + outer, inner + middle))

    def _add(self, new: Ints, width: int) -> None:
        """Search for new points from the first start and the seeds, then from neighbours until none leads to any more.

        Of a lattice without any points, every second is searched for first.
        """
        n, places = len(new), places_of(new, self.d)
        self._margins.append(np.full(n, OUTSIDE))
        self._place = np.concatenate([self._place, np.zeros(n, np.int64)])
        self._clear = np.concatenate([self._clear, np.zeros(n)])
        is_second = (places % (2 * width) == 0).all(axis=1)
        for rows in (np.flatnonzero(is_second), np.flatnonzero(~is_second)):
            self._inherit(new, rows, width)
            rows = rows[self._clear[len(self._clear) - n + rows] == 0.0]
            self._search(new, rows, self._first, seeds=True)
        tried = np.zeros(n, np.int64)  # a bit for each neighbour
        while True:
            rows = np.flatnonzero(self.margins[-n:] < 0.0)
            numbers, tried[rows] = self._untried(new[rows], tried[rows], width)
            rows, numbers = rows[numbers >= 0], numbers[numbers >= 0]
            if not len(rows):
                return
            self._search(new, rows, self.neighbours.at(numbers), seeds=False)

    def _search(self, new: Ints, rows: Ints, starts: Starts, *, seeds: bool) -> None:
        """Search for some of the new points; keep what a search without seeds gives only where it reaches them."""
        margins, ends = self.measure.approach(self.coordinates(places_of(new[rows], self.d)), starts, seeds=seeds)
        rows = len(self._place) - len(new) + rows
        self._clear[rows] = np.maximum(self._clear[rows], -margins) if seeds else self._clear[rows]
        kept = np.flatnonzero((margins >= 0.0) | seeds)
        self.margins[rows[margins >= 0.0]] = INSIDE
        self._place[rows[kept]] = sum(len(each.poses) for each in self._configurations) + np.arange(len(kept))
        self._configurations.append(take(ends, kept))

    def _inherit(self, new: Ints, rows: Ints, width: int) -> None:
        """Mark those of the new points as beyond reach that are in the ball about a neighbour which is."""
        length = self.measure.question.mechanism.characteristic_length
        for place in _places_around(self.d):
            numbers = self.points.find(new[rows] + offsets(width * place))
            rest = (
                np.where(numbers >= 0, self._clear[numbers], 0.0) - width * np.linalg.norm(place * self.step) / length
            )
            known = len(self._place) - len(new) + rows
            deeper = rest > self._clear[known]
            self._clear[known[deeper]] = rest[deeper]
            self._place[known[deeper]] = self._place[numbers[deeper]]

    def _untried(self, code: Ints, tried: Ints, width: int) -> tuple[Ints, Ints]:
        """The nearest neighbour within reach that was not tried, by its number, (n,), and what then was tried.

        It is -1 if there is none: of the neighbours that are not on the same axis, one alone is tried, and only first.
        """
        numbers, margins, first = np.full(len(code), -1), self.margins, tried == 0
        for k, offset in enumerate(offsets(width * _places_around(self.d))):
            rows = np.flatnonzero((numbers < 0) & (tried >> k & 1 == 0) & (first | (k < 2 * self.d)))
            neighbours = self.points.find(code[rows] + offset)
            reached = (neighbours >= 0) & (margins[neighbours] >= 0.0)
            rows = rows[reached]
            numbers[rows], tried[rows] = neighbours[reached], tried[rows] | 1 << k
        return numbers, tried


def _places_around(d: int) -> Ints:
    """The places of the neighbours of the place 0, the nearest first."""
    places = np.indices((3,) * d).reshape(d, -1).T - 1
    return np.asarray(places[np.argsort((places**2).sum(axis=1), kind="stable")[1:]])


def joined(starts: list[Starts]) -> Starts:
    """Starts one after the other, all without coordinates."""
    return Starts(*(np.concatenate(arrays) for arrays in zip(*starts, strict=True)))
