"""The steps by which the records of a table of legs were computed, to be run again with other numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from ..arrays import Floats, Ints, Records
from .tape import Recorded, Scalar, Tape, Vector

Field: TypeAlias = float | Scalar | Vector | Sequence[Scalar] | Sequence[Vector]
Fields: TypeAlias = dict[str, Field]

WORD = 8
"""Bytes of a number: all fields of records are one, or several."""


class Write(NamedTuple):
    """A recorded number or vector that is in a record.

    Attributes
    ----------
    word : where in the record, counted in numbers.
    place, size : its place on the tape, and how many numbers it is.
    """

    word: int
    place: int
    size: int


class RecordedRecords(NamedTuple):
    """Records, and what in each of them is on a tape."""

    records: Records
    writes: tuple[tuple[Write, ...], ...]

    @classmethod
    def of(cls, fields: Sequence[Fields], dtype: np.dtype[np.void]) -> RecordedRecords:
        """Records with the given fields; 0 where one is left out."""
        records = np.zeros(len(fields), dtype)
        return cls(records, tuple(tuple(_put(records, row, each)) for row, each in enumerate(fields)))

    def chosen(self, rows: Sequence[bool]) -> RecordedRecords:
        """Some of them, in arrays of their own."""
        writes = (write for write, is_chosen in zip(self.writes, rows, strict=True) if is_chosen)
        return RecordedRecords(self.records[np.asarray(rows, bool)], tuple(writes))


def _put(records: Records, row: int, fields: Fields) -> Iterator[Write]:
    """Put values into a record; those that are on a tape are noted."""
    offsets: Any = records.dtype.fields
    for name, field in fields.items():
        if not isinstance(field, Sequence):
            records[name][row] = field.value if isinstance(field, Recorded) else field
        elif len(field):
            records[name][row][: len(field)] = [each.value for each in field]
        word = offsets[name][1] // WORD
        for each in field if isinstance(field, Sequence) else [field]:
            if isinstance(each, Recorded):
                yield Write(word, each.place, each.size)
                word += each.size


class Recording:
    """A tape, and where its values are in arrays of records, which are given by name.

    Attributes
    ----------
    words : all arrays in a row, number by number.
    """

    def __init__(self, tape: Tape, **parts: RecordedRecords) -> None:
        self._tape, self._parts = tape, parts

    @cached_property
    def words(self) -> Floats:
        words = [part.records.view(np.float64) for part in self._parts.values() if len(part.records)]
        return np.concatenate(words)

    @cached_property
    def writes(self) -> Ints:
        """Places of values in `words`, in the layout of `kernels.replay`."""
        writes, start = [], 0
        for records, by_row in self._parts.values():
            for each in by_row:
                writes += [(start + write.word, write.place, write.size) for write in each]
                start += records.dtype.itemsize // WORD
        return np.array(writes, np.int64).reshape(-1, 3)

    @cached_property
    def steps(self) -> Ints:
        return np.array(self._tape.steps, np.int64).reshape(-1, 5)

    @cached_property
    def used(self) -> Ints:
        return np.array(sorted(self._tape.used), np.int64)

    @cached_property
    def values(self) -> Floats:
        return np.array(self._tape.values)

    @cached_property
    def _layouts(self) -> list[tuple[str, int, np.dtype[np.void], int]]:
        """Of each array its name, length and type, and where it starts [bytes]."""
        layouts, start = [], 0
        for name, (records, _) in self._parts.items():
            layouts.append((name, len(records), records.dtype, start))
            start += records.nbytes
        return layouts

    def arrays(self, words: Floats) -> dict[str, Records]:
        """The arrays of records, by name, whose numbers are in a row."""
        return {name: np.ndarray(n, dtype, words, start) for name, n, dtype, start in self._layouts}
