"""How a mechanism can move at home, to first order: freedoms of the whole and of its end effector.

Unknown are the twists (angular velocity, velocity of the point at the origin) of all bodies but the base. A joint lets
its two bodies differ by the screws of its freedoms, so their difference is orthogonal to the wrenches that the joint
transmits; the null space of all these conditions holds every motion.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .cones import next_joints
from .tolerances import TOLERANCES

if TYPE_CHECKING:
    from .mechanism import Joint, Mechanism


def instantaneous_mobility(mechanism: Mechanism) -> int:
    """Number of independent motions of the whole mechanism at home, passive ones included (a strut's own spin)."""
    return _motions(mechanism, frozenset()).shape[1]


def end_effector_freedom(mechanism: Mechanism, locked: frozenset[str]) -> int:
    """Number of independent motions of the end effector at home, with some joints locked.

    Parameters
    ----------
    locked : names of the joints that do not move.

    Returns
    -------
    0 to 6 for a body, 0 to 3 for a joint (of whose centre only the velocity counts).
    """
    motions = _motions(mechanism, locked)
    if not mechanism.end_effector_is_joint:
        return _rank(_twists_of(mechanism, mechanism.end_effector, motions))
    body = mechanism.joint(mechanism.end_effector).connects[0]
    twists = _twists_of(mechanism, body, motions)
    centre = np.asarray(mechanism.reference_point) / mechanism.characteristic_length
    return _rank(twists[3:] + np.cross(twists[:3], centre, axisa=0, axisc=0))


def universal_axes(mechanism: Mechanism, joint: Joint) -> NDArray[np.float64]:
    """The two axes of a universal joint at home, shape (2, 3): its own, or the default where none are given.

    The default axes are normal to each other and to the line to the only next joint (on the second body, else on the
    first), so that the joint keeps the link from spinning about itself; x and y where there is no such line.
    """
    if joint.axes is not None:
        return np.asarray(joint.axes)
    sides = [next_joints(mechanism.joints, joint, body) for body in reversed(joint.connects)]
    lines = [np.subtract(ends[0].at, joint.at) for ends in sides if len(ends) == 1 and ends[0].at != joint.at]
    normals = np.linalg.svd(lines[0].reshape(1, 3))[2][1:] if lines else np.eye(3)[:2]
    return np.asarray(normals)


def joint_screws(mechanism: Mechanism, joint: Joint) -> NDArray[np.float64]:
    """Screws of a joint's freedoms at home, shape (freedoms, 6): angular velocity, velocity at the origin [L]."""
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


def _rotations(axes: ArrayLike, centre: NDArray[np.float64]) -> NDArray[np.float64]:
    directions = np.asarray(axes, dtype=float)
    return np.hstack([directions, np.cross(centre, directions)])


def _motions(mechanism: Mechanism, locked: frozenset[str]) -> NDArray[np.float64]:
    """Basis of all motions: the twists of the bodies of `_moving`, stacked, one motion per column."""
    moving = _moving(mechanism)
    blocks = []
    for joint in mechanism.joints:
        screws = np.empty((0, 6)) if joint.name in locked else joint_screws(mechanism, joint)
        wrenches = _null_space(screws).T
        block = np.zeros((len(wrenches), 6 * len(moving)))
        for body, sign in zip(joint.connects, (-1.0, 1.0), strict=True):
            if body in moving:
                block[:, 6 * moving[body] : 6 * moving[body] + 6] = sign * wrenches
        blocks.append(block)
    return _null_space(np.vstack(blocks))


def _moving(mechanism: Mechanism) -> dict[str, int]:
    bodies = [body for body in mechanism.bodies if body != mechanism.base]
    return {body: index for index, body in enumerate(bodies)}


def _twists_of(mechanism: Mechanism, body: str, motions: NDArray[np.float64]) -> NDArray[np.float64]:
    """The twists of one body in all motions, shape (6, motions); zero for the base."""
    index = _moving(mechanism).get(body)
    return np.zeros((6, motions.shape[1])) if index is None else motions[6 * index : 6 * index + 6]


def _null_space(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Orthonormal basis, one vector per column, of what the rows of the matrix are blind to."""
    if len(matrix) == 0:
        return np.eye(matrix.shape[1])
    _, values, rows = np.linalg.svd(matrix)
    return np.asarray(rows[_count(values) :].T)


def _rank(matrix: NDArray[np.float64]) -> int:
    return _count(np.linalg.svd(matrix, compute_uv=False)) if matrix.size else 0


def _count(values: NDArray[np.float64]) -> int:
    """How many singular values are not zero. All matrices here have entries of order 1, so the scale is absolute."""
    return int(np.count_nonzero(values > TOLERANCES.alignment))
