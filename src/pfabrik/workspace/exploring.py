"""Exploring what is within reach from what is known to be: for mechanisms that no closed forms answer.

There a point that is not within reach takes a hundred times as long as one that is, when it is searched for from where
the mechanism starts. So points are tried from the nearest configurations that were reached, outward, one step each;
what lies behind unreached points is looked at here and there, and explored where that is within reach.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Mask
from ..closure.closure_engine import ClosureEngine
from ..closure.configurations import Configurations, new_rows
from ..kernels.rows import REACHED

NEAR = 0.25
"""How far one step goes at most [L or rad]: a longer one may leap over a singularity."""

APART = 0.03
"""How far what was reached is from all that was known to be one more to go on from [L or rad]."""

TRIES = 3
"""From how many configurations a point is tried that is not reached from the nearest one."""

SAMPLES = 96
"""How many points of a look, spread over those that are not near any within reach, are searched for all the same."""

SAME = 1e-6
"""Difference of distances up to which two configurations are equally near [L or rad]: rounding, on a lattice."""

AT_ONCE = 256
"""Points between two reports of progress."""

Tell = Callable[[int], None]
"""Called with how many points more are known about."""


class Explorer:
    """The configurations that were reached yet, and what is within reach from them."""

    def __init__(self, engine: ClosureEngine, start: Configurations, pose: Floats, at: Floats) -> None:
        """Begin with a configuration, led to a pose (4, 4) at coordinates (d,) [L or rad]."""
        self._engine, self._start = engine, start
        found = engine.advance(pose[None], start)
        known = found.rows.status == REACHED
        self._at, self._coordinates = [at[None][known]], [found.coordinates[known]]

    def explore(self, poses: Floats, at: Floats, tell: Tell) -> tuple[Mask, Floats]:
        """Which poses (n, 4, 4) at coordinates (n, d) are within reach, (n,), and where the joints ended, (n, c)."""
        look = _Look(poses, at, self._start.coordinates.shape[1])
        look.approach(self._known()[0], 0)
        self._spread(look, tell)
        far = np.flatnonzero(look.tries == 0)
        samples = far[np.unique(np.linspace(0, len(far) - 1, min(SAMPLES, len(far))).astype(np.intp))]
        for rows in np.array_split(samples, range(AT_ONCE, len(samples), AT_ONCE)):
            found = self._engine.advance(poses[rows], self._start.at(np.zeros(len(rows), np.intp)))
            self._take(look, rows, found)
        self._spread(look, tell)
        tell(int((look.tries == 0).sum()))
        return look.reached, look.coordinates

    def _known(self) -> tuple[Floats, Floats]:
        """Where what is known to be within reach is, (k, d), and its joint coordinates, (k, c)."""
        self._at, self._coordinates = [np.concatenate(self._at)], [np.concatenate(self._coordinates)]
        return self._at[0], self._coordinates[0]

    def _spread(self, look: _Look, tell: Tell) -> None:
        """Go on to what is near, from what was reached before, until nothing more is."""
        while len(rows := look.ready()):
            for block in np.array_split(rows, range(AT_ONCE, len(rows), AT_ONCE)):
                starts = self._known()[1][look.nearest[block]]
                first = look.tries[block] == 0
                found = self._engine.step(look.poses[block], self._as_answers(starts))
                self._take(look, block, found)
                tell(int(first.sum()))

    def _as_answers(self, coordinates: Floats) -> Configurations:
        return Configurations(new_rows(self._engine.model, len(coordinates)), coordinates)

    def _take(self, look: _Look, rows: NDArray[np.intp], found: Configurations) -> None:
        """Note what was tried, and go on from what was reached."""
        reached = np.asarray(found.rows.status == REACHED)
        look.note(rows, reached, found.coordinates)
        new = reached & (look.distance[rows] > APART)
        if new.any():
            first = sum(map(len, self._at))
            self._at.append(look.at[rows[new]])
            self._coordinates.append(found.coordinates[new])
            look.approach(self._at[-1], first)


class _Look:
    """Points that are asked for at once.

    Attributes
    ----------
    reached, coordinates : which are within reach, and where the joints ended at the last try.
    nearest, distance : the known configuration that is nearest to each, and how far off it is.
    tries, tried : how often each was tried, and from which configuration last.
    """

    def __init__(self, poses: Floats, at: Floats, columns: int) -> None:
        n = len(at)
        self.poses, self.at = poses, at
        self.reached, self.coordinates = np.zeros(n, bool), np.zeros((n, columns))
        self.nearest, self.distance = np.zeros(n, np.intp), np.full(n, np.inf)
        self.tries, self.tried = np.zeros(n, np.int64), np.full(n, -1)

    def ready(self) -> NDArray[np.intp]:
        """Points that are near what is within reach, and were not tried from there, the nearest first."""
        waiting = ~self.reached & (self.distance <= NEAR) & (self.tries < TRIES) & (self.tried != self.nearest)
        rows = np.flatnonzero(waiting)
        return rows[np.argsort(self.distance[rows], kind="stable")]

    def note(self, rows: NDArray[np.intp], reached: Mask, coordinates: Floats) -> None:
        """Put down what a try of some points has brought."""
        self.tries[rows] += 1
        self.tried[rows] = self.nearest[rows]
        self.reached[rows], self.coordinates[rows] = reached, coordinates

    def approach(self, at: Floats, first: int) -> None:
        """Take note of known configurations at coordinates (k, d), the first of which has a number, that are nearer."""
        rows = np.flatnonzero(~self.reached & (self.tries < TRIES)) if len(at) else np.zeros(0, np.intp)
        for block in np.array_split(rows, range(1024, len(rows), 1024)):
            squares = _squares(self.at[block], at)
            best = squares.argmin(axis=1)
            distance = np.sqrt(squares[np.arange(len(block)), best])
            as_near = distance <= self.distance[block] + SAME
            better = (distance < self.distance[block]) | (as_near & (self.tried[block] == self.nearest[block]))
            self.distance[block[better]], self.nearest[block[better]] = distance[better], first + best[better]


def _squares(some: Floats, others: Floats) -> Floats:
    """Squared distances between points (n, d) and others (k, d), (n, k)."""
    products = (some**2).sum(axis=1)[:, None] + (others**2).sum(axis=1) - 2.0 * some @ others.T
    return np.asarray(np.maximum(products, 0.0))
