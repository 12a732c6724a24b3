"""The numbers of a home configuration, by joints, and records that are filled with what follows from them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from ...common.arrays import Records
from ..description.geometry import AT_POINTS, AT_REFERENCE, home_numbers, limit_numbers
from ..description.home_mobility import ends_of_default_axes
from ..description.joint_coordinates import JointCoordinate
from ..description.joints import Joint
from ..description.mechanism import Mechanism
from ..noted_numbers import largest
from ..noted_vectors import Vector, length, square_to


class HomeNumbers:
    """The numbers of a mechanism at home and its limits, or the same as numbers that note their steps.

    Centres are in its length unit, points in L.

    Attributes
    ----------
    length : the characteristic length L [length].
    """

    def __init__(self, mechanism: Mechanism, numbers: Sequence[Any] = ()) -> None:
        self.mechanism = mechanism
        self._at = AT_POINTS + 9 * len(mechanism.joints)
        self.numbers = numbers or [*home_numbers(mechanism).tolist(), *limit_numbers(mechanism)]
        self._at_limits = self._at + len(mechanism.coordinate_names)
        self._numbers = {joint.name: number for number, joint in enumerate(mechanism.joints)}
        self.length: float = self.numbers[0]

    def _vector(self, place: int) -> Vector:
        return Vector(self.numbers[place : place + 3])

    def centre(self, joint: Joint) -> Vector:
        """The centre of a joint that has one [length]."""
        return self._vector(AT_POINTS + 3 * self._numbers[joint.name])

    def point(self, joint: Joint) -> Vector:
        """The centre of a joint; the origin, if it has none."""
        return Vector((0.0, 0.0, 0.0)) if joint.at is None else self.centre(joint) / self.length

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
        axes = Vector((1.0, 0.0, 0.0)), Vector((0.0, 1.0, 0.0))
        if ends:
            axes = square_to(self.centre(ends[0]) - self.centre(joint))
        return axes if is_forward else axes[::-1]

    def coordinate(self, coordinate: JointCoordinate) -> Any:
        """The value of a coordinate [length or rad]."""
        if coordinate.joint.along is not None:
            return length(self._span_along(coordinate.joint))
        return self.numbers[self._at + coordinate.column]

    def bounds(self, coordinate: JointCoordinate) -> tuple[Any, Any]:
        """The bounds of a coordinate [length or rad], as of `JointCoordinate.bounds`."""
        at = self._at_limits + 2 * coordinate.column
        low, high = self.numbers[at], self.numbers[at + 1]
        return (low if coordinate.joint.along is None else largest([low, 0.0])), high

    def cone(self, joint: Joint) -> tuple[Vector, Any]:
        """The axis and the half angle of a joint's cone [rad]."""
        n = len(self.mechanism.coordinates)
        at = self._at_limits + 2 * n + 4 * self._numbers[joint.name]
        return self._vector(at), self.numbers[at + 3]

    @property
    def reference_point(self) -> Vector:
        return self._vector(AT_REFERENCE) / self.length

    def _given_axis(self, joint: Joint, which: int) -> Vector:
        place = AT_POINTS + 3 * len(self._numbers) + 6 * self._numbers[joint.name]
        return _direction(self._vector(place + 3 * which))

    def _span_along(self, joint: Joint) -> Vector:
        start, end = self.mechanism.ends_along(joint)
        return self.centre(end) - self.centre(start)


def _direction(axis: Vector) -> Vector:
    """An axis. That it is not zero is a decision: so it is with other numbers too, or the axis is none."""
    if not axis @ axis > 0.0:
        raise ValueError("an axis without a direction")
    return axis


Fields: TypeAlias = dict[str, Any]
"""Fields of a record: numbers, vectors, or several of these."""


class FilledRecords(NamedTuple):
    """Records, and the fields that each was filled from."""

    records: Records
    fields: tuple[Fields, ...]

    @classmethod
    def of(cls, fields: Sequence[Fields], dtype: np.dtype[np.void]) -> FilledRecords:
        """Records with the given fields; 0 where one is left out."""
        records = np.zeros(len(fields), dtype)
        for row, each in enumerate(fields):
            for name, field in each.items():
                if not isinstance(field, list):
                    records[name][row] = field
                elif field:
                    records[name][row][: len(field)] = field
        return cls(records, tuple(fields))

    def chosen(self, rows: Sequence[bool]) -> FilledRecords:
        """Some of them, in an array of their own."""
        kept = tuple(each for each, is_chosen in zip(self.fields, rows, strict=True) if is_chosen)
        return FilledRecords(self.records[np.asarray(rows, bool)], kept)
