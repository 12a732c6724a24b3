"""Inverse kinematics on the coordinates of all joints, for every mechanism: legs closed below platforms on targets."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Ints, Mask
from ..description.mechanism import Mechanism
from ..description.task import Weights, task_of
from ..kernels.closure.loops import BASE_AXES
from ..kernels.rows import FAILED, HOLD, HOLD_NOTHING, POSITION_ERROR, PROJECTED, REACHED, ROTATION_ERROR
from ..motion.displacements import centres
from ..motion.limits import within_turns
from ..options import Options
from ..poses import are_poses, between, made_exact
from ..tolerances import TOLERANCES
from .assemble import assemble, forward_answers
from .close import HELD, Closing, Closure, close, closure_of, measure_configurations, platform_poses
from .configurations import (
    Configurations,
    coordinates_for,
    joint_coordinates,
    new_rows,
    put_rows,
    steps_of,
    write_closing,
)
from .descend import clip_targets
from .effort import starts_within, steps_within, stride_within
from .multistart import random_feasible
from .parasitic import asks_too_much, differences, follows_task, has_parasitic_motion
from .projection import ProjectionMode, held_parts, project, projection_modes, projection_multipliers
from .starts import random_coordinates
from .stretched import Bends

STRIDES = 8
"""Steps in which the platform is taken from the seed's pose to the target where one step strays."""

STRIDE = 0.25
"""How far one step goes where the working mode is to be kept: a longer one may leap over a singularity [L or rad]."""

STRANGE = 0.1
"""How far what a task leaves out may be from where it was before its way is looked at [L or rad]."""

STARTS = 80
"""Random starts of the legs that do not reach from where they are: a leg has a handful of branches."""

AGREEMENTS, SAME = 16, 1e-3
"""How many of them must end at the least gap or excess found before a leg is given up, and the share by which two may
differ and still be the same. A branch that is met half as often was by then met too, but for one time in 600."""

NEARBY = 64
"""Known configurations that are tried before random ones, the nearest to the target first."""

STEPS = 30
"""Steps each of them may take: those that arrive need fewer."""


class ClosureEngine:
    """Answers found on joint coordinates."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self._closure = closure_of(mechanism, whole=False)

    def answer(
        self, targets: Floats, start: Configurations | None, options: Options, *, keep_mode: bool
    ) -> Configurations:
        """Answer targets (n, 4, 4), each for itself, from one configuration or one for each; INVALID where no pose."""
        known, begin = are_poses(targets), start_coordinates(self.mechanism, start)
        begin = begin[known] if len(begin) > 1 else np.repeat(begin, known.sum(), axis=0)
        return _answer(self._closure, made_exact(targets[known]), begin, options, keep_mode).scatter(known)

    def follow(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        on_progress: Callable[[int, int], None] | None,
    ) -> Configurations:
        """Answer a path (n, 4, 4), each target from the answer before it, in its working mode."""
        known, begin = are_poses(targets), start_coordinates(self.mechanism, start)
        found = [np.zeros((0, begin.shape[1]))]
        rows, bends = new_rows(self.mechanism, int(known.sum())), Bends(self.mechanism, options)
        for i in steps_of(known, on_progress):
            answer = self._follow_one(made_exact(targets[i : i + 1]), begin, options, bends)
            put_rows(rows, slice(len(found) - 1, len(found)), answer.rows)
            begin = answer.coordinates
            found.append(begin)
        return Configurations(rows, np.concatenate(found)).scatter(known)

    def _follow_one(self, target: Floats, begin: Floats, options: Options, bends: Bends) -> Configurations:
        answer = _answer(self._closure, target, begin, options, keep_mode=True)
        if bends.before is not None:
            other = _answer(self._closure, target, bends.before, options, keep_mode=True)
            answer = other if bends.prefer(target, answer.rows, other.rows) else answer
        bends.note(int(answer.rows.status[0]), begin, answer.coordinates)
        return answer

    def advance(self, targets: Floats, start: Configurations) -> Configurations:
        """Go on to targets (n, 4, 4) in the working mode of as many configurations; FAILED where not reached."""
        begin = start.coordinates
        found = _reach(self._closure, targets, begin, platform_poses(self.mechanism, begin), keep_mode=True)
        rows = new_rows(self.mechanism, len(targets))
        write_closing(self._closure, found, rows)
        rows.status[:] = np.where(found.feasible, REACHED, FAILED)
        return Configurations(rows, found.coordinates)

    def step(self, targets: Floats, start: Configurations) -> Configurations:
        """Go on to targets (n, 4, 4) that are near as many configurations, in one step; FAILED where not reached.

        Cheaper than `advance` where many are not: there the platform is led on, in case that the step was too long.
        """
        closure, task, begin = self._closure, task_of(self.mechanism), start.coordinates
        wanted = targets if task.is_whole_pose else task.completed(targets, platform_poses(self.mechanism, begin))
        leapt = np.zeros(len(targets), bool)
        held = HELD if follows_task(self.mechanism) else task.held
        if held == HELD and not task.is_whole_pose:
            free = task.held if has_parasitic_motion(self.mechanism) else HELD
            assembled = close(closure, begin, wanted, platform=free, frame=task.frame, max_iterations=STEPS)
            leapt = differences(closure, assembled.poses, wanted) > STRANGE
            wanted = assembled.poses
        found = _close_below(closure, begin, wanted, held, STEPS)
        rows = new_rows(self.mechanism, len(targets))
        write_closing(closure, found, rows)
        rows.status[:] = np.where(found.feasible & ~leapt, REACHED, FAILED)
        return Configurations(rows, found.coordinates)

    def as_configurations(self, closing: Closing) -> Configurations:
        """Configurations found elsewhere, as answers whose status is still to be told."""
        rows = new_rows(self.mechanism, len(closing.poses))
        write_closing(self._closure, closing, rows)
        return Configurations(rows, closing.coordinates)

    def points(self, found: Configurations) -> Mapping[str, Floats]:
        """Joint name -> position of its centre in the base frame, (n, 3) [length]."""
        return centres(self.mechanism, found.coordinates)

    def limit_multipliers(self, found: Configurations, targets: Floats, way: ProjectionMode) -> Floats:
        """How hard every limit holds projected configurations back from targets (n, 4, 4): see `closure.descend`."""
        return projection_multipliers(self.mechanism, found.coordinates, targets, way)

    def forward(self, values: Floats, start: Configurations | None, tolerance: float) -> Configurations:
        """The configurations that have actuated values (n, n_a), from one configuration or one for each."""
        coordinates = coordinates_for(self.mechanism, start, len(values))
        closing = assemble(self.mechanism, coordinates, values, seeded=start is not None)
        return forward_answers(self.mechanism, self.as_configurations(closing), closing, values, tolerance)


def start_coordinates(mechanism: Mechanism, start: Configurations | None) -> Floats:
    """Joint coordinates to start from, (n, columns) or (1, columns); loops beside the way to the end effector, which
    will rest, are closed."""
    begin = joint_coordinates(mechanism, start)
    if not _has_loops_aside(mechanism):
        return begin
    present = measure_configurations(mechanism, begin)
    away = np.flatnonzero(~present.feasible)
    if len(away):
        closure, poses = closure_of(mechanism), present.poses[away]
        present.put(away, close(closure, begin[away], poses, platform=HELD, limits=True, margin=TOLERANCES.inside))
    return present.coordinates


def _answer(closure: Closure, wanted: Floats, start: Floats, options: Options, keep_mode: bool) -> Configurations:
    """Answer poses (n, 4, 4) from joint coordinates (n, columns): reached, or projected."""
    mechanism = closure.mechanism
    found = _reach(closure, wanted, start, platform_poses(mechanism, start), keep_mode)
    holds = np.full(len(wanted), HOLD_NOTHING)
    away = np.flatnonzero(~found.feasible)
    if len(away):
        stays = keep_mode or follows_task(mechanism)
        starts = [start[away]] if stays else [start[away], found.coordinates[away]]
        sought = clip_targets(mechanism, wanted[away])
        answers = project(
            closure,
            sought,
            starts,
            projection_modes(mechanism, options.hold, options.rotation_length),
            seeds=not keep_mode,
        )
        holds[away] = held_parts(
            mechanism, answers.holds, *task_of(mechanism).errors(answers.closing.poses, wanted[away])
        )
        found.put(away, answers.closing)
    return to_answers(closure, found, wanted, holds, options)


def to_answers(closure: Closure, found: Closing, wanted: Floats, holds: Ints, options: Options) -> Configurations:
    """Configurations found for poses (n, 4, 4), as answers: with what they hold, their errors, and their status."""
    mechanism = closure.mechanism
    within_turns(mechanism, found.coordinates)
    if _has_loops_aside(mechanism):
        found = measure_configurations(mechanism, found.coordinates)._replace(iterations=found.iterations)
    rows = new_rows(mechanism, len(wanted))
    write_closing(closure, found, rows)
    position, rotation = task_of(mechanism).errors(rows.poses, wanted)
    rows.measures[:, POSITION_ERROR], rows.measures[:, ROTATION_ERROR] = position, rotation
    rows.counters[:, HOLD] = holds
    near = (position <= (options.tolerance or TOLERANCES.position * mechanism.characteristic_length)) & (
        rotation <= options.rotation_tolerance
    )
    rows.status[:] = np.where(found.feasible, np.where(near, REACHED, PROJECTED), FAILED)
    return Configurations(rows, found.coordinates)


@lru_cache(maxsize=64)
def _has_loops_aside(mechanism: Mechanism) -> bool:
    """Whether there are loops beside every way from the base to the end effector."""
    counts = [len(closure_of(mechanism, whole).loops.paths) for whole in (True, False)]
    return counts[0] > counts[1]


def _reach(closure: Closure, targets: Floats, start: Floats, begin: Floats, keep_mode: bool) -> Closing:
    """Close the legs below platforms on their targets, within limits; the rows that are feasible are reached."""
    task, follows = task_of(closure.mechanism), follows_task(closure.mechanism)
    wanted = targets if task.is_whole_pose else task.completed(targets, begin)
    rows = np.arange(len(targets))
    if follows:
        assembled = _assembled(closure, wanted, start, begin)
        wanted, rows = assembled.poses, np.flatnonzero(assembled.gap <= TOLERANCES.position)
    held = HELD if follows else task.held
    found = _close_below(closure, start, wanted, held)
    strayed = ~found.feasible
    if keep_mode:
        strayed |= _distances(closure, begin, wanted) > STRIDE
    rest = np.flatnonzero(strayed)
    if len(rest):
        found.put_better(rest, _led(closure, wanted[rest], start[rest], begin[rest], held, limits=True))
    elif len(rows) == len(targets):
        return found
    if not keep_mode:
        at_rest = follows or task.is_whole_pose
        if not at_rest:
            _start_nearby(closure, found, targets, task.held)
        _search(closure, found, rows, wanted, held, at_rest=at_rest)
    mechanism = closure.mechanism
    if not keep_mode and follows and (has_parasitic_motion(mechanism) or asks_too_much(mechanism)):
        held = task.held if has_parasitic_motion(mechanism) else HELD
        _start_nearby(closure, found, targets, held)  # in other ways of assembly, where this one does not reach
        if asks_too_much(mechanism) or len(random_feasible(mechanism)[0]) < NEARBY:
            anywhere = task.completed(targets, begin)
            _search(closure, found, np.arange(len(targets)), anywhere, held, at_rest=False)
    return found


def _start_nearby(closure: Closure, found: Closing, targets: Floats, held: Weights) -> None:
    """Look for what does not reach yet from known configurations whose end effectors are nearest to the targets."""
    coordinates, poses = random_feasible(closure.mechanism)
    task, rest = task_of(closure.mechanism), np.flatnonzero(~found.feasible)
    away = np.array([_distances(closure, poses, np.repeat(targets[[row]], len(poses), axis=0)) for row in rest])
    nearby = starts_within(closure, NEARBY, STEPS)
    for places in np.argsort(away, axis=1)[:, :nearby].T if len(rest) else ():
        waiting = ~found.feasible[rest]
        if not waiting.any():
            break
        rows, places = rest[waiting], places[waiting]
        start = np.where(closure.idle, found.coordinates[rows], coordinates[places])
        wanted = task.completed(targets[rows], poses[places])
        found.put_better(rows, _close_below(closure, start, wanted, held, STEPS))


def _search(
    closure: Closure, found: Closing, rows: NDArray[np.intp], wanted: Floats, held: Weights, *, at_rest: bool
) -> None:
    """Look for the legs that do not reach yet from random configurations; with the platform `at_rest`, one by one.

    A row whose platform rests is given up where one of its legs keeps ending where it came nearest.
    """
    rng = np.random.default_rng(0)
    agreements = np.zeros(found.gaps.shape, np.int64)
    for _ in range(starts_within(closure, STARTS, STEPS)):
        rest = rows[~found.feasible[rows] & (agreements[rows].max(axis=1) < AGREEMENTS)]
        if not len(rest):
            break
        stays = _legs_reached(closure, found, rest) | closure.idle if at_rest else closure.idle
        scattered = np.where(stays, found.coordinates[rest], random_coordinates(closure, 1, rng))
        tried = _close_below(closure, scattered, wanted[rest], held, STEPS)
        if at_rest:
            agreements[rest] = _agreements(found.off[rest], tried.off, agreements[rest])
            _take_legs(closure, found, rest, tried)
        else:
            found.put_better(rest, tried)


def _agreements(best: Floats, tried: Floats, agreements: Ints) -> Ints:
    """How often each leg has ended where it came nearest, (n, groups); 0 for those that reached."""
    with np.errstate(invalid="ignore", over="ignore"):  # what is endlessly far off is neither nearer nor the same
        nearer, again = tried < (1.0 - SAME) * best, np.abs(tried - best) <= SAME * best
    counted = np.where(nearer, 1, agreements + again)
    return np.where(np.minimum(best, tried) <= TOLERANCES.limit, 0, counted)


def _assembled(closure: Closure, wanted: Floats, start: Floats, begin: Floats) -> Closing:
    """The whole poses that the loops, without limits, make of targets, (n, 4, 4), in the assembly of the start.

    Rows that are left open have none.
    """
    task = task_of(closure.mechanism)
    if not has_parasitic_motion(closure.mechanism):
        return close(closure, start, wanted, platform=HELD)
    found = close(closure, start, wanted, platform=task.held, frame=task.frame)
    strange = np.flatnonzero((found.gap > TOLERANCES.position) | (differences(closure, found.poses, wanted) > STRANGE))
    if len(strange):
        found.put(strange, _led(closure, wanted[strange], start[strange], begin[strange], task.held, limits=False))
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
        frame=BASE_AXES if held == HELD else task_of(closure.mechanism).frame,
        limits=limits,
        margin=TOLERANCES.inside,
        max_iterations=steps_within(closure, max_iterations),
    )


def _led(closure: Closure, targets: Floats, start: Floats, begin: Floats, held: Weights, *, limits: bool) -> Closing:
    """The platform led from where it is to its target; where what is not held leaps on the way, nothing is found."""
    task, present, steps = task_of(closure.mechanism), begin, stride_within(closure, 100, STRIDES)
    if steps == 0:
        return _close_below(closure, start, targets, held, 0 if limits else 100, limits=limits)
    leapt = np.zeros(len(targets), bool)
    for stride in range(1, STRIDES + 1):
        way = between(begin, targets, stride / STRIDES)
        way = way if held == HELD else task.completed(way, present)
        found = _close_below(closure, start, way, held, steps, limits=limits)
        leapt |= differences(closure, found.poses, way) > STRANGE + differences(closure, way, present)
        start, present = found.coordinates, found.poses
    found.gaps[leapt] = np.inf
    return found


def _legs_reached(closure: Closure, found: Closing, rows: NDArray[np.intp]) -> Mask:
    """Which coordinates belong to groups that are feasible, (m, columns)."""
    reached = found.off[rows] <= TOLERANCES.limit
    return np.asarray(reached[:, closure.loops.group_of])


def _take_legs(closure: Closure, found: Closing, rest: NDArray[np.intp], tried: Closing) -> None:
    """Take over the groups that came nearer."""
    better = tried.off < found.off[rest]
    columns = better[:, closure.loops.group_of]
    found.coordinates[rest] = np.where(columns, tried.coordinates, found.coordinates[rest])
    for array, own in ((found.gaps, tried.gaps), (found.excesses, tried.excesses)):
        array[rest] = np.where(better, own, array[rest])


def _distances(closure: Closure, poses: Floats, others: Floats) -> Floats:
    """How far poses are apart in what counts, (n,): lengths relative to L, angles in rad."""
    position, rotation = task_of(closure.mechanism).errors(poses, others)
    return np.asarray(np.hypot(position / closure.mechanism.characteristic_length, rotation))
