"""Rotations in stacks: matrices (..., 3, 3) from angles, vectors and quaternions, and back."""

from __future__ import annotations

import numpy as np

from .arrays import Floats


def from_rotvec(vectors: Floats) -> Floats:
    """Matrices (..., 3, 3) of rotation vectors (..., 3) [rad], by Rodrigues' formula.

    R = I + sinc(a) K + sinc(a / 2)^2 / 2 K^2 with K the cross product by the vector and a its length: exact down to
    zero, so that there is no branch for small angles.
    """
    if np.abs(vectors).max(initial=0.0) > MANY_TURNS:
        vectors = _within_a_turn(vectors)
    angles = np.sqrt((vectors * vectors).sum(axis=-1))[..., None, None]
    angles[angles == 0.0] = 1e-20  # whose sine is itself
    half = 0.5 * angles
    K = (vectors @ CROSSED).reshape(*vectors.shape, 3)
    return np.asarray(UNTURNED + np.sin(angles) / angles * K + 0.5 * (np.sin(half) / half) ** 2 * (K @ K))


def _within_a_turn(vectors: Floats) -> Floats:
    """Rotation vectors of any length, less than a turn long: of the largest no square can be represented."""
    largest = np.maximum(np.abs(vectors).max(axis=-1, keepdims=True), 1.0)
    axes = vectors / largest
    sizes = np.linalg.norm(axes, axis=-1, keepdims=True)
    turns = np.remainder(np.minimum(sizes, np.finfo(float).max / largest) * largest, 2.0 * np.pi)
    return np.asarray(axes / np.maximum(sizes, np.finfo(float).tiny) * turns)


def whole_turns(angles: Floats, to: Floats | float = 0.0) -> Floats:
    """The whole turns that bring angles nearest to others [rad]."""
    return np.asarray(2.0 * np.pi * np.round((to - angles) / (2.0 * np.pi)))


def nearest_turn(angles: Floats, to: Floats | float = 0.0, lo: float = -np.inf, hi: float = np.inf) -> Floats:
    """Angles moved by whole turns to where they are nearest to others; as they were where that is out of a range."""
    turned = angles + whole_turns(angles, to)
    return np.where((turned >= lo) & (turned <= hi), turned, angles)


MANY_TURNS = 1e6
"""Length beyond which whole turns are left out of a rotation vector [rad]."""

UNTURNED = np.eye(3)
CROSSED = np.array([[0, 0, 0, 0, 0, -1, 0, 1, 0], [0, 0, 1, 0, 0, 0, -1, 0, 0], [0, -1, 0, 1, 0, 0, 0, 0, 0.0]])
"""By what each component of a vector enters the matrix of its cross product, row by row, (3, 9)."""


def from_rpy(angles: Floats) -> Floats:
    """Matrices (..., 3, 3) of roll, pitch, yaw (..., 3) [rad] about fixed x, y, z: R = Rz(yaw) Ry(pitch) Rx(roll)."""
    cosines, sines = np.cos(angles), np.sin(angles)
    c_roll, c_pitch, c_yaw = cosines[..., 0], cosines[..., 1], cosines[..., 2]
    s_roll, s_pitch, s_yaw = sines[..., 0], sines[..., 1], sines[..., 2]
    rotations = np.empty((*angles.shape, 3))
    rotations[..., 0, 0] = c_yaw * c_pitch
    rotations[..., 0, 1] = c_yaw * s_pitch * s_roll - s_yaw * c_roll
    rotations[..., 0, 2] = c_yaw * s_pitch * c_roll + s_yaw * s_roll
    rotations[..., 1, 0] = s_yaw * c_pitch
    rotations[..., 1, 1] = s_yaw * s_pitch * s_roll + c_yaw * c_roll
    rotations[..., 1, 2] = s_yaw * s_pitch * c_roll - c_yaw * s_roll
    rotations[..., 2, 0] = 0.0 - s_pitch  # never -0
    rotations[..., 2, 1] = c_pitch * s_roll
    rotations[..., 2, 2] = c_pitch * c_roll
    return rotations


def to_rpy(rotations: Floats) -> Floats:
    """Roll, pitch, yaw (..., 3) [rad] of matrices (..., 3, 3), the inverse of `from_rpy`.

    Pitch lies within a quarter turn. At a quarter turn only yaw - roll (or yaw + roll) is determined; roll is 0 there.
    """
    cos_pitch = np.hypot(rotations[..., 0, 0], rotations[..., 1, 0])
    pitch = np.arctan2(-rotations[..., 2, 0], cos_pitch)
    locked = cos_pitch < GIMBAL_LOCK
    roll = np.where(locked, 0.0, np.arctan2(rotations[..., 2, 1], rotations[..., 2, 2]))
    y, x = (
        np.where(locked, a, b)
        for a, b in ((-rotations[..., 0, 1], rotations[..., 1, 0]), (rotations[..., 1, 1], rotations[..., 0, 0]))
    )
    return np.stack([roll, pitch, np.arctan2(y, x)], axis=-1)


GIMBAL_LOCK = 1e-9
"""Cosine of pitch below which roll and yaw cannot be told apart: what is left of it is rounding."""


def from_quaternion(quaternions: Floats) -> Floats:
    """Matrices (..., 3, 3) of quaternions (..., 4) of any nonzero norm, scalar last."""
    x, y, z, w = np.moveaxis(quaternions / np.linalg.norm(quaternions, axis=-1, keepdims=True), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1)).copy()


def to_quaternion(vectors: Floats) -> Floats:
    """Unit quaternions (..., 4), scalar last, of rotation vectors (..., 3) [rad]."""
    half = 0.5 * np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.concatenate([0.5 * np.sinc(half / np.pi) * vectors, np.cos(half)], axis=-1)


def rotvec_from_quaternion(quaternions: Floats) -> Floats:
    """Rotation vectors (..., 3) [rad], at most pi long, of unit quaternions (..., 4), scalar last."""
    vector, scalar = quaternions[..., :3], quaternions[..., 3]
    half = np.arctan2(np.linalg.norm(vector, axis=-1), np.abs(scalar))
    return np.asarray(vector * np.copysign(2.0 / np.sinc(half / np.pi), scalar)[..., None])


def composed(after: Floats, before: Floats) -> Floats:
    """Rotation vectors (..., 3) [rad], at most pi long, of two rotations one after the other."""
    a, b = to_quaternion(after), to_quaternion(before)
    v, w, v0, w0 = a[..., :3], a[..., 3:], b[..., :3], b[..., 3:]
    scalar = w * w0 - (v * v0).sum(axis=-1, keepdims=True)
    return rotvec_from_quaternion(np.concatenate([w * v0 + w0 * v + np.cross(v, v0), scalar], axis=-1))


def angles_and_sines(rotations: Floats) -> tuple[Floats, Floats]:
    """Angles (...,) [rad], accurate down to zero, and axes times their sines (..., 3), of matrices (..., 3, 3)."""
    skew = rotations - np.swapaxes(rotations, -1, -2)
    sines = 0.5 * np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)
    cosine = 0.5 * (np.trace(rotations, axis1=-2, axis2=-1) - 1.0)
    return np.asarray(np.arctan2(np.linalg.norm(sines, axis=-1), cosine)), sines


def angles_between(one: Floats, other: Floats) -> Floats:
    """Angles (...,) [rad] from rotations to others, matrices (..., 3, 3): by their chord, exact also where tiny."""
    half_sine = np.sqrt(((one - other) ** 2).sum(axis=(-2, -1)) / 8.0)
    return np.asarray(2.0 * np.arcsin(np.minimum(half_sine, 1.0)))


def to_rotvec(rotations: Floats) -> Floats:
    """Rotation vectors (..., 3) [rad] of matrices (..., 3, 3), of at most half a turn."""
    angles, sines = angles_and_sines(rotations)
    short = sines / np.sinc(angles / np.pi)[..., None]
    # near half a turn the sine vanishes: the axis is the longest column of (R + R^T) / 2 - cos I = (1 - cos) a a^T
    cosines = np.cos(angles)[..., None, None]
    square = 0.5 * (rotations + np.swapaxes(rotations, -1, -2)) - cosines * np.eye(3)
    longest = np.linalg.norm(square, axis=-2).argmax(axis=-1)
    axes = np.take_along_axis(square, longest[..., None, None], axis=-1)[..., 0]
    size = np.linalg.norm(axes, axis=-1, keepdims=True)
    axes = (
        axes / np.where(size > 0.0, size, 1.0) * np.where((axes * sines).sum(axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    )
    return np.where((angles > LONG)[..., None], angles[..., None] * axes, short)


LONG = 2.0
"""Angle beyond which the axis of a rotation is read from its even part [rad]."""


def nearest_rotations(matrices: Floats) -> Floats:
    """The orthogonal matrices (..., 3, 3) nearest to given ones: polar decomposition, by singular values."""
    U, _, Vt = np.linalg.svd(matrices)
    return np.asarray(U @ Vt)


def shortest_turns(a: Floats, b: Floats) -> Floats:
    """Rotations (n, 3, 3) that take unit vectors a to b, (n, 3), the shortest way; half a turn for opposite ones."""
    middle = a + b
    opposite = np.linalg.norm(middle, axis=1) < OPPOSITE
    across = np.cross(a, np.eye(3)[np.abs(a).argmin(axis=1)])
    middle = np.where(opposite[:, None], across, middle)
    middle = middle / np.linalg.norm(middle, axis=1)[:, None]
    half_turn = 2.0 * middle[:, :, None] * middle[:, None, :] - np.eye(3)
    # a half turn about the middle takes a to b; one about a before it makes the two the shortest turn
    about_a = 2.0 * a[:, :, None] * a[:, None, :] - np.eye(3)
    return np.asarray(np.where(opposite[:, None, None], half_turn, half_turn @ about_a))


OPPOSITE = 1e-9
"""Length of the sum of two unit vectors below which they are opposite, and any axis across will do."""


def square_to(axis: Floats) -> Floats:
    """Two directions square to an axis (3,) of any length but zero, and to each other, unit vectors (2, 3)."""
    return np.asarray(np.linalg.svd(axis[None])[2][1:])


def yaws(rotations: Floats) -> Floats:
    """The twists about z (...,) [rad], within half a turn, of matrices (..., 3, 3).

    R = S Rz(yaw), where S turns the z axis the shortest way to where it points. A rotation that turns z upside down has
    none; near it, the yaw is told from other entries of the matrix, as nothing cancels in them.
    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = np.moveaxis(rotations, (-2, -1), (0, 1))
    turns_most_about_x = xx >= yy
    z, w = np.where(turns_most_about_x, (zx + xz, zy - yz), (zy + yz, xz - zx))  # half-angle sine and cosine, scaled
    below = zz < 0.0
    return np.asarray(np.arctan2(np.where(below, 2.0 * z * w, yx - xy), np.where(below, w * w - z * z, xx + yy)))


def random_quaternions(n: int, rng: np.random.Generator) -> Floats:
    """Unit quaternions (n, 4), scalar last, uniform over all rotations."""
    q = np.roll(rng.normal(size=(n, 4)), -1, axis=1)
    return np.asarray(q / np.linalg.norm(q, axis=1, keepdims=True))


def turning(vectors: Floats) -> Floats:
    """Angular velocity by the rate of a rotation vector v of length a, (n, 3, 3): I + (1 - cos a)/a^2 V + c V^2.

    c = (a - sin a) / a^3; V is the cross product by v.
    """
    a = np.linalg.norm(vectors, axis=1)[:, None, None]
    V = (vectors @ CROSSED).reshape(-1, 3, 3)
    large = np.maximum(a, SMALL_ANGLE)
    c = np.where(a > SMALL_ANGLE, (large - np.sin(large)) / large**3, 1.0 / 6.0 - a * a / 120.0)
    return np.asarray(np.eye(3) + 0.5 * np.sinc(a / (2.0 * np.pi)) ** 2 * V + c * (V @ V))


SMALL_ANGLE = 1e-2
"""Angle [rad] below which the series of c is used, from which digits cancel otherwise."""
