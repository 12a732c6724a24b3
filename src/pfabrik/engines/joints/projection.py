"""Projection modes: the weights of the distance to an unreachable target, and the part that is held."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints
from ...common.derived import derived
from ...kernels.joints.loops import LOCKED
from ...kernels.rows import HOLD_NOTHING, HOLD_ORIENTATION, HOLD_POSITION
from ...machine.description.task import Weights
from ...machine.motion.loops import Closure
from ...tolerances import TOLERANCES
from .descend import limit_multipliers


class ProjectionMode(NamedTuple):
    """The objective of a projection.

    Attributes
    ----------
    weights : of the squares of position [L] and rotation [rad]; LOCKED for components that are held.
    hold : part of the target that is held: HOLD_NOTHING, HOLD_ORIENTATION or HOLD_POSITION.
    """

    weights: Weights
    hold: int

    @property
    def held(self) -> Weights:
        """The weights without an objective: LOCKED for held components, else 0."""
        return tuple(LOCKED if weight == LOCKED else 0.0 for weight in self.weights)

    def distances(self, closure: Closure, poses: Floats, targets: Floats) -> Floats:
        """Weighted distances of poses (n, 4, 4) from targets, (n,) [L]; held components do not count."""
        position, rotation = closure.task.errors(poses, targets)
        turning = np.sqrt(max((weight for weight in self.weights[3:] if weight != LOCKED), default=0.0))
        return np.asarray(np.hypot(position / closure.mechanism.characteristic_length, turning * rotation))


@derived
def projection_modes(closure: Closure, hold: str | None, rotation_length: float | None) -> tuple[ProjectionMode, ...]:
    """Projection modes in the order of trial: first with the held part, then with nothing held."""
    task, mechanism = closure.task, closure.mechanism
    turning = ((rotation_length or mechanism.rotation_length) / mechanism.characteristic_length) ** 2
    free = ProjectionMode(task.weights(1.0, turning), HOLD_NOTHING)
    if hold is None or not any(task.axes) or task.rotations == 0:
        return (free,)  # nothing to hold, or no other component
    if hold == "orientation":
        return ProjectionMode(task.weights(1.0, LOCKED), HOLD_ORIENTATION), free
    return ProjectionMode(task.weights(LOCKED, turning), HOLD_POSITION), free


def projection_multipliers(
    closure: Closure, coordinates: Floats, targets: Floats, projection: ProjectionMode
) -> Floats:
    """Multipliers of all limits at projected configurations (n, columns) of targets; see `limit_multipliers`."""
    return limit_multipliers(closure, coordinates, targets, platform=projection.weights, frame=closure.task.frame)


def held_parts(closure: Closure, holds: Ints, position: Floats, rotation: Floats) -> Ints:
    """Parts of targets that answers hold within tolerance, (n,), by their errors [length], [rad]; else HOLD_NOTHING.

    An answer to a clipped target may miss the part to be held.
    """
    misses_orientation = (holds == HOLD_ORIENTATION) & (rotation > TOLERANCES.held)
    misses_position = (holds == HOLD_POSITION) & (position > TOLERANCES.held * closure.mechanism.characteristic_length)
    return np.where(misses_orientation | misses_position, HOLD_NOTHING, holds)
