"""Inverse kinematics in joint coordinates, for every mechanism: loops are closed with the platform on its target."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Ints
from ..batch import put
from ..derived import derived
from ..kernels.rows import FAILED, HOLD, HOLD_NOTHING, POSITION_ERROR, PROJECTED, REACHED, ROTATION_ERROR
from ..model import Model
from ..motion.closure import Closure
from ..motion.displacements import centres
from ..motion.limited_coordinates import within_turns
from ..options import Options
from ..poses import are_poses, made_exact
from ..tolerances import TOLERANCES
from .assemble import assemble, forward_answers, nearest_values
from .attempts import Attempt, descents
from .close import HELD, Closing, close, measure_configurations, platform_poses
from .configurations import (
    Configurations,
    coordinates_for,
    joint_coordinates,
    new_rows,
    steps_of,
    write_closing,
)
from .descend import clip_targets
from .engine_contract import Engine
from .parasitic import differences, follows_task, has_parasitic_motion
from .projection import ProjectionMode, held_parts, project, projection_modes, projection_multipliers
from .stretched import BentConfiguration
from .target_closing import STEPS, STRANGE, close_below, reach, reach_once


class ClosureEngine(Engine):
    """The engine that solves in joint coordinates."""

    def __init__(self, model: Model) -> None:
        self.model = model

    @property
    def _closure(self) -> Closure:
        return self.model.path_closure

    def answer(
        self, targets: Floats, start: Configurations | None, options: Options, *, keep_mode: bool
    ) -> Configurations:
        """Solve for targets (n, 4, 4) independently, from one start or one for each; INVALID where no pose."""
        is_valid, begin = are_poses(targets), start_coordinates(self.model, start)
        begin = begin[is_valid] if len(begin) > 1 else np.repeat(begin, is_valid.sum(), axis=0)
        exact, has_start = made_exact(targets[is_valid]), start is not None
        return _answer(self.model, exact, begin, options, keep_mode, has_start).scatter(is_valid)

    def nearest(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        *,
        keep_mode: bool,
        nearby: bool = False,
    ) -> Configurations:
        """The nearest feasible configurations to targets (n, 4, 4) that searches find, one start for all or for each.

        With `nearby` they stay around their starts; so they do with `keep_mode`.
        """
        begin, exact = coordinates_for(self.model, start, len(targets)), made_exact(targets)
        closing = measure_configurations(self.model, begin)
        holds = np.full(len(targets), HOLD_NOTHING)
        every = np.arange(len(targets))
        seeds, has_start = not (keep_mode or nearby), start is not None
        _project(self.model, closing, holds, every, exact, [begin], options, seeds=seeds, has_start=has_start)
        return to_answers(self.model, closing, exact, holds, options)

    def attempts(
        self, target: Floats, start: Configurations | None, options: Options, *, keep_mode: bool
    ) -> Iterator[Attempt]:
        """As `InverseEngine.attempts`: closing the loops on the target, then searches for the nearest configuration."""
        closure, begin = self._closure, start_coordinates(self.model, start)
        closing = reach(closure, target, begin, platform_poses(self.model.mechanism, begin), keep_mode)
        is_reached, gap, excess = closing.feasible[0], closing.gap[0], closing.excess[0]
        gap, excess = (part if part > TOLERANCES.limit else 0.0 for part in (gap, excess))  # else rounding
        ending = "reached" if is_reached else f"gap {gap:.3g} L, {excess:.3g} beyond a limit"
        steps = int(closing.iterations[0])
        yield Attempt("loops closed on the target", "the start", steps, 0.0 if is_reached else np.nan, ending)
        if not is_reached:
            projections = projection_modes(closure, options.hold, options.rotation_length)
            yield from descents(closure, target, begin, projections, seeds=not keep_mode)

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
            put(rows, slice(len(coordinates) - 1, len(coordinates)), answer.rows)
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
        closing = reach(self._closure, targets, begin, platform_poses(self.model.mechanism, begin), keep_mode=True)
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
        closing = close_below(closure, begin, poses, held, STEPS)
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

    def forward(
        self, values: Floats, start: Configurations | None, tolerance: float, *, keep_mode: bool = True
    ) -> Configurations:
        """Solve for configurations with actuated values (n, n_a), from one start or one for each."""
        closure, coordinates = self.model.closure, coordinates_for(self.model, start, len(values))
        closing = assemble(closure, coordinates, values, has_start=start is not None, keep_mode=keep_mode)
        return forward_answers(closure, self.as_configurations(closing), closing, values, tolerance)

    def nearest_forward(self, values: Floats, start: Configurations | None, tolerance: float) -> Configurations:
        """The feasible configurations whose actuators are nearest to values (n, n_a) that searches find."""
        closure, coordinates = self.model.closure, coordinates_for(self.model, start, len(values))
        closing = nearest_values(closure, coordinates, values, has_start=start is not None)
        return forward_answers(closure, self.as_configurations(closing), closing, values, tolerance)


def close_on_targets(model: Model, targets: Floats, start: Configurations | None, *, leg_by_leg: bool) -> Closing:
    """Close the loops with the platform on targets (n, 4, 4), in any mode; from one start or each from its own."""
    begin = start_coordinates(model, start)
    begin = begin if len(begin) > 1 else np.repeat(begin, len(targets), axis=0)
    return reach_once(model.path_closure, targets, begin, platform_poses(model.mechanism, begin), leg_by_leg)


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
        put(closing, infeasible, close(closure, begin[infeasible], poses, platform=HELD, limits=True, margin=margin))
    return closing.coordinates


def _answer(
    model: Model, targets: Floats, start: Floats, options: Options, keep_mode: bool, has_start: bool
) -> Configurations:
    """Reach or project targets (n, 4, 4) from joint coordinates (n, columns)."""
    closure, mechanism = model.path_closure, model.mechanism
    closing = reach(closure, targets, start, platform_poses(mechanism, start), keep_mode)
    holds = np.full(len(targets), HOLD_NOTHING)
    unsolved = np.flatnonzero(~closing.feasible)
    if len(unsolved):
        stays = keep_mode or follows_task(closure)
        starts = [start[unsolved]] if stays else [start[unsolved], closing.coordinates[unsolved]]
        _project(model, closing, holds, unsolved, targets, starts, options, seeds=not keep_mode, has_start=has_start)
    return to_answers(model, closing, targets, holds, options)


def _project(
    model: Model,
    closing: Closing,
    holds: Ints,
    rows: NDArray[np.intp],
    targets: Floats,
    starts: Sequence[Floats],
    options: Options,
    *,
    seeds: bool,
    has_start: bool,
) -> None:
    """Write the projections of some rows, and what they hold, from several starts each; as of `project`."""
    closure = model.path_closure
    projections = projection_modes(closure, options.hold, options.rotation_length)
    clipped = clip_targets(model.mechanism, targets[rows])
    projected = project(closure, clipped, starts, projections, seeds=seeds, has_start=has_start)
    errors = model.task.errors(projected.closing.poses, targets[rows])
    holds[rows] = held_parts(closure, projected.holds, *errors)
    put(closing, rows, projected.closing)


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
