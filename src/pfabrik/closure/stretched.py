"""Links that were stretched out on a path: they are to bend back the way they did."""

from __future__ import annotations

from ..arrays import Floats
from ..description.mechanism import Mechanism
from ..kernels.rows import PROJECTED, REACHED, Rows
from ..options import Options
from .close import closure_of
from .first_order import are_stretched
from .parasitic import differences
from .projection import SAME, projection_modes

SAME_POSE = 1e-7
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
        self._ways = projection_modes(mechanism, options.hold, options.rotation_length)
        self.before: Floats | None = None

    def note(self, status: int, start: Floats, found: Floats) -> None:
        """Remember what came of one target, by joint coordinates (1, columns) before and after."""
        if status == REACHED and self.before is None:
            return  # inside the workspace links are hardly ever stretched out, and it would take time to see
        is_stretched = bool(are_stretched(self._mechanism, found)[0])
        self.before = (start if self.before is None else self.before) if is_stretched else None

    def prefer(self, target: Floats, found: Rows, other: Rows) -> bool:
        """Whether an answer to a target (1, 4, 4) that was found from `before` is to replace the one found.

        It is if it is reached or nearer, where the one found is not, or if it has the same pose, and so is bent as
        links were.
        """
        return self._is_alike(found, other) or self._is_better(target, found, other)

    def _is_alike(self, found: Rows, other: Rows) -> bool:
        apart = differences(closure_of(self._mechanism), other.poses, found.poses)[0]
        return bool(other.status[0] == found.status[0] and apart <= SAME_POSE)

    def _is_better(self, target: Floats, found: Rows, other: Rows) -> bool:
        if other.status[0] != found.status[0]:
            return bool(other.status[0] < found.status[0])
        if found.status[0] != PROJECTED:
            return False
        holds = [way.hold for way in self._ways]
        ours, theirs = (holds.index(rows.holds[0]) for rows in (found, other))
        if ours != theirs:
            return theirs < ours
        closure, way = closure_of(self._mechanism), self._ways[ours]
        here, there = (way.distances(closure, rows.poses, target)[0] for rows in (found, other))
        return bool(there < (1.0 - SAME) * here)
