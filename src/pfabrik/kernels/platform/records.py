"""What the kernels in the platform's pose are given and what they fill; lengths in L, angles in radians."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Floats, Ints, Mask, Records
from ..closure.loops import PoseObjective

STRETCHED = 1e-4
"""Difference of a carrier's two solutions below which it is at a dead point, and its side is the start's [L or rad]."""


class PlatformObjective(NamedTuple):
    """What is to come near: the pose of the platform, or the values of actuators."""

    pose: PoseObjective  # its targets in [length]
    values: Floats  # (n, n_a): deviations from home [L or rad] that `driven` are to have; no rows if that is no aim
    implied: int  # how many of the legs' equations follow from the others


class Starts(NamedTuple):
    """Configurations that searches start from: poses [L], coordinates of carriers and sides, as of `PlatformState`."""

    poses: Floats  # (s, 4, 4)
    q: Floats  # (s, legs); no rows where they are what poses and sides tell
    sides: Floats  # (s, legs)

    def at(self, places: NDArray[np.intp] | Mask | slice) -> Starts:
        """Those at some places."""
        return Starts(self.poses[places], self.q[places] if len(self.q) else self.q, self.sides[places])

    def of(self, rows: NDArray[np.intp] | Mask | slice) -> Starts:
        """Those of some rows, if there is one for each; else the one for all."""
        return self if len(self.poses) == 1 else self.at(rows)


SETTINGS = np.dtype(
    [
        ("frame", "i8"),  # as of `PoseObjective`
        ("margin", "f8"),
        ("near", "f8"),
        ("steps", "i8"),  # of a search at most; 0 to weigh limits alone
        ("implied", "i8"),  # as of `PlatformObjective`
        ("agreements", "i8"),  # how often the nearest configuration is to be met: see `is_enough`
        ("stays", "i8"),  # 1 for configurations in the working mode of a row's first start alone
        ("cones", "i8"),  # how many of the cones searches mind, the first ones; excesses over all of them are told
        ("position", "f8"),  # what is REACHED [length]
        ("rotation", "f8"),  # likewise [rad]
        ("hold", "i8"),  # what of the target is held
        ("held_position", "f8"),  # how far off it has it all the same [length]
        ("held_rotation", "f8"),  # likewise [rad]
    ]
)


class Along(NamedTuple):
    """How carriages take a whole machine along: legs, arms and platform, none of which then moves within it."""

    part: Floats  # (3, 3): of a displacement, the part that they can take
    rates: Floats  # (legs, 3): of it, what each carriage goes
    room: Floats  # (legs, 2): least and most coordinate of each [L]


class Plan(NamedTuple):
    """What searches are to bring near, and how, whatever the rows."""

    weights: Floats  # (6,): of the pose, as of `PoseObjective`
    settings: Records  # (1,): SETTINGS
    poses: Floats  # starts that follow a row's own, for any row, as of `Starts`
    q: Floats
    sides: Floats
    along: Along


class Found(NamedTuple):
    """Where the searches of each row ended; of rows without an answer, distances alone are told."""

    distances: Floats  # (n,) [L]; infinite where nothing feasible was found, and where the target is no pose
    poses: Floats  # (n, 4, 4) [length]
    q: Floats  # (n, legs)
    sides: Floats  # (n, legs)
    counters: Ints  # (n, N_COUNTERS): steps and what is held, as of `Rows`
    actuators: Floats  # (n, n_a)
    measures: Floats  # (n, 5): distances from the target [length, rad], the largest equation [length], limit excess
    status: Ints  # (n,): REACHED or PROJECTED

    def at(self, places: NDArray[np.intp] | Mask | slice) -> Found:
        """Those of some rows."""
        return Found._make(array[places] for array in self)

    def put(self, places: NDArray[np.intp] | Mask, others: Found) -> None:
        """Write others at some places."""
        for array, own in zip(self, others, strict=True):
            array[places] = own
