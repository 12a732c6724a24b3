"""Which parts of a workspace hang together, and which of them a point is in."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints
from .lattice import codes, corners
from .refining import Cells, Refined


class Parts:
    """Lattice points within reach, each labelled with the part it is in; parts are numbered as they are met.

    Attributes
    ----------
    count : how many parts there are.
    """

    def __init__(self, origin: Floats, step: Floats, found: Refined) -> None:
        self._origin, self._step = origin, step
        self._cells = sorted((*found.within, found.border), key=lambda cells: cells.width)
        self._known = [np.sort(codes(cells.lows)) for cells in self._cells]
        links = [_links(cells, len(step)) for cells in self._cells]
        self._codes, ends = np.unique(np.concatenate(links), return_inverse=True)
        roots = connected(len(self._codes), ends.reshape(-1, 2))
        distinct, self._labels = np.unique(roots, return_inverse=True)
        self.count = len(distinct)

    def of_codes(self, code: Ints) -> Ints:
        """The parts of lattice points by their codes, (n,); -1 for those not known to be within reach."""
        where = np.minimum(np.searchsorted(self._codes, code), max(len(self._codes) - 1, 0))
        if not len(self._codes):
            return np.full(code.shape, -1)
        return np.asarray(np.where(self._codes[where] == code, self._labels[where], -1))

    def of(self, points: Floats) -> Ints:
        """The parts of points (n, d), (n,): of the nearest corner within reach of the cell each is in; -1 if none."""
        d, places = len(self._step), (points - self._origin) / self._step
        found = np.full(len(points), -1)
        for cells, known in zip(self._cells, self._known, strict=True):
            open_ = np.flatnonzero(found < 0)
            low = np.floor(places[open_] / cells.width).astype(np.int64) * cells.width
            code = codes(low)
            where = np.minimum(np.searchsorted(known, code), max(len(known) - 1, 0))
            hit = known[where] == code if len(known) else np.zeros(len(open_), bool)
            rows, low = open_[hit], low[hit]
            around = low[:, None] + cells.width * corners(d)
            labels = self.of_codes(codes(around))
            far = np.linalg.norm((around - places[rows, None]) * self._step, axis=2)
            nearest = np.where(labels >= 0, far, np.inf).argmin(axis=1)
            found[rows] = labels[np.arange(len(rows)), nearest]
        return found


def _links(cells: Cells, d: int) -> Ints:
    """Pairs (n, 2) of codes of corners within: along the edges of cells, and of each with itself."""
    code = codes(cells.lows[:, None] + cells.width * corners(d))
    inside = cells.margins >= 0.0
    pairs = [(a, a | bit) for a in range(2**d) for bit in (1 << axis for axis in range(d)) if not a & bit]
    found = [np.repeat(code[inside][:, None], 2, axis=1)]
    for a, b in pairs:
        both = inside[:, a] & inside[:, b]
        found.append(np.stack([code[both, a], code[both, b]], axis=1))
    return np.concatenate(found)


def connected(n: int, pairs: Ints) -> Ints:
    """For each of n nodes joined in pairs (m, 2), the lowest node that it hangs together with, (n,)."""
    lowest = np.arange(n)
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    while len(pairs):
        ends = lowest[pairs]
        apart = ends[:, 0] != ends[:, 1]
        pairs, ends = pairs[apart], np.sort(ends[apart], axis=1)
        np.minimum.at(lowest, ends[:, 1], ends[:, 0])
        while (lowest[lowest] != lowest).any():
            lowest = lowest[lowest]
    return lowest
