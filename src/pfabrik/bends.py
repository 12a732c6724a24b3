"""Links that were stretched out on a path: they are to bend back the way they did."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .assemblies import differences
from .closure import closure_of
from .kernels import plan as P
from .mechanism import Mechanism
from .motions import are_stretched
from .options import Options
from .projection import SAME, ways_of

Floats = NDArray[np.float64]

SAME_POSE = 1e-6
"""Largest difference of poses that are the same to a search for the nearest [L and entries of rotations]."""


class Bends:
    """What a path must remember of the answers on it where links are stretched out.

    Such an answer is the same in two working modes, and a search that starts from it may go on in either, or not at
    all: along stretched links nothing moves to first order. The last answer before it knows better.

    Attributes
    ----------
    before : joint coordinates (1, columns) of the last answer whose links were bent; None while that is the last one.
    """

    def __init__(self, mechanism: Mechanism, options: Options) -> None:
        self._mechanism = mechanism
        self._ways = ways_of(mechanism, options.hold, options.rotation_length)
        self.before: Floats | None = None

    def note(self, status: int, start: Floats, found: Floats) -> None:
        """Remember what came of one target, by joint coordinates (1, columns) before and after."""
        if status == P.REACHED and self.before is None:
            return  # inside the workspace links are hardly ever stretched out, and it would take time to see
        is_stretched = bool(are_stretched(self._mechanism, found)[0])
        self.before = (start if self.before is None else self.before) if is_stretched else None

    def prefer(self, target: Floats, found: P.Rows, other: P.Rows) -> bool:
        """Whether of two answers to one target (1, 4, 4), the one found from `before` is better, or bent as before."""
        if other.status[0] != found.status[0]:
            return bool(other.status[0] < found.status[0])
        closure = closure_of(self._mechanism)
        if differences(closure, other.poses, found.poses)[0] <= SAME_POSE:
            return True
        if found.status[0] != P.PROJECTED:
            return False
        ranks = [[way.hold for way in self._ways].index(rows.counters[0, 2]) for rows in (found, other)]
        if ranks[0] != ranks[1]:
            return ranks[1] < ranks[0]
        way = self._ways[ranks[0]]
        ours, theirs = (way.distances(closure, rows.poses, target)[0] for rows in (found, other))
        return bool(theirs < (1.0 - SAME) * ours)
