"""The nearest feasible poses, by searches in the pose of the platform."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..arrays import Floats, Ints
from ..closure.close import MARGIN
from ..closure.projection import Way
from ..decomposition.leg_table import LegTable
from ..description.home_mobility import column_joints
from ..description.mechanism import Mechanism
from ..description.task import task_of
from ..kernels.closure.loops import BASE_AXES, LOCKED, PoseObjective
from ..kernels.legs import records as K
from ..kernels.platform.records import Found, Starts
from ..kernels.rows import HOLD_NOTHING
from ..tolerances import TOLERANCES
from .approach import approached, in_lengths, new_found, no_starts
from .corners import corners_of
from .rotation import keeps_rotation

MOST_STEPS = 200
"""Steps of a search, including those that are taken back; most need a dozen."""


class Projected(NamedTuple):
    """The nearest feasible configurations found, and what each holds of its target; distances are infinite where there
    is none."""

    found: Found
    holds: Ints


def project(
    mechanism: Mechanism,
    table: LegTable,
    targets: Floats,
    own: Starts,
    ways: Sequence[Way],
    *,
    corners: bool,
    stays: bool,
) -> Projected:
    """The nearest feasible configurations that searches from several starts find.

    Parameters
    ----------
    targets : (n, 4, 4) [length].
    own : the first start of each row, or one for all; poses [L].
    ways : what counts and what is held, tried in turn until one has an answer.
    corners : start from elsewhere too. Without, a search stays about where it starts.
    stays : in the working mode of the first start; through a dead point lies another.
    """
    first, *others = ways
    best = Projected(_search(mechanism, table, targets, own, first, corners, stays), np.full(len(targets), first.hold))
    for way in others:
        rows = np.flatnonzero(np.isinf(best.found.distances))
        if len(rows):
            start = own if len(own.poses) == 1 else own.at(rows)
            found = _search(mechanism, table, targets[rows], start, way, corners, stays)
            for array, tried in zip(best.found, found, strict=True):
                array[rows] = tried
            best.holds[rows] = way.hold
    return best


def _search(
    mechanism: Mechanism, table: LegTable, targets: Floats, own: Starts, way: Way, corners: bool, stays: bool
) -> Found:
    others = corners_of(mechanism) if corners else no_starts(table)
    return approached(mechanism, table, _objective(mechanism, targets, way, MOST_STEPS), own, others, stays=stays)[0]


def _objective(mechanism: Mechanism, targets: Floats, way: Way, steps: int) -> PoseObjective:
    weights, frame = np.array(way.weights, dtype=float), task_of(mechanism).frame
    if mechanism.end_effector_is_joint or keeps_rotation(mechanism):
        weights[3:], frame = LOCKED, BASE_AXES
    return PoseObjective(targets, weights, frame, MARGIN, TOLERANCES.active, steps)


def weighed_limits(mechanism: Mechanism, table: LegTable, targets: Floats, present: Starts, way: Way) -> Floats:
    """How hard every limit holds configurations back from targets (n, 4, 4) [length]: multipliers, in the order of
    those that `closure.descend.weighed_limits` gives."""
    objective = _objective(mechanism, targets, way, 0)
    found = approached(mechanism, table, objective, present, no_starts(table))[1]
    columns, ranges = len(column_joints(mechanism)), len(table.limited)
    coned = [joint.name for joint in mechanism.joints if joint.cone is not None]
    weights = np.zeros((len(targets), 2 * columns + len(coned)))
    for bound in (0, 1):
        weights[:, 2 * table.limited["column"] + bound] = found[:, bound : 2 * ranges : 2]
    cones = [2 * columns + coned.index(name) for name, bound in table.limits if bound == "cone"]
    weights[:, cones] = found[:, 2 * ranges : 2 * ranges + len(cones)]
    return weights


def nearest_actuators(mechanism: Mechanism, table: LegTable, values: Floats, own: Starts, *, corners: bool) -> Found:
    """Feasible configurations whose actuators are nearest to values (n, n_a), deviations from home [L or rad]."""
    poses = in_lengths(own.poses, mechanism.characteristic_length)
    poses = poses if len(poses) == len(values) else np.repeat(poses, len(values), axis=0)
    weights = np.zeros(6)
    if mechanism.end_effector_is_joint or keeps_rotation(mechanism):
        weights[3:] = LOCKED
    objective = PoseObjective(poses, weights, BASE_AXES, MARGIN, TOLERANCES.active, MOST_STEPS)
    others = corners_of(mechanism) if corners else no_starts(table)
    return approached(mechanism, table, objective, own, others, values)[0]


def nearest_arms(mechanism: Mechanism, table: LegTable, targets: Floats, own: Starts) -> Found:
    """Feasible configurations at targets (n, 4, 4) [length] whose arms are near to where the starts (n,) have them.

    Searches start there alone: what they miss, projections from elsewhere find.
    """
    way, n = Way(task_of(mechanism).weights(LOCKED, LOCKED), HOLD_NOTHING), len(targets)
    objective, best = _objective(mechanism, targets, way, MOST_STEPS), new_found(n, table)
    best.distances[:], best.sides[:] = 0.0, own.sides
    for part, legs in _apart_by_arms(table):
        begin, arms = Starts(own.poses, *(np.ascontiguousarray(array[:, legs]) for array in own[1:])), part.arms
        values = np.ascontiguousarray(arms["sense"] * begin.sides[:, arms["leg"]])
        found = approached(mechanism, part, objective, begin, no_starts(part), values, arms)[0]
        np.maximum(best.distances, found.distances, out=best.distances)
        best.poses[:], best.sides[:, legs] = found.poses, found.sides
    return best


@lru_cache(maxsize=64)
def _apart_by_arms(table: LegTable) -> tuple[tuple[LegTable, slice], ...]:
    """Tables of the legs on each set of arms, and which legs these are: they have nothing to do with each other where
    the pose is given; else all in one."""
    if table.task["unset"][0] > 0 or table.task["rows"][0] > 0:
        return ((table, slice(None)),)
    legs, parts = table.legs, []
    starts = np.flatnonzero((legs["kind"] == K.ARM) & (legs["arm"] < 0)).tolist()
    for k, after in zip(starts, [*starts[1:], len(legs)], strict=True):
        end = k + 1
        while end < after and legs[end]["arm"] >= k:
            end += 1
        own_legs, before = legs[k:end].copy(), legs[k]["makes"] - 2
        own_legs["arm"] -= np.where(own_legs["arm"] >= 0, k, 0)
        own_legs["makes"] -= before
        own_legs["frame"] -= np.where(own_legs["frame"] >= 2, before, 0)
        own = {name: getattr(table, name) for name in ("limited", "cones", "known")}
        own = {name: array[(array["leg"] >= k) & (array["leg"] < end)] for name, array in own.items()}
        for array in own.values():
            array["leg"] -= k
        parts.append((replace(table, forms=table.forms[k:end], legs=own_legs, **own), slice(k, end)))
    return tuple(parts)
