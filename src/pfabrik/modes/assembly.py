"""Assembly modes: every configuration in which a mechanism can be assembled with given actuator values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Mask
from ..closure.close import Closing, Closure, close, closure_of, platform_poses
from ..closure.starts import random_starts
from ..description.mechanism import Mechanism
from ..errors import ContinuumOfSolutions, InvalidArgument
from ..fk import Actuators, as_values, solution_at
from ..motion.walks import stepped_freely
from ..tolerances import TOLERANCES
from .fingerprints import pose_marks
from .lists import ALONG, BATCH, LEAST_STARTS, STEPS, Clusters, Modes, as_count


@dataclass(frozen=True)
class AssemblyModes(Modes):
    """The assembly modes that were found, nearest to home first, and what that is worth: see `Modes`."""


def assembly_modes(mechanism: Mechanism, actuators: Actuators, *, most_starts: int = 40_000) -> AssemblyModes:
    """All poses in which the mechanism can be assembled with given actuator values, limits or not.

    Newton's method from random configurations of all joints, undamped, until every mode has been found ten times and
    at least 4096 starts have been made, or `most_starts`. This is a search, not a proof: each mode listed exists, its
    loops are closed to machine precision, and it is listed once; a mode whose basin is far smaller than those of the
    others can be missed, and `unseen` of the result says how likely another start is to find one. The same call gives
    the same answer. Modes are told apart by the end effector's pose (its position, if it is a joint).

    Parameters
    ----------
    actuators : one set of actuated coordinates, (n_a,), in the order of `mechanism.actuator_names`
        [length or rad], or joint name -> value.

    Raises
    ------
    ContinuumOfSolutions : the end effector still moves with these values locked (an architecturally singular machine,
        or too few actuators).
    InvalidArgument : values of the wrong shape, or not finite.
    """
    values, shape = as_values(mechanism, actuators)
    if shape != () or not np.isfinite(values).all():
        found = f"batch shape {shape}" if shape else "a value that is not finite"
        raise InvalidArgument("actuators", found, f"one set of {len(mechanism.actuator_names)} finite values")
    most_starts = as_count("most_starts", most_starts, 1)
    search = _Search(closure_of(mechanism), values)
    while search.starts < most_starts and not search.is_done:
        search.add_starts(BATCH)
    order = np.argsort(search.from_home, kind="stable")
    coordinates = np.zeros((len(order), len(search.closure.scale)))
    for row, place in enumerate(order):
        coordinates[row] = search.found.coordinates[place]
    polished = close(search.closure, coordinates, platform_poses(mechanism, coordinates), locked=search.locked)
    modes = solution_at(mechanism, polished.coordinates, np.repeat(values, len(order), axis=0))
    return AssemblyModes(tuple(modes), tuple(search.found.hits[place] for place in order), search.starts)


class _Search:
    """Modes found so far."""

    def __init__(self, closure: Closure, values: Floats) -> None:
        self.closure = closure
        self.values = values
        self.locked = closure.driven
        self.rng = np.random.default_rng(0)
        self.starts = 0
        self.found = Clusters()

    @property
    def is_done(self) -> bool:
        return self.starts >= LEAST_STARTS and self.found.are_well_known

    @property
    def from_home(self) -> Floats:
        """How far the end effector of each mode is from home, (modes,)."""
        home = self._marks(self.closure.mechanism.home_pose[None])
        return np.asarray(np.linalg.norm(np.reshape(self.found.marks, (-1, home.size)) - home, axis=1))

    def add_starts(self, n: int) -> None:
        """Try n more starts."""
        coordinates, poses = random_starts(self.closure, n, self.rng)
        if self.starts == 0:
            coordinates[0], poses[0] = 0.0, platform_poses(self.closure.mechanism, coordinates[:1] * 0.0)[0]
        self.starts += n
        self.closure.put_actuators(coordinates, np.repeat(self.values, n, axis=0))
        found = close(
            self.closure, coordinates, poses, locked=self.locked, undamped=True, closeness=1e-11, max_iterations=STEPS
        )
        self._sort(close(self.closure, found.coordinates, found.poses, locked=self.locked, max_iterations=4))

    def _sort(self, found: Closing) -> None:
        """Count the closed ones among the known modes, or as new ones."""
        closed = found.gap <= TOLERANCES.position
        coordinates, poses = found.coordinates[closed], found.poses[closed]

        def settle(row: int) -> tuple[Floats, Floats]:
            ended = close(self.closure, coordinates[[row]], poses[[row]], locked=self.locked, closeness=0.0)
            return self._marks(ended.poses)[0], ended.coordinates[0]

        known = len(self.found.hits)
        places = self.found.count(self._marks(poses), settle)
        for row, place in enumerate(places):
            self.found.prefer(int(place), coordinates[row], (float(np.abs(coordinates[row]).sum()),))
        self._refuse_continuum(range(known, len(self.found.hits)))

    def _refuse_continuum(self, fresh: range) -> None:
        """Raise where a new mode is one of a continuum: steps along its free motion, closed again, stay away.

        And stay apart from each other: of two single modes that have nearly met, steps of any length lead to the other.
        """
        for place in fresh:
            (ends, stay), (nearer, stay_too) = (self._stepped(place, along) for along in (ALONG, 0.5 * ALONG))
            gone_on = stay & stay_too & (np.abs(ends - nearer).max(axis=1) > 0.05 * ALONG)
            if gone_on.any():
                raise ContinuumOfSolutions(self.closure.mechanism.name, int(gone_on.sum()))

    def _stepped(self, place: int, along: float) -> tuple[Floats, Mask]:
        """Where steps along each free motion of a mode end once they are closed again, and which stay about so far."""
        moved = stepped_freely(self.closure.mechanism, self.found.coordinates[place], along)
        closed = close(self.closure, moved, platform_poses(self.closure.mechanism, moved), locked=self.locked)
        marks = self._marks(closed.poses)
        apart = np.abs(marks - self.found.marks[place]).max(axis=1)
        return marks, (apart > 0.1 * along) & (apart < 2.0 * along) & (closed.gap <= TOLERANCES.position)

    def _marks(self, poses: Floats) -> Floats:
        """What modes are told apart by, (n, 3 or 12): positions [L], and rotation matrices of a body."""
        marks = pose_marks(self.closure.mechanism, poses)
        return marks[:, :3] if self.closure.mechanism.end_effector_is_joint else marks
