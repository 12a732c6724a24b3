"""Parallelograms: two equal and parallel rods between the same two bodies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from ..description.joints import Joint
from ..tolerances import TOLERANCES


@dataclass(frozen=True)
class Parallelogram:
    """Two equal and parallel rods between the same two bodies.

    Attributes
    ----------
    rods : names of the joints at the inner and the outer end of either rod.
    length : of the rods [length].
    width : between the joints of either body [length].
    pinned : whether its joints are revolutes with parallel axes: it then moves in its plane alone, and its outer body
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


def parallelogram_of(ways: Sequence[Sequence[Joint]], length: float) -> Parallelogram | None:
    """The parallelogram that the ways between two bodies form at home, or None.

    Parameters
    ----------
    ways : the joints of each way, from the inner body outward.
    length : of the mechanism [length]; what points and axes may be off is measured by it.
    """
    if len(ways) != 2 or any(len(way) != 2 for way in ways):
        return None
    types = {joint.type for way in ways for joint in way}
    if not (types == {"revolute"} or types <= {"universal", "spherical"}):
        return None
    pinned = types == {"revolute"}
    axis = np.array(ways[0][0].axis) if pinned else np.zeros(3)
    if pinned and any(_area(np.array(joint.axis), axis) > TOLERANCES.alignment for way in ways for joint in way):
        return None
    (a, b), (c, d) = ([_off(np.array(joint.at), axis) for joint in way] for way in ways)
    rod, side = b - a, c - a
    if np.linalg.norm((d - c) - rod) > TOLERANCES.alignment * length or not _spans(rod, side):
        return None
    (one, end), (other, other_end) = ways
    rods = ((one.name, end.name), (other.name, other_end.name))
    return Parallelogram(rods, float(np.linalg.norm(rod)), float(np.linalg.norm(side)), pinned)


def _off(point: Floats, axis: Floats) -> Floats:
    """A point without its part along an axis: where on its axis a pin sits does not matter."""
    return np.asarray(point - (point @ axis) * axis)


def _area(a: Floats, b: Floats) -> float:
    """Area between two vectors; of unit vectors, the sine of the angle between them."""
    return float(np.linalg.norm(np.cross(a, b)))


def _spans(rod: Floats, side: Floats) -> bool:
    """Whether two sides are not in one line: a flat parallelogram may open into one whose rods cross."""
    return _area(rod, side) > TOLERANCES.alignment * max(float(rod @ rod), float(side @ side))
