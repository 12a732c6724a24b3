"""Static equilibrium of every body: what joints transmit and actuators exert, and how displacements at joints act.

By the way of the tree from the base, joint j carries K_j = sum of the loads w_b on the bodies b beyond it; the closing
joint of loop l transmits a wrench that is not known, x_l. So joint j transmits, from its first body to its second,

    W_j = -(K_j + sum_l loops[l, j] x_l),    and for each of its coordinates k:    s_k . W_j = t_k,

with the force t_k of an actuator, or 0. Over all coordinates that is C'x = -(h + t), with the loop conditions C and
h_k = s_k . K_j. It has a solution x where N'(h + t) = 0 for the motions N that the loops allow (C N = 0): the
principle of virtual power, from which the actuators' forces follow. x is determined but for the null space of C', which
is that of the overconstraints.

Lengths are in L, and wrenches are [force times L; moment about the present reference point].
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...answers.solution import Solution
from ...common.arrays import Floats, Ints, Mask
from ...errors import UnsupportedMechanism
from ...kinematics import JointRates, column_joints, cycle_basis, model_of, tree_of
from ...machine.description.mechanism import Mechanism
from ...tolerances import TOLERANCES
from .transmission import Maps, is_redundantly_actuated

COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz")
OPEN = "equilibrium does not determine all reactions, for joints work against each other (overconstraint): {}"

ROWS_A_BLOCK = 512
"""Rows whose matrices are in memory at once."""


class Balance(NamedTuple):
    """Equilibrium at n configurations, with k loads each; lengths in L.

    Attributes
    ----------
    actuators : the least forces that hold the loads, (n, n_a, k).
    is_held : False where no actuator forces hold a load, (n, k).
    is_idle : True where it works on a motion that neither end effector nor actuators show, (n, k).
    wrenches : what joints transmit from their first body to their second, (n, joints, 6, k); where it is not determined
        by equilibrium, the least.
    open : what of these equilibrium leaves open, (n, joints, 6, z).
    is_singular : True where the loops are in a constraint singularity, in which `wrenches` mean nothing, (n,).
    """

    actuators: Floats
    is_held: Mask
    is_idle: Mask
    wrenches: Floats
    open: Floats
    is_singular: Mask


class Pairs(NamedTuple):
    """The motions of n configurations that end effector or actuators show, d of them; lengths in L.

    Attributes
    ----------
    twists, rates : of the end effector (n, r, d), and of the actuators (n, n_a, d): orthonormal together. Zero for a
        motion that nothing shows at a configuration.
    """

    twists: Floats
    rates: Floats


def balance(mechanism: Mechanism, q: Floats, carried: Floats, on_drives: Floats | float = 0.0) -> Balance:
    """The equilibrium at coordinates q (n, c) of what joints carry, (n, joints, 6, k), and what drives do."""
    acting = np.broadcast_to(on_drives, (len(q), len(mechanism.drives), carried.shape[-1]))
    blocks = [
        balance_at(mechanism, JointRates(model_of(mechanism), q[rows]), carried[rows], acting[rows])
        for start in range(0, max(len(q), 1), ROWS_A_BLOCK)
        for rows in [slice(start, start + ROWS_A_BLOCK)]
    ]
    return Balance(*(np.concatenate(parts) for parts in zip(*blocks, strict=True)))


def pairs_of(mechanism: Mechanism, q: Floats) -> Pairs:
    """The motions at coordinates q, (n, c)."""
    return pairs_at(mechanism, JointRates(model_of(mechanism), q))


def pairs_at(mechanism: Mechanism, first: JointRates) -> Pairs:
    """The motions where joint rates are known."""
    rows = 3 if mechanism.end_effector_is_joint else 6
    return Pairs(first.twists[:, :rows] @ first.pairs, first.pairs[:, first.actuated])


def balance_at(mechanism: Mechanism, first: JointRates, carried: Floats, on_drives: Floats | float = 0.0) -> Balance:
    """The equilibrium of what joints carry, (n, joints, 6, k), where their rates are known.

    Parameters
    ----------
    on_drives : loads on the actuators' coordinates themselves, (n, n_a, k): of friction, and of rotors.
    """
    owners = column_joints(mechanism)
    work = np.einsum("nci,ncik->nck", first.screws, carried[:, owners])
    work[:, first.actuated] += on_drives
    actuators, by_loop = first.wrench(work)
    wrenches = -(carried + of_joints(mechanism, by_loop))
    undone = -np.einsum("nci,ncik->nck", first.screws, wrenches[:, owners])
    undone[:, first.actuated] += actuators + on_drives
    sizes = TOLERANCES.alignment * np.abs(carried).max(axis=(1, 2), initial=0.0)
    held, idle = (np.abs(np.swapaxes(motions, -1, -2) @ undone) for motions in (first.pairs, first.unseen))
    return Balance(
        actuators=actuators,
        is_held=held.max(axis=1, initial=0.0) <= sizes,
        is_idle=idle.max(axis=1, initial=0.0) > sizes,
        wrenches=wrenches,
        open=of_joints(mechanism, first.open),
        is_singular=first.is_singular,
    )


def of_joints(mechanism: Mechanism, by_loop: Floats) -> Floats:
    """Wrenches (n, joints, 6, k) from those of loops, (n, 6 loops, k)."""
    joints, (n, _, k) = cycle_basis(mechanism).of_joints, by_loop.shape
    return np.asarray(np.einsum("lj,nlik->njik", joints, by_loop.reshape(n, len(joints), 6, k)))


def about_centres(mechanism: Mechanism, wrenches: Floats, centres: Floats, reference: Floats) -> Floats:
    """Wrenches (n, joints, 6, k) of a `Balance` as forces, and moments about the joints' centres, in machine's units.

    Parameters
    ----------
    centres : of joints, (n, joints, 3) [length]; not of slides, whose moments are about the first joint of `along`, or
        about the reference point, (n, 3) [length].
    """
    points, names = centres.copy(), [joint.name for joint in mechanism.joints]
    for place, joint in enumerate(mechanism.joints):
        if joint.at is None:
            points[:, place] = centres[:, names.index(joint.along[0])] if joint.along else reference
    forces = wrenches[:, :, :3] / mechanism.characteristic_length
    arms = (points - reference[:, None])[..., None]
    return np.concatenate([forces, wrenches[:, :, 3:] - np.cross(arms, forces, axis=2)], axis=2)


def open_components(mechanism: Mechanism, opened: Floats, centres: Floats, reference: Floats) -> Mask:
    """True where a component of a reaction is not determined, (n, joints, 6), of what `Balance.open` is."""
    left = about_centres(mechanism, opened, centres, reference)
    units = np.repeat([1.0, mechanism.characteristic_length], 3) / mechanism.characteristic_length
    return np.asarray(np.linalg.norm(left / units[:, None], axis=-1) > TOLERANCES.alignment)


def open_in_words(mechanism: Mechanism, is_open: Mask) -> str:
    """Which components of reactions are not determined in any row (n, joints, 6), in words; empty if none."""
    parts = [
        f"{joint.name} {' '.join(name for name, left in zip(COMPONENTS, row, strict=True) if left)}"
        for joint, row in zip(mechanism.joints, np.asarray(is_open.any(axis=0)), strict=True)
        if row.any()
    ]
    return OPEN.format(", ".join(parts)) if parts else ""


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
