"""The nearest feasible poses, by searches in the pose of the platform."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from math import hypot
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Records
from ..closure.close import closure_of, in_lengths
from ..closure.projection import SAME, ProjectionMode, projection_modes
from ..decomposition.leg_table import LegTable, leg_table
from ..description.home_mobility import column_joints
from ..description.mechanism import Mechanism
from ..description.task import task_of
from ..kernels.closure.loops import BASE_AXES
from ..kernels.legs import records as K
from ..kernels.platform.records import Found, Starts
from ..kernels.rows import CERTAIN, HOLD, HOLD_NOTHING, HOLD_ORIENTATION, HOLD_POSITION, PROJECTED, REACHED
from ..options import Options
from ..tolerances import TOLERANCES
from .nearest_pose import NearestPose, new_found, no_starts, starts_at
from .seeds import seeds_of

MOST_STEPS = 200
"""Steps of a search, including those that are taken back; most need a dozen."""


def project(
    mechanism: Mechanism, options: Options, targets: Floats, own: Starts, found: Found, *, seeds: bool, stays: bool
) -> int:
    """Fill the nearest feasible configurations that searches from several starts find.

    Parameters
    ----------
    options : what counts and what is held: of the ways to project, the first that has an answer.
    targets : (n, 4, 4) [length].
    own : the first start of each row, or one for all; poses [L].
    found : distances are infinite where there is none.
    corners : start from elsewhere too. Without, a search stays about where it starts.
    stays : in the working mode of the first start; through a dead point lies another.

    Returns
    -------
    How many rows have none.
    """
    tolerances = options.tolerance, options.rotation_tolerance
    asked = _asked(mechanism, options.hold, options.rotation_length, *tolerances, seeds, stays)
    first, *others = asked.searches
    left = first.fill(targets, own, found)
    for search in others:
        if not left:
            break
        if left == len(targets):
            left = search.fill(targets, own, found)
            continue
        lost = found.distances == np.inf
        some = found.at(lost)
        left = search.fill(targets[lost], own.of(lost), some)
        found.put(lost, some)
    if len(others) and _may_be_far(asked, targets, own, found):
        _let_go(asked, targets, own, found)
    if asked.otherwise is not None:
        _reach_otherwise(asked.otherwise, targets, own, found)
    return left


class Asked(NamedTuple):
    """What is asked of projections."""

    mechanism: Mechanism
    length: float
    ways: tuple[ProjectionMode, ...]
    searches: tuple[NearestPose, ...]
    otherwise: NearestPose | None  # another way, where legs reach only what they complete step by step


@lru_cache(maxsize=256)
def _asked(
    mechanism: Mechanism,
    hold: str | None,
    rotation_length: float | None,
    tolerance: float | None,
    rotation_tolerance: float,
    seeds: bool,
    stays: bool,
) -> Asked:
    """The ways to project, in the order in which they are tried, and searches of each."""
    table, length = leg_table(mechanism), mechanism.characteristic_length
    assert isinstance(table, LegTable)
    settings = {"steps": MOST_STEPS, "stays": int(stays), "rotation": rotation_tolerance}
    settings["position"] = tolerance or TOLERANCES.position * length
    starts = seeds_of(mechanism) if seeds else no_starts(table)
    ways = projection_modes(mechanism, hold, rotation_length)
    searches = tuple(_search(mechanism, table, way, settings, starts) for way in ways)
    holding = projection_modes(mechanism, "orientation", rotation_length)
    otherwise = None
    if table.is_completed and len(holding) > 1:
        otherwise = searches[-1] if len(ways) > 1 else _search(mechanism, table, holding[0], settings, starts)
    return Asked(mechanism, length, ways, searches, otherwise)


def _search(
    mechanism: Mechanism, table: LegTable, way: ProjectionMode, settings: Mapping[str, float], starts: Starts
) -> NearestPose:
    """Searches of one way, from each row's own start and then from others."""
    length = mechanism.characteristic_length
    held = {
        "hold": way.hold,
        "held_position": TOLERANCES.held * length if way.hold == HOLD_POSITION else np.inf,
        "held_rotation": TOLERANCES.held if way.hold == HOLD_ORIENTATION else np.inf,
    }
    return NearestPose(mechanism, table, way.weights, {**settings, **held}, starts)


def _reach_otherwise(search: NearestPose, targets: Floats, own: Starts, found: Found) -> None:
    """Answer the rows that another way to project reaches: near singularities each misses others."""
    is_open = (found.status == PROJECTED) & (found.counters[:, HOLD] < CERTAIN)
    asked = (is_open & (found.distances < np.inf)).nonzero()[0]
    if not len(asked):
        return
    some = found.at(asked)
    search.fill(targets[asked], own.of(asked), some)
    reached = (some.status == REACHED) & (some.distances < np.inf)
    some.counters[:, HOLD] = HOLD_NOTHING
    found.put(asked[reached], some.at(reached))


def _may_be_far(asked: Asked, targets: Floats, own: Starts, found: Found) -> bool:
    """Whether a row may be farther from its target than where it starts; not of one whose position is nearer with its
    orientation held, which is told at once."""
    if len(targets) > 1 or asked.ways[0].hold != HOLD_ORIENTATION or not all(task_of(asked.mechanism).axes):
        return True
    at, start, scale = targets[0, :3, 3].tolist(), own.poses[0, :3, 3].tolist(), asked.length
    (x, y, z), (a, b, c) = at, start
    return bool(found.distances[0] * scale > hypot(x - a * scale, y - b * scale, z - c * scale))


def _let_go(asked: Asked, targets: Floats, own: Starts, found: Found) -> None:
    """Hold nothing where what was held leads farther from targets than the start is, and nothing held does not: see
    `ProjectionMode.is_too_far`."""
    held, nothing = asked.ways
    closure = closure_of(asked.mechanism)
    holds = (found.counters[:, HOLD] % CERTAIN == held.hold) & (found.distances < np.inf)
    if held.hold == HOLD_ORIENTATION:  # most are nearer in position alone
        off = (targets[:, :3, 3] / asked.length - own.poses[:, :3, 3]) * task_of(asked.mechanism).axes
        holds &= found.distances > np.sqrt(np.einsum("ij,ij->i", off, off))
    far = holds.nonzero()[0]
    if not len(far):
        return
    starts = np.broadcast_to(in_lengths(own.poses, asked.length), targets.shape)
    far = far[held.is_too_far(closure, found.distances[far], starts[far], targets[far])]
    if not len(far):
        return
    some = found.at(far)
    asked.searches[-1].fill(targets[far], own.of(far), some)
    nearer = some.distances <= (1.0 + SAME) * nothing.distances(closure, starts[far], targets[far])
    found.put(far[nearer], some.at(nearer))


def limit_multipliers(
    mechanism: Mechanism, table: LegTable, targets: Floats, present: Starts, way: ProjectionMode
) -> Floats:
    """How hard every limit holds configurations back from targets (n, 4, 4) [length]: multipliers, in the order of
    those that `closure.descend.limit_multipliers` gives."""
    found = _weighing(mechanism, table, way).weigh(targets, present)
    columns, ranges = len(column_joints(mechanism)), len(table.limited)
    coned = [joint.name for joint in mechanism.joints if joint.cone is not None]
    weights = np.zeros((len(targets), 2 * columns + len(coned)))
    for bound in (0, 1):
        weights[:, 2 * table.limited["column"] + bound] = found[:, bound : 2 * ranges : 2]
    cones = [2 * columns + coned.index(name) for name, bound in table.limits if bound == "cone"]
    weights[:, cones] = found[:, 2 * ranges : 2 * ranges + len(cones)]
    return weights


@lru_cache(maxsize=256)
def _weighing(mechanism: Mechanism, table: LegTable, way: ProjectionMode) -> NearestPose:
    """What takes no steps, and weighs limits."""
    return NearestPose(mechanism, table, way.weights, {"steps": 0}, no_starts(table))


def nearest_actuators(mechanism: Mechanism, values: Floats, own: Starts, *, seeds: bool) -> Found:
    """Feasible configurations whose actuators are nearest to values (n, n_a), deviations from home [L or rad]."""
    poses = in_lengths(own.poses, mechanism.characteristic_length)
    poses = poses if len(poses) == len(values) else np.repeat(poses, len(values), axis=0)
    return _toward_values(mechanism, seeds).find(poses, own, values)


@lru_cache(maxsize=64)
def _toward_values(mechanism: Mechanism, seeds: bool) -> NearestPose:
    """Searches for actuators that have values; the pose does not count."""
    table = leg_table(mechanism)
    assert isinstance(table, LegTable)
    others = seeds_of(mechanism) if seeds else no_starts(table)
    settings = {"frame": BASE_AXES, "steps": MOST_STEPS}
    return NearestPose(mechanism, table, (0.0,) * 6, settings, others, table.driven)


def move_redundant(
    mechanism: Mechanism,
    table: LegTable,
    targets: Floats,
    begins: Floats,
    sides: Floats,
    places: NDArray[np.intp],
) -> tuple[NDArray[np.intp], Floats]:
    """Move the arms of some rows to where legs reach their targets within all limits, as little as can be.

    Parameters
    ----------
    targets, begins : (n, 4, 4) and (n or 1, 4, 4) [length].
    sides : where arms are, (n, legs), and where they go.
    places : the rows that are asked for.

    Returns
    -------
    The rows for which there is such a place, and the poses that the searches ended at, (rows, 4, 4) [length].
    """
    own = starts_at(mechanism, table, begins if len(begins) == 1 else begins[places], sides[places])
    found = _nearest_redundant(mechanism, table, targets[places], own)
    placed = np.isfinite(found.distances)
    sides[places[placed]] = found.sides[placed]
    return places[placed], found.poses[placed]


def _nearest_redundant(mechanism: Mechanism, table: LegTable, targets: Floats, own: Starts) -> Found:
    """Feasible configurations at targets (n, 4, 4) [length] whose arms are near to where the starts (n,) have them.

    Searches start there alone: what they miss, projections from elsewhere find. Where one set of arms has no place the
    next is not asked.

    Parameters
    ----------
    own : poses (n or 1, 4, 4), sides (n, legs), and no coordinates.
    """
    best = new_found(len(targets), table)
    best.distances[:], best.sides[:] = 0.0, own.sides
    left = np.arange(len(targets))
    for redundant, legs, nearest_pose in _toward_redundant(mechanism, table):
        poses = own.poses if len(own.poses) == 1 else own.poses[left]
        begin = Starts(poses, np.ascontiguousarray(own.q[:, legs]), np.ascontiguousarray(own.sides[left][:, legs]))
        values = np.ascontiguousarray(redundant["sense"] * begin.sides[:, redundant["leg"]])
        found = nearest_pose.find(targets[left], begin, values)
        best.distances[left] = np.maximum(best.distances[left], found.distances)
        best.poses[left], best.sides[left, legs] = found.poses, found.sides
        left = left[np.isfinite(found.distances)]
    return best


@lru_cache(maxsize=64)
def _toward_redundant(mechanism: Mechanism, table: LegTable) -> tuple[tuple[Records, slice, NearestPose], ...]:
    """Searches for each set of arms at poses that are held: the arms, and which legs these are."""
    held = task_of(mechanism).held
    return tuple(
        (
            part.redundant,
            legs,
            NearestPose(mechanism, part, held, {"steps": MOST_STEPS}, no_starts(part), part.redundant),
        )
        for part, legs in _apart_by_redundant(table)
    )


def _apart_by_redundant(table: LegTable) -> tuple[tuple[LegTable, slice], ...]:
    """Tables of the legs on each set of arms, and which legs these are: they have nothing to do with each other where
    the pose is given; else all in one."""
    if table.task["unset"][0] > 0 or table.task["rows"][0] > 0:
        return ((table, slice(None)),)
    legs, parts = table.legs, []
    starts = np.flatnonzero((legs["kind"] == K.REDUNDANT) & (legs["redundant"] < 0)).tolist()
    for k, after in zip(starts, [*starts[1:], len(legs)], strict=True):
        end = k + 1
        while end < after and legs[end]["redundant"] >= k:
            end += 1
        own_legs, before = legs[k:end].copy(), legs[k]["makes"] - 2
        own_legs["redundant"] -= np.where(own_legs["redundant"] >= 0, k, 0)
        own_legs["makes"] -= before
        own_legs["frame"] -= np.where(own_legs["frame"] >= 2, before, 0)
        own = {name: getattr(table, name) for name in ("limited", "cones", "known")}
        own = {name: array[(array["leg"] >= k) & (array["leg"] < end)] for name, array in own.items()}
        for array in own.values():
            array["leg"] -= k
        parts.append((replace(table, forms=table.forms[k:end], legs=own_legs, **own), slice(k, end)))
    return tuple(parts)
