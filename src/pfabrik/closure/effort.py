"""Bounds on the operations of a search, whose cost grows with the cube of the number of coordinates.

Machines with a dozen coordinates per chain never reach these bounds. For chains of hundreds they limit starts and
steps, so that an answer takes seconds.
"""

from __future__ import annotations

import numpy as np

from ..motion.closure import Closure

CLOSING = 5e9
"""Operations of all random starts together: a closing step takes the sum over groups of the cubed number of
coordinates. About a second; the bound matters from some 130 coordinates on."""

CONTINUATION = 1e10
"""Operations of a continuation to a target, and of each closing from the start of a search."""

DESCENDING = 4e9
"""Operations of all descents of one answer: a step takes several times the cube of the number of all coordinates."""

LIMIT_COST = 4
"""Cost of adding a limit to the active set, in squares of the number of coordinates."""

ENOUGH = 20
"""Steps that every closing may take: those that converge need ten to fifteen, however long the chain."""

FEWEST, A_DESCENT = 4, 15
"""Fewest steps for which a descent or a continuation step is tried; and the steps that most descents need."""


def steps_within(closure: Closure, most: int) -> int:
    """Most steps of a closing."""
    return min(most, max(ENOUGH, int(CONTINUATION / closure.cubes)))


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
