"""The engine of mechanisms without loops: work linear in the number of joints between base and end effector."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property, partial
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from ...common.arrays import Floats, Records
from ...common.batch import take
from ...kernels.chains.chain_constants import MET, MOST_BENT
from ...kernels.handle import Handle
from ...kernels.pose.tables import BY_LEGS, Question
from ...kernels.rows import PROJECTED, REACHED, TOO_NEAR, Rows
from ...kernels.threads import in_blocks
from ...machine.model import Model
from ...machine.poses import are_poses
from ...options import USUAL, Options
from ...tolerances import TOLERANCES
from ..joints.assemble import forward_answers
from ..joints.attempts import Attempt, held_words, with_verdicts
from ..joints.close import Closing, measure_configurations
from ..joints.closure_engine import ClosureEngine
from ..joints.configurations import Configurations, coordinates_for, joint_coordinates, new_rows, steps_of
from ..joints.engine_contract import Counted, Engine, Grower, Prepared
from ..joints.projection import ProjectionMode
from ..joints.stretched import BentConfiguration
from .chain_tables import ROWS_A_BLOCK, new_scratch, question_of, scratch_of_chain, tables_of, walk

if TYPE_CHECKING:
    from ...kernels.chains.chain_records import ChainScratch

ROWS_AHEAD = 256
"""Targets of a path that one call of the kernel follows."""

MOST_NOTED = 1000
"""Searches that are noted to look into an answer: more than are ever made."""


class ChainEngine(Engine):
    """Inverse and forward kinematics of a serial chain, with the engine in joint coordinates as fallback."""

    def __init__(self, model: Model) -> None:
        self.model, self._joint_space = model, ClosureEngine(model)
        self._home = np.zeros((1, len(model.mechanism.coordinates)))

    @cached_property
    def _has_idle(self) -> bool:
        """True if some joints are beside the chain."""
        return bool(self.model.path_closure.idle.any())

    def answer(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        *,
        keep_mode: bool,
        nearby: bool = False,
    ) -> Configurations:
        """Solve for targets (n, 4, 4) independently, from one start or one for each; INVALID where no pose.

        With `nearby` by searches that stay around the start.
        """
        begin = self._home if start is None else start.coordinates
        if not self._are_idle_within(begin):
            return self._joint_space.answer(targets, start, options, keep_mode=keep_mode)
        question = question_of(start is not None, keep_mode, nearby=nearby, most_steps=options.most_steps)
        n_missed, answers = self._run(question, options, targets, begin)
        failed = np.flatnonzero(answers.rows.status > PROJECTED) if n_missed else np.zeros(0, np.intp)
        if len(failed):
            block = start if start is None or len(start) == 1 else start.at(failed)
            fallback = self._joint_space.answer(targets[failed], block, options, keep_mode=keep_mode)
            answers = answers.with_rows(failed, fallback)
        if self.model.mechanism.clearance is None:
            return answers
        near = self._joint_space.too_near(answers)
        return self._joint_space.apart(near, answers, targets, start, options, keep_mode=keep_mode or nearby)

    @cached_property
    def _kernel(self) -> Callable[..., int]:
        from ...kernels.chains.answer_chains import answer_chains

        return answer_chains

    def _run(
        self,
        question: Handle[Question],
        options: Options,
        targets: Floats,
        starts: Floats,
        *,
        follows: bool = False,
        scratch: Handle[ChainScratch] | None = None,
    ) -> tuple[int, Configurations]:
        """Answer targets (n, 4, 4) from joint coordinates (n or 1, columns); how many are not reached, and all."""
        model, n = self.model, len(targets)
        rows, coordinates, tables = new_rows(model, n), np.empty((n, starts.shape[1])), tables_of(model, options)
        used = scratch or scratch_of_chain(model)

        def call(*arrays: Any) -> int:  # each thread has its own scratch memory
            return self._kernel(tables.address, used.address, question.address, follows, *arrays)

        def run(block: slice) -> int:
            begin = starts[block] if len(starts) > 1 else starts
            return call(targets[block], begin, coordinates[block], take(rows, block))

        if n == 1 or follows:
            n_missed = call(targets, starts, coordinates, rows)
        else:
            n_missed = sum(in_blocks(run, n, ROWS_A_BLOCK))
        return n_missed, Configurations(rows, coordinates)

    def prepared(self, target: Floats, start: Configurations | None, rows: Rows, *, keep_mode: bool) -> Prepared | None:
        """As `Engine.prepared`; None if joints beside the chain do not keep their limits at the start."""
        begin = self._home if start is None else start.coordinates
        if not self._are_idle_within(begin) or self.model.mechanism.clearance is not None:
            return None
        question, tables = question_of(start is not None, keep_mode, last=BY_LEGS), tables_of(self.model, USUAL)
        scratch = Handle(new_scratch(self.model, 0))
        addresses = tables.address, scratch.address, question.address, False
        return partial(self._kernel, *addresses, target, begin, np.empty_like(begin), rows), (
            scratch,
            tables,
            question,
        )

    def attempts(
        self, target: Floats, start: Configurations | None, options: Options, *, keep_mode: bool
    ) -> Iterator[Attempt]:
        """As `InverseEngine.attempts`: those of the chain, then of the fallback where these have no end."""
        model, begin, rows = self.model, joint_coordinates(self.model, start), None
        if self._are_idle_within(begin):
            scratch, tables = Handle(new_scratch(model, MOST_NOTED)), tables_of(model, options).record
            question = question_of(start is not None, keep_mode, most_steps=options.most_steps)
            _, answer = self._run(question, options, target, begin, scratch=scratch)
            rows, noted = answer.rows, scratch.record.log[: scratch.record.effort["searches"][0]]
            for phase, searches in groupby(noted, lambda each: int(each["phase"])):
                held = held_words(int(tables.holds[phase]), tables.prices[phase, 0])
                yield from _told(model, np.array(list(searches)), held)
        if rows is None or rows.status[0] > PROJECTED:
            yield from self._joint_space.attempts(target, start, options, keep_mode=keep_mode)

    def follow(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        on_progress: Callable[[int, int], None] | None,
    ) -> Configurations:
        """Solve a path (n, 4, 4), each target from the answer before it, in its working mode."""
        model, before = self.model, start
        if not self._are_idle_within(joint_coordinates(model, start)):
            return self._joint_space.follow(targets, start, options, on_progress)
        is_valid = are_poses(targets)
        path, bent, n_done = targets[is_valid], BentConfiguration(model, options), 0
        followed = Configurations(new_rows(model, len(path)), np.empty((len(path), self._home.shape[1])))
        for place, _ in enumerate(steps_of(is_valid, on_progress)):
            if place < n_done:
                continue
            if bent.coordinates is None:
                answers = self._follow_some(path[place : place + ROWS_AHEAD], before, options)
            else:
                answers = self._follow_bent(path[place : place + 1], before, options, bent)
            n_done = place + len(answers)
            followed.put(np.arange(place, n_done), answers, np.ones(len(answers), bool))
            last = answers.coordinates[-2:]
            begin = last[:1] if len(last) == 2 else joint_coordinates(model, before)
            if begin.shape[1] <= MOST_BENT:
                bent.update(int(answers.rows.status[-1]), begin, last[-1:])
            before = answers.at(np.array([len(answers) - 1]))
        return followed.scatter(is_valid)

    def _follow_some(self, targets: Floats, start: Configurations | None, options: Options) -> Configurations:
        """The answers to the first targets of a path, up to one that is not reached."""
        question = question_of(start is not None, True, nearby=True, most_steps=options.most_steps)
        begin = joint_coordinates(self.model, start)
        _, answers = self._run(question, options, targets, begin, follows=True)
        status = answers.rows.status
        status[self._joint_space.too_near(answers)] = TOO_NEAR
        n = 1 + int(np.argmax(np.append(status[:-1] != REACHED, True)))
        if status[n - 1] <= PROJECTED:
            return answers.at(np.arange(n))
        if n > 1:
            return answers.at(np.arange(n - 1))
        return self.answer(targets[:1], start, options, keep_mode=True, nearby=True)

    def _follow_bent(
        self, target: Floats, start: Configurations | None, options: Options, bent: BentConfiguration
    ) -> Configurations:
        """Solve one target of a path, from the answer before it and from the last bent configuration."""
        assert bent.coordinates is not None
        begin = self.as_configurations(walk(self.model, bent.coordinates))
        answer, bent_answer = (
            self.answer(target, each, options, keep_mode=True, nearby=True) for each in (start, begin)
        )
        return bent_answer if bent.is_preferred(answer.rows, bent_answer.rows) else answer

    def advance(self, targets: Floats, start: Configurations) -> Configurations:
        """Move as many configurations to targets (n, 4, 4) in their working modes; FAILED where not reached."""
        return self._joint_space.advance(targets, start)

    def grower(self, counted: Counted) -> Grower | None:
        """As `ClosureEngine.grower`."""
        return self._joint_space.grower(counted)

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
        closing = walk(model, scaled / closure.scale)
        answers = forward_answers(closure, self.as_configurations(closing), closing, values, tolerance)
        unsolved = np.flatnonzero(~closing.feasible)
        if not self._are_idle_within(begin):
            unsolved = np.arange(len(values))
        if len(unsolved):
            block = start if start is None or len(start) == 1 else start.at(unsolved)
            others = self._joint_space.forward(values[unsolved], block, tolerance, keep_mode=keep_mode)
            answers = answers.with_rows(unsolved, others)
        if self.model.mechanism.clearance is None:
            return answers
        return self._joint_space.forward_apart(self._joint_space.too_near(answers), answers, values, start, tolerance)

    def _are_idle_within(self, coordinates: Floats) -> bool:
        """True if the coordinates of idle joints, which stay as they are, keep their limits in all rows."""
        if not self._has_idle or not coordinates[:, self.model.path_closure.idle].any():
            return True
        return bool((measure_configurations(self.model, coordinates).excess <= TOLERANCES.limit).all())


def _told(model: Model, searches: Records, held: str) -> Iterator[Attempt]:
    """The searches of one phase as attempts."""
    starts = ["the start" if k < 0 else f"seed {k + 1}" for k in searches["start"]]
    if searches["phase"][0] == 0:
        for start, steps, error in zip(starts, searches["steps"].tolist(), searches["distance"].tolist(), strict=True):
            is_reached = error <= MET
            ending = "reached" if is_reached else f"off by {error:.3g} L"
            yield Attempt("joints moved to the target", start, steps, 0.0 if is_reached else np.nan, ending)
        return
    distances = np.where(np.isfinite(searches["distance"]), model.length * searches["distance"], np.nan)
    yield from with_verdicts(f"joints, {held}", starts, searches["steps"].tolist(), distances)
