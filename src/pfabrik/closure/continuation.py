"""Continuation: a way in steps that double while they succeed, and halve where they do not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Mask
from ..kernels.search_constants import SHORTEST_SHARE


def continued(n: int, advance: Callable[[NDArray[np.intp], Floats], Mask], shortest: float = SHORTEST_SHARE) -> Floats:
    """The shares (n,) of n ways to which steps lead; 1 where they lead to the end.

    Parameters
    ----------
    advance : called with some ways, and the share of each to move to from where the last step that succeeded has
        ended; moves those for which that succeeds, and tells which.
    """
    way, step = np.zeros(n), np.full(n, 0.5)
    while len(rows := np.flatnonzero((way < 1.0) & (step >= shortest))):
        has_succeeded = advance(rows, way[rows] + step[rows])
        way[rows] += np.where(has_succeeded, step[rows], 0.0)
        step[rows] = np.where(has_succeeded, np.minimum(2.0 * step[rows], 1.0 - way[rows]), 0.5 * step[rows])
    return way
