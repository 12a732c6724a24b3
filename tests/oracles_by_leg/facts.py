"""What the legs take for granted of a description, checked while they are read."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pfabrik.description.mechanism import Mechanism
from pfabrik.tolerances import TOLERANCES

Array: TypeAlias = NDArray[np.float64]

# Targets farther away than this many L are out of reach of anything: their rounding alone exceeds the tolerance.
HORIZON = 1e9


class Unsuitable(Exception):
    """A mechanism whose legs, or what follows from its task, are not covered; the text says why."""


def require(fact: bool, otherwise: str) -> None:
    """`Unsuitable`, with what is the case otherwise, unless the fact holds."""
    if not fact:
        raise Unsuitable(otherwise)


def is_parallel(a: Array, b: Array, sine: float = TOLERANCES.alignment) -> bool:
    """Whether two unit vectors are parallel or opposite, up to a sine; by default to the one that descriptions have."""
    return float(np.linalg.norm(np.cross(a, b))) <= sine


def home_values(mechanism: Mechanism) -> Array:
    """Actuated coordinates at home, (1, n_a)."""
    return np.array([[mechanism.home_coordinate(name) for name in mechanism.actuator_names]], dtype=float)
