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


def parallelogram_of(paths: Sequence[Sequence[Joint]], length: float) -> Parallelogram | None:
    """The parallelogram that the paths between two bodies form at home, or None.

    Parameters
    ----------
    paths : the joints of each path, from the inner body outward.
    length : characteristic length of the mechanism [length]; tolerances are relative to it.
    """
    if len(paths) != 2 or any(len(path) != 2 for path in paths):
        return None
    types = {joint.type for path in paths for joint in path}
    if not (types == {"revolute"} or types <= {"universal", "spherical"}):
        return None
    pinned = types == {"revolute"}
    axis = np.array(paths[0][0].axis) if pinned else np.zeros(3)
    if pinned and any(_area(np.array(joint.axis), axis) > TOLERANCES.alignment for path in paths for joint in path):
        return None
    (a, b), (c, d) = ([_across(np.array(joint.at), axis) for joint in path] for path in paths)
    rod, side = b - a, c - a
    if np.linalg.norm((d - c) - rod) > TOLERANCES.alignment * length or not _spans(rod, side):
        return None
    (inner, outer), (inner_beside, outer_beside) = paths
    rods = ((inner.name, outer.name), (inner_beside.name, outer_beside.name))
    return Parallelogram(rods, float(np.linalg.norm(rod)), float(np.linalg.norm(side)), pinned)


def _across(point: Floats, axis: Floats) -> Floats:
    """A point without its component along an axis: where on its axis a pin is does not matter."""
    return np.asarray(point - (point @ axis) * axis)


def _area(a: Floats, b: Floats) -> float:
    """Area between two vectors; of unit vectors, the sine of the angle between them."""
    return float(np.linalg.norm(np.cross(a, b)))


def _spans(rod: Floats, side: Floats) -> bool:
    """True if two sides are not parallel: a flat parallelogram may open into one whose rods cross."""
    return _area(rod, side) > TOLERANCES.alignment * max(float(rod @ rod), float(side @ side))
