"""Values for actuators: one for all, or one for each by name; single numbers, or pairs of a lowest and a highest."""

from __future__ import annotations

import reprlib
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import array, as_floats, is_positive
from ..arrays import Floats
from ..checks import require_each, require_positive
from ..errors import InvalidArgument

Bounds: TypeAlias = float | tuple[float, float] | ArrayLike | Mapping[str, float | tuple[float, float]]
"""Limits of actuators: a number for both ways, a pair (lowest, highest), or an array (n_a, 2), or either by name."""

BOUND = "a positive number, or (lowest, highest)"


def bounds_of(argument: str, given: Bounds, names: Sequence[str]) -> Floats:
    """The lowest and the highest value of each actuator, (n_a, 2); infinite where there is none."""
    if isinstance(given, Mapping):
        require_each(argument, given, names)
        return np.array([_pair(f"{argument}['{name}']", given[name]) for name in names])
    values = as_floats(argument, given, f"{BOUND}, for all {len(names)} actuators or each")
    if values.shape == (len(names), 2):
        return np.array([_pair(f"{argument}[{place}]", row) for place, row in enumerate(values)])
    return np.tile(_pair(argument, values), (len(names), 1))


def _pair(argument: str, given: Any) -> tuple[float, float]:
    value = as_floats(argument, given, BOUND)
    if value.shape == () and value > 0.0:
        return -float(value), float(value)
    if value.shape == (2,) and value[0] <= value[1]:
        return float(value[0]), float(value[1])
    raise InvalidArgument(argument, reprlib.repr(given if value.shape else float(value)), BOUND)


def positive_values(argument: str, given: ArrayLike | Mapping[str, float], names: Sequence[str]) -> Floats:
    """A positive number for each actuator, (n_a,), of one for all, an array (n_a,), or a mapping by name."""
    if isinstance(given, Mapping):
        require_each(argument, given, names)
        return np.array([require_positive(f"{argument}['{name}']", given[name]) for name in names])
    note = ", for all actuators or each, or a mapping by name"
    values = array(argument, given, f"() | {len(names)}", "positive numbers", note, is_positive)
    return np.broadcast_to(values, len(names)).copy()
