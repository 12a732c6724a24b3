"""A tape run again with other numbers, compiled."""

from __future__ import annotations

import math

from ..arrays import Floats, Ints
from . import tape
from ._jit import inlined, search

perform = inlined(tape.perform)


@search
def replay(
    steps: Ints,
    given: Floats,
    used: Ints,
    values: Floats,
    writes: Ints,
    words: Floats,
) -> bool:
    """Run a tape; False, with nothing written, if a decision comes out otherwise or a used number is not finite.

    Parameters
    ----------
    steps : (k, 5): operation, places of its operands and its result among the values, and of a decision how it came
        out (1 or 0); -1 of other steps.
    given : the numbers of the home configuration: the first of the values.
    used : places of those that steps or results depend on.
    values : constants are in their places.
    writes : (m, 3): where in `words` a result goes, its place among the values, its size.
    """
    for i in range(given.shape[0]):
        values[i] = given[i]
    for i in range(used.shape[0]):
        if not math.isfinite(values[used[i]]):
            return False
    for k in range(steps.shape[0]):
        perform(steps[k, 0], values, steps[k, 1], steps[k, 2], steps[k, 3])
        if steps[k, 4] >= 0 and values[steps[k, 3]] != steps[k, 4]:
            return False
    for k in range(writes.shape[0]):
        for i in range(writes[k, 2]):
            words[writes[k, 0] + i] = values[writes[k, 1] + i]
    return True
