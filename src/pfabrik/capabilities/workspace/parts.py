"""The connected parts of a workspace, and the part that a point is in."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ...common.arrays import Floats, Ints, Mask
from .lattice_points import Lattice, Numbering, codes, corners
from .refining import Cells, Refined
from .verdicts import MapQuestion


class Parts:
    """Lattice points within reach, each labelled with its part; computed at first use."""

    def __init__(self, lattice: Lattice, cells: Refined) -> None:
        self._origin, self._step, self._points = lattice.origin, lattice.step, lattice.points
        self._known = lattice.known
        self._cells = sorted((*cells.within, cells.border), key=lambda each: each.width)

    @cached_property
    def labels(self) -> Ints:
        """The parts of lattice points by their numbers, (n,), 0 for the part met first; -1 for points out of reach."""
        d, n = len(self._step), len(self._points)
        roots = connected(n, np.concatenate([_links(each, d) for each in self._cells]))
        within = np.zeros(n, bool)
        for each in self._cells:
            within[each.corners[each.margins >= 0.0]] = True
        distinct = np.flatnonzero(within & (roots == np.arange(n)))
        place = np.full(n, -1)
        place[distinct] = np.arange(len(distinct))
        return np.where(within, place[roots], -1)

    @property
    def count(self) -> int:
        """Number of parts."""
        return int(self.labels.max(initial=-1)) + 1

    @cached_property
    def _numberings(self) -> list[Numbering]:
        """The codes of all cells, by their sizes."""
        known = [Numbering() for _ in self._cells]
        for cells, numbering in zip(self._cells, known, strict=True):
            numbering.number(cells.codes)
        return known

    def of(self, points: Floats) -> Ints:
        """The parts of points (n, d), (n,): of the nearest corner within reach of the cell each is in; -1 if none."""
        nearest = self._nearest(points)
        return np.where(nearest >= 0, self.labels[nearest], -1)

    def reached(self, question: MapQuestion, points: Floats) -> Mask:
        """Mask (n,) of points (n, d) within reach; where these have many configurations, from near ones too."""
        if not question.has_many_at_a_point:
            return np.asarray(question.measure(points)[0] >= 0.0)
        nearest = self._nearest(points)
        reached = question.look(points, self._known.at(nearest), False)[0] >= 0.0
        rows = np.flatnonzero(~reached)
        reached[rows] = question.measure(points[rows])[0] >= 0.0
        rows = np.flatnonzero(~reached)
        if question.is_quick_anew and len(self._known.at_border.poses):
            places = question.space.poses(points[rows])[:, :3, 3] / question.mechanism.characteristic_length
            reached[rows] = question.look(points[rows], self._known.of_border(places), False)[0] >= 0.0
        return np.asarray(reached)

    def _nearest(self, points: Floats) -> Ints:
        """The number of the nearest corner within reach of the cell that each of points (n, d) is in, (n,); or -1."""
        d, places = len(self._step), (points - self._origin) / self._step
        nearest = np.full(len(points), -1)
        for cells, known in zip(self._cells, self._numberings, strict=True):
            width = cells.width
            rows = np.flatnonzero(nearest < 0)
            low = np.floor(places[rows] / width).astype(np.int64) * width
            is_known = known.find(codes(low)) >= 0
            rows, low = rows[is_known], low[is_known]
            around = low[:, None] + width * corners(d)
            numbers = self._points.find(codes(around))
            far = np.linalg.norm((around - places[rows, None]) * self._step, axis=2)
            far[self.labels[numbers] < 0] = np.inf
            numbers[np.isinf(far)] = -1
            nearest[rows] = numbers[np.arange(len(rows)), far.argmin(axis=1)]
        return nearest


def _links(cells: Cells, d: int) -> Ints:
    """Pairs (n, 2) of numbers of corners within, along the edges of cells."""
    inside = cells.margins >= 0.0
    pairs = [np.zeros((0, 2), np.int64)]
    for a in range(2**d):
        for b in (a | 1 << axis for axis in range(d) if not a >> axis & 1):
            is_link = inside[:, a] & inside[:, b]
            pairs.append(cells.corners[is_link][:, (a, b)])
    return np.concatenate(pairs)


def connected(n: int, pairs: Ints) -> Ints:
    """For each of n nodes joined in pairs (m, 2), the lowest node that it is connected with, (n,)."""
    from ...kernels.lattice import join

    lowest = np.arange(n)
    join(np.ascontiguousarray(pairs), lowest)
    while (lowest[lowest] != lowest).any():
        lowest = lowest[lowest]
    return lowest
