"""Points on a lattice of equal steps about where a map starts, each measured once."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from .blocks import Measure

BITS = 20
"""Bits of a place on each axis in the code of a lattice point: three fit into an integer, beside three more bits."""

MIDDLE = 1 << (BITS - 1)


def codes(places: Ints) -> Ints:
    """One integer for each lattice place (..., d), in the order of the places."""
    code = places[..., 0] + MIDDLE
    for axis in range(1, places.shape[-1]):
        code = (code << BITS) + (places[..., axis] + MIDDLE)
    return np.asarray(code)


def places_of(code: Ints, d: int) -> Ints:
    """The lattice places (n, d) of codes (n,)."""
    mask = (1 << BITS) - 1
    return np.stack([((code >> (BITS * (d - 1 - axis))) & mask) - MIDDLE for axis in range(d)], axis=1)


def corners(d: int) -> Ints:
    """The corners (2^d, d) of a cell, from its lowest."""
    return np.indices((2,) * d).reshape(d, -1).T.astype(np.int64)


class Lattice:
    """What is known of lattice points: each is measured when it is first asked for.

    Attributes
    ----------
    origin, step : coordinates of the place 0, (d,), and from one place to the next, (d,) [length or rad].
    """

    def __init__(self, origin: Floats, step: Floats, measure: Measure) -> None:
        self.origin, self.step, self.measure = origin, step, measure
        self._codes = np.zeros(0, np.int64)
        self._margins = np.zeros(0)

    @property
    def d(self) -> int:
        return len(self.step)

    def coordinates(self, places: Ints) -> Floats:
        """Coordinates (n, d) of places (n, d)."""
        return np.asarray(self.origin + places * self.step)

    def margins(self, code: Ints) -> Floats:
        """Margins of lattice points by their codes, of any shape."""
        distinct, back = np.unique(code, return_inverse=True)
        where = np.searchsorted(self._codes, distinct)
        known = np.zeros(len(distinct), bool)
        within = where < len(self._codes)
        known[within] = self._codes[where[within]] == distinct[within]
        found = np.empty(len(distinct))
        found[known] = self._margins[where[known]]
        new = distinct[~known]
        if len(new):
            found[~known] = self.measure(self.coordinates(places_of(new, self.d)))[0]
            self._codes = np.insert(self._codes, where[~known], new)
            self._margins = np.insert(self._margins, where[~known], found[~known])
        return np.asarray(found[back].reshape(code.shape))
