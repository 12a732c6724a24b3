"""The closed home of an open machine: the configuration nearest to its drawing in which its loops meet."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...common.arrays import Floats, Mask
from ...engines.joints.close import close, platform_poses
from ...kinematics import rate_units
from ...machine.motion.displacements import stepped
from ...tolerances import TOLERANCES
from .closing import CLOSED, OpenLoops

POLISH = 10
"""Newton's steps at the end, where least squares stall: those of a closed loop end at rounding."""

STARTS, STRAY = 6, 0.3
"""Attempts from around a drawing that is open, and how far off they start [rad or L]: legs that are stretched out, or
lie on one another, have no direction to begin with."""

FARTHEST, MOST = 1.2, 3
"""Times the distance of the nearest one up to which closed configurations are let come nearer, and most of them."""

SAME, APART = 1e-4, 0.1
"""Difference of coordinates up to which two configurations are one [rad or L]; as a share of the distance of the
nearest from the drawing, once they have come as near as a few steps get them."""

NOTHING = 1e-15
"""Deviation from home that is rounding of none [rad or L]."""

NEARER = 1.0 - 1e-3
"""Share of the distance of the nearest one below which another is worth one more round of mirror images."""

SETTLING, SETTLED = 20, 1e-9
"""Most steps by which a configuration comes nearer, and the share of its distance by which a last one does."""


@dataclass(frozen=True)
class ClosedHome:
    """Coordinates at which the loops meet, or are least open.

    Attributes
    ----------
    q : coordinates of the tree's joints, deviations from home, (c,) [rad or length].
    gap : of all loops, the largest distance [L] or angle [rad].
    distance : from the drawing, as of `OpenLoops.distances` [L].
    other : that of the next nearest configuration that was found apart from it; infinite where there is none.
    """

    q: Floats
    gap: float
    distance: float = 0.0
    other: float = np.inf


def close_home(loops: OpenLoops, free: Mask, low: Floats, high: Floats) -> ClosedHome:
    """The coordinates nearest to home, of those found, in which the loops meet; or are least open.

    Newton's method starts from the drawing and, where that is open, from around it, then from mirror images of the
    nearest that it comes to: of all joints, and of those of one loop alone, over and over while that is nearer. What
    can still move with its loops closed comes as near as it can. Nearest is least in `OpenLoops.distances`.

    Parameters
    ----------
    free : the coordinates that may move, (c,); the others stay at home.
    low, high : bounds of the coordinates as deviations from home, (c,) [rad or length]; equal ones hold a coordinate.
    """
    home = np.where(free, np.clip(0.0, low, high), 0.0)
    if not loops.loops:
        return ClosedHome(home, 0.0)
    search = _Closings(loops, free, low, high)
    search.start(home[None])
    if max(search.nearest()[0].gap, loops.gap(home)) > TOLERANCES.file_gap:
        rng, units = np.random.default_rng(0), rate_units(loops.tree)
        search.start(np.where(free, home + rng.uniform(-STRAY, STRAY, (STARTS, len(home))) * units, home))
    if loops.gap(home) > TOLERANCES.file_gap >= search.nearest()[0].gap:
        search.mirror(home)
    best, *others = search.nearest()
    distances = loops.distances(np.array([each.q for each in (best, *others)]))
    return replace(best, distance=float(distances[0]), other=float(distances[1]) if others else np.inf)


class _Closings:
    """Closed configurations of an open machine, as they are found.

    Attributes
    ----------
    found : what Newton's method came to.
    """

    def __init__(self, loops: OpenLoops, free: Mask, low: Floats, high: Floats) -> None:
        self._loops, self._free, self._low, self._high = loops, free & (low < high), low, high
        self._closure, self._bridges = loops.bridged
        self._locked = frozenset([*np.flatnonzero(~self._free).tolist(), *self._bridges])
        self._units = rate_units(loops.tree)
        self._has_limits = bool(np.isfinite([low, high]).any())
        self.found: list[ClosedHome] = []

    def nearest(self) -> list[ClosedHome]:
        """Those that are closed as well as any, the nearest to the drawing first."""
        least = min(each.gap for each in self.found)
        closed = [each for each in self.found if each.gap <= max(2.0 * least, CLOSED)]
        distances = self._loops.distances(np.array([each.q for each in closed]))
        return [closed[index] for index in np.argsort(distances, kind="stable")]

    def start(self, starts: Floats) -> None:
        """Close the loops from some coordinates (n, c), within bounds where that is what it takes."""
        for limits in (False, True)[: 1 + self._has_limits]:
            self.found += self._closed(np.clip(starts, self._low, self._high), limits)
            if self.nearest()[0].gap <= TOLERANCES.file_gap:
                return

    def _closed(self, starts: Floats, limits: bool) -> list[ClosedHome]:
        """What Newton's method comes to from some coordinates (n, c)."""
        closure, count = self._closure, starts.shape[1]
        coordinates = np.zeros((len(starts), len(closure.scale)))
        coordinates[:, :count], coordinates[:, list(self._bridges)] = starts, list(self._bridges.values())
        poses = platform_poses(closure.mechanism, coordinates)
        ends = close(closure, coordinates, poses, locked=self._locked, limits=limits, closeness=0.1 * CLOSED)
        exact = close(closure, ends.coordinates, ends.poses, locked=self._locked, undamped=True, max_iterations=POLISH)
        found = []
        for pair in np.stack([exact.coordinates, ends.coordinates], axis=1)[:, :, :count]:
            one, other = (ClosedHome(q, self._loops.gap(q)) for q in np.clip(pair, self._low, self._high))
            found.append(one if one.gap < 2.0 * other.gap else other)
        return found

    def mirror(self, home: Floats) -> None:
        """Start from mirror images of the nearest one, across home, as near as each can come, until none is nearer."""
        least = np.inf
        while True:
            nearest = float(self._loops.distances(self.nearest()[0].q[None])[0])
            self.found += [self._settled(each) for each in self._apart(FARTHEST * nearest, SAME)]
            best = self.nearest()[0]
            nearest = float(self._loops.distances(best.q[None])[0])
            if nearest > NEARER * least:
                break
            least = nearest
            images = np.where(self._loops.columns_of_loops, 2.0 * home - best.q, best.q)
            self.start(np.where(self._free, images, home))
        self.found = self._apart(FARTHEST * least, APART * least)

    def _apart(self, most: float, least: float) -> list[ClosedHome]:
        """The nearest ones, a few, that are at most so far from the drawing [L], and apart in some coordinate by more.

        Parameters
        ----------
        least : difference of coordinates from which two are apart [rad or L].
        """
        chosen: list[ClosedHome] = []
        for each in self.nearest():
            is_apart = all((np.abs(each.q - other.q) > least * self._units).any() for other in chosen)
            if is_apart and len(chosen) < MOST and (not chosen or self._loops.distances(each.q[None])[0] <= most):
                chosen.append(each)
        return chosen

    def _settled(self, home: ClosedHome) -> ClosedHome:
        """The nearest to the drawing of the closed configurations that one can be moved to; itself, if it cannot move.

        Gauss-Newton on the bodies' shifts and turns, in the motions that keep the loops closed to first order.
        """
        share = 1.0
        for _ in range(SETTLING):
            errors, bodies = self._loops.linearised(home.q)
            _, singular, rows = np.linalg.svd(errors.slopes[:, self._free])
            motions = rows[int((singular > TOLERANCES.alignment * singular[0]).sum()) :].T
            if not motions.size or share < SAME:
                break
            toward = np.linalg.lstsq(bodies.slopes[:, self._free] @ motions, bodies.values, rcond=None)[0]
            trial = self._restored(self._moved(home.q, -share * motions @ toward))
            before, after = self._loops.distances(np.array([home.q, trial.q]))
            if trial.gap > max(2.0 * home.gap, CLOSED) or after >= before:
                share *= 0.3
                continue
            home, share = trial, min(1.0, 2.0 * share)
            if before - after <= SETTLED * before:
                break
        return home

    def _moved(self, q: Floats, step: Floats) -> Floats:
        """Coordinates after a step of the free ones, as rates of `screws`, within bounds."""
        whole = np.zeros((1, len(q)))
        whole[0, self._free] = step
        moved = stepped(self._loops.tree, q[None], whole)[0]
        return np.where(self._free, np.clip(moved, self._low, self._high), q)

    def _restored(self, q: Floats) -> ClosedHome:
        """The closed configuration next to one that is nearly closed, by least steps."""
        for _ in range(POLISH):
            errors, _ = self._loops.linearised(q)
            if np.abs(errors.values).max() <= 0.5 * CLOSED:
                break
            free = errors.slopes[:, self._free]
            step = np.linalg.lstsq(free, errors.values, rcond=TOLERANCES.alignment)[0]
            q = self._moved(q, -np.asarray(step, np.float64))
        q = np.where(np.abs(q) <= NOTHING * self._units, 0.0, q)
        return ClosedHome(q, self._loops.gap(q))
