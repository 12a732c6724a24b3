"""The pose objective: half the weighted squared distance of the end effector from its target, with held components."""

from __future__ import annotations

import math
from typing import NamedTuple

from ...arrays import Floats
from .._jit import routine
from ..quaternions import UPSIDE_DOWN, difference, yaw_difference
from ..vectors import Vec, cross, dot, norm, scale
from .loops import BASE_AXES, HALF_WAY, LOCKED, TARGET_AXES, PoseObjective

ALIGNED = 1e-9
"""Sine below which two directions have no axis across them."""


class PoseGradient(NamedTuple):
    """The gradient of the objective in the twist of the end effector, and the components of the twist that are held."""

    force: Floats  # (6,): gradient of the objective in the twist
    holds: Floats  # (6, 6): gradients of the held components in the twist, one per row
    errors: Floats  # (6,): errors of the held components
    unit: Floats  # (1,): factor of the objective that makes its gradient of order one
    turn: Floats  # (6,)


@routine
def pose_gradient(
    objective: PoseObjective, target: Floats, X: Floats, gradient: PoseGradient, turns: bool
) -> tuple[float, int]:
    """The objective, and the number of held components; without `turns` the rotation counts as that of the target."""
    w, force, unit = gradient.turn, gradient.force, gradient.unit[0]
    value, held, w[3], w[4], w[5] = 0.0, 0, 0.0, 0.0, 0.0
    if turns and objective.frame == BASE_AXES:
        difference(X, target, w[3:])
    for i in range(6):
        force[i] = 0.0
        if i < 3:
            w[i] = X[i, 3] - target[i, 3]
        elif objective.frame != BASE_AXES:
            continue
        if objective.platform[i] == LOCKED:
            held = hold(gradient, held, i, w[i])
        else:
            value += 0.5 * unit * objective.platform[i] * w[i] * w[i]
            force[i] = unit * objective.platform[i] * w[i]
    if objective.frame == TARGET_AXES and objective.platform[3] == LOCKED:
        held = hold_tilt(target, X, gradient, held)
    elif objective.frame == TARGET_AXES and objective.platform[3] > 0.0:
        value += tilt(target, unit * objective.platform[3], X, force)
    elif objective.frame == HALF_WAY and objective.platform[5] == LOCKED:
        held = hold(gradient, held, 5, yaw_difference(X, target))
        for i in range(3):
            gradient.holds[held - 1, 3 + i] = yaw_gradient(X, i)
    elif objective.frame == HALF_WAY and objective.platform[5] > 0.0:
        off, weight = yaw_difference(X, target), unit * objective.platform[5]
        value += 0.5 * weight * off * off
        for i in range(3):
            force[3 + i] += weight * off * yaw_gradient(X, i)
    return value, held


@routine
def hold(gradient: PoseGradient, held: int, component: int, error: float) -> int:
    """Add a held component of the twist; the number of held components."""
    gradient.errors[held] = error
    for i in range(6):
        gradient.holds[held, i] = 1.0 if i == component else 0.0
    return held + 1


@routine
def hold_tilt(target: Floats, X: Floats, gradient: PoseGradient, held: int) -> int:
    """Hold the z axis along that of the target: its components along the target's x and y axes are zero.

    They are zero for the opposite direction too. So beyond a right angle the held components are the angle, and the
    motion across the shortest rotation to the target.
    """
    axis, angle = turn_of_tilt(target, X)
    if angle > 0.5 * math.pi:
        held = hold(gradient, held, 3, angle)
        held = hold(gradient, held, 3, 0.0)
        sway = cross(axis, (X[0, 2], X[1, 2], X[2, 2]))
        for i in range(3):
            gradient.holds[held - 2, 3 + i] = -axis[i]
            gradient.holds[held - 1, 3 + i] = sway[i]
        return held
    for k in range(2):
        off = 0.0
        for i in range(3):
            off += target[i, k] * X[i, 2]
        held = hold(gradient, held, 3, off)
        for i in range(3):
            a, b = (i + 1) % 3, (i + 2) % 3
            gradient.holds[held - 1, 3 + i] = X[a, 2] * target[b, k] - X[b, 2] * target[a, k]
    return held


@routine
def yaw_gradient(X: Floats, axis: int) -> float:
    """Gradient of the yaw in the rotation about an axis of the base: (z + z') / (1 + z . z'), with both z axes."""
    return (X[axis, 2] + (1.0 if axis == 2 else 0.0)) / max(1.0 + X[2, 2], UPSIDE_DOWN)


@routine
def tilt(target: Floats, weight: float, X: Floats, force: Floats) -> float:
    """Half the weighted square of the angle between the z axes; the gradient is added to `force`."""
    axis, angle = turn_of_tilt(target, X)
    for i in range(3):
        force[3 + i] -= weight * angle * axis[i]
    return 0.5 * weight * angle * angle


@routine
def turn_of_tilt(target: Floats, X: Floats) -> tuple[Vec, float]:
    """Axis and angle of the shortest rotation of the z axis to the target's; half a turn is about its x axis."""
    here, there = (X[0, 2], X[1, 2], X[2, 2]), (target[0, 2], target[1, 2], target[2, 2])
    axis = cross(here, there)
    sine, cosine = norm(axis), dot(here, there)
    angle = math.atan2(sine, cosine)
    if sine > ALIGNED:
        return scale(1.0 / sine, axis), angle
    if cosine > 0.0:
        return scale(1.0 / angle if angle > 0.0 else 0.0, axis), angle
    return (X[0, 0], X[1, 0], X[2, 0]), angle
