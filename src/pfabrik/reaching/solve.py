"""Inverse kinematics by P-FABRIK: rows of targets answered by its kernels, and their projections drawn near."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache, partial

import numpy as np

from ..arrays import Floats
from ..closure.assemble import assemble, judged
from ..closure.close import Closing, closure_of, measured, platform_poses
from ..closure.configurations import (
    Configurations,
    coordinates_for,
    joint_coordinates,
    new_rows,
    put_rows,
    rows_at,
    write_closing,
)
from ..closure.descend import within_sight
from ..closure.projection import SAME, Way, held_back, kept, project, ways_of
from ..closure.stretched import Bends
from ..decomposition.plan import compile_plan
from ..description.mechanism import Mechanism
from ..description.task import task_of
from ..kernels.reaching import plan as P
from ..kernels.threads import in_blocks
from ..options import Options
from ..tolerances import TOLERANCES
from .completion import coordinates_of, positions_of
from .locked import with_locked_actuators
from .points import joint_points

Kernel = Callable[[P.Plan, Floats, P.Seeds, P.Settings, P.Rows], int]

STEPS_A_REPORT = 16
"""Steps along a path between two reports of progress."""

ASSEMBLING = Options(hold=None, working_mode="any", projection="centroid")
"""How legs of given lengths are assembled: the platform goes where they let it be."""

_HOLDS = {None: P.HOLD_NOTHING, "orientation": P.HOLD_ORIENTATION, "position": P.HOLD_POSITION}


class ReachingEngine:
    """Answers found on joint positions, for mechanisms whose chains these express."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self._compiled = compile_plan(mechanism)

    def answer(
        self, targets: Floats, start: Configurations | None, options: Options, *, keep_mode: bool
    ) -> Configurations:
        """Answer targets (n, 4, 4), each for itself, from one configuration or one for each; INVALID where no pose."""
        settings = settings_of(self.mechanism, options, keep_mode)
        rows = self._new_rows(len(targets))
        self._solve(targets, self._seeds(start), settings, rows)
        if self._leaves_projections(settings):
            self._draw_near(targets, partial(joint_coordinates, self.mechanism, start), settings, options, rows)
        return self._found(rows, start)

    def follow(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        on_progress: Callable[[int, int], None] | None,
    ) -> Configurations:
        """Answer a path (n, 4, 4), each target from the answer before it, in its working mode.

        The chained kernel runs in pieces: where progress is reported, and where an answer is still to be drawn near.
        After such an answer, the steps that follow it are made again from where it ends.
        """
        from ..kernels.reaching.solve import solve_by_iteration

        rows = self._new_rows(len(targets))
        settings = settings_of(self.mechanism, options, keep_mode=True)._replace(chained=1)
        bends, before = Bends(self.mechanism, options), start
        longest = STEPS_A_REPORT if on_progress is not None else max(len(targets), 1)
        done, piece = 0, longest
        while done < len(targets):
            block = slice(done, done + piece)
            own = rows_at(rows, block)
            solve_by_iteration(self._compiled.plan, targets[block], self._seeds(before), settings, own)
            away = np.flatnonzero(own.status == P.PROJECTED)[:1] if self._leaves_projections(settings) else ()
            for row in away:
                before = self._last_answer(own, row) or before
                begin = partial(joint_coordinates, self.mechanism, before)
                here = slice(row, row + 1)
                self._draw_near(targets[block][here], begin, settings, options, rows_at(own, here))
                own = rows_at(own, slice(row + 1))
            if bends.before is not None:
                other = self._answer_from(targets[block], bends.before, settings, options)
                if bends.prefer(targets[block], own, other):
                    put_rows(own, slice(None), other)
            last = self._last_answer(own, len(own.status))
            if last is not None:
                is_drawn = last.rows.status[0] == P.PROJECTED and self._leaves_projections(settings)
                if bends.before is not None or is_drawn:
                    bends.note(int(last.rows.status[0]), joint_coordinates(self.mechanism, before), last.coordinates)
                before = last
            piece = 1 if len(away) or bends.before is not None else min(2 * piece, longest)
            done += len(own.status)
            if on_progress is not None:
                on_progress(done, len(targets))
        found = self._found(rows, start, chained=True)
        self._count_turns(rows)
        return found

    def advance(self, targets: Floats, start: Configurations, options: Options) -> Configurations:
        """Go on to targets (n, 4, 4) in the working mode of as many configurations; PENDING where not reached."""
        rows = self._new_rows(len(targets))
        settings = settings_of(self.mechanism, options, keep_mode=True)._replace(max_rounds=0)
        self._solve(targets, self._seeds(start), settings, rows)
        return Configurations(rows, partial(coordinates_of, self.mechanism, rows))

    def at(self, closing: Closing) -> Configurations:
        """Configurations found on joint coordinates, as answers whose status is still to be told."""
        rows = self._new_rows(len(closing.poses))
        write_closing(closure_of(self.mechanism), closing, rows)
        positions_of(self.mechanism, self._compiled, closing.coordinates, rows)
        return Configurations(rows, closing.coordinates)

    def points(self, found: Configurations) -> Mapping[str, Floats]:
        """Joint name -> position of its centre in the base frame, (n, 3) [length]; merged joints share a centre."""
        return joint_points(self._compiled, self._positioned(found))

    def weighed_limits(self, found: Configurations, targets: Floats, way: Way) -> Floats:
        """How hard every limit holds projected configurations back from targets (n, 4, 4): see `closure.descend`."""
        return held_back(self.mechanism, found.coordinates, targets, way)

    def forward(self, values: Floats, start: Configurations | None, tolerance: float) -> Configurations:
        """The configurations that have actuated values (n, n_a), from one configuration or one for each."""
        coordinates = coordinates_for(self.mechanism, start, len(values))
        closing = assemble(
            self.mechanism, coordinates, values, seeded=start is not None, by_positions=self._by_positions
        )
        return judged(self.mechanism, self.at(closing), closing, values, tolerance)

    def _by_positions(self, coordinates: Floats, poses: Floats, values: Floats) -> tuple[Floats, Floats]:
        """Legs whose actuators have given values (n, n_a), assembled in positions around platforms (n, 4, 4).

        The range of every actuator shrinks to its value; the platform is then projected to where the legs let it be.

        Returns
        -------
        Joint coordinates (n, columns) and platform poses (n, 4, 4), which need not be closed.
        """
        from ..kernels.reaching.solve import solve_by_iteration

        rows, start = self._new_rows(len(values)), self._new_rows(len(values))
        positions_of(self.mechanism, self._compiled, coordinates, start)
        settings = settings_of(self.mechanism, ASSEMBLING, keep_mode=False)
        for i in range(len(values)):
            row = slice(i, i + 1)
            seeds = P.Seeds(poses[row].copy(), start.nodes[row], start.trunks[row])
            plan = with_locked_actuators(self._compiled.plan, values[i])
            solve_by_iteration(plan, poses[row].copy(), seeds, settings, rows_at(rows, row))
        found = coordinates_of(self.mechanism, rows)
        return found, platform_poses(self.mechanism, found) if self.mechanism.end_effector_is_joint else rows.poses

    def _new_rows(self, n: int) -> P.Rows:
        home = self._compiled.home_seed
        return new_rows(self.mechanism, n, home.nodes.shape[1], home.trunks.shape[1])

    def _seeds(self, start: Configurations | None) -> P.Seeds:
        """Where rows start, in positions."""
        if start is None:
            return self._compiled.home_seed
        rows = self._positioned(start)
        return P.Seeds(rows.poses, rows.nodes, rows.trunks)

    def _positioned(self, found: Configurations) -> P.Rows:
        """Configurations with positions, as they are or, where another engine found them, from joint coordinates."""
        own, rows = self._new_rows(0), found.rows
        if rows.nodes.shape[1:] == own.nodes.shape[1:] and rows.trunks.shape[1:] == own.trunks.shape[1:]:
            return rows
        return self.at(measured(self.mechanism, found.coordinates)).rows

    def _found(self, rows: P.Rows, start: Configurations | None, chained: bool = False) -> Configurations:
        """Rows that were answered; joint coordinates, when asked for, are those nearest to the start's.

        Of a start only the positions are kept, not how it was found itself: answers that start from each other would
        all stay in memory.
        """
        unknown = rows.status == P.INVALID
        if unknown.any():
            for array in (rows.poses, rows.nodes, rows.trunks, rows.actuators, rows.measures):
                array[unknown] = np.nan
            rows.counters[unknown] = 0
        if start is None:
            return Configurations(rows, partial(coordinates_of, self.mechanism, rows, None, chained))
        positioned = start.rows if start.were_given else self._positioned(start)
        own = start.coordinates if start.were_given else partial(coordinates_of, self.mechanism, positioned)
        return Configurations(rows, partial(_nearest_to, self.mechanism, rows, own, chained))

    def _last_answer(self, rows: P.Rows, before: int) -> Configurations | None:
        """The last answer before a row, alone; None where there is none."""
        answered = np.flatnonzero(rows.status[:before] != P.INVALID)
        if not len(answered):
            return None
        last = rows_at(rows, slice(answered[-1], answered[-1] + 1))
        return Configurations(last, partial(coordinates_of, self.mechanism, last))

    def _solve(self, targets: Floats, seeds: P.Seeds, settings: P.Settings, rows: P.Rows) -> None:
        """Answer independent rows: directly where closed forms reach, by iteration where not."""
        from ..kernels.reaching.solve import solve_by_iteration, solve_directly

        plan = self._compiled.plan
        if len(targets) == 1:
            if solve_directly(plan, targets, seeds, settings, rows):
                solve_by_iteration(plan, targets, seeds, settings, rows)
            return

        def run(kernel: Kernel, block: slice) -> int:
            own = seeds if len(seeds.poses) == 1 else P.Seeds._make(array[block] for array in seeds)
            return kernel(plan, targets[block], own, settings, rows_at(rows, block))

        if sum(in_blocks(partial(run, solve_directly), len(targets), rows_a_block=4096)):
            in_blocks(partial(run, solve_by_iteration), len(targets), rows_a_block=64)

    def _leaves_projections(self, settings: P.Settings) -> bool:
        """Whether kernels leave projections to be drawn near: only platforms on struts they bring there themselves."""
        return settings.nearest == 1 and self._compiled.plan.scalars[P.ON_STRUTS] == 0.0

    def _draw_near(
        self,
        targets: Floats,
        start: Callable[[], Floats],
        settings: P.Settings,
        options: Options,
        rows: P.Rows,
    ) -> None:
        """Bring projected rows to the nearest feasible poses, where the kernels leave that to be done.

        The closure engine looks for them, from where the projection ended and from where it started. An answer counts
        if the kernels reach it too, from where the projection ended, and so in its working mode.

        Parameters
        ----------
        start : gives the joint coordinates (n, columns) or (1, columns) that the rows started from.
        """
        away = np.flatnonzero(rows.status == P.PROJECTED)
        if not len(away):
            return
        mechanism, closure = self.mechanism, closure_of(self.mechanism, whole=False)
        wanted, projected = targets[away], rows_at(rows, away)
        begin = start()
        begin = begin[away] if len(begin) > 1 else begin.repeat(len(away), axis=0)
        ways = ways_of(mechanism, options.hold, options.rotation_length)
        sought = within_sight(mechanism, wanted)
        starts = [coordinates_of(mechanism, projected), begin]
        found = project(closure, sought, starts, ways, corners=settings.any_mode == 1)
        reached = rows_at(projected, np.arange(len(away)))
        seeds = P.Seeds(projected.poses, projected.nodes, projected.trunks)
        self._solve(found.closing.poses, seeds, settings._replace(chained=0), reached)
        near = np.isfinite(found.distances) & (reached.status == P.REACHED)
        for way in ways:  # what fell back to a way tried later is farther, however near
            ours, theirs = projected.counters[:, P.HELD] == way.hold, found.holds == way.hold
            distances = way.distances(closure, projected.poses, sought)
            near &= ~(ours & theirs & (found.distances > (1.0 - SAME) * distances))
            near &= ~(ours & ~theirs & (way is ways[0]))
        reached.status[:] = P.PROJECTED
        reached.counters[:] = projected.counters
        reached.counters[:, P.ITERATIONS] += found.closing.iterations
        reached.counters[:, P.HELD] = kept(mechanism, found.holds, reached.poses, wanted)
        reached.measures[:, P.POSITION_ERROR], reached.measures[:, P.ROTATION_ERROR] = task_of(mechanism).errors(
            reached.poses, wanted
        )
        put_rows(rows, away[near], rows_at(reached, near))

    def _answer_from(self, target: Floats, start: Floats, settings: P.Settings, options: Options) -> P.Rows:
        """One target (1, 4, 4) answered from joint coordinates (1, columns)."""
        from ..kernels.reaching.solve import solve_by_iteration

        begin, found = self._new_rows(1), self._new_rows(1)
        begin.poses[:] = platform_poses(self.mechanism, start)
        positions_of(self.mechanism, self._compiled, start, begin)
        solve_by_iteration(
            self._compiled.plan, target, P.Seeds(begin.poses, begin.nodes, begin.trunks), settings, found
        )
        if self._leaves_projections(settings):
            self._draw_near(target, lambda: start, settings, options, found)
        return found

    def _count_turns(self, rows: P.Rows) -> None:
        """Make the angles of revolute actuators that may turn more than once continuous along a path."""
        known = rows.status != P.INVALID
        for j in range(self._compiled.n_actuators):
            coordinate = self._compiled.plan.coordinates[j]
            lo, hi = coordinate["lo"], coordinate["hi"]
            if coordinate["kind"] in (P.HINGE, P.END_HINGE) and hi - lo > 2 * np.pi:
                counted = np.unwrap(rows.actuators[known, j])
                if (counted >= lo - TOLERANCES.limit).all() and (counted <= hi + TOLERANCES.limit).all():
                    rows.actuators[known, j] = counted


def _nearest_to(mechanism: Mechanism, rows: P.Rows, start: Floats | Callable[[], Floats], chained: bool) -> Floats:
    """Joint coordinates of answers, nearest to those they started from."""
    return coordinates_of(mechanism, rows, start() if callable(start) else start, chained)


@lru_cache(maxsize=256)
def settings_of(mechanism: Mechanism, options: Options, keep_mode: bool) -> P.Settings:
    """Options as the kernels take them."""
    length = mechanism.characteristic_length
    return P.Settings(
        tolerance=float(options.tolerance or TOLERANCES.position * length),
        rotation_tolerance=float(options.rotation_tolerance),
        slack=0.1 * TOLERANCES.limit * length,
        max_iterations=int(options.max_iterations),
        max_rounds=int(options.max_rounds),
        exact=int(options.exact),
        any_mode=int(not keep_mode),
        hold=_HOLDS[options.hold],
        nearest=int(options.projection == "nearest" and options.exact),
        rotation_length=float(options.rotation_length or mechanism.rotation_length),
        chained=0,
    )
