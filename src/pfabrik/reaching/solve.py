"""The paper's method: targets answered by passes on joint positions, and projected where these do not reach."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial

import numpy as np

from ..arrays import Floats
from ..closure.close import closure_of, measured
from ..closure.configurations import (
    Configurations,
    new_rows,
    put_rows,
    rows_at,
    write_closing,
)
from ..closure.solve import ClosureEngine
from ..decomposition.plan import compile_plan
from ..description.mechanism import Mechanism
from ..kernels.reaching import plan as P
from ..kernels.threads import in_blocks
from ..options import Options
from ..platform.solve import LegsEngine
from ..tolerances import TOLERANCES
from .completion import coordinates_of, positions_of

NEAR = 1e-3
"""Share of L within which passes bring the ends of chains where exact steps follow."""

ROWS_A_BLOCK = 64

STEPS_A_REPORT = 16
"""Steps along a path between two reports of progress."""

_HOLDS = {None: P.HOLD_NOTHING, "orientation": P.HOLD_ORIENTATION, "position": P.HOLD_POSITION}


class ReachingEngine:
    """The paper's method on joint positions, for mechanisms whose chains these express.

    With `Options.exact`, what another engine reaches is that one's answer, and all else is projected as in the paper.
    """

    def __init__(self, mechanism: Mechanism, exact: LegsEngine | ClosureEngine) -> None:
        self.mechanism, self._exact = mechanism, exact
        self._compiled = compile_plan(mechanism)

    def answer(
        self, targets: Floats, start: Configurations | None, options: Options, *, keep_mode: bool
    ) -> Configurations:
        """Answer targets (n, 4, 4), each for itself, from one configuration or one for each; INVALID where no pose."""
        rows = self._new_rows(len(targets))
        if options.exact:
            found = self._exact.answer(targets, start, options, keep_mode=keep_mode)
            reached = np.flatnonzero(found.rows.status == P.REACHED)
            own, told = self._positioned(found.at(reached)), rows_at(found.rows, reached)
            own = own._replace(status=told.status, counters=told.counters, measures=told.measures)
            put_rows(rows, reached, own)
        self._solve(targets, self._seeds(start), settings_of(self.mechanism, options), rows)
        return self._found(rows, start)

    def follow(
        self,
        targets: Floats,
        start: Configurations | None,
        options: Options,
        on_progress: Callable[[int, int], None] | None,
    ) -> Configurations:
        """Answer a path (n, 4, 4), each target from the answer before it, in its working mode."""
        rows, before = self._new_rows(len(targets)), start
        for i in range(len(targets)):
            found = self.answer(targets[i : i + 1], before, options, keep_mode=True)
            put_rows(rows, slice(i, i + 1), found.rows)
            if found.rows.status[0] != P.INVALID:
                before = Configurations(found.rows, partial(coordinates_of, self.mechanism, found.rows))
            if on_progress is not None and ((i + 1) % STEPS_A_REPORT == 0 or i + 1 == len(targets)):
                on_progress(i + 1, len(targets))
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

    def _solve(self, targets: Floats, seeds: P.Seeds, settings: P.Settings, rows: P.Rows) -> None:
        """Answer the rows that are pending, each for itself."""
        from ..kernels.reaching.solve import solve_by_iteration

        def run(block: slice) -> int:
            own = seeds if len(seeds.poses) == 1 else P.Seeds._make(array[block] for array in seeds)
            return solve_by_iteration(self._compiled.plan, targets[block], own, settings, rows_at(rows, block))

        in_blocks(run, len(targets), ROWS_A_BLOCK)

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
def settings_of(mechanism: Mechanism, options: Options) -> P.Settings:
    """Options as the kernel takes them; exact steps take over sooner than passes alone may end."""
    length = mechanism.characteristic_length
    tolerance = float(options.tolerance or TOLERANCES.position * length)
    return P.Settings(
        tolerance=tolerance,
        enough=max(tolerance, NEAR * length) if options.exact else tolerance,
        rotation_tolerance=float(options.rotation_tolerance),
        slack=0.1 * TOLERANCES.limit * length,
        exact=int(options.exact),
        max_iterations=int(options.max_iterations),
        max_rounds=int(options.max_rounds),
        hold=_HOLDS[options.hold],
    )
