"""Display of actuators: angles in degrees, lengths in the mechanism's unit, with their limits."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...common.arrays import Floats
from .joint_coordinates import JointCoordinate
from .structure import Structure


@dataclass(frozen=True)
class Readout:
    """Display of the coordinate of an actuator.

    Attributes
    ----------
    name : of the actuator.
    is_angle : whether the coordinate is an angle; a length otherwise.
    unit : ``"deg"`` or the mechanism's length unit.
    limits : lowest and highest value in `unit`, infinite where there is no limit.
    """

    name: str
    is_angle: bool
    unit: str
    limits: tuple[float, float]

    def display(self, values: Floats) -> Floats:
        """Coordinates [rad or length] in `unit`."""
        return np.degrees(values) if self.is_angle else values

    def coordinate(self, shown: float) -> float:
        """The coordinate [rad or length] that is shown as a value in `unit`."""
        return math.radians(shown) if self.is_angle else shown


def readouts(mechanism: Structure) -> tuple[Readout, ...]:
    """One readout for each actuator, in the order of ``mechanism.actuator_names``."""
    return tuple(readout(drive, mechanism.length_unit) for drive in mechanism.drives)


def readout(coordinate: JointCoordinate, length_unit: str) -> Readout:
    """The display of one coordinate."""
    is_angle, (low, high) = coordinate.kind == "angle", coordinate.limits
    limits = (math.degrees(low), math.degrees(high)) if is_angle else (low, high)
    return Readout(coordinate.name, is_angle, "deg" if is_angle else length_unit, limits)
