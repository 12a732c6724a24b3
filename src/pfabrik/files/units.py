"""Angles between files, which may use degrees, and everything else, which uses radians."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from ..description.joint_types import KINDS


def in_radians(value: Any, joint_type: Any, unit: str) -> Any:
    """A joint's home or range from a file, with its angles in radians and its lengths as they are.

    Parameters
    ----------
    value : a number or nested list of numbers, by coordinate where the joint has two; None stays None.
    unit : "deg" or "rad", the unit of the angles in `value`.
    """
    return converted(value, joint_type, math.radians) if unit == "deg" else value


def converted(value: Any, joint_type: Any, convert: Callable[[float], float]) -> Any:
    """A joint's home or range with a function applied to every angle in it."""
    kind = KINDS.get(joint_type)
    if kind is None or not kind.ranged:
        return value
    if len(kind.coordinates) == 1:
        return _each(value, convert) if kind.coordinates[0] == "angle" else value
    if not isinstance(value, list | tuple) or len(value) != len(kind.coordinates):
        return value
    parts = zip(value, kind.coordinates, strict=True)
    return tuple(_each(part, convert) if coordinate == "angle" else part for part, coordinate in parts)


def _each(value: Any, convert: Callable[[float], float]) -> Any:
    if isinstance(value, list | tuple):
        return tuple(_each(part, convert) for part in value)
    return value if value is None else convert(value)


def exact_degrees(angle: float) -> float | None:
    """Degrees that `math.radians` turns into exactly this angle [rad], the shortest to write; None if there are none.

    A degree is a coarser step than a radian at most angles, so some angles have no counterpart.
    """
    degrees = math.degrees(angle)
    rounded = (float(f"{degrees:.{digits}g}") for digits in range(1, _DIGITS + 1))
    neighbours = (math.nextafter(degrees, math.inf), math.nextafter(degrees, -math.inf))
    return next((each for each in (*rounded, *neighbours) if math.radians(each) == angle), None)


_DIGITS = 17  # enough to write any float exactly
