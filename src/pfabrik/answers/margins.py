"""The margins of a configuration, its distances from all limits, and its closure residual."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..common.arrays import Floats, as_plain, shaped
from ..common.frozen import FrozenMapping
from ..common.printed import Printed, ResultTable, plain
from ..engines.joints.link_distances import pair_distances, pair_names
from ..engines.joints.placed_links import placed_at
from ..machine.description.task import Task
from ..machine.motion.displacements import actuator_units, end_effector_pose, gaps
from ..machine.motion.limited_coordinates import coned, ranges_of
from ..tolerances import TOLERANCES
from .solution import Solution, checked_solution


def closure_residual(solution: Solution) -> float | Floats:
    """Largest gap of any loop of an answer, (...,) [length].

    Bodies are posed from `solution.joints` alone, along a spanning tree of joints. The residual is the largest gap
    between the two bodies of every other joint, between the end effector and the pose of the answer, and between the
    actuated joints and its actuator values; angles are multiplied by L. NaN for INVALID rows.

    Parameters
    ----------
    solution : Solution
        One answer or a batch.

    Raises
    ------
    InvalidArgument
        The argument is no Solution.
    """
    mechanism = checked_solution(solution).mechanism
    length, rows, q = mechanism.characteristic_length, solution._rows, solution._coordinates
    valid = np.isfinite(q).all(axis=1)
    residuals = np.full(len(q), np.nan)
    whole_pose = Task((True, True, True), 0 if mechanism.end_effector_is_joint else 3)
    position, rotation = whole_pose.errors(end_effector_pose(mechanism, q[valid]), rows.poses[valid])
    residuals[valid] = np.max([gaps(mechanism, q[valid]), position, rotation * length], axis=0)
    for place, (drive, unit) in enumerate(zip(mechanism.drives, actuator_units(mechanism), strict=True)):
        value = q[valid, drive.column] + drive.home
        residuals[valid] = np.maximum(residuals[valid], np.abs(value - rows.actuators[valid, place]) * (length / unit))
    return float(residuals[0]) if solution.shape == () else residuals.reshape(solution.shape)


class Margins(Printed, FrozenMapping[tuple[str, str], float | Floats]):
    """(joint, bound) -> margin, for every limit, as `margins` returns them."""

    def table(self) -> ResultTable:
        """Every limit, the nearest first; of a batch, the least margin of each."""
        rows = [(*limit, plain(least, TOLERANCES.active)) for limit, least in self.nearest_first()]
        is_one = all(np.ndim(margin) == 0 for margin in self.values())
        lines = [] if rows else ["no limits"]
        return ResultTable("Margins", lines, ("joint", "bound", "margin" if is_one else "least margin"), rows)

    def to_dict(self) -> dict[str, Any]:
        """A list of the limits, the nearest first, ready for JSON."""
        limits = [limit for limit, _ in self.nearest_first()]
        return {"margins": [{"joint": each[0], "bound": each[1], "margin": as_plain(self[each])} for each in limits]}

    def nearest_first(self) -> list[tuple[tuple[str, str], float]]:
        """Every limit with its margin; of a batch, with the least."""
        least = {limit: _least(np.ravel(margin)) for limit, margin in self.items()}
        return sorted(least.items(), key=lambda of_limit: (np.isnan(of_limit[1]), of_limit[1]))


def _least(margins: Floats) -> float:
    """The least of margins (n,), without NaN; NaN if there is none."""
    valid = margins[~np.isnan(margins)]
    return float(valid.min()) if len(valid) else float("nan")


def margins(solution: Solution) -> Margins:
    """(joint, bound) -> margin, (...,), for every limit of the mechanism.

    Bounds are "min", "max" and "cone", as in `ActiveLimit`. A margin is a share of half the range, or of the half angle
    of the cone. It is 1 in the middle of a range or on the axis of a cone, 0 on the limit, and negative beyond it; of
    the two ranges of a universal or cylindrical joint the nearer bound counts. For a range with two equal bounds it is
    0 on them and infinite off them. NaN for INVALID rows.

    Where the mechanism has a clearance c, every pair of links that may touch has a margin too, (d - c) / L, the rest of
    their distance d as a share of the characteristic length L: ("BC1–BC3", "clearance"), with the names of both bodies.

    Parameters
    ----------
    solution : Solution
        One answer or a batch.

    Raises
    ------
    InvalidArgument
        The argument is no Solution.
    """
    mechanism = checked_solution(solution).mechanism
    ranges, q = ranges_of(mechanism), solution._coordinates
    values, half, tolerances = ranges.values(q), 0.5 * (ranges.high - ranges.low), TOLERANCES.limit * ranges.units
    shares = {
        "min": _shares(values - ranges.low, half, tolerances).T,
        "max": _shares(ranges.high - values, half, tolerances).T,
    }
    by_limit: dict[tuple[str, str], Floats] = {}
    for place, joint in enumerate(ranges.joints):
        for bound, of_bound in shares.items():
            other = by_limit.get((joint.name, bound))
            by_limit[joint.name, bound] = of_bound[place] if other is None else np.minimum(of_bound[place], other)
    for joint, angles, half_angle in coned(mechanism, q):
        by_limit[joint.name, "cone"] = (half_angle - angles) / half_angle
    if mechanism.clearance is not None:
        distances = pair_distances(placed_at(mechanism, solution._configurations))
        room = (distances - mechanism.clearance) / mechanism.characteristic_length
        for name, of_pair in zip(pair_names(mechanism), room.T, strict=True):
            other = by_limit.get((name, "clearance"))
            by_limit[name, "clearance"] = of_pair if other is None else np.minimum(of_pair, other)
    return Margins({key: shaped(margin, solution.shape) for key, margin in by_limit.items()})


def nearest_first(solution: Solution) -> list[tuple[str, str, float]]:
    """Joint, bound and margin of every limit of one answer, the nearest first."""
    return [(*limit, margin) for limit, margin in margins(solution).nearest_first()]


def _shares(distances: Floats, half: Floats, tolerances: Floats) -> Floats:
    """Distances from bounds (n, k) as shares of half the ranges, (k,); 0 or infinite for ranges of no width."""
    if (half > 0.0).all():
        return distances / half
    of_no_width = np.where(np.abs(distances) <= tolerances, 0.0 * distances, np.copysign(np.inf, distances))
    return np.where(half > 0.0, distances / np.where(half > 0.0, half, 1.0), of_no_width)
