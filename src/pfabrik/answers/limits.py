"""Limits of a configuration: which of them it lies on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..description.mechanism import Mechanism
from ..motion.displacements import rate_units
from ..motion.limits import coned, ranges_of
from ..tolerances import TOLERANCES


@dataclass(frozen=True)
class ActiveLimit:
    """A limit that holds an answer back.

    Attributes
    ----------
    joint, bound : which limit of which joint.
    value, limit : the coordinate (or the angle at the cone) and its bound [length or rad].
    coordinate : which coordinate of the joint, as in `home_coordinate`: 0, or 1 for the second of a universal or
        cylindrical joint.
    multiplier : by how much the answer to a target comes nearer to it, at most, per unit by which the limit gives way
        [length per length or rad]; rotations count as lengths by `Options.rotation_length`. By just so much where the
        limits that hold are independent; those that act as one (two rods side by side) share what they hold, and
        neither alone brings the answer nearer. None where no pose was asked for.
    """

    joint: str
    bound: Literal["min", "max", "cone"]
    value: float
    limit: float
    multiplier: float | None = None
    coordinate: int = 0


ALIKE = 0.999
"""Share of a multiplier above which another counts as the same: they are known to about one in ten thousand."""


def active_limits(mechanism: Mechanism, coordinates: Floats) -> list[tuple[ActiveLimit, ...]]:
    """The limits that each row of joint coordinates (n, columns), deviations from home, lies on; ranges first.

    A rigid joint is always where it is locked: only beyond that it counts.
    """
    found: list[list[ActiveLimit]] = [[] for _ in coordinates]
    ranges = ranges_of(mechanism)
    rigid = [joint.is_rigid for joint in ranges.joints]
    values, near = ranges.values(coordinates), np.where(rigid, -TOLERANCES.limit, TOLERANCES.active) * ranges.units
    low, high = values - ranges.low <= near, ranges.high - values <= near
    for k, (joint, place) in enumerate(zip(ranges.joints, ranges.places, strict=True)):
        for row in np.flatnonzero(low[:, k] | high[:, k]):
            bound: Literal["min", "max"] = "min" if low[row, k] else "max"
            limit = float((ranges.low if bound == "min" else ranges.high)[k])
            found[row].append(ActiveLimit(joint.name, bound, float(values[row, k]), limit, None, place))
    for joint, angles, half_angle in coned(mechanism, coordinates):
        for row in np.flatnonzero(half_angle - angles <= TOLERANCES.active):
            found[row].append(ActiveLimit(joint.name, "cone", float(angles[row]), half_angle))
    return [tuple(each) for each in found]


def holding_limits(mechanism: Mechanism, coordinates: Floats, multipliers: Floats) -> list[tuple[ActiveLimit, ...]]:
    """The limits that hold each row of joint coordinates (n, columns) back, the hardest first.

    Those that hold alike, as symmetry makes them, come as the description lists them.

    Parameters
    ----------
    multipliers : (n, 2 columns + cones), as of `limit_multipliers`.
    """
    found: list[list[ActiveLimit]] = [[] for _ in coordinates]
    n, units = coordinates.shape[1], rate_units(mechanism)
    angles = coned(mechanism, coordinates) if (multipliers[:, 2 * n :] > TOLERANCES.holding).any() else []
    for row, place in ((row, place) for row, own in enumerate(multipliers) for place in _hardest_first(own)):
        which = 0
        if place < 2 * n:
            own = mechanism.coordinates[place // 2]
            if own.joint.is_rigid:
                continue
            name, which, unit = own.joint.name, own.place, mechanism.characteristic_length / float(units[own.column])
            value, limit = float(coordinates[row, own.column]) + own.home, own.bounds[place % 2]
            bound: Literal["min", "max", "cone"] = "max" if place % 2 else "min"
        else:
            joint, values, limit = angles[place - 2 * n]
            name, value, bound, unit = joint.name, float(values[row]), "cone", mechanism.characteristic_length
        found[row].append(ActiveLimit(name, bound, value, limit, float(multipliers[row, place]) * unit, which))
    return [tuple(each) for each in found]


def is_held_by_others(mechanism: Mechanism, multipliers: Floats) -> bool:
    """Whether a limit other than an actuator's holds some row back; multipliers as of `holding_limits`."""
    resting = [drive.column for drive in mechanism.drives]
    resting += [each.column for each in mechanism.coordinates if each.joint.is_rigid]  # which are left out anyway
    others = np.ones(multipliers.shape[1], bool)
    others[[2 * column + side for column in resting for side in (0, 1)]] = False
    return bool((multipliers[:, others] > TOLERANCES.holding).any())


def _hardest_first(multipliers: Floats) -> list[int]:
    """Places of the multipliers (k,) that hold, in falling order, but for those that are alike."""
    alike: list[list[int]] = []
    for place in np.argsort(-multipliers, kind="stable").tolist():
        if multipliers[place] <= TOLERANCES.holding:
            break
        if alike and multipliers[place] > ALIKE * multipliers[alike[-1][0]]:
            alike[-1].append(place)
        else:
            alike.append([place])
    return [place for group in alike for place in sorted(group)]


BINDING = np.dtype(
    [("joint", "U64"), ("bound", "U4"), ("coordinate", "i8"), ("value", "f8"), ("limit", "f8"), ("multiplier", "f8")]
)
"""A limit as a record of an array, for batches."""


def binding_limits(rows: Sequence[tuple[ActiveLimit, ...]]) -> NDArray[np.void]:
    """The first limit of each row, (n,) records of `BINDING`; empty names and NaN where a row has none."""
    found = np.zeros(len(rows), BINDING)
    for name in ("value", "limit", "multiplier"):
        found[name] = np.nan
    for place, limits in enumerate(rows):
        for limit in limits[:1]:
            multiplier = np.nan if limit.multiplier is None else limit.multiplier
            found[place] = (limit.joint, limit.bound, limit.coordinate, limit.value, limit.limit, multiplier)
    return found
