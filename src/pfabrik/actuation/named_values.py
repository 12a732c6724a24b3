"""Arguments of maps: coordinates, vectors, and values of actuators, checked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arguments import array, is_not_negative
from ..arrays import Floats
from ..description.mechanism import Mechanism
from ..errors import InvalidArgument
from .task_path import Coordinates


def rows_of(names: Sequence[str], q: Any) -> tuple[Floats, tuple[int, ...]]:
    """Coordinates as rows (n, k), and the batch shape they came in."""
    values = vectors_of("q", q, names)
    return np.ascontiguousarray(values.reshape(-1, len(names))), values.shape[:-1]


def vectors_of(name: str, given: Any, names: Sequence[str]) -> Floats:
    """Finite vectors (..., n), one number for each name."""
    return array(name, given, f"... {len(names)}", "finite values", f": {', '.join(names)}")


def per_actuator(names: Sequence[str], name: str, given: Any) -> Floats:
    """Values that are not negative, one for each actuator, (n_a,)."""
    shape, note = f"() | {len(names)}", f": {', '.join(names)}"
    values = array(name, given, shape, "numbers that are not negative", note, is_not_negative)
    return np.array(np.broadcast_to(values, (len(names),)))


def speeds_of(mechanism: Mechanism, given: Any) -> Floats:
    """Highest speeds of actuators, (n_a,): given, or those of the mechanism's joints."""
    if given is not None:
        return per_actuator(mechanism.actuator_names, "speed_max", given)
    speeds = []
    for drive in mechanism.drives:
        rates = drive.joint.max_speed
        rate = rates[drive.place] if isinstance(rates, tuple) else rates
        if rate is None:
            raise InvalidArgument("speed_max", f"None, and no max_speed of '{drive.name}'", "speeds of actuators")
        speeds.append(rate)
    return np.array(speeds)


def box_of(coordinates: Coordinates, box: Any) -> tuple[Floats, Floats]:
    """Lowest and highest coordinates, (k,) each: of a box (2, k), or the joints' ranges."""
    expected = f": lowest and highest {', '.join(coordinates.names)}"
    if box is None:
        low, high = coordinates.low, coordinates.high
        endless = [name for name, size in zip(coordinates.names, high - low, strict=True) if not np.isfinite(size)]
        if endless:
            raise InvalidArgument("box", f"None, and no range of {', '.join(endless)}", f"finite numbers{expected}")
        return low, high
    values = array("box", box, f"2 {len(coordinates.names)}", note=expected)
    if (values[0] > values[1]).any():
        raise InvalidArgument("box", str(values.tolist())[:80], f"finite numbers{expected}")
    return values[0], values[1]
