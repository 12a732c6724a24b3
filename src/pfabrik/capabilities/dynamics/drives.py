"""Rotors, friction and limits of actuators, in SI units."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Floats
from ...common.derived import derived
from ...kernels.dynamics.signs import signs_of
from ...kinematics import actuator_units
from ...machine.description.mechanism import Mechanism
from ...machine.files.units import metres_of


class Drives:
    """What acts on the actuators' coordinates themselves, (n_a,) each.

    Attributes
    ----------
    si : the unit of each coordinate, and of its rate [m or rad].
    lengths : of those of the kernel, L or rad, in the machine's.
    forces : the unit of what it exerts, "N" or "N m".
    units : N and N m in those of a `Balance`.
    limits : the most that actuators exert [N m, N]; infinite where there is none.
    inertia : of rotors [kg m², of a slide kg].
    friction : dry [N m, N] and viscous [N m s/rad, N s/m], (n_a, 2).
    """

    def __init__(self, mechanism: Mechanism) -> None:
        metres = metres_of(mechanism.length_unit)
        is_length = np.array([drive.kind == "length" for drive in mechanism.drives])
        self.forces = ["N" if length else "N m" for length in is_length]
        self.si = np.where(is_length, metres, 1.0)
        self.lengths = actuator_units(mechanism)
        self.units = np.where(is_length, mechanism.characteristic_length, 1.0 / metres)
        self.limits = np.array([drive.said("max_torque") or np.inf for drive in mechanism.drives])
        self.inertia = np.array([drive.armature or 0.0 for drive in mechanism.drives])
        self.friction = np.array([drive.said("friction") or (0.0, 0.0) for drive in mechanism.drives])

    def signs(self, rates: Floats) -> Floats:
        """Signs of rates (n, n_a) of the machine, 0 at rest."""
        signs = np.empty(rates.shape)
        signs_of(rates / self.lengths, signs)
        return signs

    def taken(self, rates: Floats, gains: Floats, signs: Floats) -> Floats:
        """Efforts of rotors and friction at rates of some signs and accelerations, (n, n_a), in N and N m."""
        return np.asarray(self.inertia * gains * self.si + self.rubbed(rates, signs))

    def rubbed(self, rates: Floats, signs: Floats) -> Floats:
        """What friction takes at rates (n, n_a) of the machine of some signs, in N and N m."""
        return self.friction[:, 0] * signs + self.friction[:, 1] * rates * self.si


@derived
def drives_of(mechanism: Mechanism) -> Drives:
    """The actuators of a mechanism."""
    return Drives(mechanism)
