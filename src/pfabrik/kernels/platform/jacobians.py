"""Jacobians of platforms on legs in closed form, from the slopes that `read` tells.

With C the derivative of the constraints that legs leave on the pose, and J that of the actuators, by the platform's
twist: the platform moves by B y, with B an orthonormal basis of the null space of C, and the actuators by J B y. So
the inverse Jacobian is J B B', and the forward one B (J B)+.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...arrays import Floats
from .._jit import opener, routine, search
from ..closure.first_order import REGULAR, orthogonalise, triangularise

# Slope up to which a constraint follows from others [L or rad].
IMPLIED = 1e-9


class JacobianTables(NamedTuple):
    """Scratch memory of one thread; r rows of a twist."""

    table: Floats  # (rows + r + n_a, r): constraints, the twist, and actuators, by the twist
    pairs: Floats  # (freedoms, r + n_a): twists and actuator rates that go together


def new_jacobian_tables(rows: int, rank: int, twists: int, actuators: int) -> JacobianTables:
    """Scratch memory of one thread, for so many constraints of some rank."""
    width = twists + actuators
    return JacobianTables(np.zeros((rows + width, twists)), np.zeros((twists - rank, width)))


open_tables = opener(new_jacobian_tables(0, 0, 6, 6))


@search
def jacobians(scratch_address: int, slopes: Floats, is_forward: int, found: Floats) -> int:
    """Fill Jacobians where constraints have their rank, away from all singularities.

    Parameters
    ----------
    scratch : see `new_jacobian_tables`.
    slopes : of constraints, then of actuators, by the twist of the platform, (n, rows + n_a, 6) [L, rad].
    is_forward : 1 for twists by actuator rates, (n, r, n_a), 0 for actuator rates by twists, (n, n_a, r).
    found : filled with them [L, rad]; the first number of those that are not told is NaN.

    Returns
    -------
    How many are not told.
    """
    scratch = open_tables(scratch_address)
    table, pairs = scratch.table, scratch.pairs
    width, twists, left = pairs.shape[1], table.shape[1], 0
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
        is_told = abs(total) < math.inf and put_pairs(rows, table, pairs)
        if not is_told or (is_forward == 1 and not orthogonalise(pairs, first, width)):
            found[row, 0, 0] = math.nan
            left += 1
            continue
        for i in range(found.shape[1]):
            for j in range(found.shape[2]):
                found[row, i, j] = 0.0
                for k in range(pairs.shape[0]):
                    found[row, i, j] += pairs[k, to + i] * pairs[k, first + j]
    return left


@routine
def put_pairs(rows: int, table: Floats, pairs: Floats) -> bool:
    """Fill the twists that constraints allow, orthonormal, and the actuator rates that go with them.

    False where constraints have not the rank that leaves so many, or rates are next to infinite, or no numbers.
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
