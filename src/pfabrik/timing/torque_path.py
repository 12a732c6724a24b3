"""The torques of a path as splines along it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Floats
from ..description.mechanism import Mechanism
from ..dynamics.drives import Drives
from ..files.units import metres_of
from .curve import Spline


class TorqueParts(NamedTuple):
    """Torques t = by_push s'' + by_speed s'^2 + viscous s' + rest at places s of a path, (n, n_a) each [N m, N].

    Attributes
    ----------
    rest : of weight and loads, and of dry friction on the way.
    """

    by_push: Floats
    by_speed: Floats
    viscous: Floats
    rest: Floats

    def torques(self, speeds: Floats, pushes: Floats) -> Floats:
        """The torques at s' and s'', (n,) each."""
        speeds, pushes = speeds[:, None], pushes[:, None]
        return self.by_push * pushes + (self.by_speed * speeds + self.viscous) * speeds + self.rest


class TorquePath:
    """The torques of a path, of what `torque_rows` says at places s (n,).

    Attributes
    ----------
    names : of the actuators.
    """

    def __init__(self, mechanism: Mechanism, s: Floats, rows: Floats) -> None:
        self.names = mechanism.actuator_names
        self._spline, self._drives = Spline.through(s, rows), Drives(mechanism, metres_of(mechanism.length_unit))

    def at(self, s: Floats, slopes: Floats, bends: Floats) -> TorqueParts:
        """The torques at s (n,), where the actuators have these first and second derivatives, (n, n_a)."""
        n_a, drives = slopes.shape[1], self._drives
        masses, by_speed, rest = np.split(self._spline.at(s)[0], [n_a**2, n_a**2 + n_a], axis=1)
        masses = masses.reshape(-1, n_a, n_a)
        by_push, more = (np.einsum("nab,nb->na", masses, x * drives.si) for x in (slopes, bends))
        dry, viscous = drives.friction.T
        return TorqueParts(by_push, by_speed + more, viscous * slopes * drives.si, rest + dry * np.sign(slopes))
