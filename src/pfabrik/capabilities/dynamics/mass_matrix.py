"""`mass_matrix`: how a machine resists acceleration."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...answers.solution import Solution, checked_solution
from ...common.arrays import Floats, Ints
from ...common.checks import names_of
from ...errors import InvalidArgument
from ...kinematics import JointRates, around_home, end_effector_pose, joint_path, model_of
from ...machine.description.mechanism import Mechanism
from ...tolerances import TOLERANCES
from ..statics.joint_balance import pairs_at
from ..statics.loads import BodyLoads
from .moving_rows import At, MovingRows, axes_of, in_si
from .weights import weights_of


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
    mechanism, q = checked_solution(solution).mechanism, solution._coordinates
    named: At = at if isinstance(at, str) and at in ("task", "actuators") else names_of("at", at)
    weights = weights_of(mechanism, loads)
    if weights.loaded:
        raise InvalidArgument(f"loads['{weights.loaded[0]}']", "a force", "(mass, centre): a force changes no mass")
    found = MovingRows(solution, named, weights=weights).efforts(["matrices"]).matrices
    few = np.flatnonzero(np.linalg.matrix_rank(np.nan_to_num(found), TOLERANCES.rank) < found.shape[1])
    few = few[~np.isnan(q[few]).any(axis=1)]
    if len(few):
        usual = _made(mechanism, named, around_home(mechanism)).max()
        found[few[_made(mechanism, named, q[few]) < usual]] = np.nan
    return in_si(mechanism, named, found).reshape(*solution.shape, *found.shape[1:])


def _made(mechanism: Mechanism, at: At, q: Floats) -> Ints:
    """In how many ways a machine moves what `at` names, at coordinates q (n, c), (n,)."""
    first = JointRates(model_of(mechanism), q)
    twists, rates = pairs_at(mechanism, first)
    if at == "task":
        rates = axes_of(mechanism, at, end_effector_pose(mechanism, q))[..., : twists.shape[1]] @ twists
    elif at != "actuators":
        rates = first.pairs[:, joint_path(mechanism, at).columns]
    sizes, least = np.linalg.svd(rates, compute_uv=False), TOLERANCES.singular
    return np.asarray((sizes > least * np.maximum(sizes[:, :1], least)).sum(axis=1))
