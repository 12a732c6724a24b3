"""The engine of mechanisms whose chains are all legs in closed form."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property, partial
from typing import cast

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Mask
from ..batch import put, take
from ..closure.attempts import Attempt
from ..closure.close import Closing, in_lengths
from ..closure.closure_engine import ClosureEngine
from ..closure.configurations import Configurations, new_rows, steps_of
from ..closure.engine_contract import Engine, Prepared
from ..closure.parasitic import has_other_assemblies
from ..closure.projection import ProjectionMode
from ..kernels.handle import Handle
from ..kernels.platform.search_records import Starts
from ..kernels.platform.tables import NEAREST
from ..kernels.rows import PENDING, POSITION_ERROR, PROJECTED, REACHED, ROTATION_ERROR, UNSURE, Rows
from ..model import Model
from ..motion.outward import centres_at
from ..options import Options
from ..poses import are_poses
from ..tolerances import TOLERANCES
from .answers import LegAnswers, answer_coordinates, replaced, sides_at, start_coordinates_of
from .coordinates import joint_coordinates
from .folds import home_answer, starts_beside, subsets
from .forward import forward_kinematics, project_values
from .keep import kept
from .leg_attempts import attempts
from .nearest import limit_multipliers
from .nearest_pose import starts_at
from .reach import count_turns, reach, reach_on_sides, rest_redundant, turns_repeatedly
from .rows_one_by_one import Answers, answer_phases, request_from
from .single import AssemblyOutputs, SingleAssembly, SingleTarget, new_scratch
from .table import table_handle
from .unreached import answer_unreached


class LegsEngine(Engine):
    """Inverse and forward kinematics by the legs' closed forms, with a solver in joint coordinates as fallback.

    Targets are solved in closed form in the working mode of the start; what the task leaves open of a pose follows from
    the legs' constraints. Targets not reached so are tried in other working modes, then answered by the nearest
    feasible pose, a search in the platform's pose. What is unsolved then, mostly near dead points, is solved in joint
    coordinates.
    """

    def __init__(self, model: Model) -> None:
        self._model, self._table = model, model.legs
        self._joint_space, self._single = ClosureEngine(model), SingleTarget(model)

    @cached_property
    def _single_forward(self) -> SingleAssembly:
        return SingleAssembly(self._model)

    @cached_property
    def _searches(self) -> bool:
        """True if unreached targets are searched for in the platform's pose, before joint coordinates."""
        return not has_other_assemblies(self._model.path_closure)

    def answer(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        *,
        keep_mode: bool,
        nearby: bool = False,
    ) -> Configurations:
        """Solve targets (n, 4, 4) independently, from one start or one for each; INVALID where a target is no pose.

        Unreachable targets get the nearest feasible pose found: with `keep_mode` in the working mode of the start, with
        `nearby` by a search around the start alone.
        """
        answers = self._answer(targets, start, options, keep_mode=keep_mode, nearby=nearby)
        if not keep_mode or not self._table.has_sides:
            return answers
        status = answers.rows.status
        is_missed = status[0] != REACHED if len(status) == 1 else (status != REACHED).any()
        if isinstance(answers, LegAnswers) and answers.q_proximal is None and not is_missed:
            return answers
        answers = self._kept(answers, targets, start, options)
        for is_folded, begin in starts_beside(self._model, start):
            others = self._answer(targets, begin, options, keep_mode=True, nearby=nearby)
            others = self._kept(others, targets, begin, options)
            better = np.flatnonzero(is_folded & self._is_nearer(others.rows, answers.rows, options))
            if len(better):
                replaced = answers.with_others if isinstance(answers, LegAnswers) else answers.with_rows
                answers = replaced(better, others.at(better))
        return answers

    def _kept(
        self, answers: Configurations, targets: Floats, start: Configurations | None, options: Options
    ) -> Configurations:
        """As `keep.kept`."""

        if isinstance(answers, LegAnswers) and (answers.sides * self._sides_of(start) >= 0.0).all():
            return answers

        def answer(target: Floats, begin: Configurations) -> Configurations:
            return self._answer(target, begin, options, keep_mode=True, nearby=True)

        return kept(self._model, answers, targets, home_answer(self._model) if start is None else start, answer)

    def _answer(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        *,
        keep_mode: bool,
        nearby: bool,
    ) -> Configurations:
        """As `answer`, from a start on a fold in one of the modes that meet there."""
        is_one = len(targets) == 1 and (start is None or (isinstance(start, LegAnswers) and len(start) == 1))
        start_sides = self._sides_of(start)
        rows = self._single.new_rows() if is_one else new_rows(self._model, len(targets))
        end_sides = start_sides.copy() if self._table.has_implicit_joints else start_sides
        if is_one and self._reach_one(targets, start, end_sides, keep_mode, rows):
            model = self._model
            start_coordinates = start_coordinates_of(model, start, start_sides)
            platform = rows.poses, rows.actuators, end_sides
            return LegAnswers(
                rows,
                lambda places: joint_coordinates(model, *platform, start_coordinates(slice(None)))[places],
                end_sides,
            )
        n_unsolved, sides = reach(self._model, targets, start, start_sides, keep_mode, rows, is_tried=is_one)
        q_proximal, fallback = None, None
        if n_unsolved and self._searches:
            sides = np.repeat(sides, len(targets), axis=0) if len(sides) < len(targets) else sides.copy()
            q_proximal = np.full_like(sides, np.nan)
            request = request_from(self._model, options, start, start_sides, keep_mode, nearby)
            unreached = np.flatnonzero(rows.status != REACHED)
            answer_unreached(request, targets, Answers(rows, q_proximal, sides), unreached)
        is_pending = rows.status != REACHED
        if q_proximal is not None:
            is_pending = rows.status >= PENDING  # or UNSURE
        unsolved = is_pending.nonzero()[0]
        if len(unsolved):
            fallback_start = start
            if start is not None and len(start) not in (1, len(unsolved)):
                fallback_start = start.at(unsolved)
            fallback = self._joint_space.answer(targets[unsolved], fallback_start, options, keep_mode=keep_mode)
            is_kept = self._kept_projections(take(rows, unsolved), fallback.rows, options)
            rows.status[unsolved[is_kept]] = PROJECTED
            unsolved = unsolved[~is_kept]
            if is_kept.any():
                fallback = fallback.at(np.flatnonzero(~is_kept))
            if len(unsolved) == len(targets):
                return self.rested(fallback, start)
            put(rows, unsolved, fallback.rows)
            sides = np.repeat(sides, len(targets), axis=0) if len(sides) < len(targets) else sides
            sides[unsolved] = sides_at(self._model, fallback)
            if q_proximal is not None:
                q_proximal[unsolved] = np.nan
        return self.rested(self._answers(rows, sides, q_proximal, start, start_sides, unsolved, fallback), start)

    def rested(self, answers: Configurations, start: Configurations | None) -> Configurations:
        """As `Engine.rested`: projections leave redundant joints where they have pulled them."""
        projected = (answers.rows.status == PROJECTED).nonzero()[0]
        if not (self._table.has_free_redundant and len(projected)):
            return answers
        start = start if start is None or len(start) == 1 else start.at(projected)
        rows, old = take(answers.rows, projected), answers.at(projected)
        old_sides = self._sides_of(old)
        sides = old_sides.copy()
        nearer = rest_redundant(self._model, start, self._sides_of(start), sides, rows).nonzero()[0]
        others = self._answers(rows, sides, None, old, old_sides, nearer[:0], None)
        return replaced(answers, projected[nearer], others.at(nearer))

    def in_other_modes(
        self, targets: Floats, start: Configurations | None
    ) -> Iterator[tuple[NDArray[np.intp], LegAnswers]]:
        """The answers of the closed forms to targets (n, 4, 4) in other working modes, those of few changed legs first.

        Yields the rows that are reached in a mode, and their answers.
        """
        table, start_sides = self._table, self._sides_of(start)
        two_sided = np.flatnonzero(table.home_sides[0])
        start_poses = np.broadcast_to(self._single.home if start is None else start.rows.poses, targets.shape).copy()
        for changed in subsets(two_sided.tolist()):
            sides, rows = (
                np.repeat(start_sides, len(targets) // len(start_sides), axis=0),
                new_rows(self._model, len(targets)),
            )
            sides[:, changed] *= -1.0
            reach_on_sides(table_handle(table), targets, start_poses, sides, rows)
            reached = np.flatnonzero(rows.status == REACHED)
            if len(reached):
                answers = self._answers(rows, sides, None, start, start_sides, np.empty(0, np.intp), None)
                yield reached, cast(LegAnswers, answers.at(reached))

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

        With `nearby` they stay around their starts, with `keep_mode` in the working modes of these.
        """
        start_sides, rows = self._sides_of(start), new_rows(self._model, len(targets))
        shape = len(targets), len(self._table.legs)
        answers = Answers(rows, np.empty(shape), np.empty(shape))
        request = request_from(self._model, options, start, start_sides, keep_mode, nearby)
        answer_phases(request, targets, answers, np.arange(len(targets)), NEAREST, NEAREST)
        unsolved, fallback = np.flatnonzero(rows.status == PENDING), None
        if len(unsolved):
            begin = start if start is None or len(start) == 1 else start.at(unsolved)
            fallback = self._joint_space.nearest(targets[unsolved], begin, options, keep_mode=keep_mode, nearby=nearby)
            if len(unsolved) == len(targets):
                return fallback
            put(rows, unsolved, fallback.rows)
        return self._answers(rows, answers.sides, answers.q, start, start_sides, unsolved, fallback)

    def attempts(
        self, target: Floats, start: Configurations | None, options: Options, *, keep_mode: bool
    ) -> Iterator[Attempt]:
        """As `InverseEngine.attempts`: of the legs, then of the joint coordinates, which answer what legs leave."""
        last = None
        if self._searches:
            for last in attempts(self._model, target, start, self._sides_of(start), options, keep_mode=keep_mode):
                yield last
        if last is None or last.ending != "reached":
            yield from self._joint_space.attempts(target, start, options, keep_mode=keep_mode)

    def _kept_projections(self, rows: Rows, fallback: Rows, options: Options) -> Mask:
        """The UNSURE projections to keep: the fallback neither reaches their targets nor comes nearer."""
        return np.asarray((rows.status == UNSURE) & ~self._is_nearer(fallback, rows, options))

    def _is_nearer(self, others: Rows, rows: Rows, options: Options) -> Mask:
        """True where others reach targets that rows do not, or come nearer and hold no less, (n,)."""
        length = options.rotation_length or self._model.mechanism.rotation_length
        distances, other_distances = (
            np.hypot(batch.measures[:, POSITION_ERROR], length * batch.measures[:, ROTATION_ERROR])
            for batch in (rows, others)
        )
        is_nearer = other_distances < distances - TOLERANCES.position * self._model.length
        is_nearer = (others.status == PROJECTED) & is_nearer & (others.holds >= rows.holds)
        return np.asarray((rows.status != REACHED) & ((others.status == REACHED) | is_nearer))

    def prepared(self, target: Floats, start: Configurations | None, rows: Rows, *, keep_mode: bool) -> Prepared | None:
        """As `Engine.prepared`; None if actuators may turn more than once, and are counted from a start."""
        if start is not None and turns_repeatedly(self._table):
            return None
        single, start_pose = self._single, self._single.home if start is None else start.rows.poses
        sides = single.home_sides if start is None else sides_at(self._model, start)
        return single.prepared(target, start_pose, sides, rows, nearby=keep_mode), single

    def follow(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        on_progress: Callable[[int, int], None] | None,
    ) -> Configurations:
        """Solve a path (n, 4, 4) in one working mode, each target from the answer before it."""
        if not self._searches:
            return self._joint_space.follow(targets, start, options, on_progress)
        targets, is_pose = np.require(targets, requirements=["C", "W"]), are_poses(targets)
        answers: list[Configurations] = []
        for i in steps_of(is_pose, on_progress):
            previous = answers[-1] if answers else start
            answers.append(self.answer(targets[i : i + 1], previous, options, keep_mode=True, nearby=True))
        return self._joined(answers, start).scatter(is_pose)

    def _joined(self, answers: Sequence[Configurations], start: Configurations | None) -> Configurations:
        """Single answers as one batch; the first of them began at `start`."""
        rows, n_legs = new_rows(self._model, len(answers)), len(self._table.legs)
        sides, q_proximal = (
            np.repeat(self._table.home_sides, len(answers), axis=0),
            np.full((len(answers), n_legs), np.nan),
        )
        unsolved = np.array(
            [i for i, answer in enumerate(answers) if not isinstance(answer, LegAnswers)], dtype=np.intp
        )
        for i, answer in enumerate(answers):
            row = slice(i, i + 1)
            put(rows, row, answer.rows)
            if isinstance(answer, LegAnswers):
                sides[i] = answer.sides
                if answer.q_proximal is not None:
                    q_proximal[i] = answer.q_proximal
        fallback = None
        if len(unsolved):
            fallback = Configurations(take(rows, unsolved), np.concatenate([answers[i].coordinates for i in unsolved]))
        return self._answers(rows, sides, q_proximal, start, self._sides_of(start), unsolved, fallback)

    def _answers(
        self,
        rows: Rows,
        sides: Floats,
        q_proximal: Floats | None,
        start: Configurations | None,
        start_sides: Floats,
        unsolved: NDArray[np.intp],
        fallback: Configurations | None,
    ) -> LegAnswers:
        """Rows as answers, from a start with the sides `start_sides`; the rows `unsolved` are those of the fallback."""
        start_coordinates = start_coordinates_of(self._model, start, start_sides)
        coordinates = partial(
            answer_coordinates,
            self._model,
            rows,
            sides,
            q_proximal,
            start_coordinates,
            unsolved,
            fallback,
        )
        return LegAnswers(rows, coordinates, sides, q_proximal)

    def advance(self, targets: Floats, start: Configurations) -> Configurations:
        """Continue to targets (n, 4, 4), each from its own start and in its working mode; PENDING where not reached.

        Use the legs' closed forms where the start is non-singular and the pose fixes every coordinate; otherwise solve
        in joint space.
        """
        model, table, start_sides = self._model, self._table, sides_at(self._model, start)
        rows, at_start = (new_rows(model, len(targets)) for _ in range(2))
        coordinates = start.coordinates.copy()
        _, sides = reach(self._model, targets, start, start_sides, True, rows)
        reached = np.flatnonzero(rows.status == REACHED)
        coordinates_reached = joint_coordinates(
            model, rows.poses[reached], rows.actuators[reached], sides[reached], coordinates[reached]
        )
        angles = table.limited["column"][table.limited["turns"] == 1]
        is_turned = (np.abs(coordinates_reached - coordinates[reached])[:, angles] > np.pi).any(axis=1)
        rows.status[reached[is_turned]] = PENDING  # reached a turn away, from the other end of a range
        reached, coordinates_reached = reached[~is_turned], coordinates_reached[~is_turned]
        coordinates[reached] = coordinates_reached
        if len(reached) < len(targets):
            reach(self._model, start.rows.poses, start, start_sides, True, at_start)
            is_decided = (at_start.status == REACHED) & ~np.bool_(table.leaves_open)
            unsolved = np.flatnonzero((rows.status != REACHED) & ~is_decided)
            fallback = self._joint_space.advance(targets[unsolved], start.at(unsolved))
            put(rows, unsolved, fallback.rows)
            coordinates[unsolved] = fallback.coordinates
        return Configurations(rows, coordinates)

    def as_configurations(self, closing: Closing) -> Configurations:
        """Configurations found in joint coordinates, as answers whose status is not set yet."""
        return self._joint_space.as_configurations(closing)

    def points(self, answers: Configurations) -> Mapping[str, Floats]:
        """Joint name -> position of its centre in the base frame, (n, 3) [length]."""
        if not isinstance(answers, LegAnswers):
            return self._joint_space.points(answers)
        centres = centres_at(self._model.mechanism, answers.rows.poses, answers.rows.actuators)
        return centres if centres is not None else self._joint_space.points(answers)

    def limit_multipliers(self, answers: Configurations, targets: Floats, way: ProjectionMode) -> Floats:
        """The multipliers of all limits at projected configurations, for targets (n, 4, 4); as of `closure.descend`."""
        if not isinstance(answers, LegAnswers) or answers.q_proximal is None:
            return self._joint_space.limit_multipliers(answers, targets, way)
        has_proximal = np.isfinite(answers.q_proximal).all(axis=1)
        by_legs, by_joints = np.flatnonzero(has_proximal), np.flatnonzero(~has_proximal)
        scale = 1.0 / self._model.length
        solutions = Starts(
            in_lengths(answers.rows.poses[by_legs], scale), answers.q_proximal[by_legs], answers.sides[by_legs]
        )
        weights = limit_multipliers(self._model, targets[by_legs], solutions, way)
        all_weights = np.empty((len(targets), weights.shape[1]))
        all_weights[by_legs] = weights
        if len(by_joints):
            all_weights[by_joints] = self._joint_space.limit_multipliers(answers.at(by_joints), targets[by_joints], way)
        return all_weights

    def forward(
        self, values: Floats, start: Configurations | None, tolerance: float, *, keep_mode: bool = True
    ) -> Configurations:
        """The configurations at actuated values (n, n_a), from one start or one for each."""
        start_sides, outputs = self._sides_of(start), None
        if len(values) == 1:
            rows, solution = outputs = self._single.new_rows(), self._single_forward.new_outputs()
            rows.actuators[:] = values
            if self._single_forward.assemble(self._forward_start(start, start_sides), rows, solution):
                return self._single_answer(rows, solution, start, start_sides)
        nearby = start is not None and keep_mode
        request = request_from(self._model, Options(), start, start_sides, keep_mode, nearby, tolerance)
        starts = self._forward_start(start, start_sides).record
        rows, q_proximal, sides = forward_kinematics(request, values, starts, outputs)
        projected = np.flatnonzero(rows.status == PROJECTED)
        if len(projected) and not keep_mode:  # seeds are few where one freedom goes all round
            begin = start if start is None or len(start) == 1 else start.at(projected)
            others = self._joint_space.forward(values[projected], begin, tolerance, keep_mode=False)
            rows.status[projected[others.rows.status == REACHED]] = PENDING
        unsolved, fallback = np.flatnonzero(rows.status == PENDING), None
        if len(unsolved) == len(values):
            return self._joint_space.forward(values, start, tolerance, keep_mode=keep_mode)
        if len(unsolved):
            block_start = start if start is None or len(start) == 1 else start.at(unsolved)
            fallback = self._joint_space.forward(values[unsolved], block_start, tolerance, keep_mode=keep_mode)
            put(rows, unsolved, fallback.rows)
        return self._answers(rows, sides, q_proximal, start, start_sides, unsolved, fallback)

    def nearest_forward(self, values: Floats, start: Configurations | None, tolerance: float) -> Configurations:
        """The feasible configurations whose actuators are nearest to values (n, n_a) that searches find."""
        start_sides = self._sides_of(start)
        request = request_from(self._model, Options(), start, start_sides, False, start is not None, tolerance)
        rows, q_proximal, sides = project_values(request, values)
        unsolved, fallback = np.flatnonzero(rows.status == PENDING), None
        if len(unsolved):
            begin = start if start is None or len(start) == 1 else start.at(unsolved)
            fallback = self._joint_space.nearest_forward(values[unsolved], begin, tolerance)
            put(rows, unsolved, fallback.rows)
        return self._answers(rows, sides, q_proximal, start, start_sides, unsolved, fallback)

    def prepared_forward(self, start: Configurations | None, rows: Rows) -> Prepared:
        """As `Engine.prepared_forward`; with the call, its start and its scratch memory."""
        start_handle = self._forward_start(start, self._sides_of(start))
        scratch = Handle(new_scratch(self._model))
        return self._single_forward.prepared(start_handle, scratch, rows, self._single_forward.new_outputs()), (
            start_handle,
            scratch,
        )

    def _forward_start(self, start: Configurations | None, sides: Floats) -> Handle[Starts]:
        if start is None:
            return self._single_forward.home
        return Handle(starts_at(self._model, start.rows.poses, sides))

    def _sides_of(self, start: Configurations | None) -> Floats:
        """The side of each leg at a start, (n or 1, legs)."""
        return self._table.home_sides if start is None else sides_at(self._model, start)

    def _single_answer(
        self, rows: Rows, solution: AssemblyOutputs, start: Configurations | None, start_sides: Floats
    ) -> LegAnswers:
        """One assembled row as an answer, from a start with the sides `start_sides`."""
        model, q = self._model, solution.q
        start_coordinates = start_coordinates_of(model, start, start_sides)
        platform = rows.poses, rows.actuators, solution.sides
        return LegAnswers(
            rows,
            lambda places: joint_coordinates(model, *platform, start_coordinates(slice(None)), q)[places],
            solution.sides,
            q,
        )

    def _reach_one(
        self, target: Floats, start: Configurations | None, sides: Floats, keep_mode: bool, rows: Rows
    ) -> bool:
        """Solve one target from home or from one earlier answer; True if legs reach it in the mode of the start."""
        start_pose = self._single.home if start is None else start.rows.poses
        if self._single.reach(target, start_pose, sides, rows, nearby=keep_mode):
            return False
        if start is not None:
            count_turns(self._model, start.rows.actuators, rows)
        return True
