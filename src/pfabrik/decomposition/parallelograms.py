"""Parallelograms: two equal and parallel rods between the same two bodies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..description.joints import Joint
from ..tolerances import TOLERANCES
from .recorded_home import RecordedHome
from .tape import Vector, area, largest, norm


@dataclass(frozen=True)
class Parallelogram:
    """Two equal and parallel rods between the same two bodies.

    Attributes
    ----------
    rods : names of the joints at the inner and the outer end of either rod.
    length : of the rods [length].
    width : between the joints of either body [length].
    pinned : its joints are revolutes with parallel axes: it then moves in its plane alone, and its outer body
        only shifts, along a circle whose radius is the rods' length. With ball joints the outer body may also turn.
    """

    rods: tuple[tuple[str, str], tuple[str, str]]
    length: float
    width: float
    pinned: bool

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of its four joints, rod by rod."""
        return self.rods[0] + self.rods[1]


def parallelogram_of(paths: Sequence[Sequence[Joint]], home: RecordedHome) -> Parallelogram | None:
    """The parallelogram that the paths between two bodies form at home, or None.

    Parameters
    ----------
    paths : the joints of each path, from the inner body outward.
    """
    if len(paths) != 2 or any(len(path) != 2 for path in paths):
        return None
    types = {joint.type for path in paths for joint in path}
    if not (types == {"revolute"} or types <= {"universal", "spherical"}):
        return None
    pinned = types == {"revolute"}
    axis = home.axis(paths[0][0]) if pinned else home.vector(0.0, 0.0, 0.0)
    if pinned and any(area(home.axis(joint), axis) > TOLERANCES.alignment for path in paths for joint in path):
        return None
    (a, b), (c, d) = ([_across(home.centre(joint), axis) for joint in path] for path in paths)
    rod, side = b - a, c - a
    if norm((d - c) - rod) > home.length * TOLERANCES.alignment or not _spans(rod, side):
        return None
    (inner, outer), (inner_beside, outer_beside) = paths
    rods = ((inner.name, outer.name), (inner_beside.name, outer_beside.name))
    return Parallelogram(rods, norm(rod).value, norm(side).value, pinned)


def _across(point: Vector, axis: Vector) -> Vector:
    """A point without its component along an axis: where on its axis a pin is does not matter."""
    return point - axis * (point @ axis)


def _spans(rod: Vector, side: Vector) -> bool:
    """True if two sides are not parallel: a flat parallelogram may open into one whose rods cross."""
    return area(rod, side) > largest([rod @ rod, side @ side]) * TOLERANCES.alignment
