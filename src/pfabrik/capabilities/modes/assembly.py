"""Assembly modes: every configuration in which a mechanism can be assembled with given actuator values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...answers.solution import Solution
from ...answers.words import pose_cells, pose_columns
from ...common.arrays import Floats, Mask
from ...common.checks import require_count
from ...engines.joints.close import Closing, close, platform_poses
from ...engines.joints.multistart import random_starts
from ...errors import ContinuumOfSolutions, InvalidArgument
from ...fk import Actuators, as_values, solution_at
from ...kinematics import model_of
from ...machine.description.mechanism import Mechanism
from ...machine.motion.loops import Closure
from ...machine.motion.mobility import stepped_freely
from ...tolerances import TOLERANCES
from .fingerprints import pose_marks
from .lists import ALONG, BATCH, LEAST_STARTS, STEPS, Clusters, Modes


@dataclass(frozen=True)
class AssemblyModes(Modes):
    """Assembly modes found by a search, nearest to home first.

    Attributes
    ----------
    modes : tuple of Solution
        A Solution per mode: REACHED within all limits; EXCEEDED beyond those in `active_limits`.
    hits : tuple of int
        Number of starts that found each mode.
    starts : int
        Number of starts.
    """

    kind = "assembly"

    @staticmethod
    def _columns(mechanism: Mechanism) -> list[str]:
        return pose_columns(mechanism)

    @staticmethod
    def _cells(mode: Solution) -> list[str]:
        return pose_cells(mode)


def assembly_modes(mechanism: Mechanism, actuators: Actuators, *, most_starts: int = 40_000) -> AssemblyModes:
    """All poses in which the mechanism can be assembled with given actuator values, regardless of limits.

    Newton's method, undamped, starts from random configurations of all joints until every mode has been found ten times
    and at least 4096 starts have been made, or `most_starts`. This is a search, not a proof: each mode listed exists,
    its loops are closed to machine precision, and it is listed once; a mode whose basin is far smaller than those of
    the others can be missed. `unseen` of the result estimates the probability that another start finds a new one. The
    same call gives the same answer. Modes differ in the end effector's pose (its position, if it is a joint).

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    actuators : array (n_a,) or mapping of str to float
        One set of actuated coordinates, in the order of `mechanism.actuator_names` [length or rad], or joint name ->
        value.
    most_starts : int, optional
        Most starts.

    Raises
    ------
    ContinuumOfSolutions
        The end effector still moves with these values locked (an architecturally singular machine, or too few
        actuators).
    InvalidArgument
        Values of the wrong shape, or not finite.
    """
    values, shape = as_values(mechanism, actuators)
    if shape != () or not np.isfinite(values).all():
        actual = f"batch shape {shape}" if shape else "a value that is not finite"
        raise InvalidArgument("actuators", actual, f"one set of {len(mechanism.actuator_names)} finite values")
    most_starts = require_count("most_starts", most_starts)
    search = _Search(model_of(mechanism).closure, values)
    while search.starts < most_starts and not search.is_done:
        search.add_starts(BATCH)
    order = np.argsort(search.distances_from_home, kind="stable")
    coordinates = np.zeros((len(order), len(search.closure.scale)))
    for row, place in enumerate(order):
        coordinates[row] = search.clusters.coordinates[place]
    polished = close(search.closure, coordinates, platform_poses(mechanism, coordinates), locked=search.locked)
    modes = solution_at(mechanism, polished.coordinates, np.repeat(values, len(order), axis=0))
    return AssemblyModes(tuple(modes), tuple(search.clusters.hits[place] for place in order), search.starts)


class _Search:
    """A search for assembly modes, with a cluster for every mode found so far."""

    def __init__(self, closure: Closure, values: Floats) -> None:
        self.closure = closure
        self.values = values
        self.locked = closure.driven
        self.rng = np.random.default_rng(0)
        self.starts = 0
        self.clusters = Clusters()

    @property
    def is_done(self) -> bool:
        """True after enough starts, if every mode was found often enough."""
        return self.starts >= LEAST_STARTS and self.clusters.are_well_known

    @property
    def distances_from_home(self) -> Floats:
        """Distance of the end effector of each mode from home, (modes,)."""
        home = self._marks(self.closure.mechanism.home_pose[None])
        return np.asarray(np.linalg.norm(np.reshape(self.clusters.marks, (-1, home.size)) - home, axis=1))

    def add_starts(self, n: int) -> None:
        """Search from n more random starts, the first of all from home."""
        coordinates, poses = random_starts(self.closure, n, self.rng)
        if self.starts == 0:
            coordinates[0], poses[0] = 0.0, platform_poses(self.closure.mechanism, coordinates[:1] * 0.0)[0]
        self.starts += n
        self.closure.put_actuators(coordinates, np.repeat(self.values, n, axis=0))
        trial = close(
            self.closure, coordinates, poses, locked=self.locked, undamped=True, closeness=1e-11, max_iterations=STEPS
        )
        self._assign(close(self.closure, trial.coordinates, trial.poses, locked=self.locked, max_iterations=4))

    def _assign(self, closing: Closing) -> None:
        """Assign the closed configurations to existing or new clusters."""
        is_closed = closing.gap <= TOLERANCES.position
        coordinates, poses = closing.coordinates[is_closed], closing.poses[is_closed]

        def polish(row: int) -> tuple[Floats, Floats]:
            polished = close(self.closure, coordinates[[row]], poses[[row]], locked=self.locked, closeness=0.0)
            return self._marks(polished.poses)[0], polished.coordinates[0]

        n_known = len(self.clusters.hits)
        places = self.clusters.count(self._marks(poses), polish)
        for row, place in enumerate(places):
            self.clusters.prefer(int(place), coordinates[row], (float(np.abs(coordinates[row]).sum()),))
        self._refuse_continuum(range(n_known, len(self.clusters.hits)))

    def _refuse_continuum(self, new_places: range) -> None:
        """Raise if a new mode is part of a continuum: steps along its free motion, closed again, do not return to it.

        Steps of two lengths must also end apart: if two isolated modes nearly coincide, steps of any length end at the
        other one.
        """
        for place in new_places:
            (whole, stays), (half, half_stays) = (self._step_freely(place, along) for along in (ALONG, 0.5 * ALONG))
            is_free = stays & half_stays & (np.abs(whole - half).max(axis=1) > 0.05 * ALONG)
            if is_free.any():
                raise ContinuumOfSolutions(self.closure.mechanism.name, int(is_free.sum()))

    def _step_freely(self, place: int, along: float) -> tuple[Floats, Mask]:
        """Marks after a step along each free motion of a mode, closed again; mask of steps that keep their length."""
        moved = stepped_freely(self.closure.mechanism, self.clusters.coordinates[place], along)
        closed = close(self.closure, moved, platform_poses(self.closure.mechanism, moved), locked=self.locked)
        marks = self._marks(closed.poses)
        apart = np.abs(marks - self.clusters.marks[place]).max(axis=1)
        return marks, (apart > 0.1 * along) & (apart < 2.0 * along) & (closed.gap <= TOLERANCES.position)

    def _marks(self, poses: Floats) -> Floats:
        """Marks of modes, (n, 3 or 12): positions [L], and rotation matrices of a body."""
        marks = pose_marks(self.closure.mechanism, poses)
        return marks[:, :3] if self.closure.mechanism.end_effector_is_joint else marks
