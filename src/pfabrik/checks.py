"""What arguments of several questions are checked for: positive numbers, and highest values of actuators by name."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Mapping, Sequence
from numbers import Real
from typing import Any

from .arrays import Floats
from .errors import InvalidArgument, UnknownName


def require_positive(name: str, value: Any) -> float:
    """A number of any type that is positive and, as a float, finite; InvalidArgument for anything else."""
    if isinstance(value, bool) or not isinstance(value, Real) or not _is_positive(value):
        raise InvalidArgument(name, reprlib.repr(value), "a positive number")
    return float(value)


def _is_positive(value: Real) -> bool:
    try:
        return 0.0 < float(value) < math.inf
    except OverflowError:  # an integer or a fraction too large for a float
        return False


def put_limits(limits: Floats, argument: str, given: float | Mapping[str, float] | None, names: Sequence[str]) -> None:
    """Put limits that were given, one for all actuators or by name, in place of those that hold otherwise, (n_a,).

    Raises
    ------
    UnknownName : no actuator of such a name.
    InvalidArgument : a limit that is no positive number.
    """
    if isinstance(given, Mapping):
        for name, limit in given.items():
            if name not in names:
                raise UnknownName("actuator", name, names)
            limits[names.index(name)] = require_positive(f"{argument}['{name}']", limit)
    elif given is not None:
        limits[:] = require_positive(argument, given)
