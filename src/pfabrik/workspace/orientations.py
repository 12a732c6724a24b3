"""Tilts to every side, all of which a position must have."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from ..arrays import Floats, Ints
from ..rotations import from_rotvec

AZIMUTHS, RING = 24, math.radians(6.0)
"""Number of directions of tilts to every side, and the largest step between tilts [rad]."""

Verdict: TypeAlias = Callable[[Floats], tuple[Floats, Ints]]
"""From poses (n, 4, 4) to margins and bindings (n,)."""


def tilts_up_to(angle: float) -> Floats:
    """Rotations (n, 3, 3) about axes in the base's x, y plane: to every side, the greatest first, and none."""
    rings = math.ceil(angle / RING)
    azimuths = 2.0 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
    sizes = angle * np.arange(rings, 0, -1) / max(rings, 1)
    turns = np.zeros((1 + AZIMUTHS * rings, 3))
    turns[:-1, 0] = (sizes[:, None] * np.cos(azimuths)).ravel()
    turns[:-1, 1] = (sizes[:, None] * np.sin(azimuths)).ravel()
    return from_rotvec(turns)


def least_of_all(turns: Floats, poses: Floats, verdict: Verdict) -> tuple[Floats, Ints]:
    """The least margin over all turns, and its binding, of poses (n, 4, 4); the first negative margin is final."""
    if len(turns) == 1:
        return verdict(turned(turns[0], poses))
    margins, bindings = np.full(len(poses), np.inf), np.full(len(poses), -1)
    for turn in turns:
        rows = np.flatnonzero(margins >= 0.0)
        margin, binding = verdict(turned(turn, poses[rows]))
        worse = margin < margins[rows]
        margins[rows[worse]], bindings[rows[worse]] = margin[worse], binding[worse]
    return margins, bindings


def turned(turn: Floats, poses: Floats) -> Floats:
    """Poses (n, 4, 4) turned in the base frame by a rotation (3, 3), each about its reference point."""
    if not np.array_equal(turn, np.eye(3)):
        poses[:, :3, :3] = turn @ poses[:, :3, :3]
    return poses
