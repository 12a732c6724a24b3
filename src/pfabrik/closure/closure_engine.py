"""Inverse kinematics in joint coordinates, for every mechanism: loops are closed with the platform on its target."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Ints, Mask
from ..derived import derived
from ..description.task import Weights
from ..kernels.closure.loops import BASE_AXES
from ..kernels.rows import FAILED, HOLD, HOLD_NOTHING, POSITION_ERROR, PROJECTED, REACHED, ROTATION_ERROR
from ..model import Model
from ..motion.closure import Closure
from ..motion.displacements import centres
from ..motion.limited_coordinates import within_turns
from ..options import Options
from ..poses import are_poses, between, made_exact
from ..tolerances import TOLERANCES
from .assemble import assemble, forward_answers
from .close import HELD, Closing, close, measure_configurations, platform_poses
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
from .effort import starts_within, steps_per_continuation_step, steps_within
from .multistart import random_feasible
from .parasitic import asks_too_much, differences, follows_task, has_parasitic_motion
from .projection import ProjectionMode, held_parts, project, projection_modes, projection_multipliers
from .random_starts import random_coordinates
from .stretched import BentConfiguration

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


class ClosureEngine:
    """The engine that solves in joint coordinates."""

    def __init__(self, model: Model) -> None:
        self.model, self._closure = model, model.path_closure

    def answer(
        self, targets: Floats, start: Configurations | None, options: Options, *, keep_mode: bool
    ) -> Configurations:
        """Solve for targets (n, 4, 4) independently, from one start or one for each; INVALID where no pose."""
        is_valid, begin = are_poses(targets), start_coordinates(self.model, start)
        begin = begin[is_valid] if len(begin) > 1 else np.repeat(begin, is_valid.sum(), axis=0)
        exact, has_start = made_exact(targets[is_valid]), start is not None
        return _answer(self.model, exact, begin, options, keep_mode, has_start).scatter(is_valid)

    def follow(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        on_progress: Callable[[int, int], None] | None,
    ) -> Configurations:
        """Solve a path (n, 4, 4), each target from the answer before it, in its working mode."""
        is_valid, begin = are_poses(targets), start_coordinates(self.model, start)
        coordinates = [np.zeros((0, begin.shape[1]))]
        rows, bent = new_rows(self.model, int(is_valid.sum())), BentConfiguration(self.model, options)
        for i in steps_of(is_valid, on_progress):
            has_start = start is not None or len(coordinates) > 1
            answer = self._follow_one(made_exact(targets[i : i + 1]), begin, options, bent, has_start)
            put_rows(rows, slice(len(coordinates) - 1, len(coordinates)), answer.rows)
            begin = answer.coordinates
            coordinates.append(begin)
        return Configurations(rows, np.concatenate(coordinates)).scatter(is_valid)

    def _follow_one(
        self, target: Floats, begin: Floats, options: Options, bent: BentConfiguration, has_start: bool
    ) -> Configurations:
        """Solve one target of a path, also from the last bent configuration if links are stretched out."""
        answer = _answer(self.model, target, begin, options, True, has_start)
        if bent.coordinates is not None:
            bent_answer = _answer(self.model, target, bent.coordinates, options, True, has_start)
            answer = bent_answer if bent.is_preferred(target, answer.rows, bent_answer.rows) else answer
        bent.update(int(answer.rows.status[0]), begin, answer.coordinates)
        return answer

    def advance(self, targets: Floats, start: Configurations) -> Configurations:
        """Move as many configurations to targets (n, 4, 4) in their working modes; FAILED where not reached."""
        begin = start.coordinates
        closing = _reach(self._closure, targets, begin, platform_poses(self.model.mechanism, begin), keep_mode=True)
        rows = new_rows(self.model, len(targets))
        write_closing(self._closure, closing, rows)
        rows.status[:] = np.where(closing.feasible, REACHED, FAILED)
        return Configurations(rows, closing.coordinates)

    def step(self, targets: Floats, start: Configurations) -> Configurations:
        """Move as many configurations to nearby targets (n, 4, 4) in one step each; FAILED where not reached.

        Cheaper than `advance` if many are not reached, for which `advance` tries continuation.
        """
        closure, task, begin = self._closure, self._closure.task, start.coordinates
        poses = targets if task.is_whole_pose else task.completed(targets, platform_poses(self.model.mechanism, begin))
        has_jumped = np.zeros(len(targets), bool)
        held = HELD if follows_task(closure) else task.held
        if held == HELD and not task.is_whole_pose:
            free = task.held if has_parasitic_motion(closure) else HELD
            assembled = close(closure, begin, poses, platform=free, frame=task.frame, max_iterations=STEPS)
            has_jumped = differences(closure, assembled.poses, poses) > STRANGE
            poses = assembled.poses
        closing = _close_below(closure, begin, poses, held, STEPS)
        rows = new_rows(self.model, len(targets))
        write_closing(closure, closing, rows)
        rows.status[:] = np.where(closing.feasible & ~has_jumped, REACHED, FAILED)
        return Configurations(rows, closing.coordinates)

    def as_configurations(self, closing: Closing) -> Configurations:
        """The configurations of a closing; their status is PENDING."""
        rows = new_rows(self.model, len(closing.poses))
        write_closing(self._closure, closing, rows)
        return Configurations(rows, closing.coordinates)

    def points(self, configurations: Configurations) -> Mapping[str, Floats]:
        """Joint name -> position of its centre in the base frame, (n, 3) [length]."""
        return centres(self.model.mechanism, configurations.coordinates)

    def limit_multipliers(self, configurations: Configurations, targets: Floats, projection: ProjectionMode) -> Floats:
        """Multipliers of all limits at configurations that are projections of targets (n, 4, 4)."""
        return projection_multipliers(self.model.closure, configurations.coordinates, targets, projection)

    def forward(self, values: Floats, start: Configurations | None, tolerance: float) -> Configurations:
        """Solve for configurations with actuated values (n, n_a), from one start or one for each."""
        closure, coordinates = self.model.closure, coordinates_for(self.model, start, len(values))
        closing = assemble(closure, coordinates, values, has_start=start is not None)
        return forward_answers(closure, self.as_configurations(closing), closing, values, tolerance)


def start_coordinates(model: Model, start: Configurations | None) -> Floats:
    """Joint coordinates of the start, (n, columns) or (1, columns).

    Loops that are on no path to the end effector are closed first, as the search does not move their joints.
    """
    begin = joint_coordinates(model, start)
    if not _has_side_loops(model):
        return begin
    closing = measure_configurations(model, begin)
    infeasible = np.flatnonzero(~closing.feasible)
    if len(infeasible):
        closure, poses, margin = model.closure, closing.poses[infeasible], TOLERANCES.inside
        closing.put(infeasible, close(closure, begin[infeasible], poses, platform=HELD, limits=True, margin=margin))
    return closing.coordinates


def _answer(
    model: Model, targets: Floats, start: Floats, options: Options, keep_mode: bool, has_start: bool
) -> Configurations:
    """Reach or project targets (n, 4, 4) from joint coordinates (n, columns)."""
    closure, mechanism = model.path_closure, model.mechanism
    closing = _reach(closure, targets, start, platform_poses(mechanism, start), keep_mode)
    holds = np.full(len(targets), HOLD_NOTHING)
    unsolved = np.flatnonzero(~closing.feasible)
    if len(unsolved):
        stays = keep_mode or follows_task(closure)
        starts = [start[unsolved]] if stays else [start[unsolved], closing.coordinates[unsolved]]
        clipped = clip_targets(mechanism, targets[unsolved])
        projections = projection_modes(closure, options.hold, options.rotation_length)
        projected = project(closure, clipped, starts, projections, seeds=not keep_mode, has_start=has_start)
        errors = model.task.errors(projected.closing.poses, targets[unsolved])
        holds[unsolved] = held_parts(closure, projected.holds, *errors)
        closing.put(unsolved, projected.closing)
    return to_answers(model, closing, targets, holds, options)


def to_answers(model: Model, closing: Closing, targets: Floats, holds: Ints, options: Options) -> Configurations:
    """The configurations of a closing as answers to targets (n, 4, 4): with holds, errors and status."""
    mechanism = model.mechanism
    within_turns(mechanism, closing.coordinates)
    if _has_side_loops(model):
        closing = measure_configurations(model, closing.coordinates)._replace(iterations=closing.iterations)
    rows = new_rows(model, len(targets))
    write_closing(model.path_closure, closing, rows)
    position, rotation = model.task.errors(rows.poses, targets)
    rows.measures[:, POSITION_ERROR], rows.measures[:, ROTATION_ERROR] = position, rotation
    rows.counters[:, HOLD] = holds
    is_near = (position <= (options.tolerance or TOLERANCES.position * mechanism.characteristic_length)) & (
        rotation <= options.rotation_tolerance
    )
    rows.status[:] = np.where(closing.feasible, np.where(is_near, REACHED, PROJECTED), FAILED)
    return Configurations(rows, closing.coordinates)


@derived
def _has_side_loops(model: Model) -> bool:
    """True if some loops are on no path from the base to the end effector."""
    return len(model.closure.loops.paths) > len(model.path_closure.loops.paths)


def _reach(closure: Closure, targets: Floats, start: Floats, begin: Floats, keep_mode: bool) -> Closing:
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
    best = _close_below(closure, start, poses, held)
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
        best.put_better(rows, _close_below(closure, start, completed, held, STEPS))


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
        trial = _close_below(closure, start, poses[unsolved], held, STEPS)
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
        best.put(unsolved, continued)
    return best


def _close_below(
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
        return _close_below(closure, start, targets, held, 0 if limits else 100, limits=limits)
    has_jumped = np.zeros(len(targets), bool)
    for step in range(1, CONTINUATION_STEPS + 1):
        poses = between(begin, targets, step / CONTINUATION_STEPS)
        poses = poses if held == HELD else task.completed(poses, present)
        closing = _close_below(closure, start, poses, held, max_iterations, limits=limits)
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
