"""The coordinates of a mechanism's joints, one by one: their names, kinds and limits."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ...tolerances import TOLERANCES
from .joints import KINDS, Coordinate, Joint, Range


@dataclass(frozen=True)
class JointCoordinate:
    """One coordinate of a joint.

    Attributes
    ----------
    name : str
        Name of its joint, with "[0]", "[1]" or "[2]" behind it where the joint has several.
    joint : Joint
        The joint.
    place : int
        Which of the joint's coordinates it is.
    column : int
        Which of all coordinates it is, in the order of `q`.
    home : float
        Its value in the home configuration [rad or length].
    """

    name: str
    joint: Joint
    place: int
    column: int
    home: float

    @property
    def alias(self) -> str:
        """The hinge that it was where two became one, `roll` of the second of `pitch+roll`; else its name."""
        return self.joint.merged[self.place] if self.joint.merged else self.name

    @property
    def kind(self) -> Coordinate:
        """Its kind: an angle or a length."""
        return KINDS[self.joint.type].coordinates[self.place]

    def said(self, field: str) -> Any:
        """What its joint has in a field of drives for this coordinate; None where that is not known."""
        value = getattr(self.joint, field)
        return value if value is None or len(self.joint.driven) < 2 else value[self.place]

    @property
    def armature(self) -> float | None:
        """Inertia of its motor's rotor on the coordinate [kg m², of a slide kg], gear² times; None where not known."""
        rotor = self.said("rotor_inertia")
        return None if rotor is None else float(rotor * (self.said("gear") or 1.0) ** 2)

    @property
    def limits(self) -> Range:
        """Its range [rad or length], infinite where there is no limit."""
        if self.joint.range is None:
            return -math.inf, math.inf
        pair: Any = self.joint.range if len(KINDS[self.joint.type].coordinates) == 1 else self.joint.range[self.place]
        return pair[0], pair[1]

    @property
    def bounds(self) -> Range:
        """The same, but that a distance is not negative where nothing says so either."""
        low, high = self.limits
        return (low if self.joint.along is None else max(low, 0.0)), high

    def room(self, unit: float) -> Range:
        """Its bounds as deviations from home, in a unit [length or rad], with room for answers that are put inside."""
        low, high = deviations(self.bounds, self.home, unit)
        return low, high


def deviations(bounds: tuple[Any, Any], home: Any, unit: Any) -> tuple[Any, Any]:
    """Bounds as deviations from home, in a unit [length or rad], with room for answers that are put inside.

    All are numbers, or numbers that note their steps (`noted_numbers`), and so then are the deviations.
    """
    low, high = ((bound - home) / unit for bound in bounds)
    lacking = max(TOLERANCES.inside - 0.5 * (high - low), 0.0)
    return low - lacking, high + lacking
