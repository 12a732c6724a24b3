"""To first order: mobility, Jacobians, and how near answers are to a singularity."""

from __future__ import annotations

from typing import cast

import numpy as np

from ..arrays import Floats, shaped
from ..chains.chain_jacobians import forward_of_chain, inverse_of_chain, is_driven_chain
from ..closure.configurations import Configurations
from ..closure.first_order import singularities
from ..description.mechanism import Mechanism, checked_mechanism
from ..model import Model, model_of
from ..motion.mobility import Mobility, NearlyFree, generic_of
from ..motion.singularities import NUMBERS, Singularity
from ..platform.jacobians import forward_map, inverse_map
from .solution import Solution, checked_solution

__all__ = ["Mobility", "NearlyFree", "Singularity", "forward_jacobian", "inverse_jacobian", "mobility", "singularity"]


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
    return Singularity(**numbers, kinds=kinds[0] if solution.shape == () else kinds)


def _of(solution: Solution) -> tuple[Model, Configurations]:
    """The model of a solution's machine, and its configurations."""
    return model_of(checked_solution(solution).mechanism), solution._configurations
