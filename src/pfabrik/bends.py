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

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism = mechanism
        self.before: Floats | None = None

    def note(self, status: int, start: Floats, found: Floats) -> None:
        """Remember what came of one target, by joint coordinates (1, columns) before and after."""
        if status == P.REACHED and self.before is None:
            return  # inside the workspace links are hardly ever stretched out, and it would take time to see
        is_stretched = bool(are_stretched(self._mechanism, found)[0])
        self.before = (start if self.before is None else self.before) if is_stretched else None


def is_better(mechanism: Mechanism, options: Options, target: Floats, other: P.Rows, found: P.Rows) -> bool:
    """Whether of two answers to one target (1, 4, 4), the other is better than the one found: reached, or nearer."""
    if other.status[0] != found.status[0]:
        return bool(other.status[0] < found.status[0])
    if found.status[0] != P.PROJECTED:
        return False
    ways = ways_of(mechanism, options.hold, options.rotation_length)
    ranks = [[way.hold for way in ways].index(rows.counters[0, 2]) for rows in (other, found)]
    if ranks[0] != ranks[1]:
        return ranks[0] < ranks[1]
    theirs, ours = (ways[ranks[0]].distances(closure_of(mechanism), rows.poses, target)[0] for rows in (other, found))
    return bool(theirs < (1.0 - SAME) * ours)


def is_at_same_pose(mechanism: Mechanism, other: P.Rows, found: P.Rows) -> bool:
    """Whether two answers, one row each, differ in how links are bent at most."""
    return bool(differences(closure_of(mechanism), other.poses, found.poses)[0] <= SAME_POSE)


def take_over(other: P.Rows, found: P.Rows) -> None:
    """Put one answer in the place of another."""
    for array, own in zip(found, other, strict=True):
        array[:] = own
