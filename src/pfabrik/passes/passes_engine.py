"""The engine of the paper's method: passes on joint positions, and projection of unreached targets.

Passes are plain, as in the paper, or use closed-form intersections and half-spaces.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import Floats
from ..common.batch import put, take
from ..common.derived import derived
from ..engines.joints.close import Closing, close
from ..engines.joints.closure_engine import start_coordinates, to_answers
from ..engines.joints.configurations import Configurations, new_rows, steps_of
from ..engines.joints.descend import clip_targets
from ..engines.joints.engine_contract import Engine, InverseEngine
from ..engines.joints.projection import ProjectionMode, held_parts, modes_of
from ..engines.pose.answers import sides_at
from ..kernels.joints.loops import LOCKED
from ..kernels.passes import plan as P
from ..kernels.rows import FAILED, ITERATIONS, REACHED, ROUNDS
from ..kernels.threads import in_blocks
from ..machine.description.mechanism import Mechanism
from ..machine.model import Model, model_of
from ..machine.poses import are_poses, made_exact
from ..options import Options
from ..tolerances import TOLERANCES
from .joint_positions import holding, new_pass_results, place, positions_of
from .pass_options import PassOptions
from .plan import CompiledPlan, compile_plan

NEAR = 1e-3
"""Tolerance of the passes [L] if the loops are closed exactly afterwards."""

STEPS = 8
"""Steps of a round that bring the ends of chains as near as possible to the target."""

ROWS_A_BLOCK = 64

BY_FALLBACK = -1
"""Rounds of an answer that is not the passes': they ended beyond a limit, with open loops, or in another mode."""


class PassesEngine(InverseEngine):
    """The paper's method, for mechanisms that joint positions express.

    Passes bring the ends of chains to the target or move the target; the loops are then closed exactly.
    The fallback engine answers targets for which that fails, and marks them; with the "centroid" method it answers all
    targets within reach.
    """

    def __init__(self, mechanism: Mechanism, fallback: Engine, options: PassOptions) -> None:
        self.mechanism, self._fallback, self._options = mechanism, fallback, options
        self._model = model_of(mechanism if mechanism.clearance is None else mechanism.with_clearance(None))
        self._compiled, self._held = with_rules(compile_plan(mechanism), options), holding(mechanism)

    def answer(
        self, targets: Floats, start: Configurations | None, options: Options, *, keep_mode: bool
    ) -> Configurations:
        """Solve for targets (n, 4, 4) independently, from one start or one for each; INVALID where no pose."""
        is_valid = are_poses(targets)
        targets, start = targets[is_valid], _at(start, np.flatnonzero(is_valid))
        if self._options.method != "centroid":
            solutions = self._by_passes(made_exact(targets), start, keep_mode)
            failed = np.flatnonzero(solutions.rows.status == FAILED)
            if len(failed):
                fallback = self._fallback.answer(targets[failed], _at(start, failed), options, keep_mode=keep_mode)
                solutions.put(failed, fallback, np.ones(len(failed), bool))
                solutions.rows.counters[failed, ROUNDS] = BY_FALLBACK
            return solutions.scatter(is_valid)
        solutions = self._fallback.answer(targets, start, options, keep_mode=keep_mode)
        missed = np.flatnonzero(solutions.rows.status != REACHED)
        if len(missed):
            starts = _at(start, missed)
            projected = self._fallback.rested(self._by_passes(made_exact(targets[missed]), starts, keep_mode), starts)
            is_feasible = projected.rows.status != FAILED
            solutions = Configurations(solutions.rows, solutions.coordinates)
            solutions.put(missed[is_feasible], projected, is_feasible)
            solutions.rows.counters[missed[~is_feasible], ROUNDS] = BY_FALLBACK
        return solutions.scatter(is_valid)

    def follow(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        on_progress: Callable[[int, int], None] | None,
    ) -> Configurations:
        """Solve a path (n, 4, 4), each target from the answer before it, in its working mode."""
        is_valid, previous = are_poses(targets), start
        rows = new_rows(self._model, len(targets))
        coordinates = np.zeros((len(targets), start_coordinates(self._model, start).shape[1]))
        for i in steps_of(is_valid, on_progress):
            answer = self.answer(targets[i : i + 1], previous, options, keep_mode=True)
            previous = Configurations(answer.rows, answer.coordinates)
            put(rows, slice(i, i + 1), previous.rows)
            coordinates[i] = previous.coordinates[0]
        return Configurations(take(rows, is_valid), coordinates[is_valid]).scatter(is_valid)

    def _by_passes(self, targets: Floats, start: Configurations | None, keep_mode: bool) -> Configurations:
        """Solve for poses by passes; FAILED where infeasible, or where the working mode is to be kept and is not."""
        coordinates = start_coordinates(self._model, start)
        coordinates = np.repeat(coordinates, len(targets), axis=0) if len(coordinates) == 1 else coordinates
        solutions = self._solve_from(targets, coordinates, keep_mode)
        if keep_mode:
            has_left_mode = (self._branches_of(solutions) * self._branches_of(start) < 0.0).any(axis=1)
            solutions.rows.status[np.broadcast_to(has_left_mode, len(targets))] = FAILED
        return solutions

    def _branches_of(self, configurations: Configurations | None) -> Floats:
        """Working mode of configurations or of home: the branch of each leg, (n, legs); 0 of legs with one solution."""
        if not self._model.has_legs:
            return np.zeros((1, 0))
        legs, home = self._model.legs.legs, self._model.legs.home_sides
        branches = home if configurations is None else sides_at(self._model, configurations)
        return np.where(legs["implicit"] == 1, 0.0, branches)

    def _solve_from(self, targets: Floats, coordinates: Floats, keep_mode: bool) -> Configurations:
        """Solve for poses by passes from joint coordinates (n, columns); FAILED where the result is infeasible."""
        closure, options = self._model.path_closure, self._options
        projection = modes_of(closure, options)[0]
        settings = settings_of(self._model, options, projection)._replace(keep_mode=int(keep_mode))
        clipped = clip_targets(self.mechanism, targets)
        if options.method == "centroid" and not self._has_only_struts:
            placed, results = self._move_to_fit(clipped, coordinates, settings)
        else:
            results = self._run(clipped, coordinates, settings)
            placed = place(closure, self._compiled, coordinates, results)
        margin = TOLERANCES.inside
        closed = close(closure, placed.coordinates, placed.poses, platform=projection.held, limits=True, margin=margin)
        errors = self._model.task.errors(closed.poses, targets)
        shifted = np.flatnonzero((results.rounds == 0) & (errors[0] > settings.tolerance))
        if len(shifted):  # the chains came near this target, but closing the loops moved the platform: hold it
            start = placed.coordinates[shifted], placed.poses[shifted]
            closed.put_better(shifted, close(closure, *start, platform=self._held, limits=True, margin=margin))
            errors = self._model.task.errors(closed.poses, targets)
        holds = held_parts(closure, np.full(len(targets), projection.hold), *errors)
        solutions = to_answers(self._model, closed, targets, holds, options)
        solutions.rows.counters[:, ITERATIONS] = results.iterations
        solutions.rows.counters[:, ROUNDS] = results.rounds
        if self.mechanism.clearance is not None:
            solutions.rows.status[~self._fallback.as_configurations(closed).is_within_limits] = FAILED
        return solutions

    def _move_to_fit(self, targets: Floats, coordinates: Floats, settings: P.Settings) -> tuple[Closing, P.PassResults]:
        """Move the platform round by round to where all chains reach it; fit every chain by least squares.

        The fits replace passes, which can stall at joint limits. The remaining gap of a chain is at its end.
        """
        closure = self._model.path_closure
        results, unsolved = new_pass_results(self._compiled, len(targets)), np.arange(len(targets))
        results.rounds[:] = 0
        placed = close(closure, coordinates, targets, platform=self._held, limits=True, max_iterations=0)
        once = settings._replace(max_iterations=0, max_rounds=1)
        for _ in range(settings.max_rounds):
            start, poses = placed.coordinates[unsolved], placed.poses[unsolved]
            fitted = close(closure, start, poses, platform=self._held, limits=True, max_iterations=STEPS)
            revised = self._run(fitted.poses.copy(), fitted.coordinates, once)
            if not self.mechanism.end_effector_is_joint:
                fitted.poses[:] = revised.poses
            fitted.poses[:, :3, 3] = revised.poses[:, :3, 3]
            put(placed, unsolved, fitted)
            rounds = results.rounds[unsolved] + revised.rounds
            for array, revised_array in zip(results, revised, strict=True):
                array[unsolved] = revised_array
            results.rounds[unsolved] = rounds
            unsolved = unsolved[revised.gaps > settings.tolerance]
            if not len(unsolved):
                break
        results.iterations[:] = results.rounds
        return placed, results

    @cached_property
    def _has_only_struts(self) -> bool:
        """True if all branches are single segments on the base: one pass brings their ends as near as possible."""
        branches = self._compiled.plan.branches
        return bool((branches["last"] - branches["first"] <= 1).all() and (branches["carrier"] == 0).all())

    def _run(self, targets: Floats, coordinates: Floats, settings: P.Settings) -> P.PassResults:
        """Run the kernel on all rows, on all cores; overwrite the rotations of targets of a joint end effector."""
        from ..kernels.passes.solve import solve_by_passes

        if self.mechanism.end_effector_is_joint:  # a point has no orientation; that of home is used
            targets[:, :3, :3] = np.eye(3)
        seeds = positions_of(self.mechanism, self._compiled, coordinates)
        results = new_pass_results(self._compiled, len(targets))

        def run(block: slice) -> None:
            solve_by_passes(self._compiled.plan, targets[block], take(seeds, block), settings, take(results, block))

        in_blocks(run, len(targets), ROWS_A_BLOCK)
        return results


def _at(start: Configurations | None, places: NDArray[np.intp]) -> Configurations | None:
    """Select the starts of some rows; a single start for all rows is returned as it is."""
    return start if start is None or len(start) == 1 else start.at(places)


def with_rules(compiled: CompiledPlan, options: PassOptions) -> CompiledPlan:
    """The plan with the rules of passes that the options ask for."""
    return replace(compiled, plan=compiled.plan._replace(is_literal=int(options.method == "paper")))


@derived
def settings_of(model: Model, options: PassOptions, projection: ProjectionMode) -> P.Settings:
    """Convert options for the kernel; one pass a round and a looser tolerance if the loops are closed exactly after."""
    length, free = model.length, [weight != LOCKED and weight > 0.0 for weight in projection.weights]
    tolerance = float(options.tolerance or TOLERANCES.position * length)
    turning = max((weight for weight in projection.weights[3:] if weight != LOCKED), default=0.0)
    is_finished = options.method == "centroid"
    return P.Settings(
        tolerance=max(tolerance, NEAR * length) if is_finished else tolerance,
        max_iterations=1 if is_finished else int(options.max_iterations),
        max_rounds=int(options.max_rounds),
        free=P.TRANSLATES * any(free[:3]) + P.TURNS * any(free[3:]),
        keep_mode=0,
        lever=length * float(turning) ** 0.5,
        is_accelerated=int(options.method == "accelerated"),
    )
