"""Inverses of batches of small matrices, of which few may be singular."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..tolerances import TOLERANCES


def inverses(matrices: Floats) -> Floats:
    """Moore-Penrose inverses (..., k, n) of matrices (..., n, k), n >= k; what is singular is left out.

    By (A'A)^-1 A' for tall matrices would square the condition: square ones are inverted, all others decomposed.
    """
    n, k = matrices.shape[-2:]
    if n != k:
        return np.asarray(np.linalg.pinv(matrices, rcond=TOLERANCES.rank), float)
    rows = matrices.reshape(-1, n, n)
    sizes = np.linalg.norm(rows, axis=2).prod(axis=1)
    is_regular = np.abs(np.linalg.det(rows)) > REGULAR * sizes
    found = np.empty_like(rows)
    found[is_regular] = np.linalg.inv(rows[is_regular])
    found[~is_regular] = np.linalg.pinv(rows[~is_regular], rcond=TOLERANCES.rank)
    return found.reshape(matrices.shape)


REGULAR = 1e-6
"""Determinant by the product of its rows' lengths above which a matrix is inverted at once, with ten digits or so."""
