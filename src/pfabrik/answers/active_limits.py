"""The active limits of a configuration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..description.mechanism import Mechanism
from ..motion.displacements import rate_units
from ..motion.limited_coordinates import coned, ranges_of
from ..tolerances import TOLERANCES


@dataclass(frozen=True)
class ActiveLimit:
    """A limit that an answer lies on or exceeds.

    Attributes
    ----------
    joint, bound : which limit of which joint.
    value, limit : the coordinate (or the angle at the cone) and its bound [length or rad].
    coordinate : which coordinate of the joint, as in `home_coordinate`: 0, or 1 for the second of a universal or
        cylindrical joint.
    multiplier : the most by which the answer comes nearer to its target per unit by which the limit is relaxed [length
        per length or rad]; rotations count as lengths by `Options.rotation_length`. It is exact if the active limits
        are independent; redundant limits (two parallel rods) share a multiplier, and relaxing one of them alone changes
        nothing. None if the target was no pose.
    """

    joint: str
    bound: Literal["min", "max", "cone"]
    value: float
    limit: float
    multiplier: float | None = None
    coordinate: int = 0


ALIKE = 0.999
"""Ratio of two multipliers above which they count as equal: their relative error is about 1e-4."""


def active_limits(mechanism: Mechanism, coordinates: Floats) -> list[tuple[ActiveLimit, ...]]:
    """The limits that each row of joint coordinates (n, columns), deviations from home, lies on; ranges first.

    A rigid joint is always at its limits, and is listed only if it exceeds them.
    """
    limits: list[list[ActiveLimit]] = [[] for _ in coordinates]
    ranges = ranges_of(mechanism)
    rigid = [joint.is_rigid for joint in ranges.joints]
    values, near = ranges.values(coordinates), np.where(rigid, -TOLERANCES.limit, TOLERANCES.active) * ranges.units
    low, high = values - ranges.low <= near, ranges.high - values <= near
    for k, (joint, place) in enumerate(zip(ranges.joints, ranges.places, strict=True)):
        for row in np.flatnonzero(low[:, k] | high[:, k]):
            bound: Literal["min", "max"] = "min" if low[row, k] else "max"
            limit = float((ranges.low if bound == "min" else ranges.high)[k])
            limits[row].append(ActiveLimit(joint.name, bound, float(values[row, k]), limit, None, place))
    for joint, angles, half_angle in coned(mechanism, coordinates):
        for row in np.flatnonzero(half_angle - angles <= TOLERANCES.active):
            limits[row].append(ActiveLimit(joint.name, "cone", float(angles[row]), half_angle))
    return [tuple(row_limits) for row_limits in limits]


def holding_limits(mechanism: Mechanism, coordinates: Floats, multipliers: Floats) -> list[tuple[ActiveLimit, ...]]:
    """The limits that block each row of joint coordinates (n, columns) from its target, the largest multiplier first.

    Limits with equal multipliers, as of symmetric legs, are in the order of the description.

    Parameters
    ----------
    multipliers : (n, 2 columns + cones), as of `limit_multipliers`.
    """
    limits: list[list[ActiveLimit]] = [[] for _ in coordinates]
    n, units = coordinates.shape[1], rate_units(mechanism)
    angles = coned(mechanism, coordinates) if (multipliers[:, 2 * n :] > TOLERANCES.holding).any() else []
    places = [(row, place) for row in range(len(multipliers)) for place in _largest_first(multipliers[row])]
    for row, place in places:
        coordinate_place = 0
        if place < 2 * n:
            coordinate = mechanism.coordinates[place // 2]
            if coordinate.joint.is_rigid:
                continue
            name, coordinate_place, column = coordinate.joint.name, coordinate.place, coordinate.column
            unit = mechanism.characteristic_length / float(units[column])
            value, limit = float(coordinates[row, column]) + coordinate.home, coordinate.bounds[place % 2]
            bound: Literal["min", "max", "cone"] = "max" if place % 2 else "min"
        else:
            joint, values, limit = angles[place - 2 * n]
            name, value, bound, unit = joint.name, float(values[row]), "cone", mechanism.characteristic_length
        multiplier = float(multipliers[row, place]) * unit
        limits[row].append(ActiveLimit(name, bound, value, limit, multiplier, coordinate_place))
    return [tuple(row_limits) for row_limits in limits]


def has_passive_limits(mechanism: Mechanism, multipliers: Floats) -> bool:
    """True if a limit of a passive joint is active in some row; multipliers as of `holding_limits`."""
    columns = [drive.column for drive in mechanism.drives]
    columns += [coordinate.column for coordinate in mechanism.coordinates if coordinate.joint.is_rigid]  # never listed
    is_passive = np.ones(multipliers.shape[1], bool)
    is_passive[[2 * column + bound for column in columns for bound in (0, 1)]] = False
    return bool((multipliers[:, is_passive] > TOLERANCES.holding).any())


def _largest_first(multipliers: Floats) -> list[int]:
    """Places of the active multipliers (k,), in falling order; equal ones in the order of their places."""
    groups: list[list[int]] = []
    for place in np.argsort(-multipliers, kind="stable").tolist():
        if multipliers[place] <= TOLERANCES.holding:
            break
        if groups and multipliers[place] > ALIKE * multipliers[groups[-1][0]]:
            groups[-1].append(place)
        else:
            groups.append([place])
    return [place for group in groups for place in sorted(group)]


BINDING = np.dtype(
    [("joint", "U64"), ("bound", "U4"), ("coordinate", "i8"), ("value", "f8"), ("limit", "f8"), ("multiplier", "f8")]
)
"""A limit as a record of an array, for batches."""


def binding_limits(rows: Sequence[tuple[ActiveLimit, ...]]) -> NDArray[np.void]:
    """The first limit of each row, (n,) records of `BINDING`; empty names and NaN where a row has none."""
    records = np.zeros(len(rows), BINDING)
    for name in ("value", "limit", "multiplier"):
        records[name] = np.nan
    for place, limits in enumerate(rows):
        for limit in limits[:1]:
            multiplier = np.nan if limit.multiplier is None else limit.multiplier
            records[place] = (limit.joint, limit.bound, limit.coordinate, limit.value, limit.limit, multiplier)
    return records
