"""A path that was read."""

from __future__ import annotations

from typing import NamedTuple

from ..arrays import Floats

MOST_STEPS = 1_000_000
"""Steps of a path at most: what is longer is read in parts."""


class Path(NamedTuple):
    """Targets in their order.

    Attributes
    ----------
    targets : (n, 4, 4) [length].
    times : when each is to be there, (n,) [s]; None where the path does not say.
    feeds : speed of the reference point toward each, (n,) [length/s]; infinite in rapid moves, NaN where not said.
    lines : of the file that each comes from, (n,), counted from 1.
    """

    targets: Floats
    times: Floats | None
    feeds: Floats
    lines: list[int]
