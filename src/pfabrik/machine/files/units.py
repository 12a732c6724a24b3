"""Units of files: angles, which are radians everywhere else, and lengths, which are what a mechanism's label says."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from ...errors import InvalidArgument, near_miss
from ..description.coercion import numbers, truths
from ..description.form_faults import is_numbers
from ..description.joints import DRIVE_FIELDS, KINDS, Coordinate, driven_places
from ..noted_numbers import radians

METRES = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "um": 1e-6, "µm": 1e-6}
METRES |= {"in": 0.0254, "inch": 0.0254, "ft": 0.3048}
"""Label of a unit of length -> its length [m]."""

MEASURED = ("home", "range", "max_speed", "max_acceleration")
"""Fields of a joint in the unit of its coordinate (per second, per second squared): their numbers may be angles."""


IN_SI = tuple(field for field in DRIVE_FIELDS if field not in MEASURED)
"""Fields of a joint in SI units, whatever those of the file are."""


def in_radians(field: str, value: Any, joint_type: Any, actuated: Any, unit: str) -> Any:
    """The value of a joint's field in a file, with angles in radians and lengths unchanged.

    Parameters
    ----------
    field : one of MEASURED; anything in another field stays as it is.
    value : a number, or a pair of them for a range, or one for each coordinate that it is of; anything else stays too.
    actuated : the joint's field of that name: speeds are those of the driven coordinates.
    unit : "deg" or "rad", the unit of the angles in `value`.
    """
    if field not in MEASURED or unit != "deg" or joint_type not in list(KINDS):
        return value
    read = numbers(value)
    kinds = measured(field, joint_type, actuated)
    parts = read if len(kinds) > 1 else (read,)
    fits = isinstance(parts, tuple) and all(
        is_numbers(part, 2) if field == "range" else isinstance(part, float) for part in parts
    )
    return converted(read, kinds, radians) if fits else value


def measured(field: str, joint_type: Any, actuated: Any) -> tuple[Coordinate, ...]:
    """The coordinates that the numbers in one of the fields MEASURED of a joint are for: all, or the driven ones."""
    kind = KINDS[joint_type]
    if field in ("home", "range"):
        return kind.coordinates if kind.ranged else ()
    return tuple(kind.coordinates[place] for place in driven_places(joint_type, truths(actuated, joint_type)))


def angle_in_radians(value: Any, unit: str) -> Any:
    """An angle of a file in radians; any value but a number stays as it is."""
    read = numbers(value)
    return radians(read) if unit == "deg" and isinstance(read, float) else value


def converted(value: Any, kinds: Sequence[Coordinate], convert: Callable[[float], float]) -> Any:
    """A home, range, speed or acceleration with a function applied to every angle in it.

    Parameters
    ----------
    kinds : what its parts are, as of `measured`; a single one has no parts.
    """
    if len(kinds) == 1:
        return _each(value, convert) if kinds[0] == "angle" else value
    if not isinstance(value, tuple) or len(value) != len(kinds):
        return value
    return tuple(_each(part, convert) if kind == "angle" else part for part, kind in zip(value, kinds, strict=True))


def _each(value: Any, convert: Callable[[float], float]) -> Any:
    if isinstance(value, tuple):
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


def metres_of(length_unit: str) -> float:
    """Length of a unit [m], where a machine without a size counts in metres; InvalidArgument for an unknown label."""
    known = METRES | {"unit": 1.0}
    if not isinstance(length_unit, str) or length_unit not in known:
        found = f"'{length_unit}'{near_miss(length_unit, known)}"
        raise InvalidArgument("length_unit", found, f"a unit whose length in metres is known: {', '.join(known)}")
    return known[length_unit]
