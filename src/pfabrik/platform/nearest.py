"""The nearest feasible configurations: projections of targets, nearest actuators."""

from __future__ import annotations

from collections.abc import Mapping
from math import hypot
from typing import NamedTuple

import numpy as np

from ..arrays import Floats
from ..batch import put, take, take_each
from ..closure.close import in_lengths
from ..closure.projection import SAME, ProjectionMode, projection_modes
from ..derived import derived
from ..description.home_mobility import column_joints
from ..kernels.closure.loops import BASE_AXES
from ..kernels.platform.search_records import PoseSolutions, Starts
from ..kernels.rows import CERTAIN, HOLD, HOLD_NOTHING, HOLD_ORIENTATION, HOLD_POSITION, PROJECTED, REACHED
from ..model import Model
from ..options import Options
from ..tolerances import TOLERANCES
from .links_of_legs import links_of_legs
from .nearest_pose import NearestPose, no_starts
from .seeds import seeds_of

MOST_STEPS = 200
"""Steps of a search, rejected ones included; most need a dozen."""


def nearest_poses(
    model: Model,
    options: Options,
    targets: Floats,
    starts: Starts,
    solution: PoseSolutions,
    *,
    seeds: bool,
    keep_mode: bool,
    has_start: bool,
) -> int:
    """Fill the nearest feasible configurations that searches from several starts find; return the number unsolved.

    Parameters
    ----------
    options : what counts and what is held. Of the projections tried in turn, the first with an answer gives it.
    targets : (n, 4, 4) [length].
    starts : the first start of each row, or one for all; poses [L].
    solution : its distances are infinite in unsolved rows.
    seeds : search from the machine's seeds too. Without, a search stays around its start.
    keep_mode : stay in the working mode of the first start; beyond a dead point is another.
    has_start : the first start was given: nothing held leads farther away than it is.
    """
    tolerances = options.tolerance, options.rotation_tolerance
    plan = _search_plan(model, options.hold, options.rotation_length, *tolerances, seeds, keep_mode)
    preferred, *later = plan.searches
    n_unsolved = preferred.fill(targets, starts, solution)
    for search in later:
        if not n_unsolved:
            break
        if n_unsolved == len(targets):
            n_unsolved = search.fill(targets, starts, solution)
            continue
        is_unsolved = solution.distances == np.inf
        block = take(solution, is_unsolved)
        n_unsolved = search.fill(targets[is_unsolved], take_each(starts, is_unsolved), block)
        put(solution, is_unsolved, block)
    if has_start and len(later) and _may_be_too_far(plan, targets, starts, solution):
        _release(plan, targets, starts, solution)
    if plan.fallback is not None:
        _reach_by_fallback(plan.fallback, targets, starts, solution)
    return n_unsolved


class SearchPlan(NamedTuple):
    """The projections tried in turn, and a search for each."""

    model: Model
    projections: tuple[ProjectionMode, ...]
    searches: tuple[NearestPose, ...]
    fallback: NearestPose | None  # another projection, if redundant joints follow step by step


@derived
def _search_plan(
    model: Model,
    hold: str | None,
    rotation_length: float | None,
    tolerance: float | None,
    rotation_tolerance: float,
    seeds: bool,
    keep_mode: bool,
) -> SearchPlan:
    """The projections that options ask for, in the order in which they are tried, and their searches."""
    table = model.legs
    settings = {"steps": MOST_STEPS, "stays": int(keep_mode), "rotation": rotation_tolerance}
    settings["position"] = tolerance or TOLERANCES.position * model.length
    seed_starts = seeds_of(model) if seeds else no_starts(table)
    projections = projection_modes(model.path_closure, hold, rotation_length)
    searches = tuple(_new_search(model, projection, settings, seed_starts) for projection in projections)
    with_orientation = projection_modes(model.path_closure, "orientation", rotation_length)
    fallback = None
    if table.has_implicit_joints and len(with_orientation) > 1:
        fallback = (
            searches[-1] if len(projections) > 1 else _new_search(model, with_orientation[0], settings, seed_starts)
        )
    return SearchPlan(model, projections, searches, fallback)


def endings(
    model: Model, options: Options, target: Floats, starts: Starts, *, keep_mode: bool
) -> list[tuple[ProjectionMode, PoseSolutions]]:
    """Where the search of each projection ends from each start alone, for one target (1, 4, 4) [length]."""
    tolerances = options.tolerance, options.rotation_tolerance
    plan = _search_plan(model, options.hold, options.rotation_length, *tolerances, False, keep_mode)
    targets = np.repeat(target, len(starts.poses), axis=0)
    return [
        (projection, search.find(targets, starts))
        for projection, search in zip(plan.projections, plan.searches, strict=True)
    ]


def _new_search(
    model: Model,
    projection: ProjectionMode,
    settings: Mapping[str, float],
    seed_starts: Starts,
) -> NearestPose:
    """The search of one projection: from each row's start, then from seeds."""
    held = {
        "hold": projection.hold,
        "held_position": TOLERANCES.held * model.length if projection.hold == HOLD_POSITION else np.inf,
        "held_rotation": TOLERANCES.held if projection.hold == HOLD_ORIENTATION else np.inf,
    }
    return NearestPose(model, model.legs, projection.weights, {**settings, **held}, seed_starts)


def _reach_by_fallback(search: NearestPose, targets: Floats, starts: Starts, solution: PoseSolutions) -> None:
    """Solve the rows that another projection reaches: near singularities each of the two misses some."""
    is_uncertain = (solution.status == PROJECTED) & (solution.counters[:, HOLD] < CERTAIN)
    rows_to_try = (is_uncertain & (solution.distances < np.inf)).nonzero()[0]
    if not len(rows_to_try):
        return
    block = take(solution, rows_to_try)
    search.fill(targets[rows_to_try], take_each(starts, rows_to_try), block)
    is_reached = (block.status == REACHED) & (block.distances < np.inf)
    block.counters[:, HOLD] = HOLD_NOTHING
    put(solution, rows_to_try[is_reached], take(block, is_reached))


def _may_be_too_far(plan: SearchPlan, targets: Floats, starts: Starts, solution: PoseSolutions) -> bool:
    """False if the only row, its orientation held, is surely nearer in position than its start; else True.

    A quick test that spares most single targets `_release`.
    """
    if len(targets) > 1 or plan.projections[0].hold != HOLD_ORIENTATION or not all(plan.model.task.axes):
        return True
    target, start, scale = targets[0, :3, 3].tolist(), starts.poses[0, :3, 3].tolist(), plan.model.length
    (x, y, z), (a, b, c) = target, start
    return bool(solution.distances[0] * scale > hypot(x - a * scale, y - b * scale, z - c * scale))


def _release(plan: SearchPlan, targets: Floats, starts: Starts, solution: PoseSolutions) -> None:
    """Hold nothing in rows that end too far from their targets because of what is held, if that brings them nearer.

    Too far is defined by `ProjectionMode.is_too_far`.
    """
    holding, free = plan.projections
    closure = plan.model.path_closure
    is_held = (solution.counters[:, HOLD] % CERTAIN == holding.hold) & (solution.distances < np.inf)
    if holding.hold == HOLD_ORIENTATION:  # most are nearer in position alone
        offset = (targets[:, :3, 3] / plan.model.length - starts.poses[:, :3, 3]) * plan.model.task.axes
        is_held &= solution.distances > np.sqrt(np.einsum("ij,ij->i", offset, offset))
    far = is_held.nonzero()[0]
    if not len(far):
        return
    start_poses = np.broadcast_to(in_lengths(starts.poses, plan.model.length), targets.shape)
    far = far[holding.is_too_far(closure, solution.distances[far], start_poses[far], targets[far])]
    if not len(far):
        return
    block = take(solution, far)
    plan.searches[-1].fill(targets[far], take_each(starts, far), block)
    is_nearer = block.distances <= (1.0 + SAME) * free.distances(closure, start_poses[far], targets[far])
    put(solution, far[is_nearer], take(block, is_nearer))


def limit_multipliers(model: Model, targets: Floats, configurations: Starts, projection: ProjectionMode) -> Floats:
    """The multipliers of all limits at configurations, for targets (n, 4, 4) [length].

    In the order of `closure.descend.limit_multipliers`.
    """
    table, mechanism = model.legs, model.mechanism
    multipliers = _multipliers(model, projection).weigh(targets, configurations)
    columns, ranges = len(column_joints(mechanism)), len(table.limited)
    cone_joints = [joint.name for joint in mechanism.joints if joint.cone is not None]
    n_pairs = len(links_of_legs(model).pairs)
    weights = np.zeros((len(targets), 2 * columns + len(cone_joints) + n_pairs))
    weights[:, weights.shape[1] - n_pairs :] = multipliers[:, multipliers.shape[1] - n_pairs :]
    for bound in (0, 1):
        weights[:, 2 * table.limited["column"] + bound] = multipliers[:, bound : 2 * ranges : 2]
    cones = [2 * columns + cone_joints.index(name) for name, bound in table.limits if bound == "cone"]
    weights[:, cones] = multipliers[:, 2 * ranges : 2 * ranges + len(cones)]
    return weights


@derived
def _multipliers(model: Model, projection: ProjectionMode) -> NearestPose:
    """The kernel call that takes no steps and gives the multipliers of limits."""
    return NearestPose(model, model.legs, projection.weights, {"steps": 0}, no_starts(model.legs))


def nearest_positions(model: Model, targets: Floats, starts: Starts, *, seeds: bool, keep_mode: bool) -> PoseSolutions:
    """Feasible configurations whose positions are nearest to those of targets (n, 4, 4) [length], in any orientation.

    Distances are those of positions alone; rows whose position is reached have the status REACHED.

    Parameters
    ----------
    starts, seeds, keep_mode : as of `nearest_poses`.
    """
    search = _position_search(model, seeds, keep_mode)
    return search.find(np.require(targets, requirements=["C", "W"]), starts)


@derived
def _position_search(model: Model, seeds: bool, keep_mode: bool) -> NearestPose:
    """The search for nearest positions; the orientation does not count."""
    settings = {
        "steps": MOST_STEPS,
        "stays": int(keep_mode),
        "position": TOLERANCES.position * model.length,
        "rotation": np.inf,
        "held_position": np.inf,
        "held_rotation": np.inf,
    }
    seed_starts = seeds_of(model) if seeds else no_starts(model.legs)
    return NearestPose(model, model.legs, model.task.weights(1.0, 0.0), settings, seed_starts)


def nearest_actuators(model: Model, values: Floats, starts: Starts, *, seeds: bool) -> PoseSolutions:
    """Feasible configurations whose actuators are nearest to values (n, n_a), deviations from home [L or rad]."""
    poses = in_lengths(starts.poses, model.length)
    poses = poses if len(poses) == len(values) else np.repeat(poses, len(values), axis=0)
    return _actuator_search(model, seeds).find(poses, starts, values)


@derived
def _actuator_search(model: Model, seeds: bool) -> NearestPose:
    """The search for actuators nearest to values; the pose does not count."""
    table = model.legs
    seed_starts = seeds_of(model) if seeds else no_starts(table)
    settings = {"frame": BASE_AXES, "steps": MOST_STEPS}
    return NearestPose(model, table, (0.0,) * 6, settings, seed_starts, table.driven)
