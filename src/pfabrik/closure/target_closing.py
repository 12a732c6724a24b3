"""Reaching targets in joint coordinates: the legs closed below platforms that are held on their targets."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Ints, Mask
from ..batch import put
from ..description.task import Weights
from ..kernels.closure.loops import BASE_AXES
from ..motion.closure import Closure
from ..poses import between
from ..tolerances import TOLERANCES
from .close import HELD, Closing, close
from .effort import starts_within, steps_per_continuation_step, steps_within
from .multistart import random_feasible
from .parasitic import asks_too_much, differences, follows_task, has_parasitic_motion, is_flipped
from .random_starts import random_coordinates

CONTINUATION_STEPS = 8
"""Steps of a continuation of the platform from the pose of the start to the target, if one step fails."""

LONGEST_STEP = 0.25
"""Longest single step that keeps the working mode: a longer one may jump over a singularity [L or rad]."""

STRANGE = 0.1
"""Largest change of components that the task leaves out, beyond which a step is replaced by continuation [L or rad]."""

STARTS = 80
"""Random starts of legs that are not closed from the given start: a leg has a handful of branches."""

AGREEMENTS, SAME = 16, 1e-3
"""Starts that must end at the least gap or excess found before a leg is given up, and the relative difference below
which two count as equal. A branch found half as often has then been found too, but for one time in 600."""

NEARBY = 64
"""Random feasible configurations that are tried before random starts, the nearest to the target first."""

STEPS = 30
"""Most steps from each of these; those that converge need fewer."""


def reach(closure: Closure, targets: Floats, start: Floats, begin: Floats, keep_mode: bool) -> Closing:
    """Close the legs with platforms on their targets, within limits; feasible rows have reached them.

    Parameters
    ----------
    start, begin : joint coordinates (n, columns) of the start, and its platform poses (n, 4, 4).
    """
    task, follows = closure.task, follows_task(closure)
    poses = targets if task.is_whole_pose else task.completed(targets, begin)
    rows = np.arange(len(targets))
    if follows:
        assembled = _complete_poses(closure, poses, start, begin)
        poses, rows = assembled.poses, np.flatnonzero(assembled.gap <= TOLERANCES.position)
    held = HELD if follows else task.held
    best = close_below(closure, start, poses, held)
    is_unsolved = ~best.feasible
    if keep_mode:
        is_unsolved |= _distances(closure, begin, poses) > LONGEST_STEP
    unsolved = np.flatnonzero(is_unsolved)
    if len(unsolved):
        continued = _continue_to(closure, poses[unsolved], start[unsolved], begin[unsolved], held, limits=True)
        best.put_better(unsolved, continued)
    elif len(rows) == len(targets):
        return best
    if not keep_mode:
        is_pose_fixed = follows or task.is_whole_pose
        if not is_pose_fixed:
            _search_from_nearby(closure, best, targets, task.held)
        _search_from_random(closure, best, rows, poses, held, is_pose_fixed=is_pose_fixed)
    if not keep_mode and follows and (has_parasitic_motion(closure) or asks_too_much(closure)):
        held = task.held if has_parasitic_motion(closure) else HELD
        _search_from_nearby(closure, best, targets, held)  # in other assembly modes, if this one does not reach
        if asks_too_much(closure) or len(random_feasible(closure)[0]) < NEARBY:
            completed = task.completed(targets, begin)
            _search_from_random(closure, best, np.arange(len(targets)), completed, held, is_pose_fixed=False)
    return best


def reach_once(closure: Closure, targets: Floats, start: Floats, begin: Floats, leg_by_leg: bool) -> Closing:
    """Close all loops on their targets from configurations (n, columns) with platforms (n, 4, 4).

    What the task leaves open of a pose is expected as it is there. With `leg_by_leg`, where that fails, each leg is
    searched for alone at the pose expected, whatever the branches of the others; once all are near, the pose follows.
    """
    poses, held = closure.task.completed(targets, begin), closure.task.held
    best = close_below(closure, start, poses, held)
    rows = np.flatnonzero(~best.feasible)
    if leg_by_leg and len(rows):
        near = close_below(closure, start[rows], poses[rows], HELD)
        _search_from_random(closure, near, np.arange(len(rows)), poses[rows], HELD, is_pose_fixed=True)
        best.put_better(rows, close_below(closure, near.coordinates, poses[rows], held))
    best.gaps[is_flipped(closure, best.poses)] = np.inf
    return best


def _search_from_nearby(closure: Closure, best: Closing, targets: Floats, held: Weights) -> None:
    """Solve unsolved rows from the random feasible configurations whose end effectors are nearest to the targets."""
    coordinates, poses = random_feasible(closure)
    task, unsolved = closure.task, np.flatnonzero(~best.feasible)
    distances = np.array(
        [_distances(closure, poses, np.repeat(targets[[row]], len(poses), axis=0)) for row in unsolved]
    )
    n = starts_within(closure, NEARBY, STEPS)
    for places in np.argsort(distances, axis=1)[:, :n].T if len(unsolved) else ():
        is_pending = ~best.feasible[unsolved]
        if not is_pending.any():
            break
        rows, places = unsolved[is_pending], places[is_pending]
        start = np.where(closure.idle, best.coordinates[rows], coordinates[places])
        completed = task.completed(targets[rows], poses[places])
        best.put_better(rows, close_below(closure, start, completed, held, STEPS))


def _search_from_random(
    closure: Closure, best: Closing, rows: NDArray[np.intp], poses: Floats, held: Weights, *, is_pose_fixed: bool
) -> None:
    """Solve unsolved rows from random starts; if the platform's pose is fixed, leg by leg.

    With a fixed pose, a row is given up once enough starts of one of its legs agree on the least gap or excess.
    """
    rng = np.random.default_rng(0)
    agreements = np.zeros(best.gaps.shape, np.int64)
    for _ in range(starts_within(closure, STARTS, STEPS)):
        unsolved = rows[~best.feasible[rows] & (agreements[rows].max(axis=1) < AGREEMENTS)]
        if not len(unsolved):
            break
        is_kept = _solved_coordinates(closure, best, unsolved) | closure.idle if is_pose_fixed else closure.idle
        start = np.where(is_kept, best.coordinates[unsolved], random_coordinates(closure, 1, rng))
        trial = close_below(closure, start, poses[unsolved], held, STEPS)
        if is_pose_fixed:
            agreements[unsolved] = _count_agreements(best.off[unsolved], trial.off, agreements[unsolved])
            _put_better_legs(closure, best, unsolved, trial)
        else:
            best.put_better(unsolved, trial)


def _count_agreements(best: Floats, trial: Floats, agreements: Ints) -> Ints:
    """Updated agreement counts of each leg, (n, groups), from infeasibilities; 0 for legs that are feasible."""
    with np.errstate(invalid="ignore", over="ignore"):  # an infinite value is neither nearer nor equal
        is_nearer, agrees = trial < (1.0 - SAME) * best, np.abs(trial - best) <= SAME * best
    counted = np.where(is_nearer, 1, agreements + agrees)
    return np.where(np.minimum(best, trial) <= TOLERANCES.limit, 0, counted)


def _complete_poses(closure: Closure, poses: Floats, start: Floats, begin: Floats) -> Closing:
    """Close the loops, without limits, on what the task sets of poses (n, 4, 4), in the assembly mode of the start.

    The resulting poses are complete; rows with open loops have none.
    """
    task = closure.task
    if not has_parasitic_motion(closure):
        return close(closure, start, poses, platform=HELD)
    best = close(closure, start, poses, platform=task.held, frame=task.frame)
    has_jumped = differences(closure, best.poses, poses) > STRANGE
    unsolved = np.flatnonzero((best.gap > TOLERANCES.position) | has_jumped)
    if len(unsolved):
        continued = _continue_to(closure, poses[unsolved], start[unsolved], begin[unsolved], task.held, limits=False)
        put(best, unsolved, continued)
    return best


def close_below(
    closure: Closure, start: Floats, poses: Floats, held: Weights, max_iterations: int = 100, limits: bool = True
) -> Closing:
    """Close the legs, within limits, below platforms that are held at poses (n, 4, 4)."""
    return close(
        closure,
        start,
        poses,
        platform=held,
        frame=BASE_AXES if held == HELD else closure.task.frame,
        limits=limits,
        margin=TOLERANCES.inside,
        max_iterations=steps_within(closure, max_iterations),
    )


def _continue_to(
    closure: Closure, targets: Floats, start: Floats, begin: Floats, held: Weights, *, limits: bool
) -> Closing:
    """Continuation of the platform from its pose at the start to its target.

    Rows in which a component that is not held jumps on the way are marked as open.
    """
    task, present = closure.task, begin
    max_iterations = steps_per_continuation_step(closure, 100, CONTINUATION_STEPS)
    if max_iterations == 0:
        return close_below(closure, start, targets, held, 0 if limits else 100, limits=limits)
    has_jumped = np.zeros(len(targets), bool)
    for step in range(1, CONTINUATION_STEPS + 1):
        poses = between(begin, targets, step / CONTINUATION_STEPS)
        poses = poses if held == HELD else task.completed(poses, present)
        closing = close_below(closure, start, poses, held, max_iterations, limits=limits)
        has_jumped |= differences(closure, closing.poses, poses) > STRANGE + differences(closure, poses, present)
        start, present = closing.coordinates, closing.poses
    closing.gaps[has_jumped] = np.inf
    return closing


def _solved_coordinates(closure: Closure, closing: Closing, rows: NDArray[np.intp]) -> Mask:
    """Mask of the coordinates whose groups are feasible, (m, columns)."""
    is_feasible = closing.off[rows] <= TOLERANCES.limit
    return np.asarray(is_feasible[:, closure.loops.group_of])


def _put_better_legs(closure: Closure, best: Closing, rows: NDArray[np.intp], trial: Closing) -> None:
    """Put the groups of a trial that are less infeasible than the best."""
    is_better = trial.off < best.off[rows]
    columns = is_better[:, closure.loops.group_of]
    best.coordinates[rows] = np.where(columns, trial.coordinates, best.coordinates[rows])
    for array, trial_array in ((best.gaps, trial.gaps), (best.excesses, trial.excesses)):
        array[rows] = np.where(is_better, trial_array, array[rows])


def _distances(closure: Closure, poses: Floats, other_poses: Floats) -> Floats:
    """Distances between poses in the components of the task, (n,): lengths relative to L, angles in rad."""
    position, rotation = closure.task.errors(poses, other_poses)
    return np.asarray(np.hypot(position / closure.mechanism.characteristic_length, rotation))
