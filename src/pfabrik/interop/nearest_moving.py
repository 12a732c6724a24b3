"""The nearest machine that moves: joints of an overconstrained machine moved within the digits of a file until it does.

Some linkages move because lengths and angles agree that no single pair of axes shows: a third rod of a parallelogram, a
Bennett linkage. Rounding locks them. Unknown are small displacements xi of every joint, and the coordinates q of some
configurations away from home, with the loop errors e(xi, q) = 0 in all of them. Where the machine moves, the slopes J
of e by q have the rank that they have at home up to rounding; with N the left vectors that are then left over,

    N' (e + G xi) = 0      for the least xi, in units of the roundings,
    J q'  = -(e + G xi)    on the rest, by least squares,

are Gauss and Newton's steps. At home, where the joints are given, they may be displaced freely: no loop opens.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arrays import Floats
from ..description.graph import tree_of
from ..description.home_mobility import loop_conditions, unclear_conditions
from ..description.joints import Joint
from ..description.structure import Structure
from ..motion.displacements import columns, displacements, joint_displacements
from ..motion.joint_rates import at_reference, graph_of, loop_errors_here, loop_slopes, moved
from ..rotations import from_rotvec
from .digits import Rounding

SAMPLES, STEPS, STEP = 12, 3, 0.1
"""Walks from home: how many, of how many steps, of which largest joint motion [rad or L]."""

NEWTON_STEPS = 30
"""Most steps; half a dozen are usual."""

CLOSED = 1e-14
"""Loop error that counts as none [L and rad]: rounding."""

OPEN = 3e-13
"""Largest loop error with which the machine found counts as one that moves [L and rad]."""

MARGIN = 3.0
"""Factor on what rounding can do to first order: for singular values that it explains, and moves of joints."""

WEAKEST = 1e-7
"""Singular value, relative to the largest, below which a condition on the joints is not solved for."""

CLEAR = 5e-3
"""Singular value [L and rad] from which a condition is one, whatever the digits of a file."""


def nearest_moving(structure: Structure, roundings: Sequence[Rounding]) -> tuple[Joint, ...] | None:
    """The joints of the nearest machine that moves, to one whose loops all but lock.

    None where that is farther than rounding explains.

    Parameters
    ----------
    roundings : how far each joint may be from what was meant.
    """
    length = structure.characteristic_length
    units = np.array([[each.angle] * 3 + [each.length / length] * 3 for each in roundings])
    threshold = min(MARGIN * float(np.linalg.norm(units)), CLEAR)
    if not any(value <= threshold for value in unclear_conditions(structure)):
        return None
    rank = _rank(structure, np.zeros((1, _count(structure))), threshold)
    q = _walked(structure, rank, np.random.default_rng(0))
    displacements = _displacements(structure, q, units, rank)
    if displacements is None:
        return None
    moving = _displaced(structure, displacements)
    is_open = np.abs(loop_errors_here(moving, _walked(moving, rank, np.random.default_rng(1)))).max() > OPEN
    if is_open or len(unclear_conditions(moving)) >= len(unclear_conditions(structure)):
        return None
    return moving.joints


def _count(structure: Structure) -> int:
    return len(graph_of(structure).path)


def _rank(structure: Structure, q: Floats, threshold: float) -> int:
    values = np.linalg.svd(loop_slopes(structure, q), compute_uv=False)
    return int(np.count_nonzero(values > threshold, axis=1).max())


def _displacement_slopes(structure: Structure, q: Floats) -> Floats:
    """Slopes G of the loop errors by small displacements of the joints, (n, 6 loops, 6 joints).

    A joint displaced by a twist xi, at its own point at home, moves its second body by xi - Ad(M) xi more, with M
    its own motion; its first body carries that on.
    """
    bodies, loops, twists = displacements(structure, q), tree_of(structure).loops, []
    length = structure.characteristic_length
    for joint in structure.joints:
        point, span = _point(structure, joint), columns(structure)[joint.name]
        motion = joint_displacements(structure, joint.name, q[:, span])
        carried = bodies[joint.connects[0]]
        twists.append(_adjoint(carried, point, length) - _adjoint(carried @ motion, point, length))
    every = np.concatenate([np.swapaxes(each, -1, -2) for each in twists], axis=1)
    return loop_conditions(np.repeat(loops, 6, axis=1), at_reference(structure, q, every))


def _point(structure: Structure, joint: Joint) -> Floats:
    return np.array(structure.reference_point if joint.at is None else joint.at)


def _adjoint(motions: Floats, point: Floats, length: float) -> Floats:
    """The matrices (n, 6, 6) [rad, L] that carry a twist at a point, by motions (n, 4, 4), to the base origin."""
    turns, place = motions[:, :3, :3], (motions[:, :3, :3] @ point + motions[:, :3, 3]) / length
    matrix = np.zeros((len(motions), 6, 6))
    matrix[:, :3, :3] = matrix[:, 3:, 3:] = turns
    matrix[:, 3:, :3] = np.cross(place[:, :, None], turns, axis=1)
    return matrix


def _walked(structure: Structure, rank: int, rng: np.random.Generator) -> Floats:
    """Configurations (n, c) some steps from home along motions that are free up to rounding, and closed up to it."""
    q = np.zeros((SAMPLES, _count(structure)))
    for _ in range(STEPS):
        right = np.linalg.svd(loop_slopes(structure, q))[2][:, rank:]
        step = np.einsum("nki,nk->ni", right, rng.standard_normal(right.shape[:2]))
        q = moved(structure, q, STEP * step / np.abs(step).max(axis=1, keepdims=True))
        for _ in range(NEWTON_STEPS):
            step = _joint_steps(loop_slopes(structure, q), loop_errors_here(structure, q), rank)[1]
            q = moved(structure, q, step)
            if np.abs(step).max() <= CLOSED:
                break
    return q


def _joint_steps(slopes: Floats, errors: Floats, rank: int) -> tuple[Floats, Floats]:
    """Left vectors N beyond the rank, (n, 6 loops, k), and steps (n, c) that close the errors along the others."""
    left, values, right = np.linalg.svd(slopes)
    solved = np.einsum("nik,ni->nk", left[:, :, :rank], errors) / values[:, :rank]
    return left[:, :, rank:], -np.einsum("nk,nkj->nj", solved, right[:, :rank])


def _displacements(structure: Structure, q: Floats, units: Floats, rank: int) -> Floats | None:
    """Displacements of the joints (j, 6) with which the loops close in configurations near to given ones (n, c)."""
    displaced, trial = np.zeros_like(units), structure
    for _ in range(NEWTON_STEPS):
        errors, slopes = loop_errors_here(trial, q), loop_slopes(trial, q)
        if np.abs(errors).max() <= CLOSED:
            break
        by_joints = _displacement_slopes(trial, q) * units.ravel()
        excess, _ = _joint_steps(slopes, errors, rank)
        rows = np.einsum("nik,nij->nkj", excess, by_joints).reshape(-1, units.size)
        residuals = -np.einsum("nik,ni->nk", excess, errors).ravel()
        step = np.linalg.lstsq(rows, residuals, rcond=WEAKEST)[0]
        displaced = displaced + (step * units.ravel()).reshape(units.shape)
        q = moved(trial, q, _joint_steps(slopes, errors + by_joints @ step, rank)[1])
        trial = _displaced(structure, displaced)
        if (np.abs(displaced) > MARGIN * np.sqrt(3.0) * units + CLOSED).any():
            return None
    return displaced if np.abs(errors).max() <= OPEN else None


def _displaced(structure: Structure, displaced: Floats) -> Structure:
    """With every joint moved by a small displacement (j, 6), a twist at its own point [rad, L]."""
    joints = []
    for joint, xi in zip(structure.joints, displaced, strict=True):
        turn = from_rotvec(xi[None, :3])[0]
        changes: dict[str, Any] = {}
        if joint.at is not None:
            changes["at"] = np.array(joint.at) + structure.characteristic_length * xi[3:]
        if joint.axis is not None:
            changes["axis"] = turn @ np.array(joint.axis)
        if joint.axes is not None:
            changes["axes"] = np.array(joint.axes) @ turn.T
        joints.append(dataclasses.replace(joint, **changes))
    return dataclasses.replace(structure, joints=tuple(joints))
