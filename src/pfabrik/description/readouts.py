"""How actuators are shown to people: angles in degrees, lengths in the mechanism's unit, with their limits."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .joints import Joint
from .structure import Structure

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Readout:
    """How the coordinate of an actuator is shown.

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
    return tuple(readout(mechanism.joint(name), mechanism.length_unit) for name in mechanism.actuator_names)


def readout(joint: Joint, length_unit: str) -> Readout:
    """How the coordinate of one actuated revolute or prismatic joint is shown."""
    is_angle = joint.type == "revolute"
    low, high = (float(bound) for bound in joint.range or (-math.inf, math.inf))  # type: ignore[arg-type]
    limits = (math.degrees(low), math.degrees(high)) if is_angle else (low, high)
    return Readout(joint.name, is_angle, "deg" if is_angle else length_unit, limits)
