"""Tilts to every side, all of which a position must have."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from ..arrays import Floats, Ints
from ..rotations import from_rotvec

AZIMUTHS, RING = 24, math.radians(6.0)
"""Tilts to every side are asked for in so many directions, and in steps no larger than this [rad]."""

Verdict: TypeAlias = Callable[[Ints, Floats], tuple[Floats, Ints]]
"""From rows, and a rotation (3, 3) that their poses are turned by, to margins and bindings (n,)."""


def tilts_up_to(angle: float) -> Floats:
    """Rotations (n, 3, 3) about axes in the base's x, y plane: to every side, the greatest first, and none."""
    rings = math.ceil(angle / RING)
    azimuths = 2.0 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
    sizes = angle * np.arange(rings, 0, -1) / max(rings, 1)
    turns = np.zeros((1 + AZIMUTHS * rings, 3))
    turns[:-1, 0] = (sizes[:, None] * np.cos(azimuths)).ravel()
    turns[:-1, 1] = (sizes[:, None] * np.sin(azimuths)).ravel()
    return from_rotvec(turns)


def least_of_all(turns: Floats, n: int, verdict: Verdict) -> tuple[Floats, Ints]:
    """The least margin over all turns, and its binding, of n rows; of those beyond one turn, no further is asked."""
    margins, bindings = np.full(n, np.inf), np.full(n, -1)
    for turn in turns:
        rows = np.flatnonzero(margins >= 0.0)
        own, binding = verdict(rows, turn)
        worse = own < margins[rows]
        margins[rows[worse]], bindings[rows[worse]] = own[worse], binding[worse]
    return margins, bindings
