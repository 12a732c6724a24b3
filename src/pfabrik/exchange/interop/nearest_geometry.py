"""The nearest geometry that fulfils chosen relations: each joint displaced by a small turn and shift, the least of all.

    min |xi / unit|    such that    c(xi) = 0,

by Gauss and Newton's steps, each the least displacement with which the linearised relations hold; a unit is how far
rounding may have put a joint. Home is assembled, so there joints may be displaced freely: no loop opens.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...common.arrays import Floats
from ...common.rotations import from_rotvec
from ...kinematics import columns, cycle_basis, displacements, tree_of
from ...machine.description.home_mobility import loop_conditions
from ...machine.description.structure import Structure
from ...machine.motion.displacements import joint_displacements
from ...machine.motion.loops import at_reference, loop_errors_here, loop_slopes, moved
from ...tolerances import TOLERANCES
from .digits import NOTHING, Rounding
from .relations import Axis, Relation, axes_of, equations

EXACT, HOLDS = 3e-16, 1e-13
"""Value of the equations that is not to be improved on, and up to which they hold [rad, L]: arithmetic alone."""

STEPS = 30
"""Most steps; half a dozen are usual."""

SAMPLES, WALK, STEP, CLOSED = 12, 3, 0.1, 1e-14
"""Walks from home: how many, of how many steps, of which largest joint motion [rad or L], and what closes them."""

WEAKEST = 1e-9
"""Singular value, relative to the largest, below which an equation follows from others."""

FREE = 30.0
"""Unit of a common point, over the largest of joints: where what meets does so is free."""

FURTHER, AT_ONCE = 3.0, 4
"""Factor on its rounding by which a joint may be displaced, for others are displaced with it; and of relations that ask
for too much together, one of so many is given up at once, those of the fewest axes."""


Kept = list[tuple[Relation, Floats | None]]
"""Relations, each with the point where it meets, if it does [length]."""


class Moving:
    """The relation that the loops close away from home too, in some configurations.

    Where a machine moves, the slopes J of its loop errors e by the coordinates q have the rank of home up to rounding.
    With N the left vectors that are then left over, and G the slopes by displacements of the joints,

        N' (e + G xi) = 0,      J q' = -(e + G xi)   on the rest, by least squares.

    Some linkages move because lengths and angles agree that no pair of axes shows: a third rod of a parallelogram.

    Attributes
    ----------
    q : configurations (n, c), which follow.
    gap : the largest loop error there [L and rad].
    """

    def __init__(self, structure: Structure, threshold: float) -> None:
        values = np.linalg.svd(
            loop_slopes(structure, np.zeros((1, len(cycle_basis(structure).path)))), compute_uv=False
        )
        self.rank = int(np.count_nonzero(values > threshold))
        self.q, self.gap = walked(structure, self.rank, 0), np.inf

    def equations(self, structure: Structure) -> tuple[Floats, Floats]:
        """The values (k,) and the slopes (k, 6 joints) by displacements of the joints."""
        errors, slopes = loop_errors_here(structure, self.q), loop_slopes(structure, self.q)
        self.gap = float(np.abs(errors).max(initial=0.0))
        self._by_joints, self._errors, self._slopes = displacement_slopes(structure, self.q), errors, slopes
        excess, _ = _joint_steps(slopes, errors, self.rank)
        rows = np.einsum("nik,nij->nkj", excess, self._by_joints)
        return np.einsum("nik,ni->nk", excess, errors).ravel(), rows.reshape(-1, rows.shape[-1])

    def follow(self, structure: Structure, step: Floats) -> None:
        """Move the configurations as joints are displaced by a step (6 joints,) from the structure just measured."""
        errors = self._errors + self._by_joints @ step
        self.q = moved(structure, self.q, _joint_steps(self._slopes, errors, self.rank)[1])


def nearest_geometry(
    structure: Structure, roundings: Sequence[Rounding], relations: Kept, moving: Moving | None = None
) -> tuple[Structure, Kept]:
    """The nearest geometry in which relations hold, and those of them that could be kept.

    The geometry as it is, if the loops are to close away from home, and rounding does not explain that.

    Parameters
    ----------
    roundings : how far each joint may be from what was meant.
    """
    kept, axes = list(relations), axes_of(structure.joints, roundings)
    while kept or moving:
        displaced, trial, residuals = _least(structure, roundings, kept, moving)
        far = _too_far(displaced, roundings, [] if moving else kept, axes, structure.characteristic_length)
        if max(residuals) <= HOLDS and not far:
            return _aligned(trial, kept), kept
        if moving:
            break
        loose = [n for n, (relation, _) in enumerate(kept) if relation.kind != "parallel"] or range(len(kept))
        wrong = [n for n in loose if far & {axes[index].joint for index in kept[n][0].members}]
        wrong = sorted(wrong or [int(np.argmax(residuals))], key=lambda n: len(kept[n][0].members))
        given_up = set(wrong[: max(1, len(wrong) // AT_ONCE)])
        kept = [each for n, each in enumerate(kept) if n not in given_up]
    return structure, []


def _least(
    structure: Structure, roundings: Sequence[Rounding], relations: Kept, moving: Moving | None
) -> tuple[Floats, Structure, list[float]]:
    """The least displacements (j, 6) [rad, L], the structure with them, and the residual of each relation."""
    length, n = structure.characteristic_length, 6 * len(structure.joints)
    units = np.ravel([[each.angle] * 3 + [each.length / length] * 3 for each in roundings])
    points = np.ravel([point / length for _, point in relations if point is not None])
    units = np.concatenate([units, np.full(points.size, FREE * units.max(initial=0.0))])
    x, trial, before = np.zeros(len(units)), structure, np.inf
    for _ in range(STEPS):
        axes, place = axes_of(trial.joints, roundings), n
        rows, values, residuals = [np.zeros((0, len(units)))], [np.zeros(0)], []
        for relation, point in relations:
            centre = None if point is None else points[place - n : place - n + 3] + x[place : place + 3]
            first = len(values)
            for value, slopes in equations(axes, relation, centre, length):
                row = np.zeros((len(value), len(units)))
                for joint, is_shift, slope in slopes:
                    column = place if joint < 0 else 6 * joint + 3 * is_shift
                    row[:, column : column + 3] += slope
                values.append(value)
                rows.append(row)
            place += 0 if point is None else 3
            residuals.append(float(np.abs(np.concatenate(values[first:])).max()))
        if moving:
            value, by_joints = moving.equations(trial)
            values.append(value)
            rows.append(np.hstack([by_joints, np.zeros((len(value), points.size))]))
            residuals.append(moving.gap)
        largest = max(residuals)
        if largest <= EXACT or (largest >= 0.5 * before and (moving is None or largest <= HOLDS)):
            break
        before, matrix = largest, np.concatenate(rows)
        step, free = np.zeros_like(x), units > 0.0
        wanted = matrix @ x - np.concatenate(values)
        step[free] = np.linalg.lstsq(matrix[:, free] * units[free], wanted, rcond=WEAKEST)[0] * units[free]
        if moving:
            moving.follow(trial, (step - x)[:n])
        x = step
        trial = _displaced(structure, x[:n].reshape(-1, 6))
    return x[:n].reshape(-1, 6), trial, residuals


def _too_far(
    displaced: Floats, roundings: Sequence[Rounding], relations: Kept, axes: Sequence[Axis], length: float
) -> set[int]:
    """Joints that are displaced farther than their rounding explains, or that of what they are in relation with."""
    bounds = np.array([[each.angle, each.length / length] for each in roundings])
    for relation, point in relations:
        for joint in {axes[index].joint for index in relation.members}:
            place, most = (0, relation.bound) if point is None else (1, relation.bound / length)
            bounds[joint, place] = max(bounds[joint, place], min(most, TOLERANCES.file_digits))
    sizes = np.linalg.norm(displaced.reshape(-1, 2, 3), axis=2)
    return set(np.flatnonzero((sizes > FURTHER * bounds + HOLDS).any(axis=1)).tolist())


def _aligned(structure: Structure, relations: Kept) -> Structure:
    """With axes that are parallel so to the last bit."""
    joints, axes = list(structure.joints), axes_of(structure.joints, [NOTHING] * len(structure.joints))
    for relation, _ in relations:
        for index in relation.members if relation.kind == "parallel" else ():
            own, first = axes[index], axes[relation.members[0]].along
            along = first if relation.along is None else relation.along
            if joints[own.joint].axis is not None and along is not None and own.along is not None:
                axis: Any = np.sign(own.along @ along) * along + 0.0
                joints[own.joint] = dataclasses.replace(joints[own.joint], axis=axis)
    return dataclasses.replace(structure, joints=tuple(joints))


def displacement_slopes(structure: Structure, q: Floats) -> Floats:
    """Slopes G of the loop errors by small displacements of the joints, (n, 6 loops, 6 joints).

    A joint displaced by a twist xi, at its own point at home, moves its second body by xi - Ad(M) xi more, with M
    its own motion; its first body carries that on.
    """
    bodies, loops, twists = displacements(structure, q), tree_of(structure).loops, []
    length = structure.characteristic_length
    for joint in structure.joints:
        point = np.array(structure.reference_point if joint.at is None else joint.at)
        motion = joint_displacements(structure, joint.name, q[:, columns(structure)[joint.name]])
        carried = bodies[joint.connects[0]]
        twists.append(_adjoint(carried, point, length) - _adjoint(carried @ motion, point, length))
    every = np.concatenate([np.swapaxes(each, -1, -2) for each in twists], axis=1)
    return loop_conditions(np.repeat(loops, 6, axis=1), at_reference(structure, q, every))


def _adjoint(motions: Floats, point: Floats, length: float) -> Floats:
    """The matrices (n, 6, 6) [rad, L] that carry a twist at a point, by motions (n, 4, 4), to the base origin."""
    turns, place = motions[:, :3, :3], (motions[:, :3, :3] @ point + motions[:, :3, 3]) / length
    matrix = np.zeros((len(motions), 6, 6))
    matrix[:, :3, :3] = matrix[:, 3:, 3:] = turns
    matrix[:, 3:, :3] = np.cross(place[:, :, None], turns, axis=1)
    return matrix


def walked(structure: Structure, rank: int, seed: int) -> Floats:
    """Configurations (n, c) some steps from home along motions that are free up to rounding, and closed up to it."""
    q, rng = np.zeros((SAMPLES, len(cycle_basis(structure).path))), np.random.default_rng(seed)
    for _ in range(WALK):
        right = np.linalg.svd(loop_slopes(structure, q))[2][:, rank:]
        step = np.einsum("nki,nk->ni", right, rng.standard_normal(right.shape[:2]))
        q = moved(structure, q, STEP * step / np.abs(step).max(axis=1, keepdims=True))
        for _ in range(STEPS):
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
