"""Inverse kinematics by P-FABRIK: rows of targets answered by its kernels, and their projections drawn near."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial

import numpy as np

from ..arrays import Floats
from ..closure.close import closure_of, measured
from ..closure.configurations import (
    Configurations,
    new_rows,
    rows_at,
    write_closing,
)
from ..decomposition.plan import compile_plan
from ..description.mechanism import Mechanism
from ..kernels.reaching import plan as P
from ..kernels.threads import in_blocks
from ..options import Options
from ..tolerances import TOLERANCES
from .completion import coordinates_of, positions_of

Kernel = Callable[[P.Plan, Floats, P.Seeds, P.Settings, P.Rows], int]

STEPS_A_REPORT = 16
"""Steps along a path between two reports of progress."""

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
        return self._found(rows, start)

    def follow(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        on_progress: Callable[[int, int], None] | None,
    ) -> Configurations:
        """Answer a path (n, 4, 4), each target from the answer before it, in its working mode.

        The chained kernel runs in pieces where progress is reported.
        """
        from ..kernels.reaching.solve import solve_by_iteration

        rows, before = self._new_rows(len(targets)), start
        settings = settings_of(self.mechanism, options, keep_mode=True)._replace(chained=1)
        piece = STEPS_A_REPORT if on_progress is not None else max(len(targets), 1)
        for done in range(0, len(targets), piece):
            own = rows_at(rows, slice(done, done + piece))
            solve_by_iteration(self._compiled.plan, targets[done : done + piece], self._seeds(before), settings, own)
            before = self._last_answer(own) or before
            if on_progress is not None:
                on_progress(done + len(own.status), len(targets))
        found = self._found(rows, start, chained=True)
        self._count_turns(rows)
        return found

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
        placed, rows = measured(self.mechanism, found.coordinates), self._new_rows(len(found))
        write_closing(closure_of(self.mechanism), placed, rows)
        positions_of(self.mechanism, self._compiled, placed.coordinates, rows)
        return rows

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

    def _last_answer(self, rows: P.Rows) -> Configurations | None:
        """The last answer of some rows, alone; None where there is none."""
        answered = np.flatnonzero(rows.status != P.INVALID)
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
        chained=0,
    )
