"""Configurations in motion, as the kernel takes them: how they move, what they carry, and what moves them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..arrays import Floats
from ..batch import take
from ..description.mechanism import Mechanism
from ..files.units import metres_of
from ..kernels.dynamics.inverse_dynamics import inverse_dynamics
from ..kernels.dynamics.moving import SHOWN, Exerted, MovingMachine, new_moving_scratch
from ..kernels.handle import Handle, Scratch
from ..kernels.threads import in_blocks
from ..kinematics import actuator_units, cut_loops, generic_of, joint_path, rate_units
from ..statics.transmission import is_redundantly_actuated
from ..tolerances import TOLERANCES
from .asked_motion import are_lengths, axes_of, in_lengths
from .drives import drives_of
from .weights import Weights

ROWS_A_BLOCK = 64


class Probes(NamedTuple):
    """Points of bodies at home, in whose efforts a kilogram each results, p of them."""

    bodies: tuple[str, ...]
    points: Floats  # (p, 3) [length]


NO_PROBES = Probes((), np.zeros((0, 3)))


@dataclass(frozen=True, eq=False)
class MovingRows:
    """Configurations that move, in n rows, and what they weigh.

    Attributes
    ----------
    gravity : (3,) [m/s²].
    at : of what rates and accelerations are: "task", "actuators", "path", or names of joints.
    q : deviations from home, (n, c) [length or rad]; poses : (n, 4, 4).
    rates, gains : (n, k), in the machine's units; of a task, twists and accelerations, (n, 6). None is rest.
    """

    mechanism: Mechanism
    weights: Weights
    gravity: Floats
    at: str | tuple[str, ...]
    q: Floats
    poses: Floats
    rates: Floats | None = None
    gains: Floats | None = None

    @property
    def effort_units(self) -> Floats:
        """N and N m of the kernel's forces of actuators, (n_a,)."""
        length = self.mechanism.characteristic_length * metres_of(self.mechanism.length_unit)
        return np.array([length if drive.kind == "length" else length**2 for drive in self.mechanism.drives])

    def efforts(self, requests: Sequence[str] = (), probes: Probes = NO_PROBES) -> Exerted:
        """Forces of the actuators [N, N m], rates and accelerations [machine's units], and what is requested.

        NaN where loops gain a motion. Wrenches are force [N] times L, and moment about the reference point [N length],
        as of a `Balance`; matrices are in kg L².

        Parameters
        ----------
        requests : of "wrenches", "resting", "matrices", "twists", "motions", with `probes` "probes" too.
        """
        mechanism, n = self.mechanism, len(self.q)
        moving, axes = moving_of(self, probes), axes_of(mechanism, self.at, self.poses)
        units, k, n_a = in_lengths(mechanism, self.at), axes.shape[1] + len(moving.asked), len(moving.actuated)
        rates, gains = (
            np.zeros((n, k)) if x is None else self._components(axes, x[:, : len(units)] / units)
            for x in (self.rates, self.gains)
        )
        shapes = {
            "actuators": (n_a,),
            "rates": (n_a,),
            "gains": (n_a,),
            "marks": (),
            "wrenches": (len(moving.frames) + len(moving.loaded), 6),
            "resting": (n_a,),
            "matrices": (k, k),
            "probes": (n_a, len(probes.bodies)),
            "twists": (6,),
            "motions": (n_a, int(moving.counts[SHOWN])),
        }
        found = Exerted(**{
            name: np.full((n if place < 4 or name in requests else 0, *shape), 0 if name == "marks" else np.nan)
            for place, (name, shape) in enumerate(shapes.items())
        })  # fmt: skip
        machine, scratch = Handle(moving), Scratch(new_moving_scratch, moving, k)
        coordinates = np.ascontiguousarray(self.q / rate_units(mechanism))

        def run(block: slice) -> None:
            own = take(found, block) if n > ROWS_A_BLOCK else found
            rows = coordinates[block], axes[block], rates[block], gains[block]
            inverse_dynamics(machine.address, scratch.address, *rows, own)

        in_blocks(run, n, ROWS_A_BLOCK)
        length, units = mechanism.characteristic_length, actuator_units(mechanism)
        scale = length**2 * metres_of(mechanism.length_unit)
        return found._replace(rates=found.rates * units, gains=found.gains * units, wrenches=found.wrenches * scale)

    def in_si(self, matrices: Floats) -> Floats:
        """Mass matrices in kg, kg m and kg m²."""
        length = self.mechanism.characteristic_length * metres_of(self.mechanism.length_unit)
        units = np.where(are_lengths(self.mechanism, self.at), length, 1.0)
        return np.asarray(matrices * length**2 / (units[:, None] * units))

    def _components(self, axes: Floats, values: Floats) -> Floats:
        """Those of twists that the task sets; else the values as they are."""
        return np.ascontiguousarray(
            np.einsum("nki,ni->nk", axes[..., : values.shape[1]], values) if self.at == "task" else values
        )


def moving_of(rows: MovingRows, probes: Probes = NO_PROBES) -> MovingMachine:
    """What the kernel reads."""
    mechanism, weights = rows.mechanism, rows.weights
    actuated = [drive.column for drive in mechanism.drives]
    asked: list[int] = [] if rows.at == "task" else actuated
    if isinstance(rows.at, tuple):
        asked = joint_path(mechanism, rows.at).columns.tolist()
    cut = cut_loops(mechanism, (*actuated, *asked))
    drives, counts = drives_of(mechanism), generic_of(mechanism).mobility
    length, metres = mechanism.characteristic_length, metres_of(mechanism.length_unit)
    shown, by_coordinate = counts.platform + counts.internal, drives.si * actuator_units(mechanism)
    of_drives = (
        rows.effort_units,
        drives.inertia * by_coordinate,
        drives.friction[:, 0],
        drives.friction[:, 1] * by_coordinate,
    )
    has_duty = rows.at == "task" or (rows.at == "actuators" and not is_redundantly_actuated(mechanism))
    least_mass = TOLERANCES.implied * weights.masses.sum()
    fields, twists = cut._asdict(), 3 if mechanism.end_effector_is_joint else 6
    frames, places = fields.pop("frames"), fields.pop("places")

    def integers(values: Any) -> Any:
        return np.array(list(values), np.int64)

    return MovingMachine(
        **fields,
        actuated=integers(places[q] for q in actuated),
        asked=integers(places[q] for q in asked),
        counts=integers((twists, counts.mobility, shown, has_duty, rows.at == "actuators")),
        frames=integers(frames[body] for body in weights.bodies),
        masses=weights.masses,
        centres=weights.centres / length,
        inertias=weights.inertias / length**2,
        gravity=rows.gravity / (length * metres),
        probed=integers(frames[body] for body in probes.bodies),
        probes=probes.points / length,
        loaded=integers(frames[body] for body in weights.loaded),
        load_points=weights.points / length,
        loads=weights.loads / np.repeat([length * metres, (length * metres) ** 2], 3),
        drives=np.stack(of_drives, axis=1),
        limits=np.array([TOLERANCES.singular, least_mass, TOLERANCES.alignment]),
    )  # fmt: skip
