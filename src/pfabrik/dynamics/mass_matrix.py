"""`mass_matrix`: how a machine resists acceleration."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..answers.solution import Solution, checked_solution
from ..arrays import Floats
from ..files.units import metres_of
from ..statics.loads import BodyLoads, checked_loads
from .asked_motion import checked_at
from .moving_rows import MovingRows
from .weights import loads_of


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
    weights, rows = loads_of(mechanism, metres, checked_loads(mechanism, loads)), solution._rows
    known = np.flatnonzero(~np.isnan(solution._coordinates).any(axis=1))
    q = solution._configurations.coordinates_at(known)
    moving = MovingRows(mechanism, weights, np.zeros(3), at, q, rows.poses[known])
    found = moving.efforts(["matrices"])
    matrices = np.full((len(rows.status), *found.matrices.shape[1:]), np.nan)
    matrices[known] = moving.in_si(found.matrices)
    return matrices.reshape(*solution.shape, *matrices.shape[1:])
