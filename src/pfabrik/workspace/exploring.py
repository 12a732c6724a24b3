"""Exploring a workspace outward from configurations that were reached: for mechanisms without closed forms.

There a search from the start takes a hundred times as long for a point out of reach as for one within reach. So points
are tried from the nearest reached configurations, outward, one step each. Samples of the points behind unreached ones
are searched for from the start, and explored from where they are within reach.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Mask
from ..chains.chain_engine import ChainEngine
from ..closure.closure_engine import ClosureEngine
from ..closure.configurations import Configurations, new_rows
from ..closure.link_distances import clearance_excess
from ..closure.placed_links import placed_at
from ..description.mechanism import Mechanism
from ..kernels.rows import REACHED
from ..tolerances import TOLERANCES

NEAR = 0.25
"""Longest step [L or rad]: a longer one may cross a singularity unnoticed."""

APART = 0.03
"""Least distance of a reached configuration from all known ones for it to become a start [L or rad]."""

TRIES = 3
"""Number of configurations from which a point is tried, at most."""

SAMPLES = 96
"""Number of points that are searched for from the start, spread over those that are not near any reached one."""

SAME = 1e-6
"""Difference of distances up to which two configurations are equally near [L or rad]: rounding, on a lattice."""

AT_ONCE = 256
"""Points between two reports of progress."""

Tell = Callable[[int], None]
"""Called with the number of points that have become known."""


class Explorer:
    """The configurations reached so far, and the search for points near them."""

    def __init__(
        self,
        mechanism: Mechanism,
        engine: ClosureEngine | ChainEngine,
        start: Configurations,
        pose: Floats,
        at: Floats,
    ) -> None:
        """Begin with a configuration, moved to a pose (4, 4) at coordinates (d,) [L or rad].

        Parameters
        ----------
        mechanism : with its clearance, which the engine need not know.
        """
        self._mechanism, self._engine, self._start = mechanism, engine, start
        solution = engine.advance(pose[None], start)
        known = self._are_reached(solution)
        self._at, self._coordinates = [at[None][known]], [solution.coordinates[known]]

    def explore(self, poses: Floats, at: Floats, tell: Tell) -> tuple[Mask, Floats]:
        """Mask (n,) of the poses (n, 4, 4) at coordinates (n, d) that are reached, and joint coordinates, (n, c)."""
        points = _Points(poses, at, self._start.coordinates.shape[1])
        points.approach(self._known()[0], 0)
        self._spread(points, tell)
        unseen = np.flatnonzero(points.tries == 0)
        samples = unseen[np.unique(np.linspace(0, len(unseen) - 1, min(SAMPLES, len(unseen))).astype(np.intp))]
        for rows in np.array_split(samples, range(AT_ONCE, len(samples), AT_ONCE)):
            solutions = self._engine.advance(poses[rows], self._start.at(np.zeros(len(rows), np.intp)))
            self._take(points, rows, solutions)
        self._spread(points, tell)
        tell(int((points.tries == 0).sum()))
        return points.reached, points.coordinates

    def _known(self) -> tuple[Floats, Floats]:
        """Coordinates (k, d) and joint coordinates (k, c) of the reached configurations."""
        self._at, self._coordinates = [np.concatenate(self._at)], [np.concatenate(self._coordinates)]
        return self._at[0], self._coordinates[0]

    def _spread(self, points: _Points, tell: Tell) -> None:
        """Step to points near reached configurations, until none is left to try."""
        while len(rows := points.ready()):
            for block in np.array_split(rows, range(AT_ONCE, len(rows), AT_ONCE)):
                starts = self._known()[1][points.nearest[block]]
                is_new = points.tries[block] == 0
                solutions = self._engine.step(points.poses[block], self._as_answers(starts))
                self._take(points, block, solutions)
                tell(int(is_new.sum()))

    def _are_reached(self, solutions: Configurations) -> Mask:
        """Mask of solutions that are reached, with links as far apart as the clearance, if there is one."""
        reached, mechanism = np.asarray(solutions.rows.status == REACHED), self._mechanism
        if mechanism.clearance is not None:
            reached &= clearance_excess(placed_at(mechanism, solutions)) <= TOLERANCES.limit
        return reached

    def _as_answers(self, coordinates: Floats) -> Configurations:
        return Configurations(new_rows(self._engine.model, len(coordinates)), coordinates)

    def _take(self, points: _Points, rows: NDArray[np.intp], solutions: Configurations) -> None:
        """Record tries, and make starts of the configurations they reached."""
        reached = self._are_reached(solutions)
        points.note(rows, reached, solutions.coordinates)
        new = reached & (points.distance[rows] > APART)
        if new.any():
            first = sum(map(len, self._at))
            self._at.append(points.at[rows[new]])
            self._coordinates.append(solutions.coordinates[new])
            points.approach(self._at[-1], first)


class _Points:
    """The points of one call of `explore`, and the tries to reach them.

    Attributes
    ----------
    reached, coordinates : mask of those within reach, and joint coordinates at the end of the last try.
    nearest, distance : the known configuration that is nearest to each, and its distance.
    tries, tried : number of tries, and the configuration that the last one started from.
    """

    def __init__(self, poses: Floats, at: Floats, columns: int) -> None:
        n = len(at)
        self.poses, self.at = poses, at
        self.reached, self.coordinates = np.zeros(n, bool), np.zeros((n, columns))
        self.nearest, self.distance = np.zeros(n, np.intp), np.full(n, np.inf)
        self.tries, self.tried = np.zeros(n, np.int64), np.full(n, -1)

    def ready(self) -> NDArray[np.intp]:
        """Rows of points that are near a reached configuration and were not tried from it, the nearest first."""
        is_ready = ~self.reached & (self.distance <= NEAR) & (self.tries < TRIES) & (self.tried != self.nearest)
        rows = np.flatnonzero(is_ready)
        return rows[np.argsort(self.distance[rows], kind="stable")]

    def note(self, rows: NDArray[np.intp], reached: Mask, coordinates: Floats) -> None:
        """Record the results of a try of some points."""
        self.tries[rows] += 1
        self.tried[rows] = self.nearest[rows]
        self.reached[rows], self.coordinates[rows] = reached, coordinates

    def approach(self, at: Floats, first: int) -> None:
        """Update the nearest configurations by new ones at coordinates (k, d), numbered from `first` on."""
        rows = np.flatnonzero(~self.reached & (self.tries < TRIES)) if len(at) else np.zeros(0, np.intp)
        for block in np.array_split(rows, range(1024, len(rows), 1024)):
            squares = _squares(self.at[block], at)
            best = squares.argmin(axis=1)
            distance = np.sqrt(squares[np.arange(len(block)), best])
            as_near = distance <= self.distance[block] + SAME
            better = (distance < self.distance[block]) | (as_near & (self.tried[block] == self.nearest[block]))
            self.distance[block[better]], self.nearest[block[better]] = distance[better], first + best[better]


def _squares(points: Floats, configurations: Floats) -> Floats:
    """Squared distances (n, k) between points (n, d) and (k, d)."""
    products = (points**2).sum(axis=1)[:, None] + (configurations**2).sum(axis=1) - 2.0 * points @ configurations.T
    return np.asarray(np.maximum(products, 0.0))
