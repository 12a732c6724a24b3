"""The coordinates of a task, in the place of named joints: where the platform is, and how it is turned."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import compress
from typing import TypeAlias

import numpy as np

from ...answers.solution import Solution
from ...common.arrays import Floats, Ints
from ...common.rotations import CROSSED, from_rotvec, to_rotvec, turning, yaws
from ...kinematics import JointPath, Task, generic_of, task_of
from ...machine.description.mechanism import Mechanism
from ...tolerances import TOLERANCES

TURNS = {3: ("rx", "ry", "rz"), 2: ("tilt_x", "tilt_y"), 1: ("yaw",), 0: ()}
"""Names of the rotations, by how many the task sets: a rotation vector; that of a tilt, which has no z; the yaw."""


@dataclass(frozen=True, eq=False)
class TaskPath:
    """The coordinates that a task sets.

    Positions are those of the reference point [length]; a rotation is a rotation vector [rad], a tilt that of the
    shortest turn of the platform's z axis, whose z is 0; a yaw is the twist about z that is left of a rotation. What
    the platform never changes (z of a planar machine) is left out.
    """

    mechanism: Mechanism

    @cached_property
    def _task(self) -> Task:
        return task_of(self.mechanism)

    @cached_property
    def _set(self) -> tuple[str, ...]:
        """All that the task sets: of x, y, z those that it has, then rotations."""
        return (*compress("xyz", self._task.axes), *TURNS[self._task.rotations])

    @cached_property
    def _places(self) -> Ints:
        """Places among them of those that the platform changes."""
        twists = generic_of(self.mechanism).directions
        moves = np.abs(self._all_rates(self.mechanism.home_pose[None])[0] @ twists).max(axis=1, initial=0.0)
        return np.flatnonzero(moves > TOLERANCES.alignment)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates."""
        return tuple(self._set[place] for place in self._places)

    @cached_property
    def home(self) -> Floats:
        """Their values at home, (k,)."""
        return np.asarray(self.at(self.mechanism.home_pose[None])[0])

    @cached_property
    def low(self) -> Floats:
        """Lowest values: a task has no ranges."""
        return np.full(len(self.names), -np.inf)

    @cached_property
    def high(self) -> Floats:
        """Highest values."""
        return np.full(len(self.names), np.inf)

    @cached_property
    def is_angle(self) -> tuple[bool, ...]:
        """Which of them are angles."""
        return tuple(name not in ("x", "y", "z") for name in self.names)

    def poses(self, q: Floats) -> Floats:
        """Targets (n, 4, 4) [length] with coordinates q (n, k); what the task leaves out is as at home."""
        poses = np.repeat(self.mechanism.home_pose[None], len(q), axis=0)
        values = np.repeat(self._values(poses[:1]), len(q), axis=0)
        values[:, self._places] = q
        n = sum(self._task.axes)
        poses[:, np.flatnonzero(self._task.axes), 3] = values[:, :n]
        if self._task.rotations:
            poses[:, :3, :3] = from_rotvec(self._vectors(values[:, n:]))
        return poses

    def of(self, solution: Solution) -> Floats:
        """The coordinates (n, k) of a solution's poses."""
        return self.at(solution.pose.reshape(-1, 4, 4))

    def at(self, poses: Floats) -> Floats:
        """The coordinates (n, k) of poses (n, 4, 4)."""
        return self._values(poses)[:, self._places]

    def _values(self, poses: Floats) -> Floats:
        """All that the task sets, (n, m), of poses (n, 4, 4)."""
        parts = [poses[:, :3, 3][:, list(self._task.axes)]]
        if self._task.rotations == 3:
            parts.append(to_rotvec(poses[:, :3, :3]))
        elif self._task.rotations == 2:
            parts.append(_tilts(poses[:, :3, 2]))
        elif self._task.rotations == 1:
            parts.append(yaws(poses[:, :3, :3])[:, None])
        return np.concatenate(parts, axis=1)

    def vectors_at(self, poses: Floats) -> Floats:
        """The rotation vectors (n, 3) [rad] that the task sets at poses (n, 4, 4); 0 without."""
        return self._vectors(self._values(poses)[:, sum(self._task.axes) :])

    def spread(self, rates: Floats) -> tuple[Floats, Floats]:
        """Rates (n, k) as those of rotation vectors (n, 3), and twists (n, 6) of the translations alone."""
        whole, twists = np.zeros((len(rates), len(self._set))), np.zeros((len(rates), 6))
        whole[:, self._places] = rates
        n = sum(self._task.axes)
        twists[:, np.flatnonzero(self._task.axes)] = whole[:, :n]
        return self._vectors(whole[:, n:]), twists

    def rates(self, poses: Floats) -> Floats:
        """Rates of the coordinates by the twist of the platform, (n, k, 6); (n, k, 3) for a joint end effector."""
        return self._all_rates(poses)[:, self._places]

    def rates_of(self, motions: Floats, twists: Floats) -> Floats:
        """Rates of the coordinates near home, (n, k, f), by the twists (n, 6, f) of f motions."""
        return np.asarray(self.rates(np.repeat(self.mechanism.home_pose[None], len(twists), axis=0)) @ twists)

    def _all_rates(self, poses: Floats) -> Floats:
        """Rates of all that the task sets, (n, m, 6) or (n, m, 3).

        A rotation vector v turns the platform at J(v) dv/dt. With z the platform's z axis, a tilt's v has
        z' = (J dv/dt) x z = w x z, and what is left of the angular velocity w along z is the yaw's.
        """
        n, task = len(poses), self._task
        rows = np.zeros((n, len(self._set), 3 if self.mechanism.end_effector_is_joint else 6))
        for row, axis in enumerate(np.flatnonzero(task.axes)):
            rows[:, row, axis] = 1.0
        first = sum(task.axes)
        if task.rotations == 3:
            rows[:, first:, 3:] = np.linalg.inv(turning(to_rotvec(poses[:, :3, :3])))
        elif task.rotations:
            z = poses[:, :3, 2]
            tilts = turning(np.pad(_tilts(z), ((0, 0), (0, 1))))[:, :, :2]
            across = -(z @ CROSSED).reshape(-1, 3, 3)
            of_tilt = np.linalg.pinv(across @ tilts) @ across
            if task.rotations == 2:
                rows[:, first:, 3:] = of_tilt
            else:
                rows[:, first, 3:] = z - (z[:, None] @ tilts @ of_tilt)[:, 0]
        return rows

    def _vectors(self, turns: Floats) -> Floats:
        vectors = np.zeros((len(turns), 3))
        places = {3: [0, 1, 2], 2: [0, 1], 1: [2], 0: []}[self._task.rotations]
        vectors[:, places] = turns
        return vectors


Coordinates: TypeAlias = JointPath | TaskPath


def _tilts(z: Floats) -> Floats:
    """Rotation vectors, of which x and y (n, 2) [rad], of the shortest turns that take z to unit vectors (n, 3)."""
    sines = np.hypot(z[:, 0], z[:, 1])
    angles = np.arctan2(sines, z[:, 2])
    factors = np.divide(angles, sines, out=np.ones_like(angles), where=sines > 0.0)
    return np.asarray(factors[:, None] * np.stack([-z[:, 1], z[:, 0]], axis=1))
