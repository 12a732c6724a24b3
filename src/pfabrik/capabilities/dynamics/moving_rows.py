"""Configurations in motion, as the kernel takes them: how they move, what they carry, and what moves them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ...answers.solution import Solution
from ...common.arrays import Floats, Mask
from ...common.batch import take
from ...common.derived import derived, is_derived
from ...kernels.dynamics.inverse_dynamics import inverse_dynamics
from ...kernels.dynamics.moving import Exerted, MovingMachine, new_exerted, new_moving_scratch
from ...kernels.handle import Handle, Scratch
from ...kernels.threads import in_blocks
from ...kinematics import actuator_units, cut_loops, generic_of, joint_path, rate_units, task_of
from ...machine.description.mechanism import Mechanism
from ...machine.files.units import metres_of
from ...tolerances import TOLERANCES
from ..statics.transmission import is_redundantly_actuated, twist_units
from .drives import drives_of
from .weights import Weights, own_weights

ROWS_A_BLOCK = 64

At = str | tuple[str, ...]
"""What moves: "task", "actuators", "path" for end effector and actuators, or names of joints in series."""


class Probes(NamedTuple):
    """Points of bodies at home, in whose efforts a kilogram each results, p of them."""

    bodies: tuple[str, ...] = ()
    points: Floats = np.zeros((0, 3))  # (p, 3) [length]


@dataclass(frozen=True, eq=False)
class MovingRows:
    """Configurations that move, in n rows, and what they weigh.

    Attributes
    ----------
    at : of what rates and accelerations are.
    rates, gains : (n, k), in the machine's units; of a task, twists and accelerations, (n, 6). None is rest.
    times : of the rows of a path, (n,) [s].
    still : rates up to which actuators are at rest, by how exactly their places are known, (n, n_a), in the machine's
        units.
    kinks : True for rows of a path about which its velocity leaps, (n,).
    gravity : (3,) [m/s²].
    """

    solution: Solution
    at: At
    rates: Floats | None = None
    gains: Floats | None = None
    times: Floats | None = None
    still: Floats | None = None
    kinks: Mask | None = None
    weights: Weights = field(default_factory=Weights)
    gravity: Floats = field(default_factory=lambda: np.zeros(3))

    def efforts(self, requests: Sequence[str] = (), probes: Probes | None = None) -> Exerted:
        """Forces of the actuators [N, N m], rates and accelerations [machine's units], and what is requested.

        NaN where there is no configuration, or loops gain a motion. Wrenches are force [N] times L, and moment about
        the reference point [N length], as of a `Balance`; matrices are in kg L².

        Parameters
        ----------
        requests : of "wrenches", "resting", "matrices", "twists", "motions", with `probes` "probes" too.
        """
        mechanism, q = self.solution.mechanism, self.solution._coordinates
        if probes is None and is_derived(own_weights, mechanism) and self.weights is own_weights(mechanism):
            machine, scratch, k = _prepared(mechanism, self.at, tuple(self.gravity.tolist()))
        else:
            machine, scratch, k = _prepare(mechanism, self.at, self.weights, self.gravity, probes or Probes())
        moving, units = machine.record, in_lengths(mechanism, self.at)
        axes, n = axes_of(mechanism, self.at, self.solution._rows.poses), len(q)
        rates, gains = (
            np.zeros((n, len(units))) if x is None else x[:, : len(units)] / units for x in (self.rates, self.gains)
        )
        if self.at == "task":
            rates, gains = ((axes[..., : len(units)] @ x[..., None])[..., 0].copy() for x in (rates, gains))
        found, drives = new_exerted(moving, n, k, requests), actuator_units(mechanism)
        still = np.zeros((0, len(drives))) if self.still is None else self.still / drives
        coordinates = q / rate_units(mechanism)

        def run(block: slice) -> None:
            own = take(found, block) if n > ROWS_A_BLOCK else found
            rows = coordinates[block], axes[block], rates[block], gains[block], still[block]
            inverse_dynamics(machine.address, scratch.address, *rows, own)

        in_blocks(run, n, ROWS_A_BLOCK)
        length = mechanism.characteristic_length
        scale = length**2 * metres_of(mechanism.length_unit)
        return found._replace(rates=found.rates * drives, gains=found.gains * drives, wrenches=found.wrenches * scale)


class Prepared(NamedTuple):
    """What the kernel reads and writes, and how many components its rates have."""

    machine: Handle[MovingMachine]
    scratch: Scratch[Any]
    components: int


@derived
def _prepared(mechanism: Mechanism, at: At, gravity: tuple[float, ...]) -> Prepared:
    """That of a machine that carries nothing."""
    return _prepare(mechanism, at, own_weights(mechanism), np.array(gravity), Probes())


def _prepare(mechanism: Mechanism, at: At, weights: Weights, gravity: Floats, probes: Probes) -> Prepared:
    moving = moving_of(mechanism, at, weights, gravity, probes)
    k = axes_of(mechanism, at, np.eye(4)[None]).shape[1] + len(moving.asked)
    return Prepared(Handle(moving), Scratch(new_moving_scratch, moving, k), k)


def axes_of(mechanism: Mechanism, at: At, poses: Floats) -> Floats:
    """The components of the end effector's twist that `at` names, at poses (n, 4, 4), (n, k, 6); those of coordinates
    are none of these."""
    if at == "task":
        task = task_of(mechanism)
        return task.twists(poses) if task.rotations == 2 else np.repeat(_task_axes(mechanism), len(poses), axis=0)
    return np.tile(np.eye(len(twist_units(mechanism)) if at == "path" else 0, 6), (len(poses), 1, 1))


@derived
def _task_axes(mechanism: Mechanism) -> Floats:
    """The components of a task that has the same at each pose, (1, k, 6)."""
    return task_of(mechanism).twists(mechanism.home_pose[None])


def are_lengths(mechanism: Mechanism, at: At) -> Mask:
    """True for the components of "task", "actuators" or named joints that are lengths, False for angles, (k,)."""
    if at == "task":
        return np.asarray(task_of(mechanism).twists(np.eye(4))[:, :3].any(axis=1))
    drives = mechanism.drives if at == "actuators" else joint_path(mechanism, at).coordinates
    return np.array([each.kind == "length" for each in drives], bool)


@derived
def in_lengths(mechanism: Mechanism, at: At) -> Floats:
    """Units in L of rates as they are given: of twists, of actuators, of both of a "path", or of joints."""
    if at == "path":
        return np.append(twist_units(mechanism), in_lengths(mechanism, "actuators"))
    if at == "task":
        return twist_units(mechanism)
    return np.where(are_lengths(mechanism, at), mechanism.characteristic_length, 1.0)


def in_si(mechanism: Mechanism, at: At, matrices: Floats) -> Floats:
    """Mass matrices in kg, kg m and kg m², of those in kg L²."""
    length = mechanism.characteristic_length * metres_of(mechanism.length_unit)
    units = np.where(are_lengths(mechanism, at), length, 1.0)
    return np.asarray(matrices * length**2 / (units[:, None] * units))


def moving_of(mechanism: Mechanism, at: At, weights: Weights, gravity: Floats, probes: Probes) -> MovingMachine:
    """What the kernel reads."""
    actuated = [drive.column for drive in mechanism.drives]
    asked = [] if at == "task" else joint_path(mechanism, at).columns.tolist() if isinstance(at, tuple) else actuated
    cut = cut_loops(mechanism, (*actuated, *asked))
    drives, counts = drives_of(mechanism), generic_of(mechanism).mobility
    length, metres = mechanism.characteristic_length, metres_of(mechanism.length_unit)
    shown, by_coordinate = counts.platform + counts.internal, drives.si * actuator_units(mechanism)
    of_drives = (
        (length * metres) ** 2 / by_coordinate,
        drives.inertia * by_coordinate,
        drives.friction[:, 0],
        drives.friction[:, 1] * by_coordinate,
    )
    has_duty = at == "task" or (at == "actuators" and not is_redundantly_actuated(mechanism))
    least_mass = TOLERANCES.implied * weights.masses.sum()
    fields, twists = cut._asdict(), len(twist_units(mechanism))
    frames, places = fields.pop("frames"), fields.pop("places")

    def integers(values: Any) -> Any:
        return np.array(list(values), np.int64)

    return MovingMachine(
        **fields,
        actuated=integers(places[q] for q in actuated),
        asked=integers(places[q] for q in asked),
        counts=integers((twists, counts.mobility, shown, has_duty, at == "actuators")),
        frames=integers(frames[body] for body in weights.bodies),
        masses=weights.masses,
        centres=weights.centres / length,
        inertias=weights.inertias / length**2,
        gravity=gravity / (length * metres),
        probed=integers(frames[body] for body in probes.bodies),
        probes=probes.points / length,
        loaded=integers(frames[body] for body in weights.loaded),
        load_points=weights.points / length,
        loads=weights.loads / np.repeat([length * metres, (length * metres) ** 2], 3),
        drives=np.stack(of_drives, axis=1),
        limits=np.array([TOLERANCES.singular, least_mass, TOLERANCES.alignment]),
    )  # fmt: skip
