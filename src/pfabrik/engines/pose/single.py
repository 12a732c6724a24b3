"""Kernel calls of legs, prepared once for each machine: single targets, assemblies, and batches row by row."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from itertools import combinations
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...common.arrays import Floats, Ints
from ...common.batch import put, take, take_each
from ...common.derived import derived
from ...kernels.handle import Handle, Scratch
from ...kernels.pose.search_records import PoseSolutions, Starts
from ...kernels.pose.tables import IN_OTHER_MODES, Start
from ...kernels.rows import N_COUNTERS, Rows
from ...kernels.threads import in_blocks
from ...machine.decomposition.resting import Resting
from ...machine.model import Model
from ...options import USUAL, Options
from ..joints.configurations import Configurations
from .links_of_legs import links_of_legs
from .nearest_pose import home_start
from .table import legs_at_rest, local_table, search_table, table_handle
from .tables import handle_of, home_of, question_of, scratch_of_answers

if TYPE_CHECKING:
    from ...kernels.pose.forward import NewtonScratch


ROWS_A_BLOCK, ROWS_A_RUN = 16, 1024


class Answers(NamedTuple):
    """Answers of a batch."""

    rows: Rows
    q: Floats  # (n, legs): proximal coordinates found by a search, where closed forms are less exact; else NaN
    sides: Floats  # (n, legs): the side of each leg at the answer; at the start of rows that are not answered


class Request(NamedTuple):
    """A machine, with the options common to all rows."""

    model: Model
    options: Options
    start: Start  # one for all rows or one for each
    has_start: bool  # it was given, and is not home
    keep_mode: bool  # answers are in its working mode, or its assembly mode
    nearby: bool  # searches stay around it, as along a path
    tolerance: float | None = None  # of actuated values that are asked for [L or rad]; None where targets are


def request_from(
    model: Model,
    options: Options,
    start: Configurations | None,
    sides: Floats,
    keep_mode: bool,
    nearby: bool,
    tolerance: float | None = None,
) -> Request:
    """What is asked of rows from a start, one or one for each, with legs on some sides; None for home."""
    own = home_of(model)
    if start is not None:
        own = Start(start.rows.poses, sides, np.require(start.rows.actuators, requirements=["C", "W"]))
    return Request(model, options, own, start is not None, keep_mode, nearby, tolerance)


def answer_phases(
    request: Request, asked: Floats, answers: Answers, places: NDArray[np.intp], first: int, last: int
) -> None:
    """Answer targets (n, 4, 4), or values (n, n_a), at some places by some of the phases of `answer_row`."""
    model, options, start, has_start, keep_mode, nearby, tolerance = request
    if len(places) < len(asked):
        block, start = take(answers, places), take_each(start, places)
        answer_phases(request._replace(start=start), asked[places], block, np.arange(len(places)), first, last)
        put(answers, places, block)
        return
    from ...kernels.pose.answer_rows import answer_rows

    has_seeds = last > IN_OTHER_MODES and (tolerance is not None or not nearby)  # values may fit in another mode alone
    tables = handle_of(model, options, with_seeds=has_seeds)
    most_steps = options.most_steps or 0
    question = question_of(
        tolerance is not None, first, last, has_start, keep_mode, nearby, most_steps, tolerance or 0.0
    )
    scratch, distances, rows = scratch_of_answers(tables), np.empty(len(asked)), answers.rows
    found = rows.counters, rows.actuators, rows.measures, rows.status
    outputs = PoseSolutions(distances, rows.poses, answers.q, answers.sides, *found)
    given = asked if tolerance is None else asked[:, None]

    def run(given: Floats, start: Start, outputs: PoseSolutions) -> int:
        return answer_rows(tables.address, scratch.address, question.address, given, start, outputs)

    if len(asked) <= ROWS_A_BLOCK:
        run(given, start, outputs)
    else:
        in_blocks(lambda part: run(given[part], take_each(start, part), take(outputs, part)), len(asked), ROWS_A_BLOCK)


def mark_near(model: Model, rows: Rows, sides: Floats) -> int:
    """Make rows TOO_NEAR that legs reach on sides (n or 1, legs), but with links nearer than the clearance; how many.

    None where searches in joint coordinates keep the links apart.
    """
    if not len(links_of_legs(model).pairs):
        return 0
    from ...kernels.pose.answer_rows import mark_near as mark

    tables = handle_of(model, USUAL, with_seeds=False)
    scratch = scratch_of_answers(tables)

    def run(block: slice) -> int:
        own = sides if len(sides) == 1 else sides[block]
        return mark(tables.address, scratch.address, rows.poses[block], own, rows.status[block])

    return sum(in_blocks(run, len(rows.status), ROWS_A_RUN))


class SingleTarget:
    """Inverse kinematics of a machine, one target at a time.

    A target takes microseconds, so everything that does not depend on it is prepared once.
    """

    def __init__(self, model: Model) -> None:
        mechanism, table = model.mechanism, model.legs
        self._n_actuators = len(mechanism.actuator_names)
        self._is_for_blocks, self._has_implicit_joints = table.is_for_blocks, table.has_implicit_joints
        self._full_table, self._local_table = table_handle(table), local_table(table)
        self.home, self.home_sides = mechanism.home_pose[None].copy(), table.home_sides
        self._resting = legs_at_rest(table)
        self._resting_table = table_handle(table if self._resting is None else self._resting.table)

    @cached_property
    def _kernel(self) -> Callable[..., int]:
        if self._is_for_blocks:
            return self._blocks
        from ...kernels.legs.answer import answer

        return answer

    @cached_property
    def _blocks(self) -> Callable[..., int]:
        from ...kernels.legs.blocks import answer_blocks

        return answer_blocks

    def new_rows(self) -> Rows:
        """Allocate one row."""
        return Rows(
            np.empty(1, np.int64),
            np.zeros((1, N_COUNTERS), np.int64),
            np.empty((1, 4, 4)),
            np.empty((1, self._n_actuators)),
            np.zeros((1, 5)),
        )

    def reach(self, target: Floats, start_pose: Floats, sides: Floats, rows: Rows, *, nearby: bool) -> int:
        """Solve a target (1, 4, 4) if legs on given sides (1, legs) reach it; return 0 where they do.

        Parameters
        ----------
        sides : implicit joints start here, and their coordinates are written here.
        start_pose : the pose from which the target is completed, (1, 4, 4); the array `home` for home.
        nearby : complete it only near its start.
        """
        if start_pose is self.home and self._resting is not None:
            return self._reach_at_rest(self._resting, target, rows)
        return self._kernel(
            (self._local_table if nearby else self._full_table).address, target, start_pose, sides, *_outputs(rows)
        )

    def prepared(
        self, target: Floats, start_pose: Floats, sides: Floats, rows: Rows, *, nearby: bool
    ) -> Callable[[], int]:
        """A call of `reach` with these arguments, valid while this object is kept.

        Implicit joints start anew each time.
        """
        if start_pose is self.home and self._resting is not None:
            return partial(self._reach_at_rest, self._resting, target, rows)
        legs, end_sides = self._local_table if nearby else self._full_table, sides.copy()
        call = partial(self._kernel, legs.address, target, start_pose, end_sides, *_outputs(rows))
        if not self._has_implicit_joints:
            return call

        def call_anew() -> int:
            end_sides[:] = sides
            return call()

        return call_anew

    def _reach_at_rest(self, resting: Resting, target: Floats, rows: Rows) -> int:
        """`reach` from home, with the redundant joints fixed there."""
        rows.actuators[:] = resting.actuators
        return self._blocks(self._resting_table.address, target, self.home, resting.table.home_sides, *_outputs(rows))


class LegsAssembly:
    """Forward kinematics of a machine from starts, for one row or many, prepared likewise."""

    def __init__(self, model: Model) -> None:
        from ...kernels.pose.forward import assemble
        from ...kernels.pose.forward_blocks import assemble_in_blocks

        self.home, self.scratch = Handle(home_start(model)), Scratch(new_scratch, model)
        self._legs, self._places = search_table(model.legs), places_of_rods(model)
        self._n_legs = len(model.legs.legs)
        self._kernels: tuple[Callable[..., int], ...] = assemble, assemble_in_blocks

    def new_ends(self, rows: Rows) -> Starts:
        """Allocate the configurations of rows, with their poses [length]."""
        shape = len(rows.poses), self._n_legs
        return Starts(rows.poses, np.zeros(shape), np.zeros(shape))

    def prepared(
        self,
        starts: Handle[Starts],
        rows: Rows,
        ends: Starts,
        scratch: Handle[NewtonScratch] | Scratch[NewtonScratch],
    ) -> Callable[[], int]:
        """A call that assembles rows at `rows.actuators`, from one start each or one for all; 0 if all are assembled.

        Ends are those of `new_ends`. The call is valid while starts, scratch memory and this object are kept. Six rods
        are assembled in blocks, of one row too, so that a row has the same digits alone and in a batch.
        """
        legs, given, places = self._legs.address, (rows.actuators, starts.address), self._places
        assemble, assemble_in_blocks = self._kernels
        outputs = rows.status, np.zeros(rows.actuators.shape), ends, rows.measures
        others = partial(assemble, legs, scratch.address, *given, places is not None, *outputs)
        if places is None:
            return others
        in_blocks = partial(assemble_in_blocks, legs, places, *given, *outputs)
        return lambda: in_blocks() and others()


@derived
def assembly_of(model: Model) -> LegsAssembly:
    """Assembly of a machine."""
    return LegsAssembly(model)


@derived
def places_of_rods(model: Model) -> Ints | None:
    """The places of rods in `assemble_in_blocks`, those first whose lines span most; None for legs that are others."""
    table = model.legs
    has_pointing_cones = len(search_table(table).record.cones) > len(table.cones)
    is_six_rods = len(table.legs) == len(new_scratch(model).spheres.legs) == 6
    if not (table.is_for_blocks and is_six_rods) or has_pointing_cones:
        return None
    lines = table.legs["line"]
    first = max(combinations(range(6), 3), key=lambda rods: abs(np.linalg.det(lines[list(rods)])))
    return np.argsort([*first, *(k for k in range(6) if k not in first)])


def new_scratch(model: Model) -> NewtonScratch:
    """Scratch memory of assembly."""
    from ...kernels.pose.forward import new_newton_scratch

    return new_newton_scratch(search_table(model.legs).record, not model.mechanism.end_effector_is_joint)


def _outputs(rows: Rows) -> tuple[NDArray[Any], ...]:
    """The arrays that the kernel fills."""
    return rows.status, rows.poses, rows.actuators, rows.measures
