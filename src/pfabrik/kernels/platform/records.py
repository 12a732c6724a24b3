"""What the kernels in the platform's pose are given and what they fill; lengths in L, angles in radians."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Floats, Ints, Mask
from ..closure.loops import PoseObjective

STRETCHED = 1e-4
"""Difference of a carrier's two solutions below which it is at a dead point, and its side is the start's [L or rad]."""


class Aim(NamedTuple):
    """What is to come near: the pose of the platform, or the values of actuators."""

    pose: PoseObjective  # its targets in [length]
    values: Floats  # (n, n_a): deviations from home [L or rad] that `driven` are to have; no rows if that is no aim
    implied: int  # how many of the legs' equations follow from the others


class Starts(NamedTuple):
    """Configurations that searches start from: poses [L], coordinates of carriers and sides, as of `Now`."""

    poses: Floats  # (s, 4, 4)
    q: Floats  # (s, legs); no rows where they are what poses and sides tell
    sides: Floats  # (s, legs)

    def at(self, places: NDArray[np.intp] | Mask | slice) -> Starts:
        """Those at some places."""
        return Starts(self.poses[places], self.q[places] if len(self.q) else self.q, self.sides[places])

    def of(self, rows: NDArray[np.intp] | Mask | slice) -> Starts:
        """Those of some rows, if there is one for each; else the one for all."""
        return self if len(self.poses) == 1 else self.at(rows)


class Found(NamedTuple):
    """Where the searches of each row ended."""

    distances: Floats  # (n,) [L]; infinite where nothing feasible was found, and where the target is no pose
    poses: Floats  # (n, 4, 4) [length]
    q: Floats  # (n, legs)
    sides: Floats  # (n, legs)
    steps: Ints  # (n,)
    actuators: Floats  # (n, n_a)
    measures: Floats  # (n, 5): distances from the target [length, rad], the largest equation [length], limit excess
