"""Masses and servos of a simulation model: plausible, and stable whatever the size of the machine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from ..checks import require_mapping, require_positive
from ..description.mechanism import Mechanism
from ..errors import UnknownName

DENSITY = 100.0
"""Mass of the end effector over the cube of the characteristic length [kg/m³]: 0.8 kg for a hexapod of 200 mm."""

LINK = 0.1
"""Mass of any other body over that of the end effector."""

THINNEST = 0.1
"""Least radius of gyration of a body [L]: a light body that turns easily would need shorter steps."""

SERVO_RATE = 120.0
"""Natural frequency of the servos [1/s] where they carry all of the machine: an eighth of what one step of the
simulation can follow. A platform that its legs hold by short levers settles tens of times more slowly."""

STEP = 0.001
"""Time step of the simulation [s]."""


@dataclass(frozen=True)
class Physics:
    """The masses of a simulation model, and what follows from them, in SI units.

    Attributes
    ----------
    masses : body -> its mass [kg].
    given : bodies whose masses the caller gave.
    length : the characteristic length [m].
    heaviest : the largest of the masses, which any servo can carry [kg].
    """

    masses: Mapping[str, float]
    given: frozenset[str]
    length: float
    heaviest: float

    def inertia(self, body: str, points: Floats) -> tuple[float, Floats, float]:
        """Mass [kg], centre of mass (3,) [m] and moment of inertia about any axis [kg m²] of a body with these points.

        As if its mass were in a ball around them.
        """
        centre = points.mean(axis=0)
        spread = float(np.sqrt(points.var(axis=0).sum()))
        mass = self.masses.get(body, LINK**2 * self.heaviest)  # of a doubled body, hardly any
        return mass, centre, mass * max(spread, THINNEST * self.length) ** 2

    def carried(self, turning: bool) -> float:
        """The load of a servo: a moment of inertia [kg m²] if it turns, else a mass [kg]."""
        return self.heaviest * self.length**2 if turning else self.heaviest

    def servo(self, turning: bool) -> dict[str, float]:
        """Gains of a critically damped position servo, per radian or metre."""
        carried = self.carried(turning)
        return {"kp": carried * SERVO_RATE**2, "kv": 2.0 * carried * SERVO_RATE}

    def joint(self, turning: bool, actuated: bool) -> dict[str, float]:
        """Armature and damping: stiff servos on light bodies without an armature blow up."""
        carried = self.carried(turning)
        return {"armature": (0.2 if actuated else 0.01) * carried, "damping": 0.02 * carried}


def physics(mechanism: Mechanism, metres: float, masses: Mapping[str, float] | None) -> Physics:
    """Masses as given, the others plausible.

    Parameters
    ----------
    metres : length of the mechanism's unit [m].
    masses : body -> mass [kg], of some of the bodies.

    Raises
    ------
    UnknownName : a mass of no body of the mechanism.
    InvalidArgument : a mass that is not positive.
    """
    given = {}
    for body, mass in require_mapping("masses", masses, "masses in kg by the names of bodies").items():
        if body not in mechanism.bodies:
            raise UnknownName("body", body, mechanism.bodies)
        given[body] = require_positive(f"masses['{body}']", mass)
    length = mechanism.characteristic_length * metres
    whole = DENSITY * length**3
    plausible = {body: whole if body == mechanism.end_effector_body else LINK * whole for body in mechanism.bodies}
    every = plausible | given
    moving = [mass for body, mass in every.items() if body != mechanism.base]
    return Physics(every, frozenset(given), length, max(moving))
