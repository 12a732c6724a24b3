"""Poses in: from Euler angles, rotation vectors, quaternions, SciPy objects and arrays to (n, 4, 4)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InvalidArgument
from .tolerances import TOLERANCES

Floats = NDArray[np.float64]


def pose(
    xyz: ArrayLike,
    *,
    rpy: ArrayLike | None = None,
    rotvec: ArrayLike | None = None,
    quat_xyzw: ArrayLike | None = None,
    quat_wxyz: ArrayLike | None = None,
    rotation: Any = None,
) -> Floats:
    """A pose T_base_platform, shape (4, 4), from a position and at most one rotation.

    Parameters
    ----------
    xyz : position of the reference point in the base frame, shape (3,) [length].
    rpy : roll, pitch, yaw [rad] about the fixed x, y and z axes, in this order: R = Rz(yaw) Ry(pitch) Rx(roll).
    rotvec : rotation vector, shape (3,) [rad].
    quat_xyzw, quat_wxyz : quaternion of any nonzero norm, scalar last or first as the name says.
    rotation : a (3, 3) matrix, or an object with ``as_matrix`` such as a SciPy Rotation.

    Raises
    ------
    InvalidArgument : a wrong shape, a number that is not finite, more than one rotation, or not a rotation.
    """
    given = {
        name: value
        for name, value in (
            ("rpy", rpy),
            ("rotvec", rotvec),
            ("quat_xyzw", quat_xyzw),
            ("quat_wxyz", quat_wxyz),
            ("rotation", rotation),
        )
        if value is not None
    }
    if len(given) > 1:
        raise InvalidArgument("pose", " and ".join(given), "at most one rotation")
    T_base_platform = np.eye(4)
    T_base_platform[:3, 3] = _numbers("xyz", xyz, (3,))
    for name, value in given.items():
        T_base_platform[:3, :3] = _ROTATIONS[name](name, value)
    return T_base_platform


def _numbers(name: str, value: Any, shape: tuple[int, ...]) -> Floats:
    array = as_floats(name, value, f"finite numbers of shape {shape}")
    if array.shape != shape:
        raise InvalidArgument(name, f"shape {array.shape}", f"shape {shape}")
    if not np.isfinite(array).all():
        raise InvalidArgument(name, "a number that is not finite", "finite numbers")
    return array


def as_floats(name: str, value: Any, expected: str) -> Floats:
    """`value` as an array of float64; InvalidArgument for text, ragged nests, complex numbers, booleans."""
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise InvalidArgument(name, "a ragged nest of sequences", expected) from error
    if array.dtype.kind not in "iuf":
        raise InvalidArgument(name, f"{type(value).__name__} of dtype {array.dtype}", expected)
    return np.require(array, np.float64, ["C", "W"])  # the one memory layout that kernels are compiled for


def _from_rpy(name: str, value: Any) -> Floats:
    roll, pitch, yaw = _numbers(name, value, (3,))
    x, y, z = np.eye(3)
    return _from_rotvec(name, yaw * z) @ _from_rotvec(name, pitch * y) @ _from_rotvec(name, roll * x)


def _from_rotvec(name: str, value: Any) -> Floats:
    x, y, z = _numbers(name, value, (3,))
    angle = float(np.linalg.norm((x, y, z)))
    # the half angle's sine over the angle: exact down to zero, so that there is no small-angle branch
    half = 0.5 * float(np.sinc(0.5 * angle / np.pi))
    return _from_xyzw(np.array([x * half, y * half, z * half, np.cos(0.5 * angle)]))


def _from_xyzw(quaternion: Floats) -> Floats:
    x, y, z, w = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _from_quaternion(name: str, value: Any) -> Floats:
    quaternion = _numbers(name, value, (4,))
    if not np.any(quaternion):
        raise InvalidArgument(name, "a zero quaternion", "a quaternion of nonzero norm")
    quaternion = quaternion / np.abs(quaternion).max()
    return _from_xyzw(quaternion if name == "quat_xyzw" else np.roll(quaternion, -1))


def _from_matrix(name: str, value: Any) -> Floats:
    matrix = _numbers(name, value.as_matrix() if hasattr(value, "as_matrix") else value, (3, 3))
    if not is_rotation(matrix):
        raise InvalidArgument(name, "a matrix that is not a rotation", "R^T R = I and det R = 1")
    return matrix


_ROTATIONS = {
    "rpy": _from_rpy,
    "rotvec": _from_rotvec,
    "quat_xyzw": _from_quaternion,
    "quat_wxyz": _from_quaternion,
    "rotation": _from_matrix,
}


def is_rotation(matrix: Floats) -> bool:
    """Whether a (3, 3) matrix is a rotation to the tolerance targets are held to."""
    error = np.abs(matrix.T @ matrix - np.eye(3)).max()
    return bool(error <= TOLERANCES.rotation_matrix and np.linalg.det(matrix) > 0.0)


_EXPECTED = "poses of shape (..., 4, 4) or positions of shape (..., 3)"


def as_targets(target: Any) -> tuple[Floats, tuple[int, ...]]:
    """Targets as poses (n, 4, 4), C-contiguous, and the batch shape they came in.

    Accepts poses (..., 4, 4), positions (..., 3) (at home orientation) and objects with ``as_matrix`` that give poses,
    such as a SciPy RigidTransform. Whether the numbers make poses is for the kernel to see.
    """
    if hasattr(target, "as_matrix"):
        target = target.as_matrix()
        if np.shape(target)[-2:] != (4, 4):
            raise InvalidArgument("target", f"a rotation of shape {np.shape(target)}", _EXPECTED)
    array = as_floats("target", target, _EXPECTED)
    if array.shape[-2:] == (4, 4):
        return array.reshape(-1, 4, 4), array.shape[:-2]
    if array.ndim and array.shape[-1] == 3:
        positions = array.reshape(-1, 3)
        poses = np.zeros((len(positions), 4, 4))
        poses[:] = np.eye(4)
        poses[:, :3, 3] = positions
        return poses, array.shape[:-1]
    raise InvalidArgument("target", f"shape {array.shape}", _EXPECTED)


def are_poses(targets: Floats) -> NDArray[np.bool_]:
    """Which of (n, 4, 4) arrays are poses, (n,)."""
    finite = np.asarray(np.isfinite(targets).all(axis=(1, 2)))
    R = np.where(finite[:, None, None], targets, np.eye(4))[:, :3, :3]
    error = np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max(axis=(1, 2), initial=0.0)
    last = np.abs(targets[:, 3] - (0.0, 0.0, 0.0, 1.0)).max(axis=1, initial=0.0)
    near = TOLERANCES.rotation_matrix
    return np.asarray(finite & (error <= near) & (last <= near) & (np.linalg.det(R) > 0.0))


def made_exact(poses: Floats) -> Floats:
    """Poses (n, 4, 4) with the rotations nearest to theirs: targets are typed with a few digits."""
    U, _, Vt = np.linalg.svd(poses[:, :3, :3])
    exact = np.zeros_like(poses)
    exact[:, :3, :3], exact[:, :3, 3], exact[:, 3, 3] = U @ Vt, poses[:, :3, 3], 1.0
    return exact


def what_is_wrong(target: Floats) -> str:
    """Why a (4, 4) array is not a pose, in words."""
    if not np.isfinite(target).all():
        return "a number that is not finite"
    if not np.allclose(target[3], (0, 0, 0, 1), atol=TOLERANCES.rotation_matrix, rtol=0):
        return f"a last row {target[3].tolist()}"
    return "a matrix that is not a rotation"


def between(begin: Floats, end: Floats, share: Any) -> Floats:
    """Poses a share of the way from one to another: straight positions, the shortest turn."""
    way = begin + (end - begin) * share
    U, _, Vt = np.linalg.svd(way[:, :3, :3])  # the rotation nearest to the blend of the two
    proper = np.linalg.det(U @ Vt) > 0.0
    way[:, :3, :3] = np.where(proper[:, None, None], U @ Vt, begin[:, :3, :3])
    return np.asarray(way)
