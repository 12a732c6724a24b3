"""Jacobians of platforms on legs in closed form, from the slopes of the leg evaluation.

Let C be the derivative of the legs' constraints on the pose, and J that of the actuators, by the platform's twist. With
B an orthonormal basis of the null space of C, the platform moves by B y and the actuators by J B y. So the inverse
Jacobian is J B B', and the forward Jacobian B (J B)+.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...arrays import Floats
from .._jit import opener, routine, search
from ..closure.first_order import REGULAR, orthonormalise_rows, triangularise

# Largest slope of a constraint that follows from others [L or rad].
IMPLIED = 1e-9


class JacobianTables(NamedTuple):
    """Scratch memory of one thread; r rows of a twist."""

    table: Floats  # (rows + r + n_a, r): constraints, the twist, and actuators, by the twist
    pairs: Floats  # (freedoms, r + n_a): twists with their actuator rates


def new_jacobian_tables(rows: int, rank: int, twists: int, actuators: int) -> JacobianTables:
    """Scratch memory of one thread for a number of constraints and their rank."""
    width = twists + actuators
    return JacobianTables(np.zeros((rows + width, twists)), np.zeros((twists - rank, width)))


open_tables = opener(new_jacobian_tables(0, 0, 6, 6))


@search
def jacobians(scratch_address: int, slopes: Floats, is_forward: int, maps: Floats) -> int:
    """Fill Jacobians of rows whose constraints have their generic rank, away from all singularities.

    Parameters
    ----------
    scratch : see `new_jacobian_tables`.
    slopes : of constraints, then of actuators, by the twist of the platform, (n, rows + n_a, 6) [L, rad].
    is_forward : 1 for twists by actuator rates, (n, r, n_a), 0 for actuator rates by twists, (n, n_a, r).
    maps : Jacobians to fill [L, rad]; the first entry of an unsolved row is NaN.

    Returns
    -------
    The number of unsolved rows.
    """
    scratch = open_tables(scratch_address)
    table, pairs = scratch.table, scratch.pairs
    width, twists, n_unsolved = pairs.shape[1], table.shape[1], 0
    rows = table.shape[0] - width
    for row in range(slopes.shape[0]):
        total = 0.0
        for j in range(twists):
            for i in range(rows):
                table[i, j] = slopes[row, i, j]
                total += table[i, j]
            for i in range(twists):
                table[rows + i, j] = 1.0 if i == j else 0.0
            for i in range(rows, slopes.shape[1]):
                table[twists + i, j] = slopes[row, i, j]
        to, first = (0, twists) if is_forward == 1 else (twists, 0)
        is_solved = abs(total) < math.inf and fill_pairs(rows, table, pairs)
        if not is_solved or (is_forward == 1 and not orthonormalise_rows(pairs, first, width)):
            maps[row, 0, 0] = math.nan
            n_unsolved += 1
            continue
        for i in range(maps.shape[1]):
            for j in range(maps.shape[2]):
                maps[row, i, j] = 0.0
                for k in range(pairs.shape[0]):
                    maps[row, i, j] += pairs[k, to + i] * pairs[k, first + j]
    return n_unsolved


@routine
def fill_pairs(rows: int, table: Floats, pairs: Floats) -> bool:
    """Fill an orthonormal basis of the twists that constraints allow, with their actuator rates.

    False if the rank of the constraints is not the generic one, or if rates are nearly infinite or NaN.
    """
    n, width = pairs.shape
    rank = table.shape[1] - n
    if rank > 0:
        triangularise(table, rows, rank)
        if not abs(table[rank - 1, rank - 1]) > REGULAR:
            return False
    for k in range(n):
        for i in range(rank, rows):
            if not abs(table[i, rank + k]) <= IMPLIED:
                return False
        for i in range(width):
            pairs[k, i] = table[rows + i, rank + k]
            if not abs(pairs[k, i]) < 1.0 / REGULAR:
                return False
    return True
