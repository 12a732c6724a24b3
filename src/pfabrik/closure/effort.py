"""How much is searched for, in operations that are counted: what searches cost grows with the cube of a chain's joints.

Machines have chains of a dozen coordinates, and are searched for without these bounds ever being met; chains of
hundreds are searched for less, so that an answer takes seconds.
"""

from __future__ import annotations

import numpy as np

from .close import Closure

CLOSING = 5e9
"""Operations that random starts may take all together: a step of closing takes as many as the cubes of the numbers of
coordinates of all groups, in sum. About a second, where it tells at all: from some 130 coordinates on."""

LEADING = 1e10
"""The same for all strides of leading a platform to its target, and for each closing from where a search starts."""

DESCENDING = 4e9
"""Likewise for the steps of all descents of one answer: one takes the cube of the number of all coordinates, several
times."""

TAKEN_UP = 4
"""What taking up a limit costs, in squares of the number of coordinates."""

ENOUGH = 20
"""Steps that a closing may always take: those that arrive need ten to fifteen, however long the chain."""

FEWEST, A_DESCENT = 4, 15
"""Steps of a descent, or of a stride, below which it is not worth beginning; and those that most descents need."""


def steps_within(closure: Closure, most: int) -> int:
    """How many steps a closing may take."""
    return min(most, max(ENOUGH, int(LEADING / closure.cubes)))


def starts_within(closure: Closure, most: int, steps: int) -> int:
    """How many starts, of as many steps each, are closed at most."""
    return min(most, int(CLOSING / (steps * closure.cubes)))


def stride_within(closure: Closure, most: int, strides: int) -> int:
    """How many steps each stride of leading may take; 0 where too few are left to lead at all."""
    steps = min(most, int(LEADING / (strides * closure.cubes)))
    return steps if steps >= FEWEST else 0


def descents_within(closure: Closure, starts: int, most: int, met: int = 0) -> tuple[int, int]:
    """How many descents of so many begin, and how many steps each may take; no steps where too few are left.

    Parameters
    ----------
    met : how many limits a step may meet: it takes them up one by one.
    """
    moving = max(1, int(np.count_nonzero(~closure.idle)))
    steps = int(DESCENDING / (moving**2 * (moving + TAKEN_UP * met)))
    n = min(starts, max(1, steps // A_DESCENT))
    steps = min(most, steps // n)
    return n, steps if steps >= FEWEST else 0
