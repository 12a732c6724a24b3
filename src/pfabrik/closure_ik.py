"""Inverse kinematics by the closure engine alone, for mechanisms with sub-chains that positions cannot express."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .closure import Closing, Closure, close, closure_of
from .completion import actuators_of
from .displacements import displacements
from .kernels import plan as P
from .kernels.loops import LOCKED
from .limits import within_turns
from .mechanism import Mechanism
from .nearest import MARGIN, is_feasible, nearest
from .options import Options
from .paths import end_body
from .poses import are_poses
from .starts import random_coordinates
from .task import Task, Weights, norms, task_of
from .tolerances import TOLERANCES

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

STRIDES = 8
"""Steps in which the platform is taken from the seed's pose to the target where one step strays."""

STRIDE = 0.25
"""How far one step goes where the working mode is to be kept: a longer one may leap over a singularity [L or rad]."""

SIGHT = 1e4
"""How far off targets are looked for [L]: beyond, even the least weight of a wish would outweigh closed loops."""

STARTS = 40
"""Random starts of the legs that do not reach from where they are: a leg has a handful of branches."""

STEPS = 30
"""Steps each of them may take: those that arrive need fewer."""


def platform_poses(mechanism: Mechanism, coordinates: Floats) -> Floats:
    """Poses (n, 4, 4) of the end effector, or of the body that carries it where it is a joint."""
    return np.asarray(displacements(mechanism, coordinates)[end_body(mechanism)] @ mechanism.home_pose)


def answer_by_closure(
    mechanism: Mechanism, targets: Floats, start: Floats, options: Options, keep_mode: bool, rows: P.Rows
) -> Floats:
    """Answer targets (n, 4, 4) from joint coordinates (n, columns) or (1, columns); fills `rows`.

    Parameters
    ----------
    keep_mode : stay in the working mode of the start.

    Returns
    -------
    Joint coordinates of the answers, deviations from home, (n, columns); NaN for rows that are no poses.
    """
    known, coordinates = _prepare(targets, start, rows)
    begin = start[known] if len(start) > 1 else np.repeat(start, known.sum(), axis=0)
    coordinates[known] = _answer(closure_of(mechanism), targets, known, begin, options, keep_mode, rows)
    return coordinates


def follow_by_closure(
    mechanism: Mechanism,
    targets: Floats,
    start: Floats,
    options: Options,
    rows: P.Rows,
    on_progress: Callable[[int, int], None] | None,
) -> Floats:
    """Answer a path from joint coordinates (1, columns): each target from the answer before it, in its working mode."""
    known, coordinates = _prepare(targets, start, rows)
    for i in range(len(targets)):
        if known[i]:
            only = np.arange(len(targets)) == i
            start = coordinates[only] = _answer(closure_of(mechanism), targets, only, start, options, True, rows)
        if on_progress is not None:
            on_progress(i + 1, len(targets))
    return coordinates


def _prepare(targets: Floats, start: Floats, rows: P.Rows) -> tuple[Mask, Floats]:
    """Which targets are poses, the others marked, and room for coordinates."""
    known = are_poses(targets)
    for array in (rows.poses, rows.actuators, rows.measures):
        array[~known] = np.nan
    rows.status[~known], rows.counters[~known] = P.INVALID, 0
    return known, np.full((len(targets), start.shape[1]), np.nan)


def _answer(
    closure: Closure, targets: Floats, which: Mask, start: Floats, options: Options, keep_mode: bool, rows: P.Rows
) -> Floats:
    """Answer the rows `which` of the targets from (m, columns)."""
    wanted, mechanism = targets[which], closure.mechanism
    begin = platform_poses(mechanism, start)
    found = _reach(closure, wanted, start, begin, keep_mode)
    away = np.flatnonzero(~is_feasible(found))
    if len(away):
        ended = None if keep_mode else (found.coordinates[away], found.poses[away])
        sought = _within_sight(closure, wanted[away], begin[away])
        projected = _project(closure, sought, start[away], begin[away], ended, options)
        for array, own in zip(found, projected, strict=True):
            array[away] = own
    _fill(closure, found, wanted, which, options, rows)
    return found.coordinates


def _reach(closure: Closure, targets: Floats, start: Floats, begin: Floats, keep_mode: bool) -> Closing:
    """Close the legs below platforms on their targets, within limits; the rows that are feasible are reached."""
    task = task_of(closure.mechanism)
    wanted = task.completed(targets, begin)
    found = _close_below(closure, start, wanted)
    is_far = _distances(closure, begin, wanted) > STRIDE
    rest = np.flatnonzero(~is_feasible(found) | (is_far if keep_mode else False))
    if len(rest):
        _take_better(found, rest, _led(closure, wanted[rest], start[rest], begin[rest]))
    rng = np.random.default_rng(0)
    for _ in range(0 if keep_mode else STARTS):
        rest = np.flatnonzero(~is_feasible(found))
        if not len(rest):
            break
        scattered = np.repeat(random_coordinates(closure, 1, rng), len(rest), axis=0)
        if task.is_whole_pose:  # with the platform at rest, legs are found one by one
            reached = _legs_reached(closure, found, rest)
            scattered = np.where(reached, found.coordinates[rest], scattered)
        tried = _close_below(closure, scattered, wanted[rest], STEPS)
        if task.is_whole_pose:
            _take_legs(closure, found, rest, tried)
        else:
            _take_better(found, rest, tried)
    return found


def _close_below(closure: Closure, start: Floats, wanted: Floats, max_iterations: int = 100) -> Closing:
    """Close the legs, within limits, below platforms that are held in all that the task asks for."""
    task = task_of(closure.mechanism)
    return close(
        closure,
        start,
        wanted,
        platform=task.held,
        framed=task.is_framed,
        limits=True,
        margin=MARGIN,
        max_iterations=max_iterations,
    )


def _led(closure: Closure, targets: Floats, start: Floats, begin: Floats) -> Closing:
    """The platform led from where it is to its target."""
    task = task_of(closure.mechanism)
    present = begin
    for stride in range(1, STRIDES + 1):
        between = task.completed(_between(begin, targets, stride / STRIDES), present)
        found = _close_below(closure, start, between)
        start, present = found.coordinates, found.poses
    return found


def _between(begin: Floats, end: Floats, share: float) -> Floats:
    """Poses a share of the way from one to another: straight positions, the shortest turn."""
    between = begin + (end - begin) * share
    U, _, Vt = np.linalg.svd(between[:, :3, :3])  # the rotation nearest to the blend of the two
    proper = np.linalg.det(U @ Vt) > 0.0
    between[:, :3, :3] = np.where(proper[:, None, None], U @ Vt, begin[:, :3, :3])
    return between


def _off(found: Closing) -> Floats:
    """What keeps each group of each row from being feasible, (n, groups) [L or rad]."""
    return np.maximum(found.gaps, found.excesses)


def _legs_reached(closure: Closure, found: Closing, rows: NDArray[np.intp]) -> Mask:
    """Which coordinates belong to groups that are feasible, (m, columns)."""
    reached = _off(found)[rows] <= TOLERANCES.limit
    return np.asarray(reached[:, closure.loops.group_of])


def _take_legs(closure: Closure, found: Closing, rest: NDArray[np.intp], tried: Closing) -> None:
    """Take over the groups that came nearer."""
    better = _off(tried) < _off(found)[rest]
    columns = better[:, closure.loops.group_of]
    found.coordinates[rest] = np.where(columns, tried.coordinates, found.coordinates[rest])
    for array, own in ((found.gaps, tried.gaps), (found.excesses, tried.excesses)):
        array[rest] = np.where(better, own, array[rest])


def _take_better(found: Closing, rest: NDArray[np.intp], tried: Closing) -> None:
    """Take over the rows that are feasible, or came nearer."""
    better = np.flatnonzero(is_feasible(tried) | (_off(tried).max(axis=1) < _off(found)[rest].max(axis=1)))
    for array, own in zip(found, tried, strict=True):
        array[rest[better]] = own[better]


def _project(
    closure: Closure,
    targets: Floats,
    start: Floats,
    begin: Floats,
    ended: tuple[Floats, Floats] | None,
    options: Options,
) -> Closing:
    """Feasible configurations near targets that are not reached; the start itself where nothing better is found.

    Parameters
    ----------
    start, begin : where the search starts, (m, columns) and (m, 4, 4).
    ended : where reaching ended, likewise, another start; None to stay in the working mode of the first.
    """
    best = close(closure, start, begin, max_iterations=0)
    task = task_of(closure.mechanism)
    wanted = task.completed(targets, begin)
    starts = [(start, begin)] if ended is None else [(start, begin), ended]
    nearest_yet = np.full(len(targets), np.inf)
    for platform in _ways(task, options):
        waiting = np.flatnonzero(np.isinf(nearest_yet))
        if not len(waiting):
            break
        if LOCKED not in platform:
            nearest_yet[waiting] = _feasible_distances(closure, best, wanted)[waiting]
        for legs, poses in starts:
            placed = np.where(_held_entries(platform), wanted, poses)[waiting]
            tried = nearest(
                closure,
                legs[waiting],
                placed,
                platform=platform,
                framed=task.is_framed,
                targets=wanted[waiting],
                gently=ended is None,
            )
            distance = _feasible_distances(closure, tried, wanted[waiting])
            better = np.flatnonzero(distance < nearest_yet[waiting])
            nearest_yet[waiting[better]] = distance[better]
            for array, each in zip(best, tried, strict=True):
                array[waiting[better]] = each[better]
    return best


def _within_sight(closure: Closure, targets: Floats, begin: Floats) -> Floats:
    """Targets no further from where the platform is than a search can tell from others in the same direction."""
    offset = (targets - begin)[:, :3, 3]
    far = SIGHT * closure.mechanism.characteristic_length
    near = targets.copy()
    near[:, :3, 3] = begin[:, :3, 3] + offset * np.minimum(1.0, far / np.maximum(norms(offset), far))[:, None]
    return near


def _held_entries(platform: Weights) -> Mask:
    """Which entries of a pose a projection keeps, (4, 4)."""
    held = np.zeros((4, 4), bool)
    held[:3, 3], held[:3, :3] = np.array(platform[:3]) == LOCKED, LOCKED in platform[3:]
    return held


def _feasible_distances(closure: Closure, found: Closing, targets: Floats) -> Floats:
    """How far feasible rows are from their targets in what counts, (n,); infinite for the others."""
    distances = _distances(closure, found.poses, targets)
    return np.asarray(np.where(is_feasible(found), distances, np.inf))


def _ways(task: Task, options: Options) -> list[Weights]:
    """Weights of the platform's position and rotation, the ways to project in the order in which they are tried."""
    ways = {"orientation": [task.weights(1.0, LOCKED)], "position": [task.weights(LOCKED, 1.0)], None: []}[options.hold]
    both = any(task.axes) and task.rotations > 0  # else there is nothing to give way, or nothing to hold
    return [*(ways if both else []), task.weights(1.0, 1.0)]


def _distances(closure: Closure, poses: Floats, others: Floats) -> Floats:
    """How far poses are apart in what counts, (n,): lengths relative to L, angles in rad."""
    position, rotation = task_of(closure.mechanism).errors(poses, others)
    return np.asarray(np.hypot(position / closure.mechanism.characteristic_length, rotation))


def _fill(closure: Closure, found: Closing, wanted: Floats, which: Mask, options: Options, rows: P.Rows) -> None:
    """Write answers with what was measured of them."""
    mechanism = closure.mechanism
    length = mechanism.characteristic_length
    within_turns(mechanism, found.coordinates)
    poses = found.poses.copy()
    if mechanism.end_effector_is_joint:
        poses[:, :3, :3] = wanted[:, :3, :3]
    position, rotation = task_of(mechanism).errors(poses, wanted)
    near = (position <= (options.tolerance or TOLERANCES.position * length)) & (rotation <= options.rotation_tolerance)
    rows.status[which] = np.where(is_feasible(found), np.where(near, P.REACHED, P.PROJECTED), P.FAILED)
    rows.counters[which] = np.stack([found.iterations, np.zeros_like(found.iterations)], axis=1)
    rows.poses[which] = poses
    rows.actuators[which] = actuators_of(mechanism, found.coordinates)
    zero = np.zeros(len(poses))
    rows.measures[which] = np.stack(
        [position, rotation, found.gap * length, np.maximum(found.excess, 0.0), zero], axis=1
    )
