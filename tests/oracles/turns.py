"""Rotations in stacks, one a row."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


def unit(vector: object) -> Array:
    """A vector at length one."""
    array = np.array(vector, dtype=float)
    return array / np.linalg.norm(array)


def turns_about(axis: Array, angles: Array) -> Array:
    """Rotations (n, 3, 3) about one unit axis (3,) by angles (n,) [rad]."""
    return np.asarray(Rotation.from_rotvec(angles[:, None] * axis).as_matrix())


def angle_about(axis: Array, start: Array, end: Array) -> Array:
    """Angles (n,) [rad] about an axis (3,) by which directions (n, 3) or (3,) come as near to others as they can."""
    cosines = (start * end).sum(axis=-1) - (start @ axis) * (end @ axis)
    return np.asarray(np.arctan2(np.cross(start, end) @ axis, cosines))


def angle_of(turns: Array, axis: Array) -> Array:
    """Angles (n,) [rad] of rotations (n, 3, 3) about an axis (3,) of theirs."""
    skew = turns - np.swapaxes(turns, 1, 2)
    sines = 0.5 * np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1) @ axis
    return np.asarray(np.arctan2(sines, 0.5 * (np.trace(turns, axis1=1, axis2=2) - 1.0)))


def either_angle(x: Array, y: Array, part: Array, square: Array, side: Array | float) -> Array:
    """A solution (n,) [rad] of x cos q + y sin q = part: the one to the left (+1) or right (-1) of (x, y).

    Where there is none, the nearest angle. `square` is x^2 + y^2 - part^2, which who asks knows more exactly.
    """
    return np.arctan2(y, x) + side * np.arctan2(np.sqrt(np.maximum(square, 0.0)), part)
