"""The records of a table of legs as steps from home's numbers, on a tape, to be run again with other numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from ..arrays import Floats, Ints, Records
from ..description.geometry import AT_POINTS, AT_REFERENCE, home_numbers, limit_numbers
from ..description.home_mobility import ends_of_default_axes
from ..description.joint_coordinates import JointCoordinate
from ..description.joints import Joint
from ..description.mechanism import Mechanism
from .tape import Recorded, Scalar, Tape, Vector, largest, length, square_to


class RecordedHome:
    """The numbers of a mechanism at home, and its limits, on a tape: centres are in its length unit, points in L.

    Attributes
    ----------
    length : the characteristic length L [length].
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        numbers = home_numbers(mechanism).tolist()
        self.tape = Tape(numbers + limit_numbers(mechanism))
        self._at_limits = len(numbers)
        self._numbers = {joint.name: number for number, joint in enumerate(mechanism.joints)}
        self.length = self.tape.scalar(0)

    def vector(self, x: float, y: float, z: float) -> Vector:
        """A vector that does not depend on home."""
        return Vector(self.tape, self.tape.constant(x, y, z))

    def scalar(self, x: float) -> Scalar:
        """A number that does not depend on home."""
        return Scalar(self.tape, self.tape.constant(x))

    def centre(self, joint: Joint) -> Vector:
        """The centre of a joint that has one [length]."""
        return self.tape.vector(AT_POINTS + 3 * self._numbers[joint.name])

    def point(self, joint: Joint) -> Vector:
        """The centre of a joint; the origin, if it has none."""
        return self.vector(0.0, 0.0, 0.0) if joint.at is None else self.centre(joint) / self.length

    def axis(self, joint: Joint) -> Vector:
        """The axis of a revolute, prismatic or cylindrical joint."""
        if joint.along is None:
            return self._given_axis(joint, 0)
        return _direction(self._span_along(joint) / length(self._span_along(joint)))

    def universal_axes(self, joint: Joint) -> tuple[Vector, Vector]:
        """The two axes of a universal joint, as of `home_mobility.universal_axes`."""
        if joint.axes is not None:
            return self._given_axis(joint, 0), self._given_axis(joint, 1)
        ends, is_forward = ends_of_default_axes(self.mechanism, joint)
        axes = self.vector(1.0, 0.0, 0.0), self.vector(0.0, 1.0, 0.0)
        if ends:
            axes = square_to(self.centre(ends[0]) - self.centre(joint))
        return axes if is_forward else axes[::-1]

    def coordinate(self, coordinate: JointCoordinate) -> Scalar:
        """The value of a coordinate [length or rad]."""
        if coordinate.joint.along is not None:
            return length(self._span_along(coordinate.joint))
        return self.tape.scalar(AT_POINTS + 9 * len(self._numbers) + coordinate.column)

    def bounds(self, coordinate: JointCoordinate) -> tuple[Scalar | float, Scalar | float]:
        """The bounds of a coordinate [length or rad], as of `JointCoordinate.bounds`."""
        at = self._at_limits + 2 * coordinate.column
        low, high = (
            self.tape.scalar(at + k) if math.isfinite(limit) else limit for k, limit in enumerate(coordinate.limits)
        )
        if coordinate.joint.along is None:
            return low, high
        return largest([low, self.scalar(0.0)]) if isinstance(low, Scalar) else 0.0, high

    def cone(self, joint: Joint) -> tuple[Vector, Scalar]:
        """The axis and the half angle of a joint's cone [rad]."""
        n = len(self.mechanism.coordinates)
        at = self._at_limits + 2 * n + 4 * self._numbers[joint.name]
        return self.tape.vector(at), self.tape.scalar(at + 3)

    @property
    def reference_point(self) -> Vector:
        return self.tape.vector(AT_REFERENCE) / self.length

    def _given_axis(self, joint: Joint, which: int) -> Vector:
        place = AT_POINTS + 3 * len(self._numbers) + 6 * self._numbers[joint.name]
        return _direction(self.tape.vector(place + 3 * which))

    def _span_along(self, joint: Joint) -> Vector:
        start, end = self.mechanism.ends_along(joint)
        return self.centre(end) - self.centre(start)


def _direction(axis: Vector) -> Vector:
    """An axis. That it is not zero is a decision: so it is with other numbers too, or the axis is none."""
    if not axis @ axis > 0.0:
        raise ValueError("an axis without a direction")
    return axis


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
    def layouts(self) -> list[tuple[str, int, np.dtype[np.void], int]]:
        """Of each array its name, length and type, and where it starts [bytes]."""
        layouts, start = [], 0
        for name, (records, _) in self._parts.items():
            layouts.append((name, len(records), records.dtype, start))
            start += records.nbytes
        return layouts

    def arrays(self, words: Floats) -> dict[str, Records]:
        """The arrays of records, by name, whose numbers are in a row."""
        return {name: np.ndarray(n, dtype, words, start) for name, n, dtype, start in self.layouts}
