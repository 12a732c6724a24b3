"""Limited coordinates and cone angles of configurations, and the shift of angles into their ranges."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...common.arrays import Floats
from ...common.derived import derived
from ...tolerances import TOLERANCES
from ..description.graph import cone_line
from ..description.joints import Joint
from ..description.mechanism import Mechanism
from .displacements import placed, rate_units


class Ranges(NamedTuple):
    """Every coordinate that has a range, k of them, in the order of the joints.

    Attributes
    ----------
    joints, places : joint of each coordinate, and its place among those of the joint.
    columns : its place in q, (k,).
    home, low, high : its value at home and its bounds, with the zero of the description, (k,) [rad or length].
    units : L for lengths, 1 for angles, (k,).
    """

    joints: tuple[Joint, ...]
    places: tuple[int, ...]
    columns: NDArray[np.intp]
    home: Floats
    low: Floats
    high: Floats
    units: Floats

    def values(self, coordinates: Floats) -> Floats:
        """Values (n, k) of the ranged coordinates, with the zeros of the description, from q (n, c)."""
        return np.asarray(coordinates[:, self.columns] + self.home)


@derived
def ranges_of(mechanism: Mechanism) -> Ranges:
    """The ranges of a mechanism."""
    ranged = [coordinate for coordinate in mechanism.coordinates if coordinate.joint.range is not None]
    columns = np.array([coordinate.column for coordinate in ranged], np.intp)
    low, high = np.ascontiguousarray(np.reshape([coordinate.limits for coordinate in ranged], (-1, 2)).T, np.float64)
    return Ranges(
        tuple(coordinate.joint for coordinate in ranged),
        tuple(coordinate.place for coordinate in ranged),
        columns,
        np.array([coordinate.home for coordinate in ranged], float),
        low,
        high,
        rate_units(mechanism)[columns],
    )


def within_turns(mechanism: Mechanism, coordinates: Floats) -> None:
    """Shift the angles of ranged joints about one axis by full turns into their ranges, if possible, in place."""
    places, low, high = ranged_angles(mechanism)
    values = coordinates[:, places]
    outside = (values < low) | (values > high)
    if outside.any():
        least = values + 2.0 * np.pi * np.ceil((low - values) / (2.0 * np.pi))
        coordinates[:, places] = np.where(outside & (least <= high), least, values)


@derived
def ranged_angles(mechanism: Mechanism) -> tuple[NDArray[np.intp], Floats, Floats]:
    """Columns of ranged angles about one axis, and the bounds of their deviations, widened by the limit tolerance."""
    ranges = ranges_of(mechanism)
    chosen = [
        k
        for k, (joint, place) in enumerate(zip(ranges.joints, ranges.places, strict=True))
        if joint.type in ("revolute", "cylindrical") and place == 0
    ]
    low, high = (bound[chosen] - ranges.home[chosen] for bound in (ranges.low, ranges.high))
    return ranges.columns[chosen], low - TOLERANCES.limit, high + TOLERANCES.limit


class _Cones(NamedTuple):
    """Every cone: its joint, the joints its line leads from and to, and the body and direction of its axis."""

    joints: tuple[Joint, ...]
    starts: list[int]
    ends: list[int]
    bodies: list[int]
    axes: Floats


@derived
def _cones(mechanism: Mechanism) -> _Cones:
    joints = tuple(joint for joint in mechanism.joints if joint.cone is not None)
    lines = [cone_line(mechanism, joint) for joint in joints]
    cones = [joint.cone for joint in joints if joint.cone is not None]
    return _Cones(
        joints,
        [mechanism.joints.index(start) for start, _ in lines],
        [mechanism.joints.index(end) for _, end in lines],
        [mechanism.bodies.index(cone.fixed_to) for cone in cones],
        np.array([cone.axis for cone in cones]).reshape(-1, 3),
    )


def coned(mechanism: Mechanism, coordinates: Floats) -> list[tuple[Joint, Floats, float]]:
    """Every joint with a cone, the angles (n,) of its line to the cone's axis, and the half angle."""
    cones = _cones(mechanism)
    if not cones.joints:
        return []
    bodies, points = placed(mechanism, coordinates)
    lines = points[:, cones.ends] - points[:, cones.starts]
    axes = (bodies[:, cones.bodies, :3, :3] @ cones.axes[:, :, None])[..., 0]
    (ax, ay, az), (x, y, z) = np.moveaxis(axes, -1, 0), np.moveaxis(lines, -1, 0)
    across = np.sqrt((ay * z - az * y) ** 2 + (az * x - ax * z) ** 2 + (ax * y - ay * x) ** 2)
    angles = np.arctan2(across, ax * x + ay * y + az * z)
    half_angles = (joint.cone.half_angle for joint in cones.joints if joint.cone is not None)
    return list(zip(cones.joints, angles.T, half_angles, strict=True))
