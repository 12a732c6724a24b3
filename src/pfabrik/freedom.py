"""How a mechanism can move at home, to first order: freedoms of the whole and of its end effector.

Unknown are the rates of all joint coordinates. A tree of joints from the base gives the twist (angular velocity, and
velocity at the origin) of every body as a sum of screws times rates; every other joint closes a loop, and asks that
the twists of its two bodies differ by its own screws only. The null space of these conditions holds every motion.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .cones import next_joints
from .tolerances import TOLERANCES

if TYPE_CHECKING:
    from .mechanism import Joint, Mechanism


def instantaneous_mobility(mechanism: Mechanism) -> int:
    """Number of independent motions of the whole mechanism at home, passive ones included (a strut's own spin)."""
    _, closure = _twists_and_closure(mechanism, frozenset())
    return int(_null_space(closure).shape[1])


def end_effector_freedom(mechanism: Mechanism, locked: frozenset[str]) -> int:
    """Number of independent motions of the end effector at home, with some joints locked.

    Parameters
    ----------
    locked : names of the joints that do not move.

    Returns
    -------
    0 to 6 for a body, 0 to 3 for a joint (of whose centre only the velocity counts).
    """
    twists, closure = _twists_and_closure(mechanism, locked)
    motions = _null_space(closure)
    if not mechanism.end_effector_is_joint:
        return _rank(twists[mechanism.end_effector] @ motions)
    twist = twists[mechanism.joint(mechanism.end_effector).connects[0]] @ motions
    centre = np.asarray(mechanism.reference_point) / mechanism.characteristic_length
    return _rank(twist[3:] + np.cross(twist[:3], centre, axisa=0, axisc=0))


def universal_axes(mechanism: Mechanism, joint: Joint) -> NDArray[np.float64]:
    """The two axes of a universal joint at home, shape (2, 3): its own, or the default where none are given.

    The default axes are normal to each other and to the line to the only next joint (on the second body, else on the
    first), so that the joint keeps the link from spinning about itself; x and y where there is no such line.
    """
    if joint.axes is not None:
        return np.asarray(joint.axes)
    sides = [next_joints(mechanism.joints, joint, body) for body in reversed(joint.connects)]
    lines = [
        np.asarray(ends[0].at) - np.asarray(joint.at) for ends in sides if len(ends) == 1 and ends[0].at != joint.at
    ]
    normals = np.linalg.svd(lines[0].reshape(1, 3))[2][1:] if lines else np.eye(3)[:2]
    return np.asarray(normals)


def joint_screws(mechanism: Mechanism, joint: Joint) -> NDArray[np.float64]:
    """Screws that span a joint's freedoms at home, (freedoms, 6): angular velocity, velocity at the origin [L]."""
    if joint.type == "prismatic":
        return np.concatenate([np.zeros(3), mechanism.home_axis(joint.name)]).reshape(1, 6)
    if joint.type == "fixed":
        return np.empty((0, 6))
    centre = np.asarray(joint.at) / mechanism.characteristic_length
    if joint.type == "spherical":
        return _rotations(np.eye(3), centre)
    if joint.type == "universal":
        plane = np.linalg.qr(universal_axes(mechanism, joint).T)[0].T  # also for axes that are far from normal
        return _rotations(plane, centre)
    turn = _rotations([mechanism.home_axis(joint.name)], centre)
    if joint.type == "revolute":
        return turn
    return np.vstack([turn, np.concatenate([np.zeros(3), turn[0, :3]])])


def _rotations(axes: ArrayLike, centre: NDArray[np.float64]) -> NDArray[np.float64]:
    directions = np.asarray(axes, dtype=float)
    return np.hstack([directions, np.cross(centre, directions)])


def _twists_and_closure(
    mechanism: Mechanism, locked: frozenset[str]
) -> tuple[dict[str, NDArray[np.float64]], NDArray[np.float64]]:
    """The twist of every body, shape (6, rates), and the loop conditions, shape (6 loops, rates), per joint rate."""
    differences = _differences(mechanism, locked)
    twists = {mechanism.base: np.zeros((6, differences[0].shape[1]))}
    waiting = list(zip(mechanism.joints, differences, strict=True))
    conditions = [twists[mechanism.base]]  # no loop asks for nothing
    while waiting:
        joint, difference = waiting.pop(_next_reached(waiting, twists))
        first, second = joint.connects
        if first in twists and second in twists:
            conditions.append(twists[second] - twists[first] - difference)
        elif first in twists:
            twists[second] = twists[first] + difference
        else:
            twists[first] = twists[second] - difference
    return twists, np.vstack(conditions)


def _next_reached(waiting: list[tuple[Joint, NDArray[np.float64]]], twists: Mapping[str, NDArray[np.float64]]) -> int:
    """Index of the first joint of a body whose twist is known."""
    return next(index for index, (joint, _) in enumerate(waiting) if any(body in twists for body in joint.connects))


def _differences(mechanism: Mechanism, locked: frozenset[str]) -> list[NDArray[np.float64]]:
    """Twist of the second body of every joint relative to its first, shape (6, rates), per joint rate."""
    none = np.empty((0, 6))
    screws = [none if joint.name in locked else joint_screws(mechanism, joint) for joint in mechanism.joints]
    ends = np.cumsum([len(each) for each in screws])
    differences = [np.zeros((6, ends[-1])) for _ in screws]
    for difference, own, end in zip(differences, screws, ends, strict=True):
        difference[:, end - len(own) : end] = own.T
    return differences


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
