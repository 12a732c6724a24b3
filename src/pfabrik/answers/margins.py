"""How far a configuration is from each of its limits."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, shaped
from ..description.mechanism_html import card
from ..frozen import FrozenMapping
from ..motion.limits import coned, ranges_of
from ..tolerances import TOLERANCES
from .solution import Solution, checked_solution


class Margins(FrozenMapping[tuple[str, str], float | Floats]):
    """(joint, bound) -> margin, for every limit; `margins` makes them."""

    def _repr_html_(self) -> str:
        """Every limit, the nearest first, for notebooks; of a batch, the least margin of each."""
        least = {limit: _least(np.ravel(margin)) for limit, margin in self.items()}
        order = sorted(least, key=lambda limit: (np.isnan(least[limit]), least[limit]))
        rows = [(*limit, "-" if np.isnan(least[limit]) else f"{least[limit]:.4g}") for limit in order]
        is_one = all(np.ndim(margin) == 0 for margin in self.values())
        return card("Margins", (), ("joint", "bound", "margin" if is_one else "least margin"), rows, "")


def _least(margins: Floats) -> float:
    known = margins[~np.isnan(margins)]
    return float(known.min()) if len(known) else float("nan")


def margins(solution: Solution) -> Margins:
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
    ranges, q = ranges_of(mechanism), solution._coordinates
    values, room, tolerances = ranges.values(q), 0.5 * (ranges.high - ranges.low), TOLERANCES.limit * ranges.units
    shares = {
        "min": _shares(values - ranges.low, room, tolerances).T,
        "max": _shares(ranges.high - values, room, tolerances).T,
    }
    found: dict[tuple[str, str], Floats] = {}
    for place, joint in enumerate(ranges.joints):
        for bound, each in shares.items():
            before = found.get((joint.name, bound))
            found[joint.name, bound] = each[place] if before is None else np.minimum(each[place], before)
    for joint, angles, half_angle in coned(mechanism, q):
        found[joint.name, "cone"] = (half_angle - angles) / half_angle
    return Margins({key: shaped(margin, solution.shape) for key, margin in found.items()})


def nearest_first(solution: Solution) -> list[tuple[str, str, float]]:
    """Joint, bound and margin of every limit of one answer, the nearest first."""
    named = ((joint, bound, float(margin)) for (joint, bound), margin in margins(solution).items())
    return sorted(named, key=lambda limit: limit[2])


def _shares(off: Floats, room: Floats, tolerances: Floats) -> Floats:
    """Distances from bounds (n, k) as shares of the room there is, (k,)."""
    if (room > 0.0).all():
        return off / room
    without = np.where(np.abs(off) <= tolerances, 0.0 * off, np.copysign(np.inf, off))
    return np.where(room > 0.0, off / np.where(room > 0.0, room, 1.0), without)
