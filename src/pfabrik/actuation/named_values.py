"""Arguments of maps: coordinates, vectors, and values of actuators, checked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arrays import Floats
from ..description.mechanism import Mechanism
from ..errors import InvalidArgument
from ..poses import as_floats
from .task_path import Coordinates


def rows_of(names: Sequence[str], q: Any) -> tuple[Floats, tuple[int, ...]]:
    """Coordinates as rows (n, k), and the batch shape they came in."""
    values = vectors_of("q", q, names)
    return np.ascontiguousarray(values.reshape(-1, len(names))), values.shape[:-1]


def vectors_of(name: str, given: Any, names: Sequence[str]) -> Floats:
    """Finite vectors (..., n), one number for each name."""
    expected = f"finite values of shape (..., {len(names)}): {', '.join(names)}"
    values = as_floats(name, given, expected)
    if values.shape[-1:] != (len(names),):
        raise InvalidArgument(name, f"shape {values.shape}", expected)
    if not np.isfinite(values).all():
        bad = np.flatnonzero(~np.isfinite(values.reshape(-1, len(names))).all(axis=1))[:5].tolist()
        raise InvalidArgument(name, "a number that is not finite", expected, rows=bad if values.ndim > 1 else ())
    return values


def per_actuator(names: Sequence[str], name: str, given: Any) -> Floats:
    """Values that are not negative, one for each actuator, (n_a,)."""
    expected = f"numbers that are not negative, one or {len(names)}: {', '.join(names)}"
    values = as_floats(name, given, expected)
    if values.shape not in ((), (len(names),)) or not (np.isfinite(values) & (values >= 0.0)).all():
        found = f"shape {values.shape}" if values.shape not in ((), (len(names),)) else str(values.tolist())
        raise InvalidArgument(name, found, expected)
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
    expected = (
        f"lowest and highest {', '.join(coordinates.names)}: finite numbers of shape (2, {len(coordinates.names)})"
    )
    if box is None:
        low, high = coordinates.low, coordinates.high
        endless = [name for name, size in zip(coordinates.names, high - low, strict=True) if not np.isfinite(size)]
        if endless:
            raise InvalidArgument("box", f"None, and no range of {', '.join(endless)}", expected)
        return low, high
    values = as_floats("box", box, expected)
    if values.shape != (2, len(coordinates.names)) or not np.isfinite(values).all() or (values[0] > values[1]).any():
        raise InvalidArgument("box", str(values.tolist())[:80], expected)
    return values[0], values[1]
