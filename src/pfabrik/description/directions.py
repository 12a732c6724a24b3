"""Directions of a leg's joints: one for all legs or one for each, as numbers or as a word."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

from ..errors import Fault, counted, near_miss
from ..tolerances import TOLERANCES
from .coercion import unit_vector
from .form_faults import direction_faults, shown
from .joints import Vector

FIXED_WORDS: dict[str, Vector] = {
    "vertical": (0.0, 0.0, 1.0),
    "x": (1.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0),
    "z": (0.0, 0.0, 1.0),
}
"""Words for directions that are the same everywhere."""

WORDS = ("radial", "tangential", *FIXED_WORDS)
"""Words for directions: `radial` points away from the z axis, `tangential` counter-clockwise around it."""

EXPECTED = f"a direction: three numbers, or one of {', '.join(WORDS)}, '-' before it for the opposite"

PLACEHOLDER: Vector = (0.0, 0.0, 1.0)
"""Stands for a direction that cannot be told because of a fault that is reported elsewhere."""


def directions(place: str, value: Any, centres: Sequence[Vector | None], faults: list[Fault]) -> list[Vector]:
    """The direction at each centre (None where it could not be read), as unit vectors; faults are added to the list."""
    if is_direction(value):
        found = dict.fromkeys(fault for at in centres for fault in _faults(place, value, at))
        faults += list(found)[:1]
        return [_vector(value, at) for at in centres]
    if not isinstance(value, tuple) or not all(map(is_direction, value)):
        faults.append(Fault(place, shown(value), EXPECTED))
    elif len(value) != len(centres):
        faults.append(Fault(place, counted(len(value), "direction"), f"one, or one for each leg: {len(centres)}"))
    else:
        pairs = list(zip(value, centres, strict=True))
        faults += [fault for index, pair in enumerate(pairs) for fault in _faults(f"{place}[{index}]", *pair)]
        return [_vector(*pair) for pair in pairs]
    return [PLACEHOLDER] * len(centres)


def axis_pairs(
    place: str, value: Any, centres: Sequence[Vector | None], faults: list[Fault]
) -> list[tuple[Vector, Vector]]:
    """The two axes at each centre; faults are added to the list."""
    for_all = is_pair(value)
    if not for_all and not (isinstance(value, tuple) and len(value) == len(centres) and all(map(is_pair, value))):
        expected = f"two directions, or two for each leg ({len(centres)})"
        faults.append(Fault(place, shown(value), f"{expected}, each three numbers or one of {', '.join(WORDS)}"))
        return [((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))] * len(centres)
    pairs = []
    for leg, at in enumerate(centres):
        where, pair = (place, value) if for_all else (f"{place}[{leg}]", value[leg])
        if not for_all or leg == 0:
            faults += [fault for side in (0, 1) for fault in _faults(f"{where}[{side}]", pair[side], at)]
        pairs.append((_vector(pair[0], at), _vector(pair[1], at)))
    return pairs


def is_direction(value: Any) -> bool:
    """True if the value is written as one direction, not as several: a word, or numbers."""
    return isinstance(value, str) or (
        isinstance(value, tuple) and bool(value) and not any(isinstance(part, tuple | str) for part in value)
    )


def is_pair(value: Any) -> bool:
    """True if the value is written as two directions."""
    return isinstance(value, tuple) and len(value) == 2 and all(map(is_direction, value))


def _faults(place: str, value: Any, at: Vector | None) -> Iterator[Fault]:
    if not isinstance(value, str):
        yield from direction_faults(place, value)
    elif value.removeprefix("-") not in WORDS:
        yield Fault(place, f"{shown(value)}{near_miss(value, WORDS)}", EXPECTED)
    elif value.removeprefix("-") not in FIXED_WORDS and at is not None and _radius(at) == 0.0:
        yield Fault(place, f"{shown(value)} at a joint on the z axis, {shown(at)}", "three numbers")


def _radius(at: Vector) -> float:
    """Distance from the z axis; 0 within the accuracy of typed numbers."""
    radius = math.hypot(at[0], at[1])
    return radius if radius > TOLERANCES.alignment * abs(at[2]) else 0.0


def _vector(value: Any, at: Vector | None) -> Vector:
    """The direction as a unit vector; a placeholder where it cannot be told."""
    if not isinstance(value, str):
        vector = unit_vector(value)
        return PLACEHOLDER if list(direction_faults("", vector)) else vector
    word = value.removeprefix("-")
    x, y, z = FIXED_WORDS.get(word, PLACEHOLDER)
    if word in ("radial", "tangential") and at is not None and _radius(at) > 0.0:
        x, y = (at[0], at[1]) if word == "radial" else (-at[1], at[0])
        x, y, z = unit_vector((x, y, 0.0))
    return (0.0 - x, 0.0 - y, 0.0 - z) if value.startswith("-") else (x, y, z)
