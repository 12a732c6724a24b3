"""Points on a lattice of equal steps about where a map starts, each measured once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Floats, Ints
from ..batch import take
from ..kernels.platform.search_records import Starts
from .border_crossings import crossings
from .measuring import Measure
from .numbering import Numbering

BITS = 20
"""Bits of a place on each axis in the code of a lattice point: three fit into an integer."""

MIDDLE = 1 << (BITS - 1)

PLACES_AT_ONCE = 64
"""Places whose distances from all configurations at the border are computed at once."""


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


class Neighbours(NamedTuple):
    """Configurations that positions are searched for from.

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


class Lattice:
    """Lattice points with their margins; each point is measured at its first use.

    Attributes
    ----------
    origin, step : coordinates of the place 0, (d,), and from one place to the next, (d,) [length or rad].
    points : the numbers of those that are known.
    """

    def __init__(self, origin: Floats, step: Floats, measure: Measure) -> None:
        self.origin, self.step, self.measure = origin, step, measure
        self.points = Numbering()
        self._margins = [np.zeros(0)]

    @property
    def d(self) -> int:
        return len(self.step)

    @property
    def margins(self) -> Floats:
        """Margins of all points by their numbers, (n,)."""
        self._margins = [np.concatenate(self._margins)]
        return self._margins[0]

    @property
    def neighbours(self) -> Neighbours | None:
        """The configurations of all points, where searches begin at them."""
        return None

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
        if len(new):
            self._add(new, width)
        return numbers

    def _add(self, new: Ints, width: int) -> None:
        """Measure the points of new codes, (n,), and add their margins."""
        self._margins.append(self.measure(self.coordinates(places_of(new, self.d)))[0])

    def crossings(self, numbers: Ints, neighbours: Ints, close: float) -> tuple[Floats, Ints]:
        """The last points within on edges, (e, d), and the limits exceeded next, (e,).

        Parameters
        ----------
        numbers : (2, e) of the ends of edges: those within, then those beyond.
        neighbours : pairs of edges that are beside each other, (p, 2).
        close : the accuracy [share of an edge].
        """
        inner, outer = (self.coordinates(places_of(self.points.codes[ends], self.d)) for ends in numbers)
        inside, outside = self.margins[numbers]
        return crossings(self.measure, inner, outer, inside, outside, close)
