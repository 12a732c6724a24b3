"""Numbers for lattice points, in the order in which they are met."""

from __future__ import annotations

import numpy as np

from ..arrays import Ints

CODES_A_RUN = 1 << 16
"""Codes that are numbered at a time: the table is made larger between."""

FIRST_SIZE = 1 << 12


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
        from ..kernels.lattice import number_points

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
        from ..kernels.lattice import number_points

        if self._count + more <= len(self._known):
            return
        size = len(self._table)
        while size < 4 * (self._count + more):
            size *= 2
        codes, self._known, self._table = self.codes, np.zeros(size // 2, np.int64), np.full(size, -1)
        number_points(codes, self._table, self._known, 0, True, np.empty(len(codes), np.int64))
