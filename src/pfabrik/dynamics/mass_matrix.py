"""`mass_matrix`: how a machine resists acceleration."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..answers.solution import Solution, checked_solution
from ..arrays import Floats
from ..files.units import metres_of
from ..kinematics import actuator_units, generic_of
from ..statics.loads import BodyLoads, checked_loads
from .asked_motion import checked_at, shown_of
from .drives import Drives
from .inverse_dynamics import ROWS_A_BLOCK, loads_of
from .moving_machine import MovingMachine


def mass_matrix(solution: Solution, at: str | Sequence[str] = "task", *, loads: BodyLoads | None = None) -> Floats:
    """The mass matrix M of a machine, as its task, its actuators or some of its joints feel it.

    At rest, forces M a accelerate it by a; its kinetic energy is v' M v / 2. In SI units, whatever the machine's unit
    of length: kg between lengths, kg m² between angles, kg m between both. Rotors of actuators count, with their gears;
    parts that nothing holds, such as rods that spin between two ball joints, move as they will.

    Parameters
    ----------
    solution : Solution
        One configuration or a batch.
    at : {"task", "actuators"} or str or sequence of str, optional
        "task": x, y and z of the reference point, then rotations, of these what the task sets, along and about the axes
        of the base; tilts about the platform's x and y axes. "actuators": in the order of their names. Or joints, or
        coordinates of joints, that stand in series between base and end effector.
    loads : mapping of str to tuple, optional
        Body -> (mass, centre), for what it carries, as in `inverse_dynamics`.

    Returns
    -------
    array (..., k, k)
        NaN where there is no configuration, or the loops are in a constraint singularity.

    Raises
    ------
    InvalidArgument or UnknownName
        Bodies without a mass; joints that are not in series.
    """
    mechanism = checked_solution(solution).mechanism
    at, metres = checked_at(mechanism, at), metres_of(mechanism.length_unit)
    weights, drives = loads_of(mechanism, metres, checked_loads(mechanism, loads))[0], Drives(mechanism, metres)
    length, rows = mechanism.characteristic_length, solution._rows
    known = np.flatnonzero(~np.isnan(solution._coordinates).any(axis=1))
    found: Floats | None = None
    for start in range(0, len(known), ROWS_A_BLOCK):
        places = known[start : start + ROWS_A_BLOCK]
        moving = MovingMachine(mechanism, weights, solution._configurations.coordinates_at(places))
        shown = shown_of(moving, at, rows.poses[places])
        following = shown.following(moving)
        if generic_of(mechanism).mobility.idle:
            motions, mobility = moving.free_responses(moving.first.unseen)
            following = following - motions @ (mobility @ moving.inertia_along(motions, following))
        own = following[:, moving.first.actuated] * (drives.si * actuator_units(mechanism))[:, None]
        matrix = moving.inertia_along(following, following) * (length * metres) ** 2
        matrix += np.einsum("nak,nam,a->nkm", own, own, drives.inertia)
        matrix[moving.first.is_singular] = np.nan
        found = np.full((len(rows.status), *matrix.shape[1:]), np.nan) if found is None else found
        units = np.where(shown.is_length, length * metres, 1.0)
        found[places] = matrix / (units[:, None] * units)
    found = np.full((len(rows.status), 0, 0), np.nan) if found is None else found
    return found.reshape(*solution.shape, *found.shape[1:])
