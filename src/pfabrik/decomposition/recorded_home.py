"""The home configuration of a mechanism, whose arithmetic is recorded on a tape."""

from __future__ import annotations

from ..description.geometry import AT_POINTS, AT_REFERENCE, home_numbers
from ..description.home_mobility import ends_of_default_axes
from ..description.joint_coordinates import JointCoordinate
from ..description.joints import Joint
from ..description.mechanism import Mechanism
from .tape import Scalar, Tape, Vector, length, square_to


class RecordedHome:
    """The numbers of a mechanism at home, on a tape: centres are in its length unit, points in L.

    Attributes
    ----------
    length : the characteristic length L [length].
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.tape = Tape(home_numbers(mechanism).tolist())
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
