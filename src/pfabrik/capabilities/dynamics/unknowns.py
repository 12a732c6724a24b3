"""The parameters that efforts are to tell: of bodies, and of actuators."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...common.arrays import Floats
from ...kinematics import inertias_of
from ...machine.description.joints import Joint
from ...machine.description.mechanism import Mass, Mechanism
from ...machine.files.units import metres_of
from ...tolerances import TOLERANCES
from .drives import Drives, drives_of
from .inertial_fit import FROM_DENSITY, IMPOSSIBLE, TO_DENSITY
from .regressor import PARTS, POWERS, BodyScales, EffortRows, ten_of

FRICTION, ROTOR = ("dry", "viscous"), "rotor"


@dataclass(frozen=True, eq=False)
class Unknowns:
    """Ten parameters of each body in turn, then those of actuators, kind by kind.

    Attributes
    ----------
    mechanism : with a mass of all bodies that move.
    scales : of the bodies.
    kinds : of "dry", "viscous" and "rotor".
    typical : what those of actuators are compared with, (kinds, n_a), in their units.
    """

    mechanism: Mechanism
    scales: BodyScales
    kinds: tuple[str, ...]
    typical: Floats

    @cached_property
    def drives(self) -> Drives:
        """The actuators as they are described."""
        return drives_of(self.mechanism)

    @cached_property
    def gears(self) -> Floats:
        """Gear ratios, (n_a,)."""
        return np.array([drive.said("gear") or 1.0 for drive in self.mechanism.drives])

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, p."""
        actuators = self.mechanism.actuator_names
        of_bodies = [f"{body}.{part}" for body in self.scales.bodies for part in PARTS]
        return (*of_bodies, *(f"{name}.{kind}" for kind in self.kinds for name in actuators))

    @cached_property
    def units(self) -> tuple[str, ...]:
        """Their units, p."""
        length = self.mechanism.length_unit
        own = [("kg", f"kg {length}".strip(), f"kg {length}²".strip())[power] for power in POWERS]
        of_slide = {"dry": "N", "viscous": "N s/m", "rotor": "kg"}
        of_turn = {"dry": "N m", "viscous": "N m s/rad", "rotor": "kg m²"}
        slides = [unit == "N" for unit in self.drives.forces]
        return (
            *own * len(self.scales.bodies),
            *((of_slide if slide else of_turn)[kind] for kind in self.kinds for slide in slides),
        )

    @cached_property
    def described(self) -> Floats:
        """Their values in the description, (p,)."""
        known = inertias_of(self.mechanism, metres_of(self.mechanism.length_unit))
        parts = [known[body] for body in self.scales.bodies]
        masses = np.array([each.mass for each in parts])
        arms = np.reshape([each.centre for each in parts], (-1, 3)) - self.scales.points
        inertias = np.reshape([each.inertia for each in parts], (-1, 3, 3))
        own = {kind: self.drives.friction[:, place] for place, kind in enumerate(FRICTION)}
        own[ROTOR] = self.drives.inertia / self.gears**2
        return np.concatenate([ten_of(masses, arms, inertias).ravel(), *(own[kind] for kind in self.kinds)])

    @cached_property
    def by_scaled(self) -> Floats:
        """Parameters by scaled ones, of which `InertialFit` has deviations of 1, (p, p)."""
        found = np.diag(np.append(np.ones(10 * len(self.scales.bodies)), self.typical))
        for body, (mass, units) in enumerate(zip(self.scales.masses, self.scales.units, strict=True)):
            own = slice(10 * body, 10 * body + 10)
            found[own, own] = mass * units[:, None] * FROM_DENSITY
        return found

    @cached_property
    def to_scaled(self) -> Floats:
        """Scaled parameters by parameters, (p, p)."""
        return np.asarray(np.linalg.inv(self.by_scaled), float)

    def columns(self, rows: EffortRows) -> Floats:
        """Efforts by scaled parameters, (n, n_a, p)."""
        moves = {"dry": rows.signs, "viscous": rows.rates, "rotor": rows.gains * self.gears**2}
        own = [moves[kind][..., None] * np.eye(len(self.gears)) for kind in self.kinds]
        found = np.concatenate([rows.by_bodies, *own], axis=2) @ self.by_scaled
        for body, line in self.rods.items():
            block = slice(10 * body, 10 * body + 10)
            found[..., block] = found[..., block] @ _spread_along(line)
        return np.asarray(found, float)

    @cached_property
    def rods(self) -> dict[int, Floats]:
        """Bodies between two ball joints with their centres on the line of these, and its direction, (3,).

        They may spin at will, so that efforts depend on their mass, its place on the line and a moment across; all else
        would have them swing.
        """
        rods = {}
        for place, (body, point) in enumerate(zip(self.scales.bodies, self.scales.points, strict=True)):
            joints = [joint for joint in self.mechanism.joints if body in joint.connects]
            ends = [
                np.asarray(joint.at, float) for joint in joints if joint.type == "spherical" and joint.at is not None
            ]
            length = float(np.linalg.norm(ends[1] - ends[0])) if len(ends) == len(joints) == 2 else 0.0
            if length > 0.0:
                line = (ends[1] - ends[0]) / length
                if np.linalg.norm(np.cross(line, point - ends[0])) <= TOLERANCES.alignment * length:
                    rods[place] = line
        return rods

    def mass(self, values: Floats, place: int) -> Mass:
        """The mass of a body by parameters (p,); none where that is rounding."""
        body, ten, point = self.scales.bodies[place], values[10 * place :][:10], self.scales.points[place]
        mass, size = ten[0], self.scales.sizes[place]
        if mass <= IMPOSSIBLE * self.scales.masses[place]:
            return Mass(body, 0.0, point, np.zeros((3, 3)))
        arm, about = ten[1:4] / mass, ten[[4, 7, 8, 7, 5, 9, 8, 9, 6]].reshape(3, 3)
        second = 0.5 * np.trace(about) * np.eye(3) - about - mass * np.outer(arm, arm)  # of mass by place
        spread, axes = np.linalg.eigh(second)
        spread = np.where(spread <= IMPOSSIBLE * mass * size**2, 0.0, spread)
        second = (axes * spread) @ axes.T
        return Mass(body, float(mass), point + arm, spread.sum() * np.eye(3) - 0.5 * (second + second.T))

    def apply(self, values: Floats) -> Mechanism:
        """The machine with parameters (p,)."""
        masses = [self.mass(values, place) for place in range(len(self.scales.bodies))]
        others = [each for each in self.mechanism.masses if each.body not in self.scales.bodies]
        shapes = [
            replace(shape, density=None) if shape.body in self.scales.bodies else shape
            for shape in self.mechanism.shapes
        ]
        own = values[10 * len(masses) :].reshape(self.typical.shape)
        joints = [self._joint(joint, dict(zip(self.kinds, own, strict=True))) for joint in self.mechanism.joints]
        return self.mechanism._with(joints=tuple(joints), shapes=tuple(shapes), masses=(*others, *masses))

    def _joint(self, joint: Joint, values: dict[str, Floats]) -> Joint:
        """A joint with the friction and rotors of its actuators."""
        places = [place for place, drive in enumerate(self.mechanism.drives) if drive.joint.name == joint.name]
        changed: dict[str, Any] = {}
        if places and ROTOR in values:
            least = np.finfo(float).tiny  # none is 0 in a description
            changed["rotor_inertia"] = tuple(np.maximum(values[ROTOR][places], least).tolist())
        if places and FRICTION[0] in values:
            changed["friction"] = tuple(zip(*(values[kind][places].tolist() for kind in FRICTION), strict=True))
        return replace(joint, **{name: each if len(places) == 2 else each[0] for name, each in changed.items()})


def _spread_along(line: Floats) -> Floats:
    """The projection of scaled parameters of a body, (10, 10), on those of masses along a line (3,)."""
    moments = np.eye(3) - np.outer(line, line)
    shapes = np.zeros((3, 10))
    shapes[0, 0], shapes[1, 1:4] = 1.0, line
    shapes[2, 4:] = moments[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    basis = np.linalg.qr(TO_DENSITY @ shapes.T)[0]
    return np.asarray(basis @ basis.T, float)
