"""What a target sets of a pose, and what follows from the mechanism."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..kernels.closure.loops import LOCKED
from ..rotations import shortest_turns
from .mechanism import Mechanism

Floats = NDArray[np.float64]
Weights = tuple[float, ...]


@dataclass(frozen=True)
class Task:
    """Which coordinates of a pose count: of the position x, y, z, and of the rotation all three, the tilt, or none.

    The tilt is the direction of the platform's z axis: two rotations, about the x and y axes of the target.
    """

    axes: tuple[bool, bool, bool]
    rotations: int

    @property
    def is_whole_pose(self) -> bool:
        return all(self.axes) and self.rotations == 3

    @property
    def is_framed(self) -> bool:
        """Whether rotations count about the target's own axes: two of three do not count alike about the base's."""
        return self.rotations == 2

    def weights(self, position: float, rotation: float) -> Weights:
        """Weights of a pose's coordinates, for the closure kernel: those given; 0 for what does not count."""
        turns = [rotation if place < self.rotations else 0.0 for place in range(3)]
        return (*(position if counts else 0.0 for counts in self.axes), *turns)

    @property
    def held(self) -> Weights:
        """Weights that hold all that counts."""
        return self.weights(LOCKED, LOCKED)

    def completed(self, targets: Floats, begin: Floats) -> Floats:
        """Targets (n, 4, 4), with what does not count as it is in other poses (n, 4, 4)."""
        wanted = targets.copy()
        wanted[:, :3, 3] = np.where(self.axes, targets[:, :3, 3], begin[:, :3, 3])
        if self.rotations == 0:
            wanted[:, :3, :3] = begin[:, :3, :3]
        elif self.rotations == 2:
            wanted[:, :3, :3] = shortest_turns(begin[:, :3, 2], targets[:, :3, 2]) @ begin[:, :3, :3]
        return wanted

    def errors(self, poses: Floats, targets: Floats) -> tuple[Floats, Floats]:
        """Distances [length] and angles [rad] between poses in what counts, (n,) each."""
        offset = np.where(self.axes, (poses - targets)[:, :3, 3], 0.0)
        if self.rotations == 0:
            return norms(offset), np.zeros(len(poses))
        if self.rotations == 2:
            return norms(offset), 2.0 * np.arcsin(np.minimum(norms((poses - targets)[:, :3, 2]) / 2.0, 1.0))
        turned = poses[:, :3, :3] @ np.swapaxes(targets[:, :3, :3], 1, 2)
        half_sine = np.linalg.norm(turned - np.eye(3), axis=(1, 2)) / np.sqrt(8.0)
        return norms(offset), 2.0 * np.arcsin(np.minimum(half_sine, 1.0))


@lru_cache(maxsize=256)
def task_of(mechanism: Mechanism) -> Task:
    """A mechanism's task. Of a joint end effector only the position ever counts."""
    asked = mechanism.task
    rotations = 3 if "rotation" in asked else 2 if "tilt" in asked else 0
    return Task(("x" in asked, "y" in asked, "z" in asked), rotations)


def norms(vectors: Floats) -> Floats:
    """Lengths of vectors (n, 3), (n,); however long they are, they are finite: at most the largest number there is."""
    with np.errstate(over="ignore"):
        lengths = np.hypot(np.hypot(vectors[:, 0], vectors[:, 1]), vectors[:, 2])
    return np.asarray(np.where(np.isinf(lengths), np.finfo(float).max, lengths))
