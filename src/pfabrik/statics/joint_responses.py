"""What joints transmit per unit of each component of a wrench on the end effector."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..answers.solution import Solution
from ..arrays import Floats, Ints, Mask
from ..description.graph import tree_of
from ..errors import UnsupportedMechanism
from ..motion.displacements import placed
from .first_order_maps import Maps, is_redundantly_actuated
from .joint_balance import balance
from .rod_forces import rods_of, tensions


class Responses(NamedTuple):
    """Reactions by wrench at some rows of a solution; r is 6, or 3 for a joint end effector.

    Attributes
    ----------
    places : indices of the rows, (n,).
    forces : of each joint's first body on its second, per wrench about the reference point, (n, joints, 3, r).
    open : forces that equilibrium leaves open, (n, joints, 3, z).
    rods : forces along rods per wrench, (n, rods, r), in the order of `rods_of`.
    open_rods : the largest that is left open along each, (n, rods).
    is_singular : rows in a constraint singularity, in which the others mean nothing, (n,).
    """

    places: Ints
    forces: Floats
    open: Floats
    rods: Floats
    open_rods: Floats
    is_singular: Mask


def responses_of(solution: Solution, maps: Maps, purpose: str) -> Responses:
    """The responses at all valid rows.

    Raises
    ------
    UnsupportedMechanism : actuators work against each other, so that forces do not follow from equilibrium.
    """
    mechanism = solution.mechanism
    if is_redundantly_actuated(mechanism):
        reason = "there are more actuators than motions, and forces do not follow from equilibrium alone"
        raise UnsupportedMechanism(mechanism.name, [reason], purpose)
    places = np.flatnonzero(maps.is_valid)
    q, length = solution._configurations.coordinates_at(places), mechanism.characteristic_length
    wrenches = np.diag(np.repeat([length, 1.0], 3))[:, : maps.forward.shape[1]]
    path = tree_of(mechanism).paths[mechanism.end_effector_body]
    found = balance(mechanism, q, np.broadcast_to(path[:, None, None] * wrenches, (len(q), len(path), *wrenches.shape)))
    centres, rods = placed(mechanism, q)[1], rods_of(mechanism)
    return Responses(
        places,
        found.wrenches[:, :, :3] / length,
        found.open[:, :, :3],
        tensions(rods, found.wrenches, centres) / length,
        np.linalg.norm(tensions(rods, found.open, centres), axis=-1),
        found.is_singular,
    )
