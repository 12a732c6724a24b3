"""Points on a lattice of equal steps about where a map starts: each measured once, or grown from its neighbours."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints
from ...common.batch import joined, take
from ...kinematics import Starts
from .lines import Lines, lines_between, narrow
from .measuring import Measure
from .verdicts import OUTSIDE

BITS = 20
"""Bits of a place on each axis in the code of a lattice point: three fit into an integer."""

MIDDLE = 1 << (BITS - 1)

PLACES_AT_ONCE = 64
"""Places whose distances from all configurations at the border are computed at once."""

NEAR = 0.25
"""Longest step to a point that is grown from a neighbour [L or rad]: a longer one may cross a singularity unnoticed."""

TRIES = 3
"""Number of neighbours that a point is grown from, at most, where it is slow to search anew for one out of reach."""

SAMPLES = 96
"""Number of points that are searched for anew where this is slow, spread over those without a neighbour in reach."""


CODES_A_RUN = 1 << 16
"""Codes that are numbered at a time: the table is made larger between."""

FIRST_SIZE = 1 << 12


def codes(places: Ints) -> Ints:
    """One integer for each lattice place (..., d), in the order of the places."""
    code = places[..., 0] + MIDDLE
    for axis in range(1, places.shape[-1]):
        code = (code << BITS) + (places[..., axis] + MIDDLE)
    return np.asarray(code)


def offsets(places: Ints) -> Ints:
    """Differences of codes between places that are `places` (..., d) apart."""
    return codes(places) - codes(np.zeros(places.shape[-1], np.int64))


def places_of(code: Ints, d: int) -> Ints:
    """The lattice places (n, d) of codes (n,)."""
    mask = (1 << BITS) - 1
    return np.stack([((code >> (BITS * (d - 1 - axis))) & mask) - MIDDLE for axis in range(d)], axis=1)


def corners(d: int) -> Ints:
    """The corners (2^d, d) of a cell, from its lowest."""
    return np.indices((2,) * d).reshape(d, -1).T.astype(np.int64)


def places_around(d: int) -> Ints:
    """The places (3^d - 1, d) of the neighbours of the place 0, the nearest first."""
    places = np.indices((3,) * d).reshape(d, -1).T - 1
    return np.asarray(places[np.argsort((places**2).sum(axis=1), kind="stable")[1:]])


class Known(NamedTuple):
    """Configurations that points are grown from.

    Attributes
    ----------
    configurations : the first start, then those at lattice points, or nearest to them.
    place : that of each point among them, by its number.
    at_border : those at crossings of the border.
    """

    configurations: Starts
    place: Ints
    at_border: Starts

    def at(self, numbers: Ints) -> Starts:
        """The configurations of points by their numbers, (n,); the first start for -1."""
        return take(self.configurations, np.where(numbers >= 0, self.place[numbers], 0))

    def of_border(self, places: Floats) -> Starts:
        """The nearest configurations at the border to places of the reference point, (n, 3) [L]."""
        nearest = [np.zeros(0, np.int64)]
        for block in np.array_split(places, range(PLACES_AT_ONCE, len(places), PLACES_AT_ONCE)):
            offsets = block[:, None] - self.at_border.poses[:, :3, 3]
            nearest.append(np.einsum("nbi,nbi->nb", offsets, offsets).argmin(axis=1))
        return take(self.at_border, np.concatenate(nearest))


class Numbering:
    """Codes of lattice points, and a number for each: 0 for the first that was met."""

    def __init__(self) -> None:
        self._known = np.zeros(FIRST_SIZE // 2, np.int64)
        self._table = np.full(FIRST_SIZE, -1)
        self._count = 0

    def __len__(self) -> int:
        return self._count

    @property
    def codes(self) -> Ints:
        """All codes by their numbers, (n,)."""
        return self._known[: self._count]

    def number(self, codes: Ints) -> Ints:
        """The numbers of codes, of any shape; those that were not met before are numbered on."""
        return self._numbered(codes, adds=True)

    def find(self, codes: Ints) -> Ints:
        """The numbers of codes, of any shape; -1 for those that were not met."""
        return self._numbered(codes, adds=False)

    def _numbered(self, codes: Ints, adds: bool) -> Ints:
        from ...kernels.lattice import number_points

        flat = np.ascontiguousarray(codes).reshape(-1)
        numbers = np.empty(len(flat), np.int64)
        for start in range(0, len(flat), CODES_A_RUN):
            run = slice(start, start + CODES_A_RUN)
            if adds:
                self._make_room(len(flat[run]))
            self._count = number_points(flat[run], self._table, self._known, self._count, adds, numbers[run])
        return numbers.reshape(np.shape(codes))

    def _make_room(self, more: int) -> None:
        """A table that is not more than half full with so many more codes."""
        from ...kernels.lattice import number_points

        if self._count + more <= len(self._known):
            return
        size = len(self._table)
        while size < 4 * (self._count + more):
            size *= 2
        codes, self._known, self._table = self.codes, np.zeros(size // 2, np.int64), np.full(size, -1)
        number_points(codes, self._table, self._known, 0, True, np.empty(len(codes), np.int64))


class Lattice:
    """Lattice points with their margins; each point is measured at its first use.

    Where a map is grown, a point is within reach if a search from the configuration of a neighbour, or one anew, ends
    there. A search anew that ends elsewhere also says that nothing nearer is within reach.

    Attributes
    ----------
    origin, step : coordinates of the place 0, (d,), and from one place to the next, (d,) [length or rad].
    points : the numbers of those that are known.
    """

    def __init__(self, origin: Floats, step: Floats, measure: Measure) -> None:
        self.origin, self.step, self.measure = origin, step, measure
        self.points = Numbering()
        self._margins = [np.zeros(0)]
        self._first = measure.question.first_start
        self._at_border = take(self._first, slice(0))
        self._configurations = [self._first]
        self._place = np.zeros(0, np.int64)
        self._clear = np.zeros(0)  # radius of the ball about each point that is beyond reach [L]

    @property
    def d(self) -> int:
        return len(self.step)

    @property
    def margins(self) -> Floats:
        """Margins of all points by their numbers, (n,)."""
        self._margins = [np.concatenate(self._margins)]
        return self._margins[0]

    @property
    def known(self) -> Known:
        """The configurations of all points and crossings, where the map is grown."""
        self._configurations = [joined(self._configurations)]
        return Known(self._configurations[0], self._place, self._at_border)

    def coordinates(self, places: Ints) -> Floats:
        """Coordinates (n, d) of places (n, d)."""
        return np.asarray(self.origin + places * self.step)

    def number(self, code: Ints, width: int) -> Ints:
        """The numbers of points by their codes, of any shape; they are measured if they were not yet.

        Parameters
        ----------
        width : how far apart the points of this call are, in steps.
        """
        before = len(self.points)
        numbers = self.points.number(code)
        new = self.points.codes[before:]
        if len(new) and self.measure.question.is_grown:
            self._grow(new, width)
        elif len(new):
            self._margins.append(self.measure(self._at(new))[0])
        return numbers

    def crossings(self, numbers: Ints, neighbours: Ints, close: float) -> tuple[Floats, Ints]:
        """The last points within on edges, (e, d), and the limits exceeded next, (e,).

        Parameters
        ----------
        numbers : (2, e) of the ends of edges: those within, then those beyond.
        neighbours : pairs of edges that are beside each other, (p, 2).
        close : the accuracy [share of an edge].
        """
        inner, outer = map(self._at, self.points.codes[numbers])
        states = map(self.known.at, numbers) if self.measure.question.is_grown else (self._first, self._first)
        lines: Lines = lines_between(self.measure, inner, outer, *self.margins[numbers], *states)
        limits = narrow(self.measure, lines, neighbours, close)
        self._at_border = lines.within
        return lines.at(np.arange(len(inner)), lines.near), limits

    def _at(self, code: Ints) -> Floats:
        return self.coordinates(places_of(code, self.d))

    def _grow(self, new: Ints, width: int) -> None:
        """Search for new points from their neighbours until none leads to any more, then anew, and so on."""
        n = len(new)
        self._margins.append(np.full(n, OUTSIDE))
        self._place = np.concatenate([self._place, np.zeros(n, np.int64)])
        self._clear = np.concatenate([self._clear, np.zeros(n)])
        tried = np.zeros(n, np.int64)  # a bit for each neighbour
        self._spread(new, tried, width)
        for rows in self._batches_anew(new, tried, width):
            self._search(new, rows, self._first, anew=True)
            self._spread(new, tried, width)

    def _batches_anew(self, new: Ints, tried: Ints, width: int) -> Iterator[Ints]:
        """Rows of new points to be searched for anew.

        If this is quick, all but those in the ball about a neighbour that is beyond reach, every second first. Else the
        first point of all, and samples of those that no neighbour leads to.
        """
        places = places_of(new, self.d)
        if self.measure.question.is_quick_anew:
            is_second = (places % (2 * width) == 0).all(axis=1)
            for half in (is_second, ~is_second):
                rows = np.flatnonzero(half & (self.margins[-len(new) :] < 0.0))
                self._inherit(new, rows, width)
                yield rows[self._clear[-len(new) :][rows] == 0.0]
            return
        if len(new) == len(self.points):
            yield np.abs(places).sum(axis=1).argmin()[None]
        rows = np.flatnonzero((self.margins[-len(new) :] < 0.0) & (tried == 0))
        yield rows[np.unique(np.linspace(0, len(rows) - 1, min(SAMPLES, len(rows))).astype(np.int64))]

    def _spread(self, new: Ints, tried: Ints, width: int) -> None:
        while True:
            is_open = self.margins[-len(new) :] < 0.0
            if not self.measure.question.is_quick_anew:
                is_open &= sum(tried >> k & 1 for k in range(len(places_around(self.d)))) < TRIES
            rows = np.flatnonzero(is_open)
            numbers, tried[rows] = self._untried(new[rows], tried[rows], width)
            rows, numbers = rows[numbers >= 0], numbers[numbers >= 0]
            if not len(rows):
                return
            self._search(new, rows, self.known.at(numbers), anew=False)

    def _search(self, new: Ints, rows: Ints, starts: Starts, *, anew: bool) -> None:
        """Search for some of the new points; keep what a search from a neighbour gives only where it reaches them."""
        margins, _, ends = self.measure(self._at(new[rows]), starts, anew=anew)
        rows = len(self._place) - len(new) + rows
        self._clear[rows] = np.maximum(self._clear[rows], -margins) if anew else self._clear[rows]
        kept = np.flatnonzero((margins >= 0.0) | anew)
        self.margins[rows] = margins
        self._place[rows[kept]] = sum(len(each.poses) for each in self._configurations) + np.arange(len(kept))
        self._configurations.append(take(ends, kept))

    def _inherit(self, new: Ints, rows: Ints, width: int) -> None:
        """Mark those of the new points as beyond reach that are in the ball about a neighbour which is."""
        length = self.measure.question.mechanism.characteristic_length
        for place in places_around(self.d):
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
        for k, place in enumerate(self._around(width)):
            rows = np.flatnonzero((numbers < 0) & (tried >> k & 1 == 0) & (first | (k < 2 * self.d)))
            neighbours = self.points.find(code[rows] + offsets(width * place))
            reached = (neighbours >= 0) & (margins[neighbours] >= 0.0)
            rows = rows[reached]
            numbers[rows], tried[rows] = neighbours[reached], tried[rows] | 1 << k
        return numbers, tried

    def _around(self, width: int) -> Ints:
        """The places of neighbours that are near enough to grow from."""
        places, question = places_around(self.d), self.measure.question
        if question.is_quick_anew:
            return places
        far = np.linalg.norm(width * places * self.step / question.lengths, axis=1)
        return np.asarray(places[far <= NEAR])
