"""Assembly modes: every configuration in which a mechanism can be assembled with given actuator values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from .closure import Closing, Closure, close, closure_of
from .closure_ik import platform_poses
from .completion import set_actuators
from .differential import stepped_freely
from .errors import ContinuumOfSolutions, InvalidArgument
from .fk import answered, as_values
from .mechanism import Mechanism
from .solution import Solution
from .starts import random_starts
from .tolerances import TOLERANCES

Floats = NDArray[np.float64]

BATCH = 512
"""Starts between two looks at what was found."""

LEAST_STARTS = 4096
"""Starts before a search may end: a mode that one start in 500 finds is missed by all of them once in 3600 searches."""

HITS = 10
"""How often every mode is found before a search ends: an unseen mode as rare as the rarest seen is then unlikely."""

STEPS = 80
"""Newton steps a start may take; most need fewer than 20."""

ALONG = 1e-3
"""How far a singular solution is moved along its free motion to see whether that goes on [L or rad]: far enough to
tell a continuum from a double root, not so far as to meet another solution."""


@dataclass(frozen=True)
class AssemblyModes(Sequence[Solution]):
    """The modes that were found, nearest to home first, and what that is worth.

    Attributes
    ----------
    modes : one Solution each: REACHED within all limits; EXCEEDED beyond some, which `active_limits` names.
    hits : how many starts led to each.
    starts : how many starts were made.
    """

    modes: tuple[Solution, ...]
    hits: tuple[int, ...]
    starts: int

    @property
    def unseen(self) -> float:
        """Probability, about, that another start would find a new mode: those found once over all starts (Good-Turing).

        Where all were found more often, the 95 % bound for something not yet seen, three over all starts.
        """
        return max(3, sum(hits == 1 for hits in self.hits)) / self.starts

    @overload
    def __getitem__(self, index: int) -> Solution: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Solution, ...]: ...
    def __getitem__(self, index: int | slice) -> Solution | tuple[Solution, ...]:
        return self.modes[index]

    def __len__(self) -> int:
        return len(self.modes)


def assembly_modes(mechanism: Mechanism, actuators: Any, *, most_starts: int = 40_000) -> AssemblyModes:
    """All poses in which the mechanism can be assembled with given actuator values, limits or not.

    Newton's method from random configurations of all joints, undamped, until every mode has been found ten times and
    at least 4096 starts have been made, or `most_starts`. This is a search, not a proof: each mode listed exists, its
    loops are closed to machine precision, and it is listed once; a mode whose basin is far smaller than those of the
    others can be missed, and `unseen` of the result says how likely another start is to find one. The same call gives
    the same answer. Modes are told apart by the end effector's pose (its position, if it is a joint).

    Parameters
    ----------
    actuators : one set of actuated coordinates, (n_a,), in the order of `mechanism.actuators` [length or rad].

    Raises
    ------
    ContinuumOfSolutions : the end effector still moves with these values locked (an architecturally singular machine,
        or too few actuators).
    InvalidArgument : values of the wrong shape, or not finite.
    """
    values, shape = as_values(mechanism, actuators)
    if shape != () or not np.isfinite(values).all():
        found = f"batch shape {shape}" if shape else "a value that is not finite"
        raise InvalidArgument("actuators", found, f"one set of {len(mechanism.actuators)} finite values")
    search = _Search(closure_of(mechanism), values)
    while search.starts < most_starts and not search.is_done:
        search.go_on(BATCH)
    order = np.argsort(search.from_home, kind="stable")
    coordinates = np.zeros((len(order), len(search.closure.scale)))
    for row, place in enumerate(order):
        coordinates[row] = search.coordinates[place]
    polished = close(search.closure, coordinates, platform_poses(mechanism, coordinates), locked=search.locked)
    modes = answered(mechanism, polished.coordinates, np.repeat(values, len(order), axis=0))
    return AssemblyModes(tuple(modes), tuple(search.hits[place] for place in order), search.starts)


class _Search:
    """Modes found so far."""

    def __init__(self, closure: Closure, values: Floats) -> None:
        self.closure = closure
        self.values = values
        self.locked = frozenset(closure.mechanism.actuators)
        self.rng = np.random.default_rng(0)
        self.starts = 0
        self.coordinates: list[Floats] = []
        self.marks: list[Floats] = []
        self.hits: list[int] = []
        self.from_home: list[float] = []

    @property
    def is_done(self) -> bool:
        return self.starts >= LEAST_STARTS and min(self.hits, default=HITS) >= HITS

    def go_on(self, n: int) -> None:
        """Try n more starts."""
        coordinates, poses = random_starts(self.closure, n, self.rng)
        if self.starts == 0:
            coordinates[0], poses[0] = 0.0, platform_poses(self.closure.mechanism, coordinates[:1] * 0.0)[0]
        self.starts += n
        set_actuators(self.closure.mechanism, coordinates, np.repeat(self.values, n, axis=0))
        found = close(
            self.closure, coordinates, poses, locked=self.locked, plunging=True, closeness=1e-11, max_iterations=STEPS
        )
        self._sort(close(self.closure, found.coordinates, found.poses, locked=self.locked, max_iterations=4))

    def _sort(self, found: Closing) -> None:
        """Count the closed ones among the known modes, or as new ones."""
        marks = self._marks(found.poses)
        fresh = []
        for row in np.flatnonzero(found.gap <= TOLERANCES.position):
            place = self._known(marks[row])
            if place is None:
                place = self._add(found.coordinates[row], found.poses[row])
            if place == len(self.hits) - 1 and self.hits[place] == 0:
                fresh.append(place)
            self.hits[place] += 1
            if np.abs(found.coordinates[row]).sum() < np.abs(self.coordinates[place]).sum():
                self.coordinates[place] = found.coordinates[row]
        self._refuse_continuum(fresh)

    def _known(self, mark: Floats) -> int | None:
        if not self.marks:
            return None
        apart = np.abs(np.array(self.marks) - mark).max(axis=1)
        place = int(apart.argmin())
        return place if apart[place] <= TOLERANCES.same_mode else None

    def _add(self, coordinates: Floats, pose: Floats) -> int:
        """Number of the mode that a closed configuration belongs to: a new one, unless it ends at a known one.

        Near solutions that are singular the loops are as good as closed some way off: Newton's method goes on to them.
        """
        ended = close(self.closure, coordinates[None], pose[None], locked=self.locked, closeness=0.0)
        mark = self._marks(ended.poses)[0]
        known = self._known(mark)
        if known is not None:
            return known
        offset = (ended.poses[0] - self.closure.mechanism.home_pose)[:3]
        offset[:, 3] /= self.closure.mechanism.characteristic_length
        self.marks.append(mark)
        self.coordinates.append(ended.coordinates[0])
        self.hits.append(0)
        self.from_home.append(float(np.linalg.norm(offset)))
        return len(self.hits) - 1

    def _refuse_continuum(self, fresh: list[int]) -> None:
        """Raise where a new mode is one of a continuum: a step along its free motion, closed again, stays away."""
        mechanism = self.closure.mechanism
        for place in fresh:
            moved = stepped_freely(mechanism, self.coordinates[place], ALONG)
            if not len(moved):
                continue
            closed = close(self.closure, moved, platform_poses(mechanism, moved), locked=self.locked)
            apart = np.abs(self._marks(closed.poses) - self.marks[place]).max(axis=1)
            gone_on = (apart > 0.1 * ALONG) & (apart < 2.0 * ALONG) & (closed.gap <= TOLERANCES.position)
            if gone_on.any():
                raise ContinuumOfSolutions(mechanism.name, int(gone_on.sum()))

    def _marks(self, poses: Floats) -> Floats:
        """What modes are told apart by, (n, 3 or 12): positions [L], and rotation matrices of a body."""
        positions = poses[:, :3, 3] / self.closure.mechanism.characteristic_length
        if self.closure.mechanism.end_effector_is_joint:
            return np.asarray(positions)
        return np.concatenate([positions, poses[:, :3, :3].reshape(-1, 9)], axis=1)
