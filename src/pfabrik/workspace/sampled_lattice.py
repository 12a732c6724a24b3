"""Points on a lattice of equal steps about where a map starts, each measured once."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from .measuring import Measure
from .numbering import Numbering

BITS = 20
"""Bits of a place on each axis in the code of a lattice point: three fit into an integer."""

MIDDLE = 1 << (BITS - 1)


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

    def coordinates(self, places: Ints) -> Floats:
        """Coordinates (n, d) of places (n, d)."""
        return np.asarray(self.origin + places * self.step)

    def number(self, code: Ints) -> Ints:
        """The numbers of points by their codes, of any shape; they are measured if they were not yet."""
        before = len(self.points)
        numbers = self.points.number(code)
        new = self.points.codes[before:]
        if len(new):
            self._margins.append(self.measure(self.coordinates(places_of(new, self.d)))[0])
        return numbers
