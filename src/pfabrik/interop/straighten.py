"""Axes that are parallel, or square to each other, up to the digits of a file, made so exactly.

A loop of hinges whose axes are off by a millionth of a radian, which is what `1.5708` leaves of a quarter turn, does
not move: it is locked by what is no more than rounding.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arrays import Floats
from ..description.home_mobility import inexactness
from ..description.joints import Joint
from ..description.structure import Structure
from ..tolerances import TOLERANCES
from .opened import Note, OpenMechanism

PARALLEL = 1e-15
"""Sine up to which they are."""


def straightened(
    joints: Sequence[Joint], opened: OpenMechanism, reference: Floats | None, told: list[Note]
) -> Sequence[Joint]:
    """The joints, with their axes put straight where the loops all but lock without, and not with it."""

    def locks(made: Sequence[Joint]) -> float:
        point: Any = None if reference is None else tuple(reference)
        return inexactness(Structure(opened.name, tuple(made), opened.end_effector, point, opened.base))

    before = locks(joints)
    if before == 0.0:
        return joints
    straight = _straight(joints)
    if locks(straight) >= before:
        return joints
    pairs = zip(joints, straight, strict=True)
    turned = {
        old.name: float(np.linalg.norm(np.subtract(old.axis, new.axis))) for old, new in pairs if old.axis and new.axis
    }
    names = tuple(name for name, angle in turned.items() if angle > PARALLEL)
    told.append(Note(f"axes put straight, by up to {max(turned.values()):.1g} rad, for the loops to move", names))
    return straight


def _straight(joints: Sequence[Joint]) -> list[Joint]:
    """Every axis along the mean of those that are nearly parallel to it, and that square to the means before it."""
    means: list[Floats] = []
    for joint in joints:
        if joint.axis is not None:
            axis = np.array(joint.axis)
            near = [mean for mean in means if _sine(mean, axis) < TOLERANCES.file_angle]
            if not near:
                means.append(_mean([np.array(each.axis) for each in joints if each.axis is not None], axis))
    for place, mean in enumerate(means):
        square = [other for other in means[:place] if abs(other @ mean) < TOLERANCES.file_angle]
        if square:
            across = np.linalg.qr(np.array(square).T)[0]
            means[place] = mean - across @ (across.T @ mean)
            means[place] /= np.linalg.norm(means[place])
    return [joint if joint.axis is None else _turned(joint, means) for joint in joints]


def _mean(axes: Sequence[Floats], axis: Floats) -> Floats:
    """The mean direction of the axes nearly parallel to one, to its side."""
    total = np.sum([np.sign(each @ axis) * each for each in axes if _sine(each, axis) < TOLERANCES.file_angle], axis=0)
    return np.asarray(total / np.linalg.norm(total))


def _turned(joint: Joint, means: Sequence[Floats]) -> Joint:
    axis = np.array(joint.axis)
    mean = next((each for each in means if _sine(each, axis) < 2.0 * TOLERANCES.file_angle), axis)
    return dataclasses.replace(joint, axis=np.sign(mean @ axis) * mean)


def _sine(one: Floats, other: Floats) -> float:
    return float(np.linalg.norm(np.cross(one, other)))
