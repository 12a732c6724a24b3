"""Inverse kinematics of mechanisms whose every chain is a leg in closed form, in front of the engine for all others."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Mask
from ..closure.close import Closing, in_lengths
from ..closure.configurations import Configurations, new_rows, put_rows, rows_at, steps_of
from ..closure.parasitic import has_other_assemblies
from ..closure.projection import ProjectionMode
from ..closure.solve import ClosureEngine
from ..decomposition.leg_table import LegTable
from ..description.mechanism import Mechanism
from ..description.task import task_of
from ..kernels.handle import Handle
from ..kernels.platform.records import Starts
from ..kernels.rows import OPEN, PENDING, POSITION_ERROR, PROJECTED, REACHED, ROTATION_ERROR, UNSURE, Rows
from ..kernels.threads import in_blocks
from ..motion.outward import centres_at
from ..options import Options
from ..poses import are_poses
from ..tolerances import TOLERANCES
from .answers import LegAnswers, begins_of, coordinates_of, sides_at
from .coordinates import settled
from .forward import assembled
from .nearest import limit_multipliers, move_redundant
from .nearest_pose import starts_at
from .one import Ends, OneAssembly, OneTarget, new_scratch
from .table import Machine, local_table, machine, resting_at_home
from .unreached import Question, Unreached, answer_unreached

ROWS_A_BLOCK, ROWS_A_RUN = 1024, 4096
"""Rows of one call of a kernel that answers one by one, or in blocks."""


class LegsEngine:
    """Answers that legs in closed form reach in the working mode they start in; another engine gives all the others.

    The constraints that legs leave on the pose complete what the task leaves open. What they do not reach is answered
    in other working modes, then by the nearest feasible pose, by searches in the platform's pose; and what these leave,
    near dead points above all, as if there were no closed forms.
    """

    def __init__(self, mechanism: Mechanism, table: LegTable) -> None:
        self.mechanism, self._table = mechanism, table
        self._inner, self._one = ClosureEngine(mechanism), OneTarget(mechanism, table)
        self._one_forward = OneAssembly(self.mechanism, table)
        driven = table.driven
        self._turning = driven[(driven["turns"] == 1) & (driven["hi"] - driven["lo"] > 2.0 * np.pi)]

    @cached_property
    def _searches(self) -> bool:
        """Whether targets that legs do not reach are looked for in the platform's pose."""
        return not has_other_assemblies(self.mechanism)

    def answer(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        *,
        keep_mode: bool,
        nearby: bool = False,
    ) -> Configurations:
        """Answer targets (n, 4, 4), each for itself, from one configuration or one for each; INVALID where no pose.

        Projections are the nearest found in the working mode, if that is kept, or `nearby` those next to the start.
        """
        is_one = len(targets) == 1 and (start is None or (isinstance(start, LegAnswers) and len(start) == 1))
        first = self._sides_of(start)
        rows = self._one.new_rows() if is_one else new_rows(self.mechanism, len(targets))
        ends = first.copy() if self._table.has_implicit_joints else first
        if is_one and self._reach_one(targets, start, ends, keep_mode, rows):
            mechanism, table = self.mechanism, self._table
            begins, told = begins_of(mechanism, table, start, first), (rows.poses, rows.actuators, ends)
            return LegAnswers(rows, lambda own: settled(mechanism, table, *told, begins(slice(None)))[own], ends)
        left, sides = self._reach(targets, start, first, keep_mode, rows, tried=is_one)
        q_proximal, others = None, None
        if left and self._searches:
            sides = np.repeat(sides, len(targets), axis=0) if len(sides) < len(targets) else sides.copy()
            q_proximal = np.empty_like(sides)
            q_proximal[:] = np.nan
            poses = self._one.home if start is None else start.rows.poses
            question = Question(self.mechanism, self._table, options, keep_mode, nearby)
            unreached = Unreached(targets, poses, sides, q_proximal, rows)
            away = rows.status != REACHED
            if start is not None and self._table.has_sides:
                away &= ~self._starts_there(targets, start.rows.poses)
            unreached.answer(away, partial(answer_unreached, question))
            if start is not None:
                self._count_turns(start.rows.actuators, rows)
        waits = (rows.status == PENDING) | (rows.status == UNSURE) if q_proximal is not None else rows.status != REACHED
        rest = waits.nonzero()[0]
        if len(rest):
            begin = start if start is None or len(start) == 1 or len(rest) == len(start) else start.at(rest)
            others = self._inner.answer(targets[rest], begin, options, keep_mode=keep_mode)
            stays = self._stay(rows_at(rows, rest), others.rows, options)
            rows.status[rest[stays]] = PROJECTED
            rest, others = rest[~stays], others if not stays.any() else others.at(np.flatnonzero(~stays))
            if len(rest) == len(targets):
                return others
            put_rows(rows, rest, others.rows)
            sides = np.repeat(sides, len(targets), axis=0) if len(sides) < len(targets) else sides
            sides[rest] = sides_at(self.mechanism, self._table, others)
            if q_proximal is not None:
                q_proximal[rest] = np.nan
        return self._answers(rows, sides, q_proximal, start, first, rest, others)

    def _stay(self, rows: Rows, others: Rows, options: Options) -> Mask:
        """Which projections that are UNSURE stay: others of their targets are not reached, and no nearer."""
        lever = options.rotation_length or self.mechanism.rotation_length
        away, off = (
            np.hypot(each.measures[:, POSITION_ERROR], lever * each.measures[:, ROTATION_ERROR])
            for each in (rows, others)
        )
        nearer = (others.status == PROJECTED) & (
            off < away - TOLERANCES.position * self.mechanism.characteristic_length
        )
        better = (others.status == REACHED) | (nearer & (others.holds >= rows.holds))
        return np.asarray((rows.status == UNSURE) & ~better)

    def prepared(
        self, target: Floats, start: Configurations | None, rows: Rows, *, keep_mode: bool
    ) -> Callable[[], int] | None:
        """A call that answers what stands in `target`, (1, 4, 4), into `rows`; it returns 0 where legs reach it.

        None where the turns of its actuators are counted from a start.
        """
        if start is not None and len(self._turning):
            return None
        one, begin = self._one, self._one.home if start is None else start.rows.poses
        sides = one.home_sides if start is None else sides_at(self.mechanism, self._table, start)
        return one.prepared(target, begin, sides, rows, nearby=keep_mode)

    def follow(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        on_progress: Callable[[int, int], None] | None,
    ) -> Configurations:
        """Answer a path (n, 4, 4), each target from the answer before it, in its working mode."""
        if not self._searches:
            return self._inner.follow(targets, start, options, on_progress)
        targets, known = np.require(targets, requirements=["C", "W"]), are_poses(targets)
        found: list[Configurations] = []
        for i in steps_of(known, on_progress):
            before = found[-1] if found else start
            found.append(self.answer(targets[i : i + 1], before, options, keep_mode=True, nearby=True))
        return self._joined(found, start).scatter(known)

    def _joined(self, found: Sequence[Configurations], start: Configurations | None) -> Configurations:
        """Single answers as a batch; `start` is where the first began."""
        rows, legs = new_rows(self.mechanism, len(found)), len(self._table.legs)
        sides, q_proximal = np.repeat(self._table.home_sides, len(found), axis=0), np.full((len(found), legs), np.nan)
        rest = np.array([i for i, each in enumerate(found) if not isinstance(each, LegAnswers)], dtype=np.intp)
        for i, each in enumerate(found):
            own = slice(i, i + 1)
            put_rows(rows, own, each.rows)
            if isinstance(each, LegAnswers):
                sides[i] = each.sides
                if each.q_proximal is not None:
                    q_proximal[i] = each.q_proximal
        others = None
        if len(rest):
            others = Configurations(rows_at(rows, rest), np.concatenate([found[i].coordinates for i in rest]))
        return self._answers(rows, sides, q_proximal, start, self._sides_of(start), rest, others)

    def _answers(
        self,
        rows: Rows,
        sides: Floats,
        q_proximal: Floats | None,
        start: Configurations | None,
        first: Floats,
        rest: NDArray[np.intp],
        others: Configurations | None,
    ) -> LegAnswers:
        """Rows as answers, from a start on sides `first`; those at `rest` are the other engine's."""
        begins = begins_of(self.mechanism, self._table, start, first)
        coordinates = partial(
            coordinates_of, self.mechanism, self._table, rows, sides, q_proximal, begins, rest, others
        )
        return LegAnswers(rows, coordinates, sides, q_proximal)

    def advance(self, targets: Floats, start: Configurations) -> Configurations:
        """Go on to targets (n, 4, 4) in the working mode of as many configurations; PENDING where not reached.

        Where legs can be as they are at the start, and leave nothing open that could give way to a limit, they decide;
        joint coordinates do elsewhere.
        """
        mechanism, table, first = self.mechanism, self._table, sides_at(self.mechanism, self._table, start)
        rows, present = (new_rows(mechanism, len(targets)) for _ in range(2))
        coordinates = start.coordinates.copy()
        _, sides = self._reach(targets, start, first, True, rows)
        own = np.flatnonzero(rows.status == REACHED)
        ends = settled(mechanism, table, rows.poses[own], rows.actuators[own], sides[own], coordinates[own])
        angles = table.limited["column"][table.limited["turns"] == 1]
        turned = (np.abs(ends - coordinates[own])[:, angles] > np.pi).any(axis=1)
        rows.status[own[turned]] = PENDING  # reached a turn away, from the other end of a range
        own, ends = own[~turned], ends[~turned]
        coordinates[own] = ends
        if len(own) < len(targets):
            self._reach(start.rows.poses, start, first, True, present)
            decided = (present.status == REACHED) & ~np.bool_(table.leaves_open)
            rest = np.flatnonzero((rows.status != REACHED) & ~decided)
            others = self._inner.advance(targets[rest], start.at(rest))
            put_rows(rows, rest, others.rows)
            coordinates[rest] = others.coordinates
        return Configurations(rows, coordinates)

    def as_configurations(self, closing: Closing) -> Configurations:
        """Configurations found on joint coordinates, as answers whose status is still to be told."""
        return self._inner.as_configurations(closing)

    def points(self, found: Configurations) -> Mapping[str, Floats]:
        """Joint name -> position of its centre in the base frame, (n, 3) [length]."""
        if not isinstance(found, LegAnswers):
            return self._inner.points(found)
        placed = centres_at(self.mechanism, found.rows.poses, found.rows.actuators)
        return placed if placed is not None else self._inner.points(found)

    def limit_multipliers(self, found: Configurations, targets: Floats, way: ProjectionMode) -> Floats:
        """How hard every limit holds projected configurations back from targets (n, 4, 4): see `closure.descend`."""
        if not isinstance(found, LegAnswers) or found.q_proximal is None:
            return self._inner.limit_multipliers(found, targets, way)
        own = np.isfinite(found.q_proximal).all(axis=1)
        mine, others = np.flatnonzero(own), np.flatnonzero(~own)
        scale = 1.0 / self.mechanism.characteristic_length
        present = Starts(in_lengths(found.rows.poses[mine], scale), found.q_proximal[mine], found.sides[mine])
        weights = limit_multipliers(self.mechanism, self._table, targets[mine], present, way)
        every = np.empty((len(targets), weights.shape[1]))
        every[mine] = weights
        if len(others):
            every[others] = self._inner.limit_multipliers(found.at(others), targets[others], way)
        return every

    def forward(self, values: Floats, start: Configurations | None, tolerance: float) -> Configurations:
        """The configurations that have actuated values (n, n_a), from one configuration or one for each."""
        first, tried = self._sides_of(start), None
        if len(values) == 1:
            rows, ends = tried = self._one.new_rows(), self._one_forward.new_ends()
            rows.actuators[:] = values
            if self._one_forward.assemble(self._forward_start(start, first), rows, ends):
                return self._answer_one(rows, ends, start, first)
        rows, q_proximal, sides = assembled(self.mechanism, self._table, values, start, first, tolerance, tried)
        rest, others = np.flatnonzero(rows.status == PENDING), None
        if len(rest) == len(values):
            return self._inner.forward(values, start, tolerance)
        if len(rest):
            begin = start if start is None or len(start) == 1 else start.at(rest)
            others = self._inner.forward(values[rest], begin, tolerance)
            put_rows(rows, rest, others.rows)
        return self._answers(rows, sides, q_proximal, start, first, rest, others)

    def prepared_forward(self, start: Configurations | None, rows: Rows) -> tuple[Callable[[], int], object]:
        """A call that answers `rows.actuators` into the rest of one row, and what is to be kept for it: where it starts
        and its own scratch memory. It returns 0 where they assemble."""
        own = self._forward_start(start, self._sides_of(start))
        scratch = Handle(new_scratch(self.mechanism, self._table))
        return self._one_forward.prepared(own, scratch, rows, self._one_forward.new_ends()), (own, scratch)

    def _forward_start(self, start: Configurations | None, sides: Floats) -> Handle[Starts]:
        if start is None:
            return self._one_forward.home
        return Handle(starts_at(self.mechanism, self._table, start.rows.poses, sides))

    def _starts_there(self, targets: Floats, poses: Floats) -> Mask:
        """Whether rows start on their targets (n, 4, 4), from as many poses or one: joint coordinates reach these where
        legs, at dead points, do not tell."""
        task, poses = task_of(self.mechanism), np.broadcast_to(poses, targets.shape)
        off = np.where(task.axes, (targets - poses)[:, :3, 3], 0.0)
        there = np.asarray(np.abs(off).max(axis=1) <= TOLERANCES.position * self.mechanism.characteristic_length)
        if np.count_nonzero(there):
            _, turned = task.errors(poses[there], targets[there])
            there[there] = turned <= TOLERANCES.rotation
        return there

    def _sides_of(self, start: Configurations | None) -> Floats:
        """Which of its two solutions each leg takes at a start, (n or 1, legs)."""
        return self._table.home_sides if start is None else sides_at(self.mechanism, self._table, start)

    def _answer_one(self, rows: Rows, ends: Ends, start: Configurations | None, first: Floats) -> LegAnswers:
        """One row that assembles as an answer, from a start on sides `first`."""
        mechanism, table, q = self.mechanism, self._table, ends.q
        begins, told = begins_of(mechanism, table, start, first), (rows.poses, rows.actuators, ends.sides)
        return LegAnswers(
            rows, lambda own: settled(mechanism, table, *told, begins(slice(None)), q)[own], ends.sides, q
        )

    def _reach_one(
        self, target: Floats, start: Configurations | None, sides: Floats, keep_mode: bool, rows: Rows
    ) -> bool:
        """Answer one target from home or from one answer before; whether legs reach it as they are."""
        begin = self._one.home if start is None else start.rows.poses
        if self._one.reach(target, begin, sides, rows, nearby=keep_mode):
            return False
        if start is not None:
            self._count_turns(start.rows.actuators, rows)
        return True

    def _reach(
        self,
        targets: Floats,
        start: Configurations | None,
        sides: Floats,
        keep_mode: bool,
        rows: Rows,
        *,
        tried: bool = False,
    ) -> tuple[int, Floats]:
        """Answer the rows that legs reach; how many they do not, and the sides of answers with arms where they are.

        One row that was `tried` has a status already.
        """
        begins = self.mechanism.home_pose[None] if start is None else start.rows.poses
        asked = local_table(self._table) if keep_mode else machine(self._table)
        if self._table.has_implicit_joints:
            sides = np.repeat(sides, len(targets), axis=0) if len(sides) == 1 else sides.copy()
        left = 1 if tried else self._reach_as_they_are(start is None, asked, targets, begins, sides, rows)
        if left and self._table.is_for_blocks and self._table.task["unset"][0]:
            left -= self._complete(asked, targets, begins, sides, rows)
        if left and self._table.has_free_redundant:
            sides = np.repeat(sides, len(targets), axis=0) if len(sides) == 1 else sides.copy()
            left -= self._reach_by_redundant(asked, targets, begins, sides, rows)
            if left and start is not None and not keep_mode:
                left -= self._reach_from_home(asked, targets, sides, rows)
        if start is not None:
            self._count_turns(start.rows.actuators, rows)
        return left, sides

    def _reach_as_they_are(
        self, from_home: bool, asked: Machine, targets: Floats, begins: Floats, sides: Floats, rows: Rows
    ) -> int:
        """Answer the rows that legs reach with arms that are not led where they are; how many they do not."""
        resting = resting_at_home(self._table) if from_home else None
        if resting is None:
            return self._run(self._table.is_for_blocks, asked, targets, begins, sides, rows)
        rows.actuators[:] = resting.actuators
        return self._run(True, machine(resting.table), targets, begins, resting.table.home_sides, rows)

    def _reach_by_redundant(self, asked: Machine, targets: Floats, begins: Floats, sides: Floats, rows: Rows) -> int:
        """Answer rows whose legs reach once arms have moved, and note where; how many these are."""
        before, rest = sides.copy(), np.flatnonzero(rows.status != REACHED)
        some, poses = move_redundant(self.mechanism, self._table, targets, begins, sides, rest)
        if not len(some):
            return 0
        own, begins = rows_at(rows, some), poses
        left = self._run(False, asked, targets[some], begins, sides[some], own)
        put_rows(rows, some, own)
        lost = some[own.status != REACHED]
        sides[lost] = before[lost]
        return len(some) - left

    def _reach_from_home(self, asked: Machine, targets: Floats, sides: Floats, rows: Rows) -> int:
        """The same, with arms that start at home: from where they are, limits may be in the way."""
        away, home, redundant = rows.status != REACHED, sides.copy(), self._table.implicit_joints["leg"]
        home[:, redundant] = self._table.home_sides[:, redundant]
        n = self._reach_by_redundant(asked, targets, self._one.home, home, rows)
        found = away & (rows.status == REACHED)
        sides[found] = home[found]
        return n

    def _run(self, by_blocks: bool, asked: Machine, targets: Floats, begins: Floats, sides: Floats, rows: Rows) -> int:
        """Answer targets on all cores, in blocks of poses or one by one; how many are not reached."""
        if by_blocks:
            from ..kernels.legs.blocks import answer_blocks as answer
        else:
            from ..kernels.legs.answer import answer

        def run(block: slice) -> int:
            return answer(
                asked.address,
                targets[block],
                _part(begins, block),
                _part(sides, block),
                rows.status[block],
                rows.poses[block],
                rows.actuators[block],
                rows.measures[block],
            )

        return sum(in_blocks(run, len(targets), ROWS_A_RUN if by_blocks else ROWS_A_BLOCK))

    def _complete(self, asked: Machine, targets: Floats, begins: Floats, sides: Floats, rows: Rows) -> int:
        """Answer the rows that blocks left OPEN, whose poses are to be completed; how many of them are reached."""
        some = (rows.status == OPEN).nonzero()[0]
        if not len(some):
            return 0
        own = rows_at(rows, some)
        begins, sides = (array if len(array) == 1 else array[some] for array in (begins, sides))
        left = self._run(False, asked, targets[some], begins, sides, own)
        put_rows(rows, some, own)
        return len(some) - left

    def _count_turns(self, begin: Floats, rows: Rows) -> None:
        """Count the angles of actuators that may turn more than once from those of a start (n or 1, n_a)."""
        for driven in self._turning:
            told = rows.status != PENDING
            values, before = rows.actuators[told, driven["column"]], begin[:, driven["column"]]
            before = before if len(begin) == 1 else before[told]
            nearest = values - 2.0 * np.pi * np.round((values - before) / (2.0 * np.pi))
            inside = (nearest >= driven["home"] + driven["lo"]) & (nearest <= driven["home"] + driven["hi"])
            rows.actuators[told, driven["column"]] = np.where(inside, nearest, values)


def _part(array: Floats, block: slice) -> Floats:
    """One for all rows, or those of a block; writable, as kernels are compiled for."""
    own = array if len(array) == 1 else array[block]
    return np.require(own, requirements=["C", "W"])
