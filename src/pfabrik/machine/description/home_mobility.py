"""Mobility at home, to first order: freedoms of the mechanism and of its end effector.

Unknown are the rates of all joint coordinates. A tree of joints from the base gives the twist (angular velocity, and
velocity at the origin) of every body as a sum of screws times rates; every other joint closes a loop, and asks that
the twists of its two bodies differ by its own screws only. The null space of these conditions holds every motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...common.arrays import Floats
from ...common.derived import derived
from ...tolerances import TOLERANCES
from ..noted_vectors import Vector, square_to
from .graph import next_joints, steps_from_base, tree_of
from .joints import KINDS, Joint
from .structure import Structure


def body_twist(path: Floats, screws: Floats) -> Floats:
    """Twist of a body per rate, shape (..., 6, c).

    Parameters
    ----------
    path : for every column, how the way to the body passes its joint (+1, -1 or 0), shape (c,).
    screws : one a column, shape (..., c, 6).
    """
    return np.swapaxes(screws, -1, -2) * path


def loop_conditions(loops: Floats, screws: Floats) -> Floats:
    """Conditions of the loops by joint rates, shape (..., 6 loops, c); they vanish in every motion.

    Parameters
    ----------
    loops : for every column, how each loop (or a combination of loops) passes its joint, shape (loops, c).
    screws : one a column, shape (..., c, 6).
    """
    conditions = loops[:, None, :] * np.swapaxes(screws, -1, -2)[..., None, :, :]
    return conditions.reshape(*screws.shape[:-2], 6 * len(loops), screws.shape[-2])


def end_effector_freedom(
    mechanism: Structure, locked: frozenset[int], task: Sequence[str] = ("x", "y", "z", "rotation")
) -> int:
    """Number of independent motions of the end effector at home, with some coordinates locked.

    Parameters
    ----------
    locked : columns of the coordinates that do not move.
    task : what counts of a motion; what it does to other coordinates of the end effector does not.

    Returns
    -------
    0 to 6 for a body, 0 to 3 for a joint (of whose centre only the velocity counts).
    """
    twist, closure = _home_motion(mechanism, locked)
    motions = _null_space(closure)
    turns = {"rotation", "tilt"} & {*task}, {"rotation", "tilt"} & {*task}, {"rotation", "yaw"} & {*task}
    counts = np.array([*map(bool, turns), *(axis in task for axis in "xyz")])
    counts[:3] &= not mechanism.end_effector_is_joint
    return _rank(twist[counts] @ motions)


def is_held(mechanism: Structure) -> bool:
    """True if the loops hold the end effector at home, to second order too.

    To first order they also do where links are stretched out so that the end effector is at the end of what it
    reaches: it moves as these bend, with the square of what they bend by. On a chain of screws s with rates u the
    acceleration is the sum of s u' and, over pairs in their order, of [s_i, s_j] u_i u_j; the u' close the loops. Where
    no u' does, the second order does not tell, and the end effector is not said to be held.
    """
    if end_effector_freedom(mechanism, frozenset()) > 0:
        return False
    screws = _screws(mechanism)
    owners, tree = column_joints(mechanism), tree_of(mechanism)
    twist = body_twist(tree.paths[mechanism.end_effector_body][owners], screws)
    closure = loop_conditions(tree.loops[:, owners], screws)
    rates = _null_space(closure)
    rates = rates @ np.random.default_rng(0).standard_normal((rates.shape[1], SAMPLED_RATES))
    bent = np.zeros((0, rates.shape[1]))
    for index in tree.closing:
        first, second = mechanism.joints[index].connects
        around = [*tree.way(second), (index, False), *_backward(tree.way(first))]
        bent = np.concatenate([bent, _bracketed(around, screws, owners, rates)])
    accelerations = -np.linalg.pinv(closure, TOLERANCES.alignment) @ bent if bent.size else np.zeros(rates.shape)
    moved = twist @ accelerations + _bracketed(tree.way(mechanism.end_effector_body), screws, owners, rates)
    if mechanism.end_effector_is_joint:
        moved = moved[3:]
    left_open = closure @ accelerations + bent
    return bool(max(np.abs(moved).max(initial=0.0), np.abs(left_open).max(initial=0.0)) <= TOLERANCES.alignment)


SAMPLED_RATES = 4
"""Joint motions that are looked at to second order: what one of them does not show by chance, the others do."""


def _backward(way: list[tuple[int, bool]]) -> list[tuple[int, bool]]:
    """A way from its end to its begin."""
    return [(index, not forward) for index, forward in reversed(way)]


def _bracketed(
    way: list[tuple[int, bool]],
    screws: Floats,
    owners: NDArray[np.intp],
    rates: Floats,
) -> Floats:
    """The sum of [s_i, s_j] u_i u_j over the pairs of a way in their order, (6, k), at rates u (c, k)."""
    twist, total = np.zeros((6, rates.shape[1])), np.zeros((6, rates.shape[1]))
    for index, forward in way:
        places = np.flatnonzero(owners == index)
        for place in places if forward else places[::-1]:
            own = screws[place][:, None] * rates[place] * (1.0 if forward else -1.0)
            angular = np.cross(twist[:3], own[:3], axis=0)
            velocity = np.cross(twist[:3], own[3:], axis=0) - np.cross(own[:3], twist[3:], axis=0)
            total += np.concatenate([angular, velocity])
            twist = twist + own
    return total


def unclear_conditions(mechanism: Structure, below: float = TOLERANCES.nearly_implied) -> list[float]:
    """By how much conditions of the loops at home fail to follow from the others, and yet hardly are their own.

    Parameters
    ----------
    below : singular value from which on a condition is one of its own [L and rad].

    Returns
    -------
    The singular values of this kind [L and rad], the largest first. Where there are any, axes that should be parallel,
    or meet, do so up to the digits of the description only: loops that close to `TOLERANCES.position` hinder the
    joints, or keep them from moving. Or home is next to a configuration in which the mechanism gains a motion.
    """
    _, closure = _home_motion(mechanism, frozenset())
    values = np.linalg.svd(closure, compute_uv=False) if closure.size else np.zeros(0)
    unclear = (values > TOLERANCES.implied) & (values < below)
    return [float(value) for value in values[unclear]]


def unclear_joints(mechanism: Structure, below: float = TOLERANCES.nearly_implied) -> frozenset[int]:
    """Indices of the joints in the loops whose conditions `unclear_conditions` finds."""
    _, closure = _home_motion(mechanism, frozenset())
    if not closure.size:
        return frozenset()
    left, values, _ = np.linalg.svd(closure, full_matrices=False)
    unclear = left[:, (values > TOLERANCES.implied) & (values < below)]
    loops = tree_of(mechanism).loops
    parts = np.abs(unclear).reshape(len(loops), -1).max(axis=1, initial=0.0)
    return frozenset(np.flatnonzero(loops[parts > TOLERANCES.alignment].any(axis=0)).tolist())


def universal_axes(mechanism: Structure, joint: Joint) -> Floats:
    """The two axes of a universal joint at home, shape (2, 3): its own, or the default where none are given.

    The default axes are normal to each other and to the line on which all next joints are (on the body farther from the
    base, else on the nearer one), so that the joint keeps the link from spinning about itself; x and y where there is
    no such line. They do not depend on which body the joint names first.
    """
    if joint.axes is not None:
        return np.asarray(joint.axes)
    ends, is_forward = ends_of_default_axes(mechanism, joint)
    lines = [Vector(end.at or ()) - (joint.at or ()) for end in ends]
    normals = np.array(square_to(lines[0])) if lines else np.eye(3)[:2]
    return np.asarray(normals if is_forward else normals[::-1])


@derived
def ends_of_default_axes(mechanism: Structure, joint: Joint) -> tuple[list[Joint], bool]:
    """The joints to which the line of a universal joint may be that its default axes are square to, by precedence.

    Also whether the first of these axes is that of the joint's first body. Joints that are off one line by little, as
    in a machine that was measured, count as on it.
    """
    steps = steps_from_base(mechanism)
    inward, outward = sorted(joint.connects, key=lambda body: steps.get(body, 0))
    sides = [next_joints(mechanism.joints, joint, body) for body in (outward, inward)]
    apart = [[end for end in ends if end.at != joint.at] for ends in sides]
    lines = [ends[0] for ends in apart if ends and off_line(joint, ends) <= TOLERANCES.independent]
    return lines, joint.connects[0] == inward


def off_line(joint: Joint, ends: Sequence[Joint]) -> float:
    """Largest sine between the lines from a joint to others, which are elsewhere; opposite ways are one line."""
    lines = np.array([end.at for end in ends]) - joint.at
    lines /= np.linalg.norm(lines, axis=1)[:, None]
    return float(np.linalg.norm(np.cross(lines, lines[0]), axis=1).max())


def joint_screws(mechanism: Structure, joint: Joint, point: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Floats:
    """Unit screws of a joint's coordinates at home, (freedoms, 6): angular velocity, velocity at a point [L].

    The three of a spherical joint are the rotations about x, y and z.

    Parameters
    ----------
    point : by default the origin [length].
    """
    if joint.type == "prismatic":
        return np.concatenate([np.zeros(3), mechanism.home_axis(joint.name)]).reshape(1, 6)
    if joint.type == "fixed":
        return np.empty((0, 6))
    centre = (np.asarray(joint.at) - point) / mechanism.characteristic_length
    if joint.type == "spherical":
        return _rotations(np.eye(3), centre)
    if joint.type == "universal":
        return _rotations(universal_axes(mechanism, joint), centre)
    turn = _rotations([mechanism.home_axis(joint.name)], centre)
    if joint.type == "revolute":
        return turn
    return np.vstack([turn, np.concatenate([np.zeros(3), turn[0, :3]])])


def column_joints(mechanism: Structure) -> NDArray[np.intp]:
    """Index of the joint that every coordinate of the mechanism belongs to, shape (c,)."""
    counts = [len(KINDS[joint.type].coordinates) for joint in mechanism.joints]
    return np.repeat(np.arange(len(counts)), counts)


@derived
def column_moves(mechanism: Structure) -> Floats:
    """1 for every coordinate of the mechanism, 0 for those of locked joints, shape (c,)."""
    moves = np.array([float(not mechanism.joints[owner].is_rigid) for owner in column_joints(mechanism)])
    moves.setflags(write=False)
    return moves


def orthonormal_rates(mechanism: Structure) -> Floats:
    """Combinations of coordinates that turn a joint about orthonormal axes, shape (c, c), one a row.

    They count what a universal joint can do, however close its axes are; for all other joints they change nothing.
    As the two axes keep their angle, the same combinations serve in every configuration.
    """
    first_columns = np.searchsorted(column_joints(mechanism), np.arange(len(mechanism.joints)))
    combinations = np.eye(len(column_joints(mechanism)))
    for joint, column in zip(mechanism.joints, first_columns, strict=True):
        if joint.type == "universal":
            first, second = universal_axes(mechanism, joint)
            cosine, sine = first @ second, np.linalg.norm(np.cross(first, second))
            combinations[column + 1, column : column + 2] = np.array([-cosine, 1.0]) / sine
    return combinations


def _rotations(axes: ArrayLike, centre: Floats) -> Floats:
    directions = np.asarray(axes, dtype=float)
    return np.hstack([directions, np.cross(centre, directions)])


@derived
def _screws(mechanism: Structure) -> Floats:
    """Unit screws of all coordinates at home, (c, 6), with the velocity at the reference point [L]; 0 if locked."""
    screws = np.vstack([joint_screws(mechanism, joint, mechanism.reference_point) for joint in mechanism.joints])
    return np.asarray(screws * column_moves(mechanism)[:, None])


def _home_motion(mechanism: Structure, locked: frozenset[int]) -> tuple[Floats, Floats]:
    """Twist of the end effector, (6, rates), and loop conditions, (6 loops, rates), per rate of what is not locked.

    Velocities are those at the reference point: at an origin far away from the machine its motions would look alike.
    """
    screws = _screws(mechanism)
    owners = column_joints(mechanism)
    moving = np.array([column not in locked for column in range(len(owners))], dtype=bool)
    screws, owners = (orthonormal_rates(mechanism) @ screws)[moving], owners[moving]
    tree = tree_of(mechanism)
    path = tree.paths[mechanism.end_effector_body]
    return body_twist(path[owners], screws), loop_conditions(tree.loops[:, owners], screws)


def _null_space(matrix: Floats) -> Floats:
    """Orthonormal basis of the null space of a matrix, one vector per column."""
    if matrix.size == 0:
        return np.eye(matrix.shape[1])
    _, values, rows = np.linalg.svd(matrix)
    return np.asarray(rows[_count(values) :].T)


def _rank(matrix: Floats) -> int:
    return _count(np.asarray(np.linalg.svd(matrix, compute_uv=False))) if matrix.size else 0


def _count(values: NDArray[Any]) -> int:
    """Number of nonzero singular values. All matrices here have entries of order 1, so the scale is absolute."""
    return int(np.count_nonzero(values > TOLERANCES.alignment))
