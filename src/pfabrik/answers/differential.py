"""To first order: mobility, Jacobians, and how near answers are to a singularity."""

from __future__ import annotations

from functools import partial
from itertools import compress
from typing import cast

import numpy as np

from ..common.arrays import Floats, shaped
from ..common.printed import triple
from ..engines.chains.chain_jacobians import forward_of_chain, inverse_of_chain, is_driven_chain
from ..engines.joints.configurations import Configurations
from ..engines.joints.first_order import JointRates, singularities
from ..engines.pose.jacobians import forward_map, inverse_map
from ..machine.description.mechanism import Mechanism, checked_mechanism
from ..machine.model import Model, model_of
from ..machine.motion.mobility import Mobility, NearlyFree, generic_of
from ..machine.motion.singularities import NUMBERS, Singularity
from ..tolerances import TOLERANCES
from .solution import Solution, checked_solution

__all__ = ["Mobility", "NearlyFree", "Singularity", "forward_jacobian", "inverse_jacobian", "mobility", "singularity"]

SLIGHT = 0.01
"""Turn of a translation [rad per L], or advance of a turn [L per rad], that words leave out: they name the motion."""


def mobility(mechanism: Mechanism) -> Mobility:
    """Motions of a mechanism in general, counted at configurations reached from home without regard to limits.

    Overconstrained mechanisms count right: the loops are closed exactly before conditions are compared.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    """
    return generic_of(model_of(checked_mechanism(mechanism)).mechanism).mobility


def forward_jacobian(solution: Solution) -> Floats:
    """Twist of the end effector per actuator rate, (..., 6, n_a), in the base frame.

    Rows: velocity of the reference point [length/s], angular velocity [rad/s]; for a joint end effector only the
    velocity of its centre, (..., 3, n_a). Columns: `mechanism.actuator_names` [rad/s or length/s].

    Rates that the mechanism cannot make are replaced by the nearest it can; freedoms that no actuator controls rest as
    far as possible. At a type 2 singularity no such map exists: the direction gained is left out (see `singularity`).
    INVALID rows are NaN.

    Parameters
    ----------
    solution : Solution
        One configuration or a batch.
    """
    model, found = _of(solution)
    by_chain = is_driven_chain(model)
    maps = forward_of_chain(model, found.coordinates) if by_chain else forward_map(model, found)
    forward: Floats = shaped(maps, solution.shape)
    return forward


def inverse_jacobian(solution: Solution) -> Floats:
    """Actuator rates per twist of the end effector, (..., n_a, 6), in the base frame.

    Rows and columns are the columns and rows of `forward_jacobian`; (..., n_a, 3) for a joint end effector. The two are
    inverses of each other where the mechanism has as many actuators as the end effector has freedoms in space, else
    Moore-Penrose inverses (with lengths in units of L): twists that the mechanism cannot make are replaced by the
    nearest it can, and of all actuator rates that make a twist, the smallest are given. At a type 1 singularity the
    direction lost is left out (see `singularity`). INVALID rows are NaN.

    Parameters
    ----------
    solution : Solution
        One configuration or a batch.
    """
    model, found = _of(solution)
    by_chain = is_driven_chain(model)
    maps = inverse_of_chain(model, found.coordinates) if by_chain else inverse_map(model, found)
    inverse: Floats = shaped(maps, solution.shape)
    return inverse


def singularity(solution: Solution) -> Singularity:
    """Distances of a solution's configurations from singularities of every kind; NaN for INVALID rows.

    Parameters
    ----------
    solution : Solution
        One configuration or a batch.
    """
    model, configurations = _of(solution)
    found = singularities(model, configurations.coordinates)
    numbers = {name: shaped(np.asarray(getattr(found, name)), solution.shape) for name in NUMBERS}
    kinds = cast(list[tuple[str, ...]], found.kinds)
    if solution.shape:
        return Singularity(**numbers, kinds=kinds)
    return Singularity(**numbers, kinds=kinds[0], _in_words=partial(_motions_in_words, solution))


def _motions_in_words(solution: Solution, found: Singularity) -> list[str]:
    """The motions of one answer that are nearest to being lost and gained, as translations, turns or screws."""
    drives = () if "passive" in found.kinds and found.passive < found.serial else _drives_of(solution, found.lost)
    moving = "all actuators" if len(drives) == len(solution.mechanism.actuator_names) > 1 else " and ".join(drives)
    ends = {"lost": f", for which {moving} would move most" * bool(drives), "gained": ", with all actuators locked"}
    words = {name: _twist_in_words(solution, getattr(found, name)) for name in ends}
    return [f"nearest to being {name}: {twist}{ends[name]}" for name, twist in words.items() if twist]


def _drives_of(solution: Solution, lost: Floats) -> list[str]:
    """The actuators that move most in the motion whose twist is nearest to being lost.

    Twists T = U S V' and actuator rates A of all motions: S vanishes in a singularity, where A V U' still says them.
    """
    model, configurations = _of(solution)
    first, directions = JointRates(model, configurations.coordinates), generic_of(model.mechanism).directions
    left, _, right = np.linalg.svd(
        directions.T @ first.twists[0, : len(directions)] @ first.pairs[0], full_matrices=False
    )
    rates = np.abs(first.pairs[0][first.actuated] @ right.T @ (left.T @ (directions.T @ lost)))
    is_most = rates > max(0.5 * rates.max(initial=0.0), TOLERANCES.alignment)
    return list(compress(model.mechanism.actuator_names, is_most))


def _twist_in_words(solution: Solution, twist: Floats) -> str:
    """A unit twist, lengths in L, of the reference point of one answer; empty if it is unknown."""
    mechanism, least = solution.mechanism, TOLERANCES.alignment
    length, velocity, turning = mechanism.characteristic_length, twist[:3], twist[3:]
    square = float(turning @ turning)
    if np.isnan(twist).any():
        return ""
    if square <= SLIGHT**2:
        return f"a translation along {triple(velocity / np.linalg.norm(velocity), least)}"
    pitch = float(velocity @ turning) / square
    centre = solution.pose[:3, 3] + length * np.cross(turning, velocity) / square
    about = f"about {triple(turning / square**0.5, least)} through {triple(centre, least * length)}"
    advance = f"{2.0 * np.pi * pitch * length:.4g} {mechanism.length_unit}"
    return f"a turn {about}" if abs(pitch) <= SLIGHT else f"a screw of {advance} a turn {about}"


def _of(solution: Solution) -> tuple[Model, Configurations]:
    """The model of a solution's machine, and its configurations."""
    return model_of(checked_solution(solution).mechanism), solution._configurations
