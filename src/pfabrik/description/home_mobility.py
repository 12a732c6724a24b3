"""How a mechanism can move at home, to first order: freedoms of the whole and of its end effector.

Unknown are the rates of all joint coordinates. A tree of joints from the base gives the twist (angular velocity, and
velocity at the origin) of every body as a sum of screws times rates; every other joint closes a loop, and asks that
the twists of its two bodies differ by its own screws only. The null space of these conditions holds every motion.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..tolerances import TOLERANCES
from .graph import next_joints, steps_from_base, tree_of
from .joint_types import KINDS
from .joints import Joint
from .structure import Structure


def body_twist(path: NDArray[np.float64], screws: NDArray[np.float64]) -> NDArray[np.float64]:
    """Twist of a body per rate, shape (..., 6, c).

    Parameters
    ----------
    path : for every column, how the way to the body passes its joint (+1, -1 or 0), shape (c,).
    screws : one a column, shape (..., c, 6).
    """
    return np.swapaxes(screws, -1, -2) * path


def loop_conditions(loops: NDArray[np.float64], screws: NDArray[np.float64]) -> NDArray[np.float64]:
    """What the loops ask to vanish, per rate, shape (..., 6 loops, c).

    Parameters
    ----------
    loops : for every column, how each loop (or a combination of loops) passes its joint, shape (loops, c).
    screws : one a column, shape (..., c, 6).
    """
    conditions = loops[:, None, :] * np.swapaxes(screws, -1, -2)[..., None, :, :]
    return conditions.reshape(*screws.shape[:-2], 6 * len(loops), screws.shape[-2])


def end_effector_freedom(mechanism: Structure, locked: frozenset[str]) -> int:
    """Number of independent motions of the end effector at home, with some joints locked.

    Parameters
    ----------
    locked : names of the joints that do not move.

    Returns
    -------
    0 to 6 for a body, 0 to 3 for a joint (of whose centre only the velocity counts).
    """
    twist, closure = _home_motion(mechanism, locked)
    motions = _null_space(closure)
    if not mechanism.end_effector_is_joint:
        return _rank(twist @ motions)
    centre = np.asarray(mechanism.reference_point) / mechanism.characteristic_length
    return _rank((twist[3:] + np.cross(twist[:3], centre, axisa=0, axisc=0)) @ motions)


def inexactness(mechanism: Structure) -> float:
    """By how much conditions of the loops at home fail to follow from the others, and yet hardly are their own.

    Returns
    -------
    The largest singular value of this kind [L and rad], 0 if there is none. Where there is one, axes that should be
    parallel, or meet, do so up to the digits of the description only: loops that close to `TOLERANCES.position` hinder
    the joints, or keep them from moving. Or home is next to a configuration in which the mechanism gains a motion.
    """
    _, closure = _home_motion(mechanism, frozenset())
    values = np.linalg.svd(closure, compute_uv=False) if closure.size else np.zeros(0)
    unclear = values[(values > TOLERANCES.implied) & (values < TOLERANCES.nearly_implied)]
    return float(unclear.max(initial=0.0))


def universal_axes(mechanism: Structure, joint: Joint) -> NDArray[np.float64]:
    """The two axes of a universal joint at home, shape (2, 3): its own, or the default where none are given.

    The default axes are normal to each other and to the line to the only next joint (on the body farther from the
    base, else on the nearer one), so that the joint keeps the link from spinning about itself; x and y where there is
    no such line. They do not depend on which body the joint names first.
    """
    if joint.axes is not None:
        return np.asarray(joint.axes)
    steps = steps_from_base(mechanism)
    inward, outward = sorted(joint.connects, key=lambda body: steps.get(body, 0))
    sides = [next_joints(mechanism.joints, joint, body) for body in (outward, inward)]
    lines = [
        np.asarray(ends[0].at) - np.asarray(joint.at) for ends in sides if len(ends) == 1 and ends[0].at != joint.at
    ]
    normals = np.linalg.svd(lines[0].reshape(1, 3))[2][1:] if lines else np.eye(3)[:2]
    return np.asarray(normals if joint.connects[0] == inward else normals[::-1])


def joint_screws(mechanism: Structure, joint: Joint) -> NDArray[np.float64]:
    """Unit screws of a joint's coordinates at home, (freedoms, 6): angular velocity, velocity at the origin [L].

    The three of a spherical joint are the rotations about x, y and z.
    """
    if joint.type == "prismatic":
        return np.concatenate([np.zeros(3), mechanism.home_axis(joint.name)]).reshape(1, 6)
    if joint.type == "fixed":
        return np.empty((0, 6))
    centre = np.asarray(joint.at) / mechanism.characteristic_length
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


def orthonormal_rates(mechanism: Structure) -> NDArray[np.float64]:
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


def _rotations(axes: ArrayLike, centre: NDArray[np.float64]) -> NDArray[np.float64]:
    directions = np.asarray(axes, dtype=float)
    return np.hstack([directions, np.cross(centre, directions)])


def _home_motion(mechanism: Structure, locked: frozenset[str]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Twist of the end effector, (6, rates), and loop conditions, (6 loops, rates), per rate of what is not locked."""
    screws = np.vstack([joint_screws(mechanism, joint) for joint in mechanism.joints])
    owners = column_joints(mechanism)
    moving = np.array([joint.name not in locked for joint in mechanism.joints])[owners]
    screws, owners = (orthonormal_rates(mechanism) @ screws)[moving], owners[moving]
    tree = tree_of(mechanism)
    path = tree.paths[mechanism.end_effector_body]
    return body_twist(path[owners], screws), loop_conditions(tree.loops[:, owners], screws)


def _null_space(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Orthonormal basis, one vector per column, of what the rows of the matrix are blind to."""
    if matrix.size == 0:
        return np.eye(matrix.shape[1])
    _, values, rows = np.linalg.svd(matrix)
    return np.asarray(rows[_count(values) :].T)


def _rank(matrix: NDArray[np.float64]) -> int:
    return _count(np.asarray(np.linalg.svd(matrix, compute_uv=False))) if matrix.size else 0


def _count(values: NDArray[Any]) -> int:
    """How many singular values are not zero. All matrices here have entries of order 1, so the scale is absolute."""
    return int(np.count_nonzero(values > TOLERANCES.alignment))
