"""Bounds on the operations of a search, and continuation: steps that double while they succeed, else halve.

Machines with a dozen coordinates per chain never reach these bounds. For chains of hundreds they limit starts and
steps, so that an answer takes seconds.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...common.arrays import Floats, Mask
from ...kernels.joints.joint_constants import (
    A_DESCENT,
    CLOSING,
    CONTINUATION,
    DESCENDING,
    FEWEST,
    FEWEST_CLOSING,
    LIMIT_COST,
)
from ...kernels.search_constants import SHORTEST_SHARE
from ...machine.motion.loops import Closure


def steps_within(closure: Closure, most: int) -> int:
    """Most steps of a closing."""
    return min(most, max(FEWEST_CLOSING, int(CONTINUATION / closure.cubes)))


def starts_within(closure: Closure, most: int, steps: int) -> int:
    """Most starts of a search that takes `steps` steps from each."""
    return min(most, int(CLOSING / (steps * closure.cubes)))


def steps_per_continuation_step(closure: Closure, most: int, n: int) -> int:
    """Most closing steps of each of n continuation steps; 0 if too few are affordable."""
    steps = min(most, int(CONTINUATION / (n * closure.cubes)))
    return steps if steps >= FEWEST else 0


def descents_within(closure: Closure, starts: int, most: int, n_limits: int = 0) -> tuple[int, int]:
    """Most descents, and most steps of each; 0 steps if too few are affordable.

    Parameters
    ----------
    starts, most : descents and steps that are wanted.
    n_limits : limits that a step may add to the active set, one by one.
    """
    steps = descending_steps(closure, n_limits)
    n = min(starts, max(1, steps // A_DESCENT))
    steps = min(most, steps // n)
    return n, steps if steps >= FEWEST else 0


def descending_steps(closure: Closure, n_limits: int = 0) -> int:
    """Most steps of all descents of one answer."""
    moving = max(1, int(np.count_nonzero(~closure.idle)))
    return int(DESCENDING / (moving**2 * (moving + LIMIT_COST * n_limits)))


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
