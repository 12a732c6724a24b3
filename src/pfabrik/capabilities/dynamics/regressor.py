"""Efforts by the inertial parameters of bodies, in which they are linear, and by friction and rotors.

A body has ten parameters about a point p of its own: its mass m, first moments m (c - p), and moments of inertia about
p. What a mass resists with is linear in them, and of a point mass a polynomial of the second degree in its place: so
what ten point masses resist with gives the columns of all ten parameters, by the same code as in `inverse_dynamics`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Mask
from ...kernels.dynamics.moving import FREE_PART
from ...kinematics import actuator_units
from .drives import drives_of
from .moving_rows import MovingRows, Probes

PARTS = ("mass", "x", "y", "z", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
"""The parameters of a body: x, y and z are its first moments."""

POWERS = np.array([0, 1, 1, 1, 2, 2, 2, 2, 2, 2])
"""The power of a length in the unit of each."""

_ENDS = np.eye(3)
_PLACES = np.array([np.zeros(3), *_ENDS, *-_ENDS, *(_ENDS[[0, 0, 1]] + _ENDS[[1, 2, 2]])])


class BodyScales(NamedTuple):
    """Bodies, the points that their parameters are about, and sizes to compare these with.

    Attributes
    ----------
    bodies : their names, b.
    points : at home, (b, 3) [length].
    sizes : (b,) [length]; masses : (b,) [kg].
    """

    bodies: tuple[str, ...]
    points: Floats
    sizes: Floats
    masses: Floats

    @property
    def units(self) -> Floats:
        """Units of the parameters with lengths in sizes, in kg, kg length and kg length², (b, 10)."""
        return np.asarray(self.sizes[:, None] ** POWERS)


def ten_of(masses: Floats, arms: Floats, inertias: Floats) -> Floats:
    """The parameters (b, 10) of masses (b,) with centres at arms (b, 3), and inertias about these, (b, 3, 3)."""
    squares = np.einsum("bi,bi->b", arms, arms)[:, None, None] * np.eye(3)
    about = inertias + masses[:, None, None] * (squares - arms[:, :, None] * arms[:, None])
    moments = about[:, [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return np.concatenate([masses[:, None], masses[:, None] * arms, moments], axis=1)


class EffortRows(NamedTuple):
    """Efforts at n configurations in motion, in SI units.

    Attributes
    ----------
    described : of the machine as it is described, (n, n_a).
    by_bodies : by the parameters of bodies, (n, n_a, 10 b).
    rates, gains, signs : of the actuators, their accelerations, and the signs of their rates, 0 at rest, (n, n_a).
    motions : those that the loops allow the actuators, (n, n_a, d).
    is_good : False where the actuators do not hold the machine, or it does not move so, (n,).
    """

    described: Floats
    by_bodies: Floats
    rates: Floats
    gains: Floats
    signs: Floats
    motions: Floats
    is_good: Mask


def effort_rows(rows: MovingRows, scales: BodyScales) -> EffortRows:
    """Efforts of rows, and how they depend on the parameters of bodies."""
    mechanism = rows.solution.mechanism
    places = scales.points[:, None] + scales.sizes[:, None, None] * _PLACES
    bodies = tuple(body for body in scales.bodies for _ in _PLACES)
    found = rows.efforts(["motions", "probes"], Probes(bodies, places.reshape(-1, 3)))
    of_places = np.linalg.inv(ten_of(np.ones(10), _PLACES, np.zeros((10, 3, 3))))
    by_places = found.probes.reshape(*found.rates.shape, len(scales.bodies), 10)
    columns = (by_places @ of_places.T / scales.units).reshape(*found.rates.shape, -1)
    si, is_good = drives_of(mechanism).si, (found.marks & ~FREE_PART) == 0
    motions = found.motions * (si * actuator_units(mechanism))[:, None]
    return EffortRows(found.actuators, columns, found.rates * si, found.gains * si, found.signs, motions, is_good)
