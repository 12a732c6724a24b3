"""Responses of the end effector to displacements at joints, such as play or a stretched rod."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..answers.solution import Solution
from ..arrays import Floats, Ints, Mask
from ..errors import UnsupportedMechanism
from ..kinematics import JointRates, cycle_basis, model_of, tree_of
from .first_order_maps import Maps, is_redundantly_actuated
from .joint_balance import of_joints


class Responses(NamedTuple):
    """Twists by displacements of each joint's second body from its first, at some rows of a solution.

    By virtual work these are also the forces that joints transmit, per wrench on the end effector.

    Attributes
    ----------
    places : indices of the rows, (n,).
    twists : at held actuators, per length, (n, joints, r, 3); r is 6, or 3 for a joint end effector.
    open : what loops resist of displacements, (n, joints, 3, z); 0 where they give way.
    is_singular : rows in a constraint singularity, in which the others mean nothing, (n,).
    """

    places: Ints
    twists: Floats
    open: Floats
    is_singular: Mask


def responses_of(solution: Solution, maps: Maps, purpose: str) -> Responses:
    """The responses at all valid rows.

    Raises
    ------
    UnsupportedMechanism : actuators work against each other, so that they hold no displacement.
    """
    mechanism, places = solution.mechanism, np.flatnonzero(maps.is_valid)
    if is_redundantly_actuated(mechanism):
        reason = "there are more actuators than motions, and forces do not follow from equilibrium alone"
        raise UnsupportedMechanism(mechanism.name, [reason], purpose)
    first, r = JointRates(model_of(mechanism), solution._configurations.coordinates_at(places)), maps.forward.shape[1]
    path, shift = tree_of(mechanism).paths[mechanism.end_effector_body], np.eye(6, 3)
    openings = np.einsum("lj,ik->lijk", cycle_basis(mechanism).of_joints, shift).reshape(-1, 3 * len(path))
    rates = first.geometry(openings, np.zeros((len(first.actuated), openings.shape[1])))
    twists = np.swapaxes((first.twists @ rates)[:, :r].reshape(-1, r, len(path), 3), 1, 2)
    twists = twists + np.multiply.outer(path, shift[:r])
    twists[:, :, 3:] /= mechanism.characteristic_length
    return Responses(places, twists, of_joints(mechanism, first.open)[:, :, :3], first.is_singular)
