"""The engine of mechanisms without loops: work linear in the number of joints between base and end effector."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..batch import put, take
from ..closure.assemble import forward_answers
from ..closure.attempts import Attempt
from ..closure.close import Closing, measure_configurations
from ..closure.closure_engine import ClosureEngine, to_answers
from ..closure.configurations import Configurations, coordinates_for, joint_coordinates, new_rows, steps_of
from ..closure.descend import clip_targets
from ..closure.engine_contract import Engine
from ..closure.projection import ProjectionMode, held_parts, projection_modes
from ..closure.stretched import BentConfiguration
from ..closure.target_closing import CONTINUATION_STEPS, LONGEST_STEP
from ..description.home_mobility import column_moves
from ..kernels.projecting import SAME
from ..kernels.rows import FAILED, HOLD_NOTHING, POSITION_ERROR, PROJECTED, REACHED, ROTATION_ERROR
from ..model import Model
from ..options import Options
from ..poses import are_poses, between, made_exact
from ..tolerances import TOLERANCES
from .project_chain import MET, chain_aim, closing_of_chain, has_few_joints, project_chain
from .run_chains import new_answers, run_chains, run_walk
from .serial_chain import length_beyond

TRIES_OF_FEW, TRIES = 40, 8
"""Seeds from which a target is tried, in chains of few joints and in longer ones."""

MOST_BENT = 100
"""Coordinates up to which links that are stretched out on a path bend back: the check takes their cube."""


class ChainEngine(Engine):
    """Inverse and forward kinematics of a serial chain, with the engine in joint coordinates as fallback."""

    def __init__(self, model: Model) -> None:
        self.model, self._joint_space = model, ClosureEngine(model)

    @cached_property
    def _tries(self) -> int:
        return TRIES_OF_FEW if has_few_joints(self.model) else TRIES

    def answer(
        self, targets: Floats, start: Configurations | None, options: Options, *, keep_mode: bool
    ) -> Configurations:
        """Solve for targets (n, 4, 4) independently, from one start or one for each; INVALID where no pose."""
        begin = joint_coordinates(self.model, start) * column_moves(self.model.mechanism)
        if not self._are_idle_within(begin):
            return self._joint_space.answer(targets, start, options, keep_mode=keep_mode)
        is_valid = are_poses(targets)
        begin = begin[is_valid] if len(begin) > 1 else np.repeat(begin, is_valid.sum(), axis=0)
        exact = made_exact(targets[is_valid])
        answers = self._answer(exact, begin, options, keep_mode, start is not None)
        return answers.scatter(is_valid)

    def attempts(
        self, target: Floats, start: Configurations | None, options: Options, *, keep_mode: bool
    ) -> Iterator[Attempt]:
        """As `InverseEngine.attempts`: those of the fallback, which ends where the chain's own searches end."""
        return self._joint_space.attempts(target, start, options, keep_mode=keep_mode)

    def _answer(
        self, targets: Floats, start: Floats, options: Options, keep_mode: bool, has_start: bool
    ) -> Configurations:
        """Reach or project targets (n, 4, 4) from joint coordinates (n, columns)."""
        model = self.model
        clipped = clip_targets(model.mechanism, targets)
        closing, is_reached = self._reach(clipped, start, keep_mode)
        is_reached &= (clipped == targets).all(axis=(1, 2))
        holds, unsolved = np.full(len(targets), HOLD_NOTHING), np.flatnonzero(~is_reached)
        if len(unsolved):
            begin = closing_of_chain(model, run_walk(model, start[unsolved] * model.closure.scale)).poses
            projected = project_chain(
                model,
                clipped[unsolved],
                start[unsolved] if keep_mode else closing.coordinates[unsolved],
                begin,
                projection_modes(model.path_closure, options.hold, options.rotation_length),
                seeds=not keep_mode,
                has_start=has_start,
            )
            errors = model.task.errors(projected.closing.poses, targets[unsolved])
            holds[unsolved] = held_parts(model.path_closure, projected.holds, *errors)
            put(closing, unsolved, projected.closing)
            is_reached[unsolved] = np.isfinite(projected.distances)
        answers = to_answers(model, closing, targets, holds, options)
        failed = np.flatnonzero(~is_reached | (answers.rows.status == FAILED))
        if len(failed):
            fallback = self._joint_space.answer(
                targets[failed], self._configurations_at(start[failed]), options, keep_mode=keep_mode
            )
            answers = answers.with_rows(failed, fallback)
        if keep_mode and has_few_joints(model):
            answers = self._nearer_of_both(answers, targets, start, options)
        return answers

    def _nearer_of_both(
        self, answers: Configurations, targets: Floats, start: Floats, options: Options
    ) -> Configurations:
        """Answers in the working mode of the start, or those of the fallback where these are nearer.

        There is one search in that mode, from the start; where links are stretched, which minimum it ends in is chance.
        """
        projected = np.flatnonzero(answers.rows.status == PROJECTED)
        if not len(projected):
            return answers
        begin = self._configurations_at(start[projected])
        fallback = self._joint_space.answer(targets[projected], begin, options, keep_mode=True)
        lever = options.rotation_length or self.model.mechanism.rotation_length
        ours, theirs = (
            np.hypot(rows.measures[:, POSITION_ERROR], lever * rows.measures[:, ROTATION_ERROR])
            for rows in (take(answers.rows, projected), fallback.rows)
        )
        is_nearer = (fallback.rows.status == PROJECTED) & (theirs < (1.0 - SAME) * ours)
        is_nearer &= fallback.rows.holds >= answers.rows.holds[projected]
        better = np.flatnonzero(is_nearer | (fallback.rows.status == REACHED))
        return answers.with_rows(projected[better], fallback.at(better)) if len(better) else answers

    def _reach(self, targets: Floats, start: Floats, keep_mode: bool) -> tuple[Closing, NDArray[np.bool_]]:
        """Reach targets from joint coordinates (n, columns); True for those that are reached.

        With `keep_mode`, targets that are far from the start are approached in steps.
        """
        model = self.model
        if not keep_mode:
            return self._try(targets, start, self._tries)
        closing, is_reached = self._try(targets, start, 0)
        begin = closing_of_chain(model, run_walk(model, start * model.closure.scale)).poses
        position, rotation = model.task.errors(begin, targets)
        far = np.flatnonzero(~is_reached | (np.hypot(position / model.length, rotation) > LONGEST_STEP))
        if len(far):
            stepped, were_reached = start[far], np.zeros(len(far), bool)
            for step in range(1, CONTINUATION_STEPS + 1):
                poses = between(begin[far], targets[far], step / CONTINUATION_STEPS)
                continued, were_reached = self._try(poses, stepped, 0)
                stepped = continued.coordinates
            better = np.flatnonzero(were_reached)
            put(closing, far[better], continued, better)
            is_reached[far[better]] = True
        return closing, is_reached

    def _try(self, targets: Floats, start: Floats, tries: int) -> tuple[Closing, NDArray[np.bool_]]:
        """Reach targets from starts (n, columns), and from so many seeds; True for those that are reached."""
        from ..kernels.chains.answer_chains import reach_in_chains

        model = self.model
        answers = new_answers(start * model.closure.scale)
        is_near = length_beyond(model, targets) <= 0.0
        if is_near.all() or not tries:
            run_chains(model, reach_in_chains, chain_aim(model, targets, model.task.held, tries), answers)
            return closing_of_chain(model, answers), np.asarray(answers.distances <= MET)
        closing, is_reached = closing_of_chain(model, answers), np.zeros(len(targets), bool)
        for rows, n_tries in ((np.flatnonzero(is_near), tries), (np.flatnonzero(~is_near), 0)):
            if len(rows):
                trial, is_reached[rows] = self._try(targets[rows], start[rows], n_tries)
                put(closing, rows, trial)
        return closing, is_reached

    def follow(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        on_progress: Callable[[int, int], None] | None,
    ) -> Configurations:
        """Solve a path (n, 4, 4), each target from the answer before it, in its working mode."""
        model = self.model
        begin = joint_coordinates(model, start) * column_moves(model.mechanism)
        if not self._are_idle_within(begin):
            return self._joint_space.follow(targets, start, options, on_progress)
        is_valid, coordinates = are_poses(targets), [np.zeros((0, begin.shape[1]))]
        exact = made_exact(targets[is_valid])
        rows, bent = new_rows(model, len(exact)), BentConfiguration(model, options)
        n_done = 0
        for place, _ in enumerate(steps_of(is_valid, on_progress)):
            if place == n_done:
                answers = self._follow_reached(exact[place:], begin, options, bent.coordinates is None)
                if not len(answers):
                    has_start = start is not None or place > 0
                    answers = self._follow_one(exact[place : place + 1], begin, options, bent, has_start)
                put(rows, slice(place, place + len(answers)), answers.rows)
                coordinates.append(answers.coordinates)
                begin, n_done = answers.coordinates[-1:], place + len(answers)
        return Configurations(rows, np.concatenate(coordinates)).scatter(is_valid)

    def _follow_reached(self, targets: Floats, begin: Floats, options: Options, is_bent: bool) -> Configurations:
        """The answers to the first targets of a path, up to one that is not reached in one short step."""
        from ..kernels.chains.answer_chains import reach_in_chains

        model = self.model
        before = closing_of_chain(model, run_walk(model, begin * model.closure.scale)).poses
        position, rotation = model.task.errors(np.concatenate([before, targets[:-1]]), targets)
        far = np.hypot(position / model.length, rotation) > LONGEST_STEP
        n = int(far.argmax()) if far.any() else len(targets)
        n = n if is_bent else 0
        answers = new_answers(np.repeat(begin * model.closure.scale, n, axis=0))
        if n:
            aim = chain_aim(model, targets[:n], model.task.held, 0, follows=True)
            n = run_chains(model, reach_in_chains, aim, answers)
        closing = closing_of_chain(model, type(answers)._make(array[:n] for array in answers))
        return to_answers(model, closing, targets[:n], np.full(n, HOLD_NOTHING), options)

    def _follow_one(
        self, target: Floats, begin: Floats, options: Options, bent: BentConfiguration, has_start: bool
    ) -> Configurations:
        """Solve one target of a path, also from the last bent configuration if links are stretched out."""
        answer = self._answer(target, begin, options, True, has_start)
        if bent.coordinates is not None:
            bent_answer = self._answer(target, bent.coordinates, options, True, has_start)
            answer = bent_answer if bent.is_preferred(target, answer.rows, bent_answer.rows) else answer
        if begin.shape[1] <= MOST_BENT:
            bent.update(int(answer.rows.status[0]), begin, answer.coordinates)
        return answer

    def advance(self, targets: Floats, start: Configurations) -> Configurations:
        """Move as many configurations to targets (n, 4, 4) in their working modes; FAILED where not reached."""
        return self._joint_space.advance(targets, start)

    def step(self, targets: Floats, start: Configurations) -> Configurations:
        """Move as many configurations to nearby targets (n, 4, 4) in one step each; FAILED where not reached."""
        return self._joint_space.step(targets, start)

    def as_configurations(self, closing: Closing) -> Configurations:
        """The configurations of a closing; their status is PENDING."""
        return self._joint_space.as_configurations(closing)

    def points(self, configurations: Configurations) -> Mapping[str, Floats]:
        """Joint name -> position of its centre in the base frame, (n, 3) [length]."""
        return self._joint_space.points(configurations)

    def limit_multipliers(self, configurations: Configurations, targets: Floats, projection: ProjectionMode) -> Floats:
        """Multipliers of all limits at configurations that are projections of targets (n, 4, 4)."""
        return self._joint_space.limit_multipliers(configurations, targets, projection)

    def forward(
        self, values: Floats, start: Configurations | None, tolerance: float, *, keep_mode: bool = True
    ) -> Configurations:
        """Solve for configurations with actuated values (n, n_a), from one start or one for each.

        Values beyond their ranges are projected onto them, one by one, which is the nearest that is feasible.
        """
        model, closure = self.model, self.model.closure
        begin = coordinates_for(model, start, len(values))
        coordinates, low, high = begin.copy(), closure.loops.lo, closure.loops.hi
        closure.put_actuators(coordinates, values)
        scaled = coordinates * closure.scale
        is_outside = (scaled < low - TOLERANCES.limit) | (scaled > high + TOLERANCES.limit)
        is_outside[:, np.setdiff1d(np.arange(scaled.shape[1]), closure.actuated)] = False
        inside = np.minimum(TOLERANCES.inside, 0.5 * (high - low))
        scaled = np.where(is_outside, np.clip(scaled, low + inside, high - inside), scaled)
        closing = closing_of_chain(model, run_walk(model, scaled))
        answers = forward_answers(closure, self.as_configurations(closing), closing, values, tolerance)
        unsolved = np.flatnonzero(~closing.feasible)
        if not self._are_idle_within(begin):
            unsolved = np.arange(len(values))
        if len(unsolved):
            block = start if start is None or len(start) == 1 else start.at(unsolved)
            others = self._joint_space.forward(values[unsolved], block, tolerance, keep_mode=keep_mode)
            answers = answers.with_rows(unsolved, others)
        return answers

    def _are_idle_within(self, coordinates: Floats) -> bool:
        """True if the coordinates of idle joints, which stay as they are, keep their limits in all rows."""
        idle = self.model.path_closure.idle
        if not coordinates[:, idle].any():
            return True
        return bool((measure_configurations(self.model, coordinates).excess <= TOLERANCES.limit).all())

    def _configurations_at(self, coordinates: Floats) -> Configurations:
        """Configurations to start from at joint coordinates (n, columns)."""
        closing = closing_of_chain(self.model, run_walk(self.model, coordinates * self.model.closure.scale))
        return self.as_configurations(closing)
