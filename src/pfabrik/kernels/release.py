"""Projections that hold a part of their target, in any unknowns: when what is held leads too far, and is released."""

from __future__ import annotations

import math

from ..arrays import Floats
from ._jit import routine
from .closure.loops import LOCKED
from .rows import HOLD_ORIENTATION

SAME = 1e-7
"""Relative decrease of the distance by which a later search must improve on an earlier one."""

HOLD_COST = 1.0
"""Most that a held component may add to the distance, per unit by which the start differs from the target in that
component [L per rad, or rad per L]: a rotation about the middle of a machine moves no joint by more."""


@routine
def weighted_distance(weights: Floats, position: float, rotation: float) -> float:
    """Distance of a pose from a target [L], from its errors [L], [rad]; held components do not count."""
    turning = 0.0
    for i in range(3, 6):
        turning = turning if weights[i] == LOCKED else max(turning, weights[i])
    return math.hypot(position, math.sqrt(turning) * rotation)


@routine
def is_too_far(distance: float, weights: Floats, hold: int, position: float, rotation: float) -> bool:
    """True if an answer is farther from its target than holding a part of that may cost.

    That is d > d0 + e0, where d and d0 are the distances of the answer and of the start in components that are not
    held, and e0 is the error of the start in those that are.

    Parameters
    ----------
    position, rotation : errors of the start [L], [rad].
    """
    held_error = rotation if hold == HOLD_ORIENTATION else position
    allowed = weighted_distance(weights, position, rotation) + HOLD_COST * held_error
    return distance < math.inf and distance > (1.0 + SAME) * allowed


@routine
def brings_nearer(distance: float, weights: Floats, position: float, rotation: float) -> bool:
    """True if an answer that holds nothing is no farther from its target than the start, whose errors are given."""
    return distance <= (1.0 + SAME) * weighted_distance(weights, position, rotation)
