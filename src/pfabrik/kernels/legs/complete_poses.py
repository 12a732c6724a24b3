"""Poses: targets read, completed with what they leave open, and made orthonormal; rotations of the platform."""

from __future__ import annotations

import math

from ...common.arrays import Floats, Ints, Record
from .._jit import routine, search
from ..quaternions import UPSIDE_DOWN, turn_about_z, yaw_of
from ..vectors import Vec, cross, dot, norm, scale, turn, vec
from .endings import turned
from .leg_constants import LEAST_MARGIN, NOT_A_ROTATION, ROUNDED


@routine
def turn_pose(pose: Floats, spin: Vec) -> None:
    """Turn the rotation of a pose by a rotation vector, in base coordinates."""
    angle = norm(spin)
    if angle == 0.0:
        return
    axis = scale(1.0 / angle, spin)
    for j in range(3):
        column = turned((pose[0, j], pose[1, j], pose[2, j]), axis, math.cos(angle), math.sin(angle))
        for i in range(3):
            pose[i, j] = column[i]


@routine
def middle_of(pose: Floats, task: Record) -> Vec:
    """Vector from the reference point, which may be far away, to the centre of the joints on the platform."""
    return turn(pose, vec(task["centre"]))


@routine
def read_target(target: Floats, begin: Floats, task: Record, pose: Floats) -> bool:
    """Convert a target [length] to a pose [L], unset coordinates from `begin`; False if it is no pose or upside down.

    The rotation is made orthonormal by two steps of R <- R (3 - R^T R) / 2. If the target sets only the direction of
    the z axis, the z axis of `begin` is brought there by the shortest turn; if it sets only the yaw, by a turn about z.
    """
    if not is_pose(target):
        return False
    rotations, yaw = task["rotations"], 0.0
    for i in range(3):
        pose[i, 3] = (target[i, 3] if task["axes"][i] == 1 else begin[i, 3]) / task["length"]
        for j in range(3):
            pose[i, j] = target[i, j] if rotations == 3 or rotations == 1 else begin[i, j]
    if rotations == 3 or rotations == 1:
        orthonormalise(pose)
    if rotations == 2:
        return tilt_to(target, 1.0, pose)
    if rotations == 1:
        yaw = yaw_of(pose)
        is_upright = 1.0 + min(pose[2, 2], begin[2, 2]) > UPSIDE_DOWN
        for i in range(3):
            for j in range(3):
                pose[i, j] = begin[i, j]
        set_yaw(pose, yaw)
        return is_upright
    return True


@routine
def set_yaw(pose: Floats, yaw: float) -> None:
    """Turn a pose about the base's z axis until it has this yaw [rad]."""
    turn_about_z(pose, yaw - yaw_of(pose))


@routine
def tilt_to(target: Floats, share: float, pose: Floats) -> bool:
    """Turn the z axis of a pose a share of the shortest way to a target's; False if they are opposite."""
    axis, target_axis = (pose[0, 2], pose[1, 2], pose[2, 2]), (target[0, 2], target[1, 2], target[2, 2])
    target_axis = scale(1.0 / norm(target_axis), target_axis)
    across = cross(axis, target_axis)
    sine, cosine = norm(across), dot(axis, target_axis)
    if sine > 0.0:
        turn_pose(pose, scale(share * math.atan2(sine, cosine) / sine, across))
    return cosine > LEAST_MARGIN - 1.0


@routine
def is_pose(target: Floats) -> bool:
    """True if the matrix (4, 4) is finite, with a proper rotation and last row 0 0 0 1, each to NOT_A_ROTATION."""
    for i in range(3):
        if not (abs(target[i, 3]) < math.inf and abs(target[3, i]) <= NOT_A_ROTATION):
            return False
        for j in range(3):
            if not abs(target[i, j]) < 2.0:  # so that no square overflows
                return False
    for i in range(3):
        for j in range(i, 3):
            if not abs(gram(target, i, j)) <= NOT_A_ROTATION:
                return False
    x, y, z = column(target, 0), column(target, 1), column(target, 2)
    return abs(target[3, 3] - 1.0) <= NOT_A_ROTATION and dot(cross(x, y), z) > 0.0


@search
def are_poses(targets: Floats, marks: Ints) -> None:
    """Mark each of (n, 4, 4) matrices: 1 if it is a pose, else 0."""
    for row in range(targets.shape[0]):
        marks[row] = 1 if is_pose(targets[row]) else 0


@routine
def column(T: Floats, i: int) -> Vec:
    return T[0, i], T[1, i], T[2, i]


@routine
def gram(T: Floats, i: int, j: int) -> float:
    """An entry of R^T R - 1."""
    return T[0, i] * T[0, j] + T[1, i] * T[1, j] + T[2, i] * T[2, j] - (1.0 if i == j else 0.0)


@routine
def orthonormalise(pose: Floats) -> None:
    """Replace the rotation of a pose by the nearest orthonormal one."""
    for _ in range(2):
        xx, yy, zz = gram(pose, 0, 0), gram(pose, 1, 1), gram(pose, 2, 2)
        xy, yz, zx = gram(pose, 0, 1), gram(pose, 1, 2), gram(pose, 2, 0)
        if abs(xx) + abs(yy) + abs(zz) + abs(xy) + abs(yz) + abs(zx) <= ROUNDED:
            return
        for i in range(3):
            row = vec(pose[i])
            pose[i, 0] -= 0.5 * dot(row, (xx, xy, zx))
            pose[i, 1] -= 0.5 * dot(row, (xy, yy, yz))
            pose[i, 2] -= 0.5 * dot(row, (zx, yz, zz))


@routine
def load_pose(pose: Floats, length: float, to: Floats) -> None:
    """Fill a pose [L] from one in [length]."""
    for i in range(3):
        to[i, 3] = pose[i, 3] / length
        for j in range(3):
            to[i, j] = pose[i, j]


@routine
def put_pose(pose: Floats, length: float, to: Floats) -> None:
    """Fill a pose [length], (4, 4), from one in [L]."""
    for i in range(3):
        to[i, 3] = pose[i, 3] * length
        for j in range(3):
            to[i, j] = pose[i, j]
