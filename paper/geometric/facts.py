"""What a closed form reads of a description, and takes for granted of it beyond the joints of its chains."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from pfabrik import Mechanism

from ..arrays import Floats
from ..step import Step
from ..tolerances import ALIGNMENT, LIMIT

Interval: TypeAlias = tuple[float, float]

# Targets farther away than this many L are out of reach of anything: their rounding alone exceeds the tolerance.
HORIZON = 1e9
# Half a turn of cosines: what a missing cone compares with, so that every line keeps it.
NO_CONE = -2.0
# What the comparison of a cosine may be wrong by: a few roundings. A half angle below 1e-7 rad is lost in it.
COSINE_ROUNDING = 1e-15


class Unsuitable(Exception):
    """A mechanism with the right chains that a closed form does not cover; the text says why."""


def require(fact: bool, otherwise: str) -> None:
    """`Unsuitable`, with what is the case otherwise, unless the fact holds."""
    if not fact:
        raise Unsuitable(otherwise)


def centre(step: Step) -> Floats:
    """Centre of a joint at home, (3,) [length]."""
    return np.array(step.joint.at, dtype=float)


def home_of(mechanism: Mechanism, step: Step) -> float:
    """Home value of a joint with one coordinate [rad or length]."""
    home = mechanism.home_coordinate(step.joint.name)
    assert isinstance(home, float)
    return home


def range_of(step: Step) -> Interval:
    """The range of a joint with one coordinate [rad or length]; infinite without limits."""
    if step.joint.range is None:
        return (-math.inf, math.inf)
    lo, hi = step.joint.range
    assert isinstance(lo, float)
    assert isinstance(hi, float)
    return (lo, hi)


def least_cosine(half_angle: float) -> float:
    """The cosine that a line within a cone has at least, tolerance included."""
    angle = half_angle + LIMIT
    return NO_CONE if angle >= math.pi else math.cos(angle) - COSINE_ROUNDING


def is_parallel(a: Floats, b: Floats) -> bool:
    """Whether two unit vectors are parallel or opposite."""
    return float(np.linalg.norm(np.cross(a, b))) <= ALIGNMENT


def tolerances(mechanism: Mechanism) -> tuple[float, float]:
    """What a length may exceed its limits by, and how far a target may be away to count [length]."""
    length = mechanism.characteristic_length
    return LIMIT * length, HORIZON * length
