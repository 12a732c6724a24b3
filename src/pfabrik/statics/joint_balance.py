"""Static equilibrium of every body of a machine: what joints transmit and actuators exert.

By the way of the tree from the base, joint j carries K_j = sum of the loads w_b on the bodies b beyond it; the closing
joint of loop l transmits a wrench that is not known, x_l. So joint j transmits, from its first body to its second,

    W_j = -(K_j + sum_l loops[l, j] x_l),    and for each of its coordinates k:    s_k . W_j = t_k,

with the force t_k of an actuator, or 0. Over all coordinates that is C'x = -(h + t), with the loop conditions C and
h_k = s_k . K_j. It has a solution x where N'(h + t) = 0 for the motions N that the loops allow (C N = 0): the
principle of virtual power, from which the actuators' forces follow. x is determined but for the null space of C', which
is that of the overconstraints.

Lengths are in L, and wrenches are [moment about the present reference point; force times L].
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Floats, Mask
from ..description.graph import tree_of
from ..description.home_mobility import body_twist, column_joints, loop_conditions
from ..description.mechanism import Mechanism
from ..motion.displacements import screws
from ..motion.joint_rates import actuated_columns, at_reference, graph_of
from ..motion.mobility import generic_of
from ..tolerances import TOLERANCES

ROWS_A_BLOCK = 128
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
    open : what of these equilibrium leaves open, orthonormal, (n, joints, 6, z).
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
    twists, rates : of the end effector (n, 6, d), [angular; linear], and of the actuators (n, n_a, d): orthonormal
        together. Zero for a motion that nothing shows at a configuration.
    of_joints : rates of all orthonormal joint coordinates, (n, c, d).
    unseen : motions that nothing shows, (n, c, m); zero for the others.
    """

    twists: Floats
    rates: Floats
    of_joints: Floats
    unseen: Floats


class _Loops(NamedTuple):
    """Loop conditions C (n, 6 loops, c) by orthonormal joint rates, and their singular vectors and values."""

    screws: Floats
    left: Floats
    values: Floats
    right: Floats


def balance(mechanism: Mechanism, q: Floats, carried: Floats) -> Balance:
    """The equilibrium at coordinates q (n, c) of what joints carry, (n, joints, 6, k)."""
    blocks = [
        _balance(mechanism, q[start : start + ROWS_A_BLOCK], carried[start : start + ROWS_A_BLOCK])
        for start in range(0, max(len(q), 1), ROWS_A_BLOCK)
    ]
    return Balance(*(np.concatenate(parts) for parts in zip(*blocks, strict=True)))


def pairs_of(mechanism: Mechanism, q: Floats) -> Pairs:
    """The motions at coordinates q, (n, c)."""
    blocks = [
        _pairs(mechanism, _loops(mechanism, q[start : start + ROWS_A_BLOCK]))
        for start in range(0, max(len(q), 1), ROWS_A_BLOCK)
    ]
    return Pairs(*(np.concatenate(parts) for parts in zip(*blocks, strict=True)))


def _balance(mechanism: Mechanism, q: Floats, carried: Floats) -> Balance:
    loops, owners = _loops(mechanism, q), column_joints(mechanism)
    pairs, rank = _pairs(mechanism, loops), generic_of(mechanism).rank
    work = np.einsum("nci,ncik->nck", loops.screws, carried[:, owners])
    actuators, left = _least_forces(pairs, work)
    sizes = TOLERANCES.alignment * np.abs(carried).max(axis=(1, 2), initial=0.0)
    unseen = np.abs(np.swapaxes(pairs.unseen, -1, -2) @ work).max(axis=1, initial=0.0)
    columns = actuated_columns(mechanism)
    work[:, columns] += actuators
    kept = loops.right[:, :rank] @ work / np.where(loops.values[:, :rank] > 0.0, loops.values[:, :rank], 1.0)[..., None]
    joints = np.linalg.qr(tree_of(mechanism).loops.T)[0].T
    by_loop = -(loops.left[..., :rank] @ kept)
    wrenches = -(carried + _of_joints(joints, by_loop))
    return Balance(
        actuators=actuators,
        is_held=left <= sizes,
        is_idle=unseen > sizes,
        wrenches=wrenches,
        open=_of_joints(joints, loops.left[..., rank:]),
        is_singular=loops.values[:, :rank].min(axis=1, initial=1.0) < TOLERANCES.singular,
    )


def _of_joints(joints: Floats, by_loop: Floats) -> Floats:
    """Wrenches (n, joints, 6, k) from those of loops, (n, 6 loops, k)."""
    n, _, k = by_loop.shape
    return np.asarray(np.einsum("lj,nlik->njik", joints, by_loop.reshape(n, len(joints), 6, k)))


def _loops(mechanism: Mechanism, q: Floats) -> _Loops:
    graph = graph_of(mechanism)
    present = graph.rates @ at_reference(mechanism, q, screws(mechanism, q))
    conditions = loop_conditions(graph.orthonormal, present)
    if 0 in conditions.shape[1:]:
        n, rows, columns = conditions.shape
        full = np.broadcast_to(np.eye(columns), (n, columns, columns))
        return _Loops(present, np.zeros((n, rows, rows)), np.zeros((n, 0)), full)
    return _Loops(present, *np.linalg.svd(conditions))


def _pairs(mechanism: Mechanism, loops: _Loops) -> Pairs:
    generic = generic_of(mechanism)
    counts, columns = generic.mobility, actuated_columns(mechanism)
    motions = np.swapaxes(loops.right[:, generic.rank :], -1, -2)
    twist = body_twist(graph_of(mechanism).path, loops.screws)
    shown_rows = twist[:, 3:] if mechanism.end_effector_is_joint else twist
    seen = np.concatenate([shown_rows @ motions, motions[:, columns]], axis=1)
    _, sizes, right = np.linalg.svd(seen)
    shown = counts.platform + counts.internal
    sizes = np.concatenate([sizes, np.zeros((len(seen), max(0, motions.shape[-1] - sizes.shape[1])))], axis=1)
    is_shown = (sizes > TOLERANCES.singular) & (np.arange(sizes.shape[1]) < shown)
    turned = motions @ np.swapaxes(right, -1, -2)
    of_joints = np.divide(turned, sizes[:, None], out=np.zeros_like(turned), where=is_shown[:, None])[..., :shown]
    unseen = np.where(is_shown[:, None], 0.0, turned)
    return Pairs(twist @ of_joints, of_joints[:, columns], of_joints, unseen)


def _least_forces(pairs: Pairs, work: Floats) -> tuple[Floats, Floats]:
    """The least actuator forces (n, n_a, k) against work (n, c, k), and the largest work that is left, (n, k)."""
    against = np.swapaxes(pairs.of_joints, -1, -2) @ work
    left, sines, right = np.linalg.svd(pairs.rates, full_matrices=False)
    inverse = np.divide(1.0, sines, out=np.zeros_like(sines), where=sines > TOLERANCES.singular)
    forces = -(left @ (inverse[..., None] * (right @ against)))
    undone = against + np.swapaxes(pairs.rates, -1, -2) @ forces
    return np.asarray(forces), np.abs(undone).max(axis=1, initial=0.0)


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
    forces = wrenches[:, :, 3:] / mechanism.characteristic_length
    arms = (points - reference[:, None])[..., None]
    return np.concatenate([forces, wrenches[:, :, :3] - np.cross(arms, forces, axis=2)], axis=2)
