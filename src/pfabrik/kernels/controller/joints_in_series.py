"""Joints in series as coordinates of a machine: the pose there, and back from actuators."""

from __future__ import annotations

import math
from typing import NamedTuple

from ...common.arrays import Floats
from .._jit import routine
from ..linear import solve_spd
from ..quaternions import difference
from ..walk_path import walk_row
from .assembled import Assembling, assemble
from .reached import LEG, NO_POSE, Reaching

STEPS, LONGEST_STEP = 40, 0.5
"""Most Newton steps from a pose to joint coordinates, and the longest of them [L or rad]."""

FITTED, NEARLY_FITTED = 1e-13, 1e-10
"""Errors of a pose that end the iteration: as small as rounding leaves them, and small enough [L or rad]."""


class Series(NamedTuple):
    """Joints in series from the base to the end effector, and the memory of a call."""

    motions: Floats  # as in `walk_path` [length]
    end: Floats  # (3,): the end point at home [length]
    home: Floats  # (k,): coordinates at home
    units: Floats  # (k,): L of lengths, 1 of angles
    length: Floats  # (1,): L
    deviations: Floats  # (k,)
    pose: Floats  # (4, 4): at the coordinates [length]
    twists: Floats  # (6, k): by the coordinates [length, rad]
    wanted: Floats  # (4, 4): at the actuators [length]
    normal: Floats  # (k, k + 1)
    error: Floats  # (6,): of the pose [L, rad]; the end effector's own, (3,), if it is a point


@routine
def walk(own: Series, joints: Floats) -> bool:
    """Fill the pose and its twists at joint coordinates; False if they are not finite."""
    size = 0.0
    for j in range(joints.shape[0]):
        own.deviations[j] = joints[j] - own.home[j]
        size += own.deviations[j]
    put_walk(own)
    for i in range(3):
        for j in range(4):
            size += own.pose[i, j]
    return abs(size) < math.inf


@routine
def put_walk(own: Series) -> None:
    """Fill the pose, unrotated of a point, and its twists."""
    walk_row(own.motions, own.end, own.deviations, own.pose, own.twists)
    for i in range(9 if own.error.shape[0] == 3 else 0):
        own.pose[i // 3, i % 3] = 1.0 if i % 4 == 0 else 0.0


@routine
def put_joints(own: Series, assembling: Assembling, reaching: Reaching, actuators: Floats, joints: Floats) -> int:
    """Replace joint coordinates by those at which actuators are, in the assembly mode there; a code.

    Nothing is written unless it is 0, or links are too near.
    """
    if not walk(own, joints):
        return NO_POSE
    for i in range(4):
        for j in range(4):
            own.wanted[i, j] = own.pose[i, j]
    code = assemble(assembling, reaching, actuators, own.wanted)
    if code < 0 or (code >= LEG and code < 2 * LEG):
        return code
    return code if fit(own, joints) else LEG + 1


@routine
def fit(own: Series, joints: Floats) -> bool:
    """Move joint coordinates by Newton's method until their pose is the one wanted; False, and unmoved, if it fails."""
    n, rows, length, previous = joints.shape[0], own.error.shape[0], own.length[0], math.inf
    normal, error = own.normal, own.error
    for _ in range(STEPS):
        worst = 0.0
        if rows > 3:
            difference(own.wanted, own.pose, error[3:])
        for i in range(rows):
            error[i] = (own.wanted[i, 3] - own.pose[i, 3]) / length if i < 3 else error[i]
            worst = max(worst, abs(error[i])) if abs(error[i]) < math.inf else math.inf
        if worst <= FITTED or (worst <= NEARLY_FITTED and worst > 0.25 * previous):
            for j in range(n):
                joints[j] = own.home[j] + own.deviations[j]
            return True
        previous = worst
        for a in range(n):
            for b in range(n + 1):
                normal[a, b] = 0.0
                for i in range(rows):
                    slope = own.twists[i, a] * own.units[a] / (length if i < 3 else 1.0)
                    other = own.twists[i, b] * own.units[b] / (length if i < 3 else 1.0) if b < n else error[i]
                    normal[a, b] += slope * other
        if not worst < math.inf or not solve_spd(normal, n, 0.0):
            return False
        longest = LONGEST_STEP
        for a in range(n):
            longest = max(longest, abs(normal[a, n]))
        for a in range(n):
            own.deviations[a] += normal[a, n] * own.units[a] * LONGEST_STEP / longest
        put_walk(own)
    return False
