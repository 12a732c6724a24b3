"""The engine of machines with a clearance: answers of another engine, with links kept apart."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..closure.attempts import Attempt
from ..closure.close import Closing
from ..closure.closure_engine import ClosureEngine
from ..closure.configurations import Configurations, steps_of
from ..closure.engine_contract import Engine, InverseEngine
from ..closure.projection import ProjectionMode
from ..kernels.rows import (
    FAILED,
    HOLD_NOTHING,
    ITERATIONS,
    LIMIT_EXCESS,
    POSITION_ERROR,
    PROJECTED,
    REACHED,
    ROTATION_ERROR,
)
from ..model import Model
from ..options import Options
from ..platform.legs_engine import LegsEngine
from ..platform.links_of_legs import keeps_links
from ..poses import are_poses
from ..tolerances import TOLERANCES
from .link_distances import clearance_excess
from .placed_links import PlacedLinks

Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class ApartEngine(Engine):
    """Answers of an engine where they keep links apart, and of searches that keep them apart where they do not.

    A nearest pose that keeps links apart without being made to is the nearest of those that do. So searches are made
    for the other answers only.

    Attributes
    ----------
    usual : the engine that knows nothing of links.
    inverse : the engine that answers targets; the same, or that of the passes.
    """

    model: Model
    usual: Engine
    inverse: InverseEngine

    @cached_property
    def _search(self) -> LegsEngine | ClosureEngine:
        """The engine whose searches keep links apart."""
        return LegsEngine(self.model) if self.model.has_legs and keeps_links(self.model) else ClosureEngine(self.model)

    def answer(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        *,
        keep_mode: bool,
        nearby: bool = False,
    ) -> Configurations:
        """As `InverseEngine.answer`; with `nearby`, searches stay around the start."""
        answers = self.inverse.answer(targets, start, options, keep_mode=keep_mode)
        rows = self._too_near(answers)
        if not len(rows):
            return answers
        if not keep_mode:
            answers, rows = self._in_other_modes(answers, rows, targets, start)
        if not len(rows):
            return answers
        for part, part_options in self._by_hold(answers, rows, options):
            begin, part_targets = _starts_of(start, part), np.require(targets[part], requirements=["C", "W"])
            found = self._search.nearest(part_targets, begin, part_options, keep_mode=keep_mode, nearby=nearby)
            answers = answers.with_rows(part, self._checked(found))
        return answers

    def _by_hold(self, answers: Configurations, rows: Rows, options: Options) -> list[tuple[Rows, Options]]:
        """The rows, and the options that they are searched with: those that can hold nothing anyhow are not to."""
        gives_up = (answers.rows.status[rows] == PROJECTED) & (answers.rows.holds[rows] == HOLD_NOTHING)
        if options.hold is None or self.inverse is not self.usual or not gives_up.any():
            return [(rows, options)]
        parts = (rows[~gives_up], options), (rows[gives_up], replace(options, hold=None))
        return [part for part in parts if len(part[0])]

    def _in_other_modes(
        self, answers: Configurations, rows: Rows, targets: Floats, start: Configurations | None
    ) -> tuple[Configurations, Rows]:
        """Answers with some of the rows reached in other working modes; the rows that are left."""
        is_left = np.ones(len(rows), bool)
        is_reached = answers.rows.status[rows] == REACHED
        if not isinstance(self._search, LegsEngine) or not is_reached.any():
            return answers, rows
        tried, begin = rows[is_reached], _starts_of(start, rows[is_reached])
        for reached, others in self._search.in_other_modes(np.ascontiguousarray(targets[tried]), begin):
            is_new = is_left[is_reached][reached]
            is_new[self._too_near(others)] = False
            if is_new.any():
                places = tried[reached[is_new]]
                answers = answers.with_rows(places, others.at(np.flatnonzero(is_new)))
                is_left[np.isin(rows, places)] = False
            if not is_left[is_reached].any():
                break
        return answers, rows[is_left]

    def follow(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        on_progress: Callable[[int, int], None] | None,
    ) -> Configurations:
        """As `InverseEngine.follow`. After a step whose links would be too near, ever more steps are taken at once."""
        is_pose = are_poses(targets)
        reports = steps_of(is_pose, on_progress)
        targets = np.require(targets[is_pose], requirements=["C", "W"])
        parts, done, count = list[Configurations](), 0, len(targets)
        while done < len(targets):
            answers = self.inverse.follow(targets[done : done + count], start, options, None)
            rows = self._too_near(answers)
            n_clear, count = (int(rows[0]), 1) if len(rows) else (len(answers), 2 * count)
            if n_clear:
                parts.append(answers if not len(rows) else answers.at(np.arange(n_clear)))
            if len(rows):
                before = parts[-1].at(np.array([len(parts[-1]) - 1])) if parts else start
                target = targets[done + n_clear : done + n_clear + 1]
                parts.append(self.answer(target, before, options, keep_mode=True, nearby=True))
            start = parts[-1].at(np.array([len(parts[-1]) - 1]))
            for _ in range(n_clear + min(len(rows), 1)):
                done += 1
                next(reports)
        list(reports)
        return _joined(parts, self.inverse.follow(targets[:0], start, options, None)).scatter(is_pose)

    def attempts(
        self, target: Floats, start: Configurations | None, options: Options, *, keep_mode: bool
    ) -> Iterator[Attempt]:
        """As `InverseEngine.attempts`; last the searches that keep links apart, where they are needed."""
        yield from self.inverse.attempts(target, start, options, keep_mode=keep_mode)
        if len(self._too_near(self.inverse.answer(target, start, options, keep_mode=keep_mode))):
            answer = self.answer(target, start, options, keep_mode=keep_mode)
            lever, measures = options.rotation_length or self.model.mechanism.rotation_length, answer.rows.measures[0]
            distance = float(np.hypot(measures[POSITION_ERROR], lever * measures[ROTATION_ERROR]))
            ending = "reached" if answer.rows.status[0] == REACHED else "nearest"
            yield Attempt("links kept apart", "the start", int(answer.rows.counters[0, ITERATIONS]), distance, ending)

    def advance(self, targets: Floats, start: Configurations) -> Configurations:
        """As `Engine.advance`; FAILED where links would be too near."""
        return self._checked(self.usual.advance(targets, start))

    def forward(
        self, values: Floats, start: Configurations | None, tolerance: float, *, keep_mode: bool = True
    ) -> Configurations:
        """As `Engine.forward`."""
        answers = self.usual.forward(values, start, tolerance, keep_mode=keep_mode)
        rows = self._too_near(answers)
        if not len(rows):
            return answers
        found = self._search.nearest_forward(values[rows], _starts_of(start, rows), tolerance)
        return answers.with_rows(rows, self._checked(found))

    def as_configurations(self, closing: Closing) -> Configurations:
        """As `Engine.as_configurations`; links that are too near count as limits that are exceeded."""
        configurations = self.usual.as_configurations(closing)
        measures, excess = configurations.rows.measures, clearance_excess(self._placed(configurations))
        measures[:, LIMIT_EXCESS] = np.fmax(measures[:, LIMIT_EXCESS], excess)
        return configurations

    def points(self, configurations: Configurations) -> Mapping[str, Floats]:
        """As `Engine.points`."""
        return self.usual.points(configurations)

    def limit_multipliers(self, configurations: Configurations, targets: Floats, projection: ProjectionMode) -> Floats:
        """As `Engine.limit_multipliers`; behind the cones are those of pairs of links."""
        return self._search.limit_multipliers(configurations, targets, projection)

    def _too_near(self, answers: Configurations) -> Rows:
        """The rows whose links are nearer than the clearance."""
        return np.flatnonzero(clearance_excess(self._placed(answers)) > TOLERANCES.limit)

    def _placed(self, configurations: Configurations) -> PlacedLinks:
        return PlacedLinks(self.model.mechanism, configurations, lambda: self.usual.points(configurations))

    def _checked(self, answers: Configurations) -> Configurations:
        """Mark answers FAILED where links are too near; the answers."""
        answers.rows.status[self._too_near(answers)] = FAILED
        return answers


def _starts_of(start: Configurations | None, rows: Rows) -> Configurations | None:
    return start if start is None or len(start) == 1 else start.at(rows)


def _joined(parts: list[Configurations], none: Configurations) -> Configurations:
    """Answers one after the other."""
    if len(parts) < 2:
        return parts[0] if parts else none
    rows = type(none.rows)._make(np.concatenate(arrays) for arrays in zip(*(part.rows for part in parts), strict=True))
    return Configurations(rows, np.concatenate([part.coordinates for part in parts]))
