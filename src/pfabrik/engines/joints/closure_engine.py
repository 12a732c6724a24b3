"""Inverse kinematics in joint coordinates, for every mechanism: loops are closed with the platform on its target."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from ...common.arrays import Floats, Ints
from ...common.batch import put
from ...common.derived import derived
from ...kernels.handle import Handle
from ...kernels.joints.joint_tables import ANSWER, EXPECTED, NEAREST, REACH, STEP, JointQuestion
from ...kernels.pose.search_records import Starts
from ...kernels.rows import (
    EXCEEDED,
    FAILED,
    HOLD,
    INVALID,
    LIMIT_EXCESS,
    OPEN,
    POSITION_ERROR,
    PROJECTED,
    REACHED,
    RESIDUAL,
    ROTATION_ERROR,
    Rows,
)
from ...machine.model import Model
from ...machine.motion.displacements import centres
from ...machine.motion.limited_coordinates import within_turns
from ...machine.motion.singularities import loop_blocks
from ...machine.poses import are_poses
from ...options import USUAL, Options
from ...tolerances import TOLERANCES
from .assemble import assemble, forward_answers, nearest_values
from .attempts import Attempt, attempts_of
from .close import HELD, Closing, close, in_lengths, measure_configurations
from .configurations import (
    Configurations,
    coordinates_for,
    joint_coordinates,
    new_rows,
    steps_of,
    write_closing,
)
from .engine_contract import Counted, Engine, Grower, Prepared
from .joint_answers import answer_rows, logged, near_rows, prompt_call, question_of
from .link_distances import clearance_excess
from .placed_links import placed_at
from .projection import ProjectionMode, projection_multipliers
from .stretched import BentConfiguration


class ClosureEngine(Engine):
    """The engine that solves in joint coordinates."""

    def __init__(self, model: Model) -> None:
        self.model = model

    def answer(
        self, targets: Floats, start: Configurations | None, options: Options, *, keep_mode: bool
    ) -> Configurations:
        """Solve for targets (n, 4, 4) independently, from one start or one for each; INVALID where no pose."""
        question = question_of(ANSWER, keep_mode, start is not None, most_steps=options.most_steps)
        return self._answer(targets, start_coordinates(self.model, start), options, question)

    def _answer(
        self, targets: Floats, begin: Floats, options: Options, question: Handle[JointQuestion]
    ) -> Configurations:
        """Answer targets by the kernel, from joint coordinates (n, columns), or (1, columns) for all.

        Loops that are on no path to the end effector are measured too; answers are FAILED where these are open.
        """
        rows = new_rows(self.model, len(targets))
        answers = Configurations(rows, answer_rows(self.model, targets, begin, options, question, rows))
        if _has_side_loops(self.model):
            valid = np.flatnonzero(rows.status != INVALID)
            closing = measure_configurations(self.model, answers.coordinates[valid])
            measured = np.stack([closing.gap * self.model.length, closing.excess], axis=1)
            rows.measures[valid[:, None], (RESIDUAL, LIMIT_EXCESS)] = measured
            rows.status[valid[~closing.feasible]] = FAILED
        return answers

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
        question = question_of(NEAREST, keep_mode or nearby, start is not None, most_steps=options.most_steps)
        return self._answer(targets, joint_coordinates(self.model, start), options, question)

    def prepared(self, target: Floats, start: Configurations | None, rows: Rows, *, keep_mode: bool) -> Prepared | None:
        """As `Engine.prepared`, for targets that one closing of the loops reaches."""
        model, mechanism = self.model, self.model.mechanism
        is_told = model.task.is_whole_pose and not (_has_side_loops(model) or (keep_mode and loop_blocks(mechanism)))
        if not is_told or mechanism.clearance is not None:
            return None
        call, kept = prompt_call(model, target, start_coordinates(model, start), rows, keep_mode, start is not None)

        def reach() -> int:
            rows.status[0] = OPEN
            call()
            return int(rows.status[0] != REACHED)

        return reach, kept

    def attempts(
        self, target: Floats, start: Configurations | None, options: Options, *, keep_mode: bool
    ) -> Iterator[Attempt]:
        """As `InverseEngine.attempts`: closing the loops on the target, then searches for the nearest configuration."""
        question = question_of(ANSWER, keep_mode, start is not None, most_steps=options.most_steps)
        begin = start_coordinates(self.model, start)
        yield from attempts_of(*logged(self.model, target, begin, options, question), self.model.length)

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
            answer = self._follow_one(targets[i : i + 1], begin, options, bent, has_start)
            put(rows, slice(len(coordinates) - 1, len(coordinates)), answer.rows)
            begin = answer.coordinates
            coordinates.append(begin)
        return Configurations(rows, np.concatenate(coordinates)).scatter(is_valid)

    def _follow_one(
        self, target: Floats, begin: Floats, options: Options, bent: BentConfiguration, has_start: bool
    ) -> Configurations:
        """Solve one target of a path, also from the last bent configuration if links are stretched out."""
        question = question_of(ANSWER, True, has_start, most_steps=options.most_steps)
        answer = self._answer(target, begin, options, question)
        if bent.coordinates is not None:
            bent_answer = self._answer(target, bent.coordinates, options, question)
            answer = bent_answer if bent.is_preferred(answer.rows, bent_answer.rows) else answer
        bent.update(int(answer.rows.status[0]), begin, answer.coordinates)
        return answer

    def advance(self, targets: Floats, start: Configurations) -> Configurations:
        """Move as many configurations to targets (n, 4, 4) in their working modes; FAILED where not reached."""
        return self._answer(targets, start.coordinates, USUAL, question_of(REACH, True, True))

    def grower(self, counted: Counted) -> Grower | None:
        """Itself where whole poses count: a target out of reach costs a hundred times as much as one within."""
        return self if counted == "orientation" else None

    def known(self, start: Configurations | None) -> Starts:
        """As `Grower.known`: by joint coordinates."""
        poses = self.model.mechanism.home_pose[None] if start is None else start.rows.poses
        coordinates = start_coordinates(self.model, None) if start is None else start.coordinates
        return Starts(in_lengths(poses, 1.0 / self.model.length), coordinates, np.zeros((0, 0)))

    def grow(self, known: Starts, targets: Floats, *, anew: bool, keep_mode: bool) -> Configurations:
        """As `Grower.grow`: in one step, `anew` by continuation; FAILED where not reached."""
        begin = np.repeat(known.q, len(targets), axis=0) if len(known.q) == 1 else known.q
        return self._answer(targets, begin, USUAL, question_of(REACH if anew else STEP, True, True))

    def close_as_expected(
        self, targets: Floats, start: Configurations | None, options: Options, *, leg_by_leg: bool
    ) -> Configurations:
        """Close the loops on targets (n, 4, 4), from one start or one for each, in any mode; FAILED where not reached.

        What the task leaves open of a pose is expected as it is at the start. With `leg_by_leg`, where that fails, each
        leg is searched for alone at the pose expected.
        """
        question = question_of(EXPECTED, False, start is not None, leg_by_leg)
        return self._answer(targets, start_coordinates(self.model, start), options, question)

    def as_configurations(self, closing: Closing) -> Configurations:
        """The configurations of a closing; their status is PENDING. Links that are too near exceed a limit."""
        rows = new_rows(self.model, len(closing.poses))
        write_closing(self.model.path_closure, closing, rows)
        answers = Configurations(rows, closing.coordinates)
        if self.model.mechanism.clearance is not None:
            excess = clearance_excess(placed_at(self.model.mechanism, answers))
            rows.measures[:, LIMIT_EXCESS] = np.fmax(rows.measures[:, LIMIT_EXCESS], excess)
        return answers

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
        answers = forward_answers(closure, self.as_configurations(closing), closing, values, tolerance)
        return self.forward_apart(self.too_near(answers), answers, values, start, tolerance)

    def too_near(self, answers: Configurations) -> Ints:
        """The rows whose links are nearer than the clearance."""
        rows = near_rows(self.model, answers.coordinates)
        return np.asarray(rows[answers.rows.status[rows] != INVALID])

    def apart(
        self,
        near: Ints,
        answers: Configurations,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        *,
        keep_mode: bool,
    ) -> Configurations:
        """Answers to targets (n, 4, 4), in rows whose links are too near of a search that keeps them apart."""
        if not len(near):
            return answers
        begin = start if start is None or len(start) == 1 else start.at(near)
        return answers.with_rows(near, self.nearest(targets[near], begin, options, keep_mode=keep_mode))

    def forward_apart(
        self,
        rows: Ints,
        answers: Configurations,
        values: Floats,
        start: Configurations | None,
        tolerance: float,
    ) -> Configurations:
        """As `apart`, for actuated values (n, n_a)."""
        if not len(rows):
            return answers
        begin = start if start is None or len(start) == 1 else start.at(rows)
        found = self.nearest_forward(values[rows], begin, tolerance)
        found.rows.status[found.rows.status == EXCEEDED] = FAILED
        return answers.with_rows(rows, found)

    def nearest_forward(self, values: Floats, start: Configurations | None, tolerance: float) -> Configurations:
        """The feasible configurations whose actuators are nearest to values (n, n_a) that searches find."""
        closure, coordinates = self.model.closure, coordinates_for(self.model, start, len(values))
        closing = nearest_values(closure, coordinates, values, has_start=start is not None)
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
        put(closing, infeasible, close(closure, begin[infeasible], poses, platform=HELD, limits=True, margin=margin))
    return closing.coordinates


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
