"""How far a configuration is from each of its limits."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from ..motion.limits import coned, ranged
from ..tolerances import TOLERANCES
from .solution import Solution, checked_solution

Floats = NDArray[np.float64]


def margins(solution: Solution) -> Mapping[tuple[str, str], float | Floats]:
    """(joint, bound) -> how far every limit is from being met, (...,), for every limit of its mechanism.

    Bounds are "min", "max" and "cone", as in `ActiveLimit`. A margin is a share of the room there is: of half the
    range, or of the cone's half angle. It is 1 in the middle of a range or on the axis of a cone, 0 on the limit, and
    negative beyond it; of the two ranges of a universal or cylindrical joint the nearer bound counts. In a range whose
    two bounds are the same there is no room: 0 on it, infinite off it. NaN for INVALID rows.

    Raises
    ------
    InvalidArgument : what is no Solution.
    """
    mechanism = checked_solution(solution).mechanism
    found: dict[tuple[str, str], Floats] = {}
    for joint in mechanism.joints:
        for values, (low, high), unit in ranged(mechanism, joint, solution._coordinates):
            for bound, off in (("min", values - low), ("max", high - values)):
                margin = _share(off, 0.5 * (high - low), TOLERANCES.limit * unit)
                found[joint.name, bound] = np.minimum(margin, found.get((joint.name, bound), np.inf))
    for joint, angles, half_angle in coned(mechanism, solution._coordinates):
        found[joint.name, "cone"] = (half_angle - angles) / half_angle
    return MappingProxyType({key: _shaped(margin, solution.shape) for key, margin in found.items()})


def _share(off: Floats, room: float, tolerance: float) -> Floats:
    """Distances from a bound (n,) as shares of the room there is."""
    if room > 0.0:
        return off / room
    return np.where(np.abs(off) <= tolerance, 0.0 * off, np.copysign(np.inf, off))


def _shaped(array: Floats, shape: tuple[int, ...]) -> float | Floats:
    return array.reshape(shape) if shape else float(array[0])
