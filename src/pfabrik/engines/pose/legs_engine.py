"""The engine of mechanisms whose chains are all legs in closed form."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...common.arrays import Floats, Mask
from ...common.batch import put, take
from ...kernels.handle import Handle
from ...kernels.pose.search_records import Starts
from ...kernels.rows import (
    FAILED,
    LIMIT_EXCESS,
    PENDING,
    POSITION_ERROR,
    PROJECTED,
    REACHED,
    RESIDUAL,
    ROTATION_ERROR,
    UNSURE,
    Rows,
)
from ...machine.model import Model
from ...machine.motion.outward import centres_at
from ...machine.poses import are_poses
from ...options import Options
from ...tolerances import TOLERANCES
from ..joints.attempts import Attempt
from ..joints.close import Closing, in_lengths
from ..joints.closure_engine import ClosureEngine
from ..joints.configurations import Configurations, new_rows, steps_of
from ..joints.engine_contract import Counted, Engine, Grower, LegsRead, Prepared
from ..joints.link_distances import too_near
from ..joints.parasitic import has_other_assemblies
from ..joints.projection import ProjectionMode, modes_of
from .answers import LegAnswers, leg_answers, sides_at
from .branch import answer_unreached, branch_of, home_answer, kept, poses_decide, same_branch, starts_beside
from .coordinates import joint_coordinates, known_columns
from .forward import forward_kinematics
from .leg_attempts import attempts
from .links_of_legs import keeps_links, links_of_legs
from .nearest import limit_multipliers, nearest_positions
from .nearest_pose import starts_at
from .reach import count_turns, reach, rest_redundant, turns_repeatedly
from .single import Answers, LegsAssembly, SingleTarget, assembly_of, mark_near, new_scratch, request_from
from .table import reading_scratch, reading_table

STEPS_FROM_NEAR = 60
"""Steps of a search from a configuration next to a target, which is reached in a few or not at all."""


def distances_of(model: Model, rows: Rows, options: Options) -> Floats:
    """Distances of projections from their targets, priced as options say, (n,) [L]."""
    closure = model.path_closure
    errors = rows.measures[:, POSITION_ERROR], rows.measures[:, ROTATION_ERROR]
    return modes_of(closure, options)[-1].distances(closure, *errors)


class LegsEngine(Engine):
    """Inverse and forward kinematics by the legs' closed forms, with a solver in joint coordinates as fallback.

    Targets are solved in closed form in the working mode of the start; what the task leaves open of a pose follows from
    the legs' constraints. Targets not reached so are tried in other working modes, then answered by the nearest
    feasible pose, a search in the platform's pose. What is unsolved then, mostly near dead points, is solved in joint
    coordinates.
    """

    def __init__(self, model: Model) -> None:
        self.model, self._table = model, model.legs
        self._joint_space, self._single = ClosureEngine(model), SingleTarget(model)
        self.is_fast, self._keeps_apart = self.searches, len(links_of_legs(model).pairs) > 0

    @cached_property
    def _assembly(self) -> LegsAssembly:
        return assembly_of(self.model)

    @cached_property
    def searches(self) -> bool:
        """True if unreached targets are searched for in the platform's pose, before joint coordinates."""
        return not has_other_assemblies(self.model.path_closure)

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
        answers = self.by_stages(targets, start, options, keep_mode, nearby)
        if options.most_steps or not keep_mode or not self._table.has_sides:
            return answers
        status = answers.rows.status
        is_missed = status[0] != REACHED if len(status) == 1 else (status != REACHED).any()
        if isinstance(answers, LegAnswers) and answers.q_proximal is None and not is_missed:
            return answers
        answers = self._in_mode(answers, targets, start, options)
        for is_folded, begin in starts_beside(self.model, start):
            others = self.by_stages(targets, begin, options, keep_mode, nearby)
            others = self._in_mode(others, targets, begin, options)
            better = np.flatnonzero(is_folded & self._is_nearer(others.rows, answers.rows, options))
            if len(better):
                answers = answers.with_rows(better, others.at(better))
        return answers

    def _in_mode(
        self, answers: Configurations, targets: Floats, start: Configurations | None, options: Options
    ) -> Configurations:
        """As `keep.kept`."""
        if isinstance(answers, LegAnswers) and (answers.sides * self._sides_of(start) >= 0.0).all():
            return answers

        def answer(target: Floats, begin: Configurations) -> Configurations:
            return self.by_stages(target, begin, options, True, True)

        return kept(self.model, answers, targets, home_answer(self.model) if start is None else start, answer)

    def by_stages(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        keep_mode: bool,
        nearby: bool,
        *,
        continues: bool = True,
    ) -> Configurations:
        """Answer targets by closed forms; then what these leave, in other modes, by searches, in joint coordinates.

        As `answer`, from a start on a fold in one of the modes that meet there.

        Parameters
        ----------
        continues : implicit joints are led to far targets in small steps.
        """
        model, start_sides = self.model, self._sides_of(start)
        is_one = len(targets) == 1 and (start is None or (isinstance(start, LegAnswers) and len(start) == 1))
        rows, sides = self._single.new_rows() if is_one else new_rows(model, len(targets)), start_sides
        if is_one:
            sides = start_sides.copy() if self._table.has_implicit_joints else start_sides
        n_unsolved = 0
        if not (is_one and self._reach_one(targets, start, sides, keep_mode, rows)):
            n_unsolved, sides = reach(
                model, targets, start, start_sides, keep_mode, rows, is_tried=is_one, continues=continues
            )
        if self._keeps_apart:
            n_unsolved += mark_near(model, rows, sides)
        if not n_unsolved:
            return leg_answers(model, rows, sides, None, start, start_sides)
        unsolved, q = np.flatnonzero(rows.status != REACHED), None
        sides = np.repeat(sides, len(targets), axis=0) if len(sides) < len(targets) else sides.copy()
        if self.searches:
            q = np.full_like(sides, np.nan)
            request = request_from(model, options, start, start_sides, keep_mode, nearby)
            answer_unreached(request, targets, Answers(rows, q, sides), unsolved)
        else:
            rows.status[unsolved] = PENDING

        def by_joints(rows: NDArray[np.intp], begin: Configurations | None) -> Configurations:
            return self._joint_space.answer(targets[rows], begin, options, keep_mode=keep_mode)

        return self.rested(self._completed(rows, sides, q, start, by_joints, options), start)

    def _completed(
        self,
        rows: Rows,
        sides: Floats,
        q: Floats | None,
        start: Configurations | None,
        by_joints: Callable[[NDArray[np.intp], Configurations | None], Configurations],
        options: Options,
    ) -> Configurations:
        """Rows of legs as answers; those that are PENDING, UNSURE or INVALID by joints.

        An UNSURE projection stays where these neither reach its target nor come nearer.
        """
        unsolved, start_sides = np.flatnonzero(rows.status > PROJECTED), self._sides_of(start)
        if not len(unsolved):
            return leg_answers(self.model, rows, sides, q, start, start_sides)
        begin = start if start is None or len(start) in (1, len(unsolved)) else start.at(unsolved)
        fallback = by_joints(unsolved, begin)
        left = take(rows, unsolved)
        is_kept = (left.status == UNSURE) & ~self._is_nearer(fallback.rows, left, options)
        rows.status[unsolved[is_kept]] = PROJECTED
        by_legs = leg_answers(self.model, rows, sides, q, start, start_sides)
        if is_kept.any():
            unsolved, fallback = unsolved[~is_kept], fallback.at(np.flatnonzero(~is_kept))
        if not len(unsolved) or len(unsolved) == len(rows.status):
            return fallback if len(unsolved) else by_legs
        put(rows, unsolved, fallback.rows)  # no pose is left unset, for coordinates that are computed for all rows
        sides = sides_at(self.model, fallback)
        return by_legs.with_rows(unsolved, LegAnswers(fallback.rows, fallback.coordinates, sides))

    def rested(self, answers: Configurations, start: Configurations | None) -> Configurations:
        """As `Engine.rested`: projections leave redundant joints where they have pulled them."""
        projected = (answers.rows.status == PROJECTED).nonzero()[0]
        if not (self._table.has_free_redundant and len(projected)):
            return answers
        start = start if start is None or len(start) == 1 else start.at(projected)
        rows, old = take(answers.rows, projected), answers.at(projected)
        old_sides = self._sides_of(old)
        sides = old_sides.copy()
        nearer = rest_redundant(self.model, start, self._sides_of(start), sides, rows).nonzero()[0]
        others = leg_answers(self.model, rows, sides, None, old, old_sides)
        return answers.with_rows(projected[nearer], others.at(nearer)) if len(nearer) else answers

    def attempts(
        self, target: Floats, start: Configurations | None, options: Options, *, keep_mode: bool
    ) -> Iterator[Attempt]:
        """As `InverseEngine.attempts`: of the legs, then of the joint coordinates, which answer what legs leave."""
        last = None
        if self.searches:
            for last in attempts(self.model, target, start, self._sides_of(start), options, keep_mode=keep_mode):
                yield last
        if last is None or last.ending != "reached":
            yield from self._joint_space.attempts(target, start, options, keep_mode=keep_mode)

    def _is_nearer(self, others: Rows, rows: Rows, options: Options) -> Mask:
        """True where others reach targets that rows do not, or come nearer, (n,)."""
        distances, other_distances = (distances_of(self.model, batch, options) for batch in (rows, others))
        is_nearer = (others.status == PROJECTED) & (other_distances < distances - TOLERANCES.position)
        return np.asarray((rows.status != REACHED) & ((others.status == REACHED) | is_nearer))

    def prepared(self, target: Floats, start: Configurations | None, rows: Rows, *, keep_mode: bool) -> Prepared | None:
        """As `Engine.prepared`; None if actuators may turn more than once, and are counted from a start."""
        if start is not None and turns_repeatedly(self._table):
            return None
        single, start_pose = self._single, self._single.home if start is None else start.rows.poses
        sides = single.home_sides if start is None else sides_at(self.model, start)
        call = single.prepared(target, start_pose, sides, rows, nearby=keep_mode)
        if not self._keeps_apart:
            return call, single
        return lambda: call() or mark_near(self.model, rows, sides), single

    def read_legs(self, start: Configurations | None) -> LegsRead | None:
        """As `Engine.read_legs`; None with redundant joints, whose coordinates follow from poses as sides do."""
        table = self._table
        if table.has_implicit_joints or len(table.redundant):
            return None
        sides = np.require(self._sides_of(start)[0], float).copy()
        return LegsRead(reading_table(table), reading_scratch(table), sides, known_columns(table))

    def follow(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        on_progress: Callable[[int, int], None] | None,
    ) -> Configurations:
        """Solve a path (n, 4, 4) in one working mode, each target from the answer before it."""
        if not self.searches:
            return self._joint_space.follow(targets, start, options, on_progress)
        targets, is_pose = np.require(targets, requirements=["C", "W"]), are_poses(targets)
        answers: list[Configurations] = []
        for i in steps_of(is_pose, on_progress):
            previous = answers[-1] if answers else start
            answers.append(self.answer(targets[i : i + 1], previous, options, keep_mode=True, nearby=True))
        return self._joined(answers, start).scatter(is_pose)

    def _joined(self, answers: Sequence[Configurations], start: Configurations | None) -> Configurations:
        """Single answers as one batch; the first of them began at `start`."""
        rows, n_legs = new_rows(self.model, len(answers)), len(self._table.legs)
        sides, q_proximal = (
            np.repeat(self._table.home_sides, len(answers), axis=0),
            np.full((len(answers), n_legs), np.nan),
        )
        for i, answer in enumerate(answers):
            put(rows, slice(i, i + 1), answer.rows)
            if isinstance(answer, LegAnswers):
                sides[i] = answer.sides
                if answer.q_proximal is not None:
                    q_proximal[i] = answer.q_proximal
        joined = leg_answers(self.model, rows, sides, q_proximal, start, self._sides_of(start))
        by_joints = np.array([i for i, answer in enumerate(answers) if not isinstance(answer, LegAnswers)], np.intp)
        if not len(by_joints):
            return joined
        fallback = take(rows, by_joints), np.concatenate([answers[i].coordinates for i in by_joints])
        return joined.with_rows(by_joints, LegAnswers(*fallback, sides[by_joints]))

    def advance(self, targets: Floats, start: Configurations) -> Configurations:
        """Continue to targets (n, 4, 4), each from its own start and in its working mode; PENDING where not reached.

        Use the legs' closed forms where the start is non-singular and the pose fixes every coordinate; otherwise solve
        in joint space.
        """
        model, table, start_sides = self.model, self._table, sides_at(self.model, start)
        rows, at_start = (new_rows(model, len(targets)) for _ in range(2))
        coordinates = start.coordinates.copy()
        _, sides = reach(self.model, targets, start, start_sides, True, rows)
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
            reach(self.model, start.rows.poses, start, start_sides, True, at_start)
            is_decided = (at_start.status == REACHED) & ~np.bool_(table.leaves_open)
            unsolved = np.flatnonzero((rows.status != REACHED) & ~is_decided)
            fallback = self._joint_space.advance(targets[unsolved], start.at(unsolved))
            put(rows, unsolved, fallback.rows)
            coordinates[unsolved] = fallback.coordinates
        answers = Configurations(rows, coordinates)
        rows.status[too_near(self, model.mechanism, answers)] = FAILED
        return answers

    def grower(self, counted: Counted) -> Grower | None:
        """Itself where positions alone count, if one assembly has all targets and searches keep links apart.

        Where whole poses do, but leave something to search for: by answers from one configuration to the next.
        """
        if counted == "orientation":
            return None if poses_decide(self.model) else GrownAnswers(self)
        return self if self.searches and keeps_links(self.model) else None

    def known(self, start: Configurations | None) -> Starts:
        """As `Grower.known`: by poses and sides."""
        poses = self.model.mechanism.home_pose[None] if start is None else start.rows.poses
        return starts_at(self.model, poses, self._sides_of(start))

    def grow(self, known: Starts, targets: Floats, *, anew: bool, keep_mode: bool) -> Configurations:
        """As `Grower.grow`, for the positions of targets: the orientation follows."""
        model, length = self.model, self.model.length
        found = nearest_positions(model, targets, known, seeds=anew, keep_mode=keep_mode)
        rows = Rows(found.status, found.counters, found.poses, found.actuators, found.measures)
        is_closed = rows.measures[:, RESIDUAL] <= TOLERANCES.position * length
        is_feasible = is_closed & (rows.measures[:, LIMIT_EXCESS] <= TOLERANCES.limit) & (found.distances < np.inf)
        rows.status[:] = np.where(is_feasible, np.where(found.status == REACHED, REACHED, PROJECTED), FAILED)
        rows.measures[:, POSITION_ERROR] = found.distances * length
        answers = leg_answers(model, rows, found.sides, found.q, None, found.sides)
        rows.status[too_near(self, model.mechanism, answers)] = FAILED
        return answers

    def as_configurations(self, closing: Closing) -> Configurations:
        """Configurations found in joint coordinates, as answers whose status is not set yet."""
        return self._joint_space.as_configurations(closing)

    def points(self, answers: Configurations) -> Mapping[str, Floats]:
        """Joint name -> position of its centre in the base frame, (n, 3) [length]."""
        if not isinstance(answers, LegAnswers):
            return self._joint_space.points(answers)
        centres = centres_at(self.model.mechanism, answers.rows.poses, answers.rows.actuators)
        return centres if centres is not None else self._joint_space.points(answers)

    def limit_multipliers(self, answers: Configurations, targets: Floats, way: ProjectionMode) -> Floats:
        """The multipliers of all limits at projected configurations, for targets (n, 4, 4); as of `joints.descend`."""
        if not isinstance(answers, LegAnswers) or answers.q_proximal is None:
            return self._joint_space.limit_multipliers(answers, targets, way)
        has_proximal = np.isfinite(answers.q_proximal).all(axis=1)
        by_legs, by_joints = np.flatnonzero(has_proximal), np.flatnonzero(~has_proximal)
        scale = 1.0 / self.model.length
        solutions = Starts(
            in_lengths(answers.rows.poses[by_legs], scale), answers.q_proximal[by_legs], answers.sides[by_legs]
        )
        weights = limit_multipliers(self.model, targets[by_legs], solutions, way)
        if not len(by_joints):
            return weights
        others = self._joint_space.limit_multipliers(answers.at(by_joints), targets[by_joints], way)
        all_weights = np.zeros((len(targets), others.shape[1]))  # only the joints' may have columns for links
        all_weights[by_legs, : weights.shape[1]], all_weights[by_joints] = weights, others
        return all_weights

    def forward(
        self, values: Floats, start: Configurations | None, tolerance: float, *, keep_mode: bool = True
    ) -> Configurations:
        """The configurations at actuated values (n, n_a), from one start or one for each."""
        start_sides, given = self._sides_of(start), None
        if len(values) == 1:
            rows = self._single.new_rows()
            rows.actuators[:] = values
            ends = self._assembly.new_ends(rows)
            own = self._forward_start(start, start_sides)
            is_solved = self._assembly.prepared(own, rows, ends, self._assembly.scratch)() == 0
            if is_solved and not (self._keeps_apart and mark_near(self.model, rows, ends.sides)):
                return leg_answers(self.model, rows, ends.sides, ends.q, start, start_sides)
            given = rows, ends
        nearby = start is not None and keep_mode
        request = request_from(self.model, Options(), start, start_sides, keep_mode, nearby, tolerance)
        starts = self._forward_start(start, start_sides).record
        rows, q_proximal, sides = forward_kinematics(request, values, starts, given)
        projected = np.flatnonzero(rows.status == PROJECTED)
        if len(projected) and not keep_mode:  # seeds are few where one freedom goes all round
            begin = start if start is None or len(start) == 1 else start.at(projected)
            others = self._joint_space.forward(values[projected], begin, tolerance, keep_mode=False)
            rows.status[projected[others.rows.status == REACHED]] = PENDING

        def by_joints(rows: NDArray[np.intp], begin: Configurations | None) -> Configurations:
            return self._joint_space.forward(values[rows], begin, tolerance, keep_mode=keep_mode)

        return self._completed(rows, sides, q_proximal, start, by_joints, request.options)

    def prepared_forward(self, start: Configurations | None, rows: Rows) -> Prepared | None:
        """As `Engine.prepared_forward`; with the call, its start and its scratch memory; None with a clearance."""
        if self.model.mechanism.clearance is not None:
            return None
        start_handle = self._forward_start(start, self._sides_of(start))
        scratch = Handle(new_scratch(self.model))
        call = self._assembly.prepared(start_handle, rows, self._assembly.new_ends(rows), scratch)
        return call, (start_handle, scratch)

    def _forward_start(self, start: Configurations | None, sides: Floats) -> Handle[Starts]:
        if start is None:
            return self._assembly.home
        return Handle(starts_at(self.model, start.rows.poses, sides))

    def _sides_of(self, start: Configurations | None) -> Floats:
        """The side of each leg at a start, (n or 1, legs)."""
        return self._table.home_sides if start is None else sides_at(self.model, start)

    def _reach_one(
        self, target: Floats, start: Configurations | None, sides: Floats, keep_mode: bool, rows: Rows
    ) -> bool:
        """Solve one target from home or from one earlier answer; True if legs reach it in the mode of the start."""
        start_pose = self._single.home if start is None else start.rows.poses
        if self._single.reach(target, start_pose, sides, rows, nearby=keep_mode):
            return False
        if start is not None:
            count_turns(self.model, start.rows.actuators, rows)
        return True


class GrownAnswers(NamedTuple):
    """Grows answers to whole poses that the legs alone do not decide: from near starts in few steps, anew in full."""

    engine: LegsEngine

    def known(self, start: Configurations | None) -> Starts:
        """As `Grower.known`."""
        return self.engine.known(start)

    def grow(self, known: Starts, targets: Floats, *, anew: bool, keep_mode: bool) -> Configurations:
        """As `Grower.grow`; the distance to a projection is that of its pose, turns included."""
        model = self.engine.model
        rows = new_rows(model, len(known.poses))
        rows.poses[:] = in_lengths(known.poses, model.length)
        start = leg_answers(model, rows, known.sides, None, None, known.sides)
        options = Options(hold=None, most_steps=None if anew else STEPS_FROM_NEAR)
        if anew:
            answers = self.engine.answer(targets, start, options, keep_mode=keep_mode)
        else:
            answers = self.engine.by_stages(targets, start, options, keep_mode, True, continues=False)
        status, measures = answers.rows.status, answers.rows.measures
        if keep_mode and not anew:
            there, here = branch_of(model, answers.rows.poses, sides_at(model, answers)), rows.poses
            status[~same_branch(there, branch_of(model, here, known.sides))] = FAILED
        missed = status == PROJECTED
        measures[missed, POSITION_ERROR] = model.length * distances_of(model, answers.rows, options)[missed]
        return answers


class LegsApartByJoints(LegsEngine):
    """The engine of legs with links whose places poses do not tell: searches in joint coordinates keep them apart."""

    def answer(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        *,
        keep_mode: bool,
        nearby: bool = False,
    ) -> Configurations:
        """As `LegsEngine.answer`."""
        answers = super().answer(targets, start, options, keep_mode=keep_mode, nearby=nearby)
        near = too_near(self, self.model.mechanism, answers)
        return self._joint_space.apart(near, answers, targets, start, options, keep_mode=keep_mode or nearby)

    def forward(
        self, values: Floats, start: Configurations | None, tolerance: float, *, keep_mode: bool = True
    ) -> Configurations:
        """As `Engine.forward`."""
        answers = super().forward(values, start, tolerance, keep_mode=keep_mode)
        near = too_near(self, self.model.mechanism, answers)
        return self._joint_space.forward_apart(near, answers, values, start, tolerance)

    def prepared(self, target: Floats, start: Configurations | None, rows: Rows, *, keep_mode: bool) -> Prepared | None:
        """As `Engine.prepared`: none."""
        return None
