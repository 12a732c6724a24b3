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
from .weights import Weights, weights_of


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
        Where the machine has more motions than `at` has coordinates, and actuators for all, what forces at these meet
        while the actuators are free: (J M_a^-1 J')^-1, with M_a at the actuators (Khatib, IEEE J. Robotics and
        Automation 3, 1987, 43). Where it has fewer, that of the possible motion nearest to the one asked for, angles
        compared with lengths over L: of no higher rank than there are motions, with rows of zeros for coordinates that
        never move. NaN where there is no configuration, the loops are in a constraint singularity, or some motion that
        `at` has elsewhere cannot be made: there the machine resists it without bound.

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
    if named != "actuators":
        _let_others_follow(solution, named, weights, found)
    few = np.flatnonzero(np.linalg.matrix_rank(np.nan_to_num(found), TOLERANCES.rank) < found.shape[1])
    few = few[~np.isnan(q[few]).any(axis=1)]
    if len(few):
        usual = _made(mechanism, named, around_home(mechanism)).max()
        found[few[_made(mechanism, named, q[few]) < usual]] = np.nan
    return in_si(mechanism, named, found).reshape(*solution.shape, *found.shape[1:])


def _let_others_follow(solution: Solution, at: At, weights: Weights, found: Floats) -> None:
    """Fill the mass matrices (n, k, k) of machines with more motions than coordinates, all of them actuated."""
    mechanism, q = solution.mechanism, solution._coordinates
    rows = np.flatnonzero(~np.isnan(q).any(axis=1) & np.isfinite(found).all(axis=(1, 2)))
    moved, driven = _moved(mechanism, at, q[rows])
    n_motions = moved.shape[2]
    if n_motions <= found.shape[1] or driven.shape[1] < n_motions or not len(rows):
        return
    at_actuators = MovingRows(solution, "actuators", weights=weights).efforts(["matrices"]).matrices[rows]
    of_motions = np.swapaxes(driven, 1, 2) @ at_actuators @ driven
    is_regular = (np.linalg.matrix_rank(moved, TOLERANCES.singular) == found.shape[1]) & (
        np.linalg.matrix_rank(driven, TOLERANCES.singular) == n_motions
    )
    moved, of_motions = moved[is_regular], of_motions[is_regular]
    followed = np.linalg.solve(of_motions, np.swapaxes(moved, 1, 2))
    found[rows[is_regular]] = np.linalg.inv(moved @ followed)


def _moved(mechanism: Mechanism, at: At, q: Floats) -> tuple[Floats, Floats]:
    """What each of a machine's motions does to `at` (n, k, m), and to its actuators (n, n_a, m)."""
    first = JointRates(model_of(mechanism), q)
    twists, driven = pairs_at(mechanism, first)
    if at == "task":
        return axes_of(mechanism, at, end_effector_pose(mechanism, q))[..., : twists.shape[1]] @ twists, driven
    return (driven if at == "actuators" else first.pairs[:, joint_path(mechanism, at).columns]), driven


def _made(mechanism: Mechanism, at: At, q: Floats) -> Ints:
    """In how many ways a machine moves what `at` names, at coordinates q (n, c), (n,)."""
    rates, _ = _moved(mechanism, at, q)
    sizes, least = np.linalg.svd(rates, compute_uv=False), TOLERANCES.singular
    return np.asarray((sizes > least * np.maximum(sizes[:, :1], least)).sum(axis=1))
