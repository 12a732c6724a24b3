"""`mass_matrix`: how a machine resists acceleration."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..answers.solution import Solution, checked_solution
from ..arrays import Floats, Ints
from ..description.mechanism import Mechanism
from ..errors import InvalidArgument
from ..files.units import metres_of
from ..kinematics import JointRates, around_home, end_effector_pose, joint_path, model_of
from ..statics.joint_balance import pairs_at
from ..statics.loads import BodyLoads, checked_loads
from ..tolerances import TOLERANCES
from .asked_motion import axes_of, checked_at
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
        Body -> (mass, centre), for what it carries, as in `inverse_dynamics`; no forces, which change no mass.

    Returns
    -------
    array (..., k, k)
        Where the machine has fewer motions than `at` has coordinates, that of the possible motion nearest to the one
        asked for, angles compared with lengths over L: of no higher rank than there are motions, with rows of zeros for
        coordinates that never move. NaN where there is no configuration, the loops are in a constraint singularity, or
        some motion that `at` has elsewhere cannot be made: there the machine resists it without bound.

    Raises
    ------
    InvalidArgument or UnknownName
        Bodies without a mass; a load that is a force; joints that are not in series.
    """
    mechanism = checked_solution(solution).mechanism
    at, metres = checked_at(mechanism, at), metres_of(mechanism.length_unit)
    weights, rows = loads_of(mechanism, metres, checked_loads(mechanism, loads)), solution._rows
    if weights.loaded:
        raise InvalidArgument(f"loads['{weights.loaded[0]}']", "a force", "(mass, centre): a force changes no mass")
    known = np.flatnonzero(~np.isnan(solution._coordinates).any(axis=1))
    q = solution._configurations.coordinates_at(known)
    moving = MovingRows(mechanism, weights, np.zeros(3), at, q, rows.poses[known])
    found = moving.efforts(["matrices"])
    matrices = np.full((len(rows.status), *found.matrices.shape[1:]), np.nan)
    matrices[known] = moving.in_si(found.matrices)
    few = np.flatnonzero(np.linalg.matrix_rank(np.nan_to_num(found.matrices), TOLERANCES.rank) < matrices.shape[1])
    if len(few):
        usual = _made(mechanism, at, around_home(mechanism)).max()
        matrices[known[few[_made(mechanism, at, q[few]) < usual]]] = np.nan
    return matrices.reshape(*solution.shape, *matrices.shape[1:])


def _made(mechanism: Mechanism, at: str | tuple[str, ...], q: Floats) -> Ints:
    """In how many ways a machine moves what `at` names, at coordinates q (n, c), (n,)."""
    first = JointRates(model_of(mechanism), q)
    twists, rates = pairs_at(mechanism, first)
    if at == "task":
        rates = axes_of(mechanism, at, end_effector_pose(mechanism, q))[..., : twists.shape[1]] @ twists
    elif at != "actuators":
        rates = first.pairs[:, joint_path(mechanism, at).columns]
    sizes, least = np.linalg.svd(rates, compute_uv=False), TOLERANCES.singular
    return np.asarray((sizes > least * np.maximum(sizes[:, :1], least)).sum(axis=1))
