"""Projection modes: the weights of the distance to an unreachable target, and the part that is held."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints
from ...common.derived import derived
from ...kernels.joints.loops import LOCKED
from ...kernels.rows import HOLD_NOTHING, HOLD_ORIENTATION, HOLD_POSITION
from ...kernels.search_constants import COARSELY, MOST_ROUNDED, ROUNDED_OFF
from ...machine.description.task import Weights
from ...machine.motion.loops import Closure
from ...options import Options
from ...tolerances import TOLERANCES
from .descend import limit_multipliers


class ProjectionMode(NamedTuple):
    """The objective of a projection.

    Attributes
    ----------
    weights : of the squares of position [L] and rotation [rad]; LOCKED for components that are held.
    hold : part of the target that is held: HOLD_NOTHING, HOLD_ORIENTATION or HOLD_POSITION.
    price : of the error of that part, where it is held up to a price [L per rad, or per L]; else 0.
    rounding : share of the distance that the price is rounded off by.
    """

    weights: Weights
    hold: int
    price: float = 0.0
    rounding: float = 0.0

    @property
    def held(self) -> Weights:
        """The weights without an objective: LOCKED for held components, else 0."""
        return tuple(LOCKED if weight == LOCKED else 0.0 for weight in self.weights)

    @property
    def coarse(self) -> ProjectionMode:
        """The same with its price rounded off farther: to find basins."""
        return self._replace(rounding=rounding_of(self.price, COARSELY))

    def distances(self, closure: Closure, position: Floats, rotation: Floats) -> Floats:
        """Distances with the price, (n,) [L], of errors (n,) [length], [rad]; held components do not count."""
        turning = np.sqrt(max((weight for weight in self.weights[3:] if weight != LOCKED), default=0.0))
        place = position / closure.mechanism.characteristic_length
        return np.asarray(
            np.hypot(place, turning * rotation) + self.price * (place if self.hold == HOLD_POSITION else rotation)
        )


def rounding_of(price: float, share: float) -> float:
    """A share of the distance that a price is rounded off by, small enough for any price."""
    return min(share, MOST_ROUNDED / price)


def modes_of(closure: Closure, options: Options) -> tuple[ProjectionMode, ...]:
    """The projection modes of options."""
    return projection_modes(closure, options.hold, options.rotation_length, options.hold_price)


@derived
def projection_modes(
    closure: Closure, hold: str | None, rotation_length: float | None, hold_price: float
) -> tuple[ProjectionMode, ...]:
    """A single mode with nothing held, or one in which a part is held, and one in which it is up to its price.

    A radian about the middle of the platform's joints is what has the price: seen from a tool's tip far from there, the
    same turn moves the tip too.
    """
    task, mechanism = closure.task, closure.mechanism
    turning = ((rotation_length or mechanism.rotation_length) / mechanism.characteristic_length) ** 2
    weights = task.weights(1.0, turning)
    if hold is None or not any(task.axes) or task.rotations == 0:
        return (ProjectionMode(weights, HOLD_NOTHING),)  # nothing to hold, or no other component
    if hold == "position":
        price, held = hold_price, ProjectionMode(task.weights(LOCKED, turning), HOLD_POSITION)
    else:
        points, lever = mechanism.platform_points, 0.0
        if len(points):
            lever = float(np.linalg.norm(points.mean(axis=0) - mechanism.reference_point))
        price = hold_price + lever / mechanism.characteristic_length
        held = ProjectionMode(task.weights(1.0, LOCKED), HOLD_ORIENTATION)
    return held, ProjectionMode(weights, held.hold, price, rounding_of(price, ROUNDED_OFF))


def with_coarse(modes: tuple[ProjectionMode, ...]) -> tuple[ProjectionMode, ...]:
    """Projection modes of searches: where a part is held, also up to a price that is rounded off farther."""
    return (*modes, modes[1].coarse) if len(modes) > 1 else modes


def projection_multipliers(
    closure: Closure, coordinates: Floats, targets: Floats, projection: ProjectionMode
) -> Floats:
    """Multipliers of all limits at projected configurations (n, columns) of targets; see `limit_multipliers`."""
    priced = projection.hold, projection.price, projection.rounding
    return limit_multipliers(
        closure, coordinates, targets, platform=projection.weights, frame=closure.task.frame, priced=priced
    )


def held_parts(closure: Closure, holds: Ints, position: Floats, rotation: Floats) -> Ints:
    """Parts of targets that answers hold within tolerance, (n,), by their errors [length], [rad]; else HOLD_NOTHING.

    An answer to a clipped target may miss the part to be held.
    """
    misses_orientation = (holds == HOLD_ORIENTATION) & (rotation > TOLERANCES.held)
    misses_position = (holds == HOLD_POSITION) & (position > TOLERANCES.held * closure.mechanism.characteristic_length)
    return np.where(misses_orientation | misses_position, HOLD_NOTHING, holds)
