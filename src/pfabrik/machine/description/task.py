"""Tasks: the components of a pose that a target sets; the others follow from the mechanism."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...common.arrays import Floats
from ...common.derived import derived
from ...common.rotations import angles_between, from_rotvec, nearest_turn, shortest_turns, yaws
from ...kernels.joints.loops import BASE_AXES, HALF_WAY, LOCKED, TARGET_AXES
from .joints import TASK_TURNS
from .mechanism import Mechanism

Weights = tuple[float, ...]


@dataclass(frozen=True)
class Task:
    """Which coordinates of a pose count: of the position x, y, z, and of the rotation all, the tilt, the yaw, or none.

    The tilt is the direction of the platform's z axis: two rotations, about the x and y axes of the target. The yaw is
    the twist about z that is left of a rotation R when the z axis is turned back the shortest way: R = S Rz(yaw).

    Attributes
    ----------
    rotations : how many of the rotation's freedoms count: 3, 2 (the tilt), 1 (the yaw), or 0.
    """

    axes: tuple[bool, bool, bool]
    rotations: int

    @property
    def is_whole_pose(self) -> bool:
        return all(self.axes) and self.rotations == 3

    @property
    def turns(self) -> tuple[bool, bool, bool]:
        """Which rotations count, about x, y and z; of a tilt, about those of the target."""
        return self.rotations > 1, self.rotations > 1, self.rotations % 2 == 1

    def turning_axes(self, poses: Floats) -> Floats:
        """Axes of the rotations at poses (..., 4, 4): unit vectors (..., k, 3) in the base frame."""
        turned = np.swapaxes(poses[..., :3, :3], -1, -2)
        axes = turned if self.rotations == 2 else np.broadcast_to(np.eye(3), turned.shape)
        return np.asarray(axes[..., list(self.turns), :])

    def twists(self, poses: Floats) -> Floats:
        """The motions that it sets at poses (..., 4, 4): unit twists (..., k, 6), each along or about one axis."""
        lines, turns = np.eye(3)[list(self.axes)], self.turning_axes(poses)
        found = np.zeros((*turns.shape[:-2], len(lines) + turns.shape[-2], 6))
        found[..., : len(lines), :3], found[..., len(lines) :, 3:] = lines, turns
        return found

    @property
    def frame(self) -> int:
        """What rotations count about, for the closure kernel: axes of which those count that the weights say."""
        return {2: TARGET_AXES, 1: HALF_WAY}.get(self.rotations, BASE_AXES)

    def weights(self, position: float, rotation: float) -> Weights:
        """Weights of a pose's coordinates, for the closure kernel: those given; 0 for what does not count."""
        turns = (rotation if counts else 0.0 for counts in self.turns)
        return (*(position if counts else 0.0 for counts in self.axes), *turns)

    @property
    def held(self) -> Weights:
        """Weights that hold all that counts."""
        return self.weights(LOCKED, LOCKED)

    @property
    def left_out(self) -> Task:
        """What does not count: with the tilt goes the yaw, with the yaw the tilt."""
        x, y, z = self.axes
        return Task((not x, not y, not z), 3 - self.rotations)

    def completed(self, targets: Floats, begin: Floats) -> Floats:
        """Targets (n, 4, 4), with what does not count as it is in other poses (n, 4, 4)."""
        wanted = targets.copy()
        wanted[:, :3, 3] = np.where(self.axes, targets[:, :3, 3], begin[:, :3, 3])
        if self.rotations == 0:
            wanted[:, :3, :3] = begin[:, :3, :3]
        elif self.rotations == 1:
            turned = self._yaw_errors(targets, begin)[:, None] * np.array([0.0, 0.0, 1.0])
            wanted[:, :3, :3] = from_rotvec(turned) @ begin[:, :3, :3]
        elif self.rotations == 2:
            wanted[:, :3, :3] = shortest_turns(begin[:, :3, 2], targets[:, :3, 2]) @ begin[:, :3, :3]
        return wanted

    def errors(self, poses: Floats, targets: Floats) -> tuple[Floats, Floats]:
        """Distances [length] and angles [rad] between poses in what counts, (n,) each."""
        offset = np.where(self.axes, (poses - targets)[:, :3, 3], 0.0)
        if self.rotations == 0:
            return norms(offset), np.zeros(len(poses))
        if self.rotations == 1:
            return norms(offset), np.abs(self._yaw_errors(poses, targets))
        if self.rotations == 2:
            return norms(offset), 2.0 * np.arcsin(np.minimum(norms((poses - targets)[:, :3, 2]) / 2.0, 1.0))
        return norms(offset), angles_between(poses[:, :3, :3], targets[:, :3, :3])

    @staticmethod
    def _yaw_errors(poses: Floats, others: Floats) -> Floats:
        """By how much poses yaw more than others, within half a turn, (n,) [rad]."""
        return nearest_turn(yaws(poses[:, :3, :3]) - yaws(others[:, :3, :3]))


@derived
def task_of(mechanism: Mechanism) -> Task:
    """A mechanism's task. Of a joint end effector only the position ever counts."""
    asked = mechanism.task
    rotations = max(TASK_TURNS.get(each, 0) for each in asked)
    return Task(("x" in asked, "y" in asked, "z" in asked), rotations)


def norms(vectors: Floats) -> Floats:
    """Lengths of vectors (n, 3), (n,); however long they are, they are finite: at most the largest number there is."""
    with np.errstate(over="ignore"):
        lengths = np.hypot(np.hypot(vectors[:, 0], vectors[:, 1]), vectors[:, 2])
    return np.asarray(np.where(np.isinf(lengths), np.finfo(float).max, lengths))
