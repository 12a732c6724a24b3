"""Poses in: from Euler angles, rotation vectors, quaternions, SciPy objects and arrays to (n, 4, 4)."""

from __future__ import annotations

import reprlib
import warnings
from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from ..common.arguments import array, as_floats
from ..common.arrays import Floats, Mask
from ..common.rotations import UNTURNED, from_quaternion, from_rotvec, from_rpy, nearest_rotations
from ..errors import InvalidArgument
from ..tolerances import TOLERANCES


@runtime_checkable
class SupportsMatrix(Protocol):
    """A rotation or rigid transform of another library, such as SciPy's."""

    def as_matrix(self) -> Floats: ...


def pose(
    xyz: ArrayLike,
    *,
    rpy: ArrayLike | None = None,
    rotvec: ArrayLike | None = None,
    quat_xyzw: ArrayLike | None = None,
    quat_wxyz: ArrayLike | None = None,
    rotation: ArrayLike | SupportsMatrix | None = None,
    degrees: bool = False,
) -> Floats:
    """Poses T_base_platform, shape (..., 4, 4), from positions and at most one kind of rotation.

    Leading axes of positions and rotations are broadcast against each other.

    Parameters
    ----------
    xyz : array (..., 3)
        Position of the reference point in the base frame [length].
    rpy : array (..., 3), optional
        Roll, pitch, yaw about the fixed x, y and z axes, in this order: R = Rz(yaw) Ry(pitch) Rx(roll).
    rotvec : array (..., 3), optional
        Rotation vector.
    quat_xyzw, quat_wxyz : array (..., 4), optional
        Quaternion of any nonzero norm, scalar last or first as the name says.
    rotation : array (..., 3, 3) or Rotation, optional
        Matrices, or an object with ``as_matrix`` such as a SciPy Rotation.
    degrees : bool, optional
        True if `rpy` and `rotvec` are in degrees; else they are in radians.

    Raises
    ------
    InvalidArgument
        A wrong shape, a number that is not finite, more than one rotation, or not a rotation.
    """
    rotations = {"rpy": rpy, "rotvec": rotvec, "quat_xyzw": quat_xyzw, "quat_wxyz": quat_wxyz, "rotation": rotation}
    given = [name for name, value in rotations.items() if value is not None]
    if len(given) > 1:
        raise InvalidArgument("pose", " and ".join(given), "at most one rotation")
    if not isinstance(degrees, bool | np.bool_):
        raise InvalidArgument("degrees", reprlib.repr(degrees), "True or False")
    positions = array("xyz", xyz, "... 3")
    turned = np.eye(3)
    for name in given:
        value = rotations[name]
        value = value.as_matrix() if isinstance(value, SupportsMatrix) else value
        numbers = array(name, value, {"rotation": "... 3 3", "rpy": "... 3", "rotvec": "... 3"}.get(name, "... 4"))
        in_degrees = degrees and name in ("rpy", "rotvec")
        most = np.abs(numbers).max(initial=0.0) if name in ("rpy", "rotvec") and not degrees else 0.0
        if most > 2.0 * np.pi:
            turns = f"an angle of {most:.4g} rad is {most / (2.0 * np.pi):.3g} turns"
            warnings.warn(f"{name}: {turns}; were degrees meant? pose(..., degrees=True)", stacklevel=2)
        turned = _ROTATIONS[name](name, np.radians(numbers) if in_degrees else numbers)
    try:
        shape = np.broadcast_shapes(positions.shape[:-1], turned.shape[:-2])
    except ValueError:
        found = f"shape {positions.shape} beside rotations of batch shape {turned.shape[:-2]}"
        raise InvalidArgument("xyz", found, "batch shapes that agree") from None
    T_base_platform = np.zeros((*shape, 4, 4))
    T_base_platform[..., :3, :3], T_base_platform[..., :3, 3], T_base_platform[..., 3, 3] = turned, positions, 1.0
    return T_base_platform


def _from_quaternion(name: str, value: Floats) -> Floats:
    largest = np.abs(value).max(axis=-1, keepdims=True)
    if not largest.all():
        raise InvalidArgument(name, "a zero quaternion", "a quaternion of nonzero norm")
    quaternions = value / largest  # so that no square is too large, or too small, to be represented
    return from_quaternion(quaternions if name == "quat_xyzw" else np.roll(quaternions, -1, axis=-1))


def _from_matrix(name: str, value: Floats) -> Floats:
    if not all(map(is_rotation, value.reshape(-1, 3, 3))):
        raise InvalidArgument(name, "a matrix that is not a rotation", "R^T R = I and det R = 1")
    return value


_ROTATIONS: dict[str, Callable[[str, Floats], Floats]] = {
    "rpy": lambda _, angles: from_rpy(angles),
    "rotvec": lambda _, vectors: from_rotvec(vectors),
    "quat_xyzw": _from_quaternion,
    "quat_wxyz": _from_quaternion,
    "rotation": _from_matrix,
}


def is_rotation(matrix: Floats) -> bool:
    """True if a (3, 3) matrix is a rotation to the tolerance targets are held to."""
    turned = np.eye(4)
    turned[:3, :3] = matrix
    return bool(are_poses(turned[None])[0])


_EXPECTED = "poses of shape (..., 4, 4) or positions of shape (..., 3)"


def as_poses(target: Any) -> tuple[Floats, tuple[int, ...]]:
    """Poses (n, 4, 4), C-contiguous, and the batch shape they came in.

    Accepts poses (..., 4, 4), positions (..., 3) (at home orientation) and objects with ``as_matrix`` that give poses,
    such as a SciPy RigidTransform. Whether the numbers make poses is for the kernel to see.
    """
    if hasattr(target, "as_matrix"):
        target = target.as_matrix()
        if np.shape(target)[-2:] != (4, 4):
            raise InvalidArgument("target", f"a rotation of shape {np.shape(target)}", _EXPECTED)
    given = as_floats("target", target, _EXPECTED)
    if given.shape[-2:] == (4, 4):
        return given.reshape(-1, 4, 4), given.shape[:-2]
    if given.ndim and given.shape[-1] == 3:
        positions = given.reshape(-1, 3)
        poses = np.zeros((len(positions), 4, 4))
        poses[:, :3, :3], poses[:, :3, 3], poses[:, 3, 3] = UNTURNED, positions, 1.0
        return poses, given.shape[:-1]
    raise InvalidArgument("target", f"shape {given.shape}", _EXPECTED)


def one_pose(name: str, value: Any) -> Floats:
    """An argument that is one pose (4, 4), or a position (3,) without a turn, made exact; else InvalidArgument."""
    try:
        poses, batch = as_poses(value)
    except InvalidArgument as error:
        raise InvalidArgument(name, error.found, "a pose of shape (4, 4), or a position of shape (3,)") from None
    if batch:
        raise InvalidArgument(name, f"shape {np.shape(value)}", "one pose of shape (4, 4), or a position of shape (3,)")
    if not are_poses(poses)[0]:
        raise InvalidArgument(name, what_is_wrong(poses[0]), "a pose of shape (4, 4), or a position of shape (3,)")
    return np.asarray(made_exact(poses)[0])


def are_poses(targets: Floats) -> Mask:
    """Which of (n, 4, 4) arrays are poses, (n,)."""
    from ..kernels.legs.complete_poses import are_poses as mark_poses

    marks = np.empty(len(targets), np.int64)
    mark_poses(np.ascontiguousarray(targets), marks)
    return np.asarray(marks == 1)


def made_exact(poses: Floats) -> Floats:
    """Poses (n, 4, 4) with the rotations nearest to theirs: targets are typed with a few digits.

    Two steps of Newton's method for the polar decomposition, R <- R (3 - R^T R) / 2: of an error of 1e-6, which is the
    most that poses have, the first leaves 1e-12.
    """
    exact = poses.copy()
    R, exact[:, 3] = exact[:, :3, :3], (0.0, 0.0, 0.0, 1.0)
    for _ in range(2):
        R[:] = R @ (1.5 * UNTURNED - 0.5 * (np.swapaxes(R, 1, 2) @ R))
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
    blend = nearest_rotations(way[:, :3, :3])
    proper = np.linalg.det(blend) > 0.0
    way[:, :3, :3] = np.where(proper[:, None, None], blend, begin[:, :3, :3])
    return np.asarray(way)
