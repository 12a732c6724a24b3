"""Bounds on the operations of a search, whose cost grows with the cube of the number of coordinates.

Machines with a dozen coordinates per chain never reach these bounds. For chains of hundreds they limit starts and
steps, so that an answer takes seconds.
"""

from __future__ import annotations

import numpy as np

from ..kernels.closure.joint_constants import (
    A_DESCENT,
    CLOSING,
    CONTINUATION,
    DESCENDING,
    FEWEST,
    FEWEST_CLOSING,
    LIMIT_COST,
)
from ..motion.closure import Closure


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
