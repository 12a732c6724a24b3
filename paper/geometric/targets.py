"""Targets in, block by block: poses side by side, one array an entry, so that a line of arithmetic serves many."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..tolerances import ROTATION_MATRIX
from .compiled import routine

Statuses: TypeAlias = NDArray[np.int64]

# What became of a row.
MISSED, REACHED, INVALID = 0, 1, 2
# Targets side by side: few enough for the nearest cache, many enough to pay for the loops.
BLOCK = 64
# Rows of the table: twelve entries of the poses, how far their last rows are off, whether anything is exceeded (0 if
# not), and behind these what the closed form needs.
LAST_ROW, OVER, FREE = 12, 13, 14
# Largest deviation of R^T R from I in a target, and below which it is left as it is: it moves no point by more than a
# thousandth of what limits allow.
NOT_A_ROTATION, ROUNDED = ROTATION_MATRIX, 1e-12


@routine
def load_block(targets: Floats, row: int, n: int, far: float, table: Floats, status: Statuses) -> int:
    """Lay `n` targets out in the table, rotations made orthonormal; how many are no poses.

    These, and targets farther away than `far` (where rounding alone is more than the tolerance), are over, and zero.
    """
    for i in range(n):
        T = targets[row + i]
        for k in range(3):
            for j in range(4):
                table[4 * k + j, i] = T[k, j]
        table[LAST_ROW, i] = abs(T[3, 0]) + abs(T[3, 1]) + abs(T[3, 2]) + abs(T[3, 3] - 1.0)
    judge_block(n, far, table)
    invalid = 0
    for i in range(n):
        status[row + i] = MISSED
        if table[OVER, i] != 0.0:
            if not is_pose(targets[row + i]):
                status[row + i] = INVALID
                invalid += 1
            elif is_near(i, far, table):
                rectify(i, table)
                table[OVER, i] = 0.0
            if table[OVER, i] != 0.0:
                for entry in range(LAST_ROW):
                    table[entry, i] = 0.0
    return invalid


@routine
def judge_block(n: int, far: float, table: Floats) -> None:
    """Whether each column of the table is a pose to rounding, and near."""
    for i in range(n):
        xx, xy, xz = table[0, i], table[1, i], table[2, i]
        yx, yy, yz = table[4, i], table[5, i], table[6, i]
        zx, zy, zz = table[8, i], table[9, i], table[10, i]
        deviation = (
            abs(xx * xx + yx * yx + zx * zx - 1.0)
            + abs(xy * xy + yy * yy + zy * zy - 1.0)
            + abs(xz * xz + yz * yz + zz * zz - 1.0)
            + abs(xx * xy + yx * yy + zx * zy)
            + abs(xx * xz + yx * yz + zx * zz)
            + abs(xy * xz + yy * yz + zy * zz)
        )
        determinant = xx * (yy * zz - yz * zy) - xy * (yx * zz - yz * zx) + xz * (yx * zy - yy * zx)
        plain = (deviation <= ROUNDED) & (determinant > 0.0) & (table[LAST_ROW, i] <= ROUNDED)
        table[OVER, i] = 0.0 if plain & is_near(i, far, table) else 1.0


@routine
def is_near(i: int, far: float, table: Floats) -> bool:
    """Whether column `i` is no farther away than `far`, along any axis."""
    return bool((abs(table[3, i]) <= far) & (abs(table[7, i]) <= far) & (abs(table[11, i]) <= far))


@routine
def is_pose(T: Floats) -> bool:
    """Whether a (4, 4) array is a finite pose, as exactly as targets must be."""
    worst = 0.0
    for i in range(3):
        for j in range(4):
            if not math.isfinite(T[i, j]):
                return False
        for j in range(i, 3):
            product = T[0, i] * T[0, j] + T[1, i] * T[1, j] + T[2, i] * T[2, j]
            worst = max(worst, abs(product - (1.0 if i == j else 0.0)))
    determinant = (
        T[0, 0] * (T[1, 1] * T[2, 2] - T[1, 2] * T[2, 1])
        - T[0, 1] * (T[1, 0] * T[2, 2] - T[1, 2] * T[2, 0])
        + T[0, 2] * (T[1, 0] * T[2, 1] - T[1, 1] * T[2, 0])
    )
    last_row = abs(T[3, 0]) + abs(T[3, 1]) + abs(T[3, 2]) + abs(T[3, 3] - 1.0)
    return bool(worst <= NOT_A_ROTATION and determinant > 0.0 and last_row <= NOT_A_ROTATION)


@routine
def rectify(i: int, table: Floats) -> None:
    """Make the rotation of column `i` the nearest that is orthonormal: two steps of R <- R (3 - R^T R) / 2."""
    for _ in range(2):
        xx, yx, zx = table[0, i], table[4, i], table[8, i]
        xy, yy, zy = table[1, i], table[5, i], table[9, i]
        xz, yz, zz = table[2, i], table[6, i], table[10, i]
        a, b, c = xx * xx + yx * yx + zx * zx, xy * xy + yy * yy + zy * zy, xz * xz + yz * yz + zz * zz
        d, e, f = xx * xy + yx * yy + zx * zy, xy * xz + yy * yz + zy * zz, xz * xx + yz * yx + zz * zx
        for place, x, y, z in ((0, xx, xy, xz), (4, yx, yy, yz), (8, zx, zy, zz)):
            table[place, i] = 0.5 * (x * (3.0 - a) - y * d - z * f)
            table[place + 1, i] = 0.5 * (y * (3.0 - b) - x * d - z * e)
            table[place + 2, i] = 0.5 * (z * (3.0 - c) - x * f - y * e)
