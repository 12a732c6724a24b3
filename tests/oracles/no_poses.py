"""Matrices that are poses and matrices that are none, told apart in exact arithmetic."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import product

import numpy as np

from .turns import Array

TOLERANCE = Fraction(1e-6)
"""Largest deviation of R^T R from I, and of the last row from 0 0 0 1."""


def is_pose(matrix: Array) -> bool:
    """True if all 16 numbers are finite, the rotation is one, and the last row is 0 0 0 1, each to `TOLERANCE`."""
    if not all(map(math.isfinite, matrix.ravel().tolist())):
        return False
    T = [[Fraction(number) for number in row] for row in matrix.tolist()]
    x, y, z = ([T[i][j] for i in range(3)] for j in range(3))
    squares = [sum(a * b for a, b in zip(u, v, strict=True)) - (u is v) for u, v in product((x, y, z), repeat=2)]
    last = [number - (j == 3) for j, number in enumerate(T[3])]
    across = (y[1] * z[2] - y[2] * z[1], y[2] * z[0] - y[0] * z[2], y[0] * z[1] - y[1] * z[0])
    is_proper = sum(a * b for a, b in zip(x, across, strict=True)) > 0
    return is_proper and max(map(abs, squares + last)) <= TOLERANCE


def no_poses(pose: Array) -> Array:
    """A pose spoiled in every way, (n, 4, 4): each number not finite, no rotation, another last row."""
    spoiled = []
    for place, value in product(np.ndindex(4, 4), (np.nan, np.inf, -np.inf)):
        matrix = pose.copy()
        matrix[place] = value
        spoiled.append(matrix)
    for row, value in product(range(4), (1e-3, 2.0, 1e200, -1e308)):
        matrix = pose.copy()
        matrix[3, row] += value
        spoiled.append(matrix)
    opposite = pose.copy()
    opposite[:3, 3] = (np.inf, -np.inf, 0.0)
    spoiled.append(opposite)
    R = pose[:3, :3]
    for rotation in (0.0 * R, 1.001 * R, -R, R @ np.diag((1, -1, 1)), R + 1e-3 * np.eye(3)[::-1], 1e200 * R, R + 1e200):
        matrix = pose.copy()
        matrix[:3, :3] = rotation
        spoiled.append(matrix)
    return np.array(spoiled)


def rough_pose(pose: Array) -> Array:
    """A pose whose rotation is off by nearly as much as it may, in all three of its axes, (4, 4)."""
    matrix = pose.copy()
    matrix[:3, :3] *= 1.0 + 0.45e-6
    return matrix


def far_poses(pose: Array) -> Array:
    """Poses whose position is as far away as numbers go, (n, 4, 4): the sum of its coordinates may be none."""
    most = np.finfo(float).max
    signs = [(1, 0, 0), (0, 0, -1), (1, 1, 1), (1, -1, 1)]
    poses = np.repeat(pose[None], 3 * len(signs), axis=0)
    poses[:, :3, 3] = np.kron(np.array([[1e20], [1e200], [most]]), signs)
    return poses
