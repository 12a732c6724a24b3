"""The paper's method: targets answered by passes on joint positions, and projected where these do not reach."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..closure.close import Closing, close, closure_of
from ..closure.configurations import Configurations, new_rows, put_rows, rows_at, steps_of
from ..closure.descend import clip_targets
from ..closure.projection import ProjectionMode, held_parts, projection_modes
from ..closure.solve import ClosureEngine, start_coordinates, to_answers
from ..decomposition.leg_table import LegTable, leg_table
from ..decomposition.plan import compile_plan
from ..description.mechanism import Mechanism
from ..description.task import task_of
from ..kernels.closure.loops import LOCKED
from ..kernels.legs.records import REDUNDANT
from ..kernels.reaching import plan as P
from ..kernels.rows import FAILED, ITERATIONS, REACHED, ROUNDS
from ..kernels.threads import in_blocks
from ..options import Options
from ..platform.answers import sides_at
from ..platform.solve import LegsEngine
from ..poses import are_poses, made_exact
from ..tolerances import TOLERANCES
from .positions import holding, new_pass_results, place, positions_of

NEAR = 1e-3
"""Share of L within which passes bring the ends of chains where exact answers are asked for: loops close from there."""

STEPS = 8
"""Steps to come as near as chains can, each round."""

ROWS_A_BLOCK = 64


class ReachingEngine:
    """The paper's method on joint positions, for mechanisms whose chains these express.

    Passes bring the ends of chains near, and move the target where they do not; from there the loops are closed
    exactly. With `Options.exact`, what another engine reaches is that one's answer; that engine also answers what the
    passes leave no feasible configuration for.
    """

    def __init__(self, mechanism: Mechanism, exact: LegsEngine | ClosureEngine) -> None:
        self.mechanism, self._exact = mechanism, exact
        self._compiled, self._table = compile_plan(mechanism), leg_table(mechanism)
        self._held = holding(mechanism)

    def answer(
        self, targets: Floats, start: Configurations | None, options: Options, *, keep_mode: bool
    ) -> Configurations:
        """Answer targets (n, 4, 4), each for itself, from one configuration or one for each; INVALID where no pose."""
        known = are_poses(targets)
        if options.exact:
            found = self._exact.answer(targets, start, options, keep_mode=keep_mode)
            away = np.flatnonzero(known & (found.rows.status != REACHED))
            if not len(away):
                return found
            found = Configurations(found.rows, found.coordinates)
            tried = self._by_passes(made_exact(targets[away]), _at(start, away), options, keep_mode)
            good = tried.rows.status != FAILED
            found.put(away[good], tried, good)
            return found
        own = _at(start, np.flatnonzero(known))
        found = self._by_passes(made_exact(targets[known]), own, options, keep_mode)
        away = np.flatnonzero(found.rows.status == FAILED)
        if len(away):
            others = self._exact.answer(targets[known][away], _at(own, away), options, keep_mode=keep_mode)
            found.put(away, others, np.ones(len(away), bool))
        return found.scatter(known)

    def follow(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        on_progress: Callable[[int, int], None] | None,
    ) -> Configurations:
        """Answer a path (n, 4, 4), each target from the answer before it, in its working mode."""
        known, before = are_poses(targets), start
        found = new_rows(self.mechanism, len(targets))
        coordinates = np.zeros((len(targets), start_coordinates(self.mechanism, start).shape[1]))
        for i in steps_of(known, on_progress):
            answer = self.answer(targets[i : i + 1], before, options, keep_mode=True)
            before = Configurations(answer.rows, answer.coordinates)
            put_rows(found, slice(i, i + 1), before.rows)
            coordinates[i] = before.coordinates[0]
        return Configurations(rows_at(found, known), coordinates[known]).scatter(known)

    def _by_passes(
        self, wanted: Floats, start: Configurations | None, options: Options, keep_mode: bool
    ) -> Configurations:
        """Answer poses by passes; FAILED where these end in nothing feasible, or leave the mode to be kept."""
        begin = start_coordinates(self.mechanism, start)
        begin = np.repeat(begin, len(wanted), axis=0) if len(begin) == 1 else begin
        way = projection_modes(self.mechanism, options.hold, options.rotation_length)[0]
        found = self._tried(wanted, begin, options, way)
        if keep_mode:
            strayed = (self._sides(found) * self._sides(start) < 0.0).any(axis=1)
            found.rows.status[strayed] = FAILED
        return found

    def _sides(self, found: Configurations | None) -> Floats:
        """The working mode of configurations, home's for None: which of its two solutions each leg takes, (n, legs)."""
        if not isinstance(self._table, LegTable):
            return np.zeros((1, 0))
        legs, home = self._table.legs, self._table.home_sides
        chosen = (legs["kind"] != REDUNDANT) | (legs["orients"] == 1)
        return np.where(chosen, home if found is None else sides_at(self.mechanism, self._table, found), 0.0)

    def _tried(self, wanted: Floats, begin: Floats, options: Options, way: ProjectionMode) -> Configurations:
        """Answer poses by passes one way, from joint coordinates (n, columns); FAILED where the loops do not close."""
        closure = closure_of(self.mechanism, whole=False)
        settings, sought = settings_of(self.mechanism, options, way), clip_targets(self.mechanism, wanted)
        if options.exact and not self._is_struts:
            placed, reached = self._agree(sought, begin, settings)
        else:
            passes = settings._replace(max_iterations=1) if options.exact else settings
            reached = self._run(sought, begin, passes)
            placed = place(self.mechanism, self._compiled, begin, reached)
        margin = TOLERANCES.inside
        closed = close(closure, placed.coordinates, placed.poses, platform=way.held, limits=True, margin=margin)
        errors = task_of(self.mechanism).errors(closed.poses, wanted)
        slipped = np.flatnonzero((reached.rounds == 0) & (errors[0] > settings.enough))
        if len(slipped):  # loops that close only off a target that chains came near to may close on it
            start = placed.coordinates[slipped], placed.poses[slipped]
            closed.put_better(slipped, close(closure, *start, platform=self._held, limits=True, margin=margin))
            errors = task_of(self.mechanism).errors(closed.poses, wanted)
        holds = held_parts(self.mechanism, np.full(len(wanted), way.hold), *errors)
        found = to_answers(closure, closed, wanted, holds, options)
        found.rows.counters[:, ITERATIONS], found.rows.counters[:, ROUNDS] = reached.iterations, reached.rounds
        return found

    def _agree(self, wanted: Floats, begin: Floats, settings: P.Settings) -> tuple[Closing, P.PassResults]:
        """Configurations with their platforms where chains that come as near as they can agree.

        Passes are caught by the ranges of joints. As near as it can is here what closes the chain's loops in the sense
        of least squares, with all that it misses put at its ends.
        """
        closure = closure_of(self.mechanism, whole=False)
        reached, rest = new_pass_results(self._compiled, len(wanted)), np.arange(len(wanted))
        reached.rounds[:] = 0
        placed = close(closure, begin, wanted, platform=self._held, limits=True, max_iterations=0)
        once = settings._replace(max_iterations=0, max_rounds=1)
        for _ in range(settings.max_rounds):
            start, poses = placed.coordinates[rest], placed.poses[rest]
            tried = close(closure, start, poses, platform=self._held, limits=True, max_iterations=STEPS)
            ended = self._run(tried.poses.copy(), tried.coordinates, once)
            if not self.mechanism.end_effector_is_joint:
                tried.poses[:] = ended.poses
            tried.poses[:, :3, 3] = ended.poses[:, :3, 3]
            placed.put(rest, tried)
            rounds = reached.rounds[rest] + ended.rounds
            for array, own in zip(reached, ended, strict=True):
                array[rest] = own
            reached.rounds[rest] = rounds
            rest = rest[ended.gaps > settings.enough]
            if not len(rest):
                break
        reached.iterations[:] = reached.rounds
        return placed, reached

    @cached_property
    def _is_struts(self) -> bool:
        """Whether one pass brings all ends as near as they come: single segments on the base."""
        branches = self._compiled.plan.branches
        return bool((branches["last"] - branches["first"] <= 1).all() and (branches["carrier"] == 0).all())

    def _run(self, wanted: Floats, begin: Floats, settings: P.Settings) -> P.PassResults:
        """The kernel over all rows, on all cores."""
        from ..kernels.reaching.solve import solve_by_passes

        if self.mechanism.end_effector_is_joint:  # a point has no orientation: home's
            wanted[:, :3, :3] = np.eye(3)
        seeds = positions_of(self.mechanism, self._compiled, begin)
        reached = new_pass_results(self._compiled, len(wanted))

        def run(block: slice) -> None:
            own = P.Seeds._make(array[block] for array in seeds)
            ends = P.PassResults._make(array[block] for array in reached)
            solve_by_passes(self._compiled.plan, wanted[block], own, settings, ends)

        in_blocks(run, len(wanted), ROWS_A_BLOCK)
        return reached


def _at(start: Configurations | None, places: NDArray[np.intp]) -> Configurations | None:
    """Where rows start: one configuration for all stays one."""
    return start if start is None or len(start) == 1 else start.at(places)


@lru_cache(maxsize=256)
def settings_of(mechanism: Mechanism, options: Options, way: ProjectionMode) -> P.Settings:
    """Options as the kernel takes them; where exact steps follow, passes end sooner."""
    length, free = mechanism.characteristic_length, [weight != LOCKED and weight > 0.0 for weight in way.weights]
    tolerance = float(options.tolerance or TOLERANCES.position * length)
    return P.Settings(
        enough=max(tolerance, NEAR * length) if options.exact else tolerance,
        max_iterations=int(options.max_iterations),
        max_rounds=int(options.max_rounds),
        free=P.TRANSLATES * any(free[:3]) + P.TURNS * any(free[3:]),
    )
