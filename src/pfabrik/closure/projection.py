"""What the nearest feasible configuration to a target is: what counts of the distance, and what is held."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Floats, Ints
from ..derived import derived
from ..description.task import Weights
from ..kernels.closure.loops import LOCKED
from ..kernels.rows import HOLD_NOTHING, HOLD_ORIENTATION, HOLD_POSITION
from ..motion.closure import Closure
from ..tolerances import TOLERANCES
from .descend import limit_multipliers


class ProjectionMode(NamedTuple):
    """The objective of a projection.

    Attributes
    ----------
    weights : of the squares of position [L] and rotation [rad]; LOCKED for components that are held.
    hold : the part of the target that is held: HOLD_NOTHING, HOLD_ORIENTATION or HOLD_POSITION.
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
    """The projection modes in the order in which they are tried: first with the held part, then with nothing held."""
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
    """Multipliers of all limits, as of `limit_multipliers`, at projected configurations (n, columns) of targets."""
    return limit_multipliers(closure, coordinates, targets, platform=projection.weights, frame=closure.task.frame)


def held_parts(closure: Closure, holds: Ints, position: Floats, rotation: Floats) -> Ints:
    """The parts of targets that poses really hold, (n,), from their errors [length], [rad]; else HOLD_NOTHING.

    An answer to a clipped target may miss the part that it was to hold.
    """
    is_turned = (holds == HOLD_ORIENTATION) & (rotation > TOLERANCES.held)
    is_moved = (holds == HOLD_POSITION) & (position > TOLERANCES.held * closure.mechanism.characteristic_length)
    return np.where(is_turned | is_moved, HOLD_NOTHING, holds)
