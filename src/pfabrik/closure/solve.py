"""Inverse kinematics by the closure engine alone, for mechanisms with sub-chains that positions cannot express."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..answers.limits import within_turns
from ..description.mechanism import Mechanism
from ..description.task import Weights, task_of
from ..kernels.reaching import plan as P
from ..options import Options
from ..poses import are_poses, between, made_exact
from ..reaching.completion import actuators_of
from ..tolerances import TOLERANCES
from .close import HELD, Closing, Closure, close, closure_of, platform_poses
from .descend import within_sight
from .nearest import MARGIN, is_feasible
from .parasitic import differences, follows_task, has_parasitic_motion
from .projection import kept, project, ways_of
from .starts import random_coordinates
from .stretched import Bends

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

STRIDES = 8
"""Steps in which the platform is taken from the seed's pose to the target where one step strays."""

STRIDE = 0.25
"""How far one step goes where the working mode is to be kept: a longer one may leap over a singularity [L or rad]."""

STRANGE = 0.1
"""How far what a task leaves out may be from where it was before its way is looked at [L or rad]."""

STARTS = 80
"""Random starts of the legs that do not reach from where they are: a leg has a handful of branches."""

STEPS = 30
"""Steps each of them may take: those that arrive need fewer."""


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
    closure, bends, alone = closure_of(mechanism), Bends(mechanism, options), np.ones(1, bool)
    for i in range(len(targets)):
        if known[i]:
            target, row = targets[i : i + 1], P.Rows._make(array[i : i + 1] for array in rows)
            found = _answer(closure, target, alone, start, options, True, row)
            if bends.before is not None:
                other_row = P.Rows._make(array.copy() for array in row)
                other = _answer(closure, target, alone, bends.before, options, True, other_row)
                found = other if bends.settle(target, row, other_row) else found
            bends.note(int(row.status[0]), start, found)
            start = coordinates[i : i + 1] = found
        if on_progress is not None:
            on_progress(i + 1, len(targets))
    return coordinates


def reached_by_closure(mechanism: Mechanism, targets: Floats, start: Floats) -> tuple[Floats, Mask]:
    """Joint coordinates at targets (n, 4, 4), in the working mode of those to start from, and which are reached."""
    found = _reach(closure_of(mechanism), targets, start, platform_poses(mechanism, start), keep_mode=True)
    return found.coordinates, is_feasible(found)


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
    wanted, mechanism = made_exact(targets[which]), closure.mechanism
    begin = platform_poses(mechanism, start)
    found = _reach(closure, wanted, start, begin, keep_mode)
    holds = np.full(len(wanted), P.HOLD_NOTHING)
    away = np.flatnonzero(~is_feasible(found))
    if len(away):
        stays = keep_mode or follows_task(mechanism)
        starts = [start[away]] if stays else [start[away], found.coordinates[away]]
        sought = within_sight(mechanism, wanted[away])
        answers = project(
            closure, sought, starts, ways_of(mechanism, options.hold, options.rotation_length), corners=not keep_mode
        )
        holds[away] = kept(mechanism, answers.holds, answers.closing.poses, wanted[away])
        for array, own in zip(found, answers.closing, strict=True):
            array[away] = own
    _fill(closure, found, wanted, which, options, rows)
    rows.counters[which, 2] = holds
    return found.coordinates


def _reach(closure: Closure, targets: Floats, start: Floats, begin: Floats, keep_mode: bool) -> Closing:
    """Close the legs below platforms on their targets, within limits; the rows that are feasible are reached."""
    task, follows = task_of(closure.mechanism), follows_task(closure.mechanism)
    wanted = task.completed(targets, begin)
    rows = np.arange(len(targets))
    if follows:
        assembled = _assembled(closure, wanted, start, begin)
        wanted, rows = assembled.poses, np.flatnonzero(assembled.gap <= TOLERANCES.position)
    held = HELD if follows else task.held
    found = _close_below(closure, start, wanted, held)
    is_far = _distances(closure, begin, wanted) > STRIDE
    rest = np.flatnonzero(~is_feasible(found) | (is_far if keep_mode else False))
    if len(rest):
        _take_better(found, rest, _led(closure, wanted[rest], start[rest], begin[rest], held, limits=True))
    if not keep_mode:
        _search(closure, found, rows, wanted, held, at_rest=follows or task.is_whole_pose)
    if not keep_mode and follows and has_parasitic_motion(closure.mechanism):
        anywhere = task.completed(targets, begin)  # in other ways of assembly, where this one does not reach
        _search(closure, found, np.arange(len(targets)), anywhere, task.held, at_rest=False)
    return found


def _search(
    closure: Closure, found: Closing, rows: NDArray[np.intp], wanted: Floats, held: Weights, *, at_rest: bool
) -> None:
    """Look for the legs that do not reach yet from random configurations; with the platform `at_rest`, one by one."""
    rng = np.random.default_rng(0)
    for _ in range(STARTS):
        rest = rows[~is_feasible(found)[rows]]
        if not len(rest):
            break
        scattered = np.repeat(random_coordinates(closure, 1, rng), len(rest), axis=0)
        if at_rest:
            reached = _legs_reached(closure, found, rest)
            scattered = np.where(reached, found.coordinates[rest], scattered)
        tried = _close_below(closure, scattered, wanted[rest], held, STEPS)
        if at_rest:
            _take_legs(closure, found, rest, tried)
        else:
            _take_better(found, rest, tried)


def _assembled(closure: Closure, wanted: Floats, start: Floats, begin: Floats) -> Closing:
    """The whole poses that the loops, without limits, make of targets, (n, 4, 4), in the assembly of the start.

    Rows that are left open have none.
    """
    task = task_of(closure.mechanism)
    if not has_parasitic_motion(closure.mechanism):
        return close(closure, start, wanted, platform=HELD)
    found = close(closure, start, wanted, platform=task.held, framed=task.is_framed)
    strange = np.flatnonzero((found.gap > TOLERANCES.position) | (differences(closure, found.poses, wanted) > STRANGE))
    if len(strange):
        led = _led(closure, wanted[strange], start[strange], begin[strange], task.held, limits=False)
        for array, own in zip(found, led, strict=True):
            array[strange] = own
    return found


def _close_below(
    closure: Closure, start: Floats, wanted: Floats, held: Weights, max_iterations: int = 100, limits: bool = True
) -> Closing:
    """Close the legs, within limits, below platforms that are held where they are wanted."""
    return close(
        closure,
        start,
        wanted,
        platform=held,
        framed=task_of(closure.mechanism).is_framed and held != HELD,
        limits=limits,
        margin=MARGIN,
        max_iterations=max_iterations,
    )


def _led(closure: Closure, targets: Floats, start: Floats, begin: Floats, held: Weights, *, limits: bool) -> Closing:
    """The platform led from where it is to its target; where what is not held leaps on the way, nothing is found."""
    task, present = task_of(closure.mechanism), begin
    leapt = np.zeros(len(targets), bool)
    for stride in range(1, STRIDES + 1):
        way = between(begin, targets, stride / STRIDES)
        way = way if held == HELD else task.completed(way, present)
        found = _close_below(closure, start, way, held, limits=limits)
        leapt |= differences(closure, found.poses, way) > STRANGE + differences(closure, way, present)
        start, present = found.coordinates, found.poses
    found.gaps[leapt] = np.inf
    return found


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
    rows.counters[which] = np.stack([found.iterations, *np.zeros((2, len(poses)), np.int64)], axis=1)
    rows.poses[which] = poses
    rows.actuators[which] = actuators_of(mechanism, found.coordinates)
    zero = np.zeros(len(poses))
    rows.measures[which] = np.stack(
        [position, rotation, found.gap * length, np.maximum(found.excess, 0.0), zero], axis=1
    )
