"""Where the joints of legs are and which way they point, joint by joint and leg by leg."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from ...errors import Fault, counted, near_miss
from ...tolerances import TOLERANCES
from .coercion import unit_vector
from .form_faults import direction_faults, number_faults, shown
from .joints import Vector
from .legs import ChainJoint, Leg

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


@dataclass(frozen=True)
class Point:
    """A point, None if it could not be read, and where the description has it."""

    at: Vector | None
    place: str


def leg_points(leg: Leg, steps: Sequence[ChainJoint], place: str, faults: list[Fault]) -> list[list[Point]]:
    """The centres of the joints that have one, from the base outward: for each of them one point for each leg.

    All lists are equally long. Faults are added to the list.
    """
    count = sum(step.centred for step in steps)
    ends = {"base": leg.base, "platform": leg.platform}
    if not steps:
        return []
    if count < 2:
        ends = _only_end(leg, place, count, faults)
    legs = count_legs(*ends.values())
    found = {name: points_of_legs(f"{place}.{name}", value, legs, faults) for name, value in ends.items()}
    between = _via(leg, place, count - 2, legs, faults)
    return [row for name in ("base", "via", "platform") for row in ([found[name]] if name in found else between) if row]


def _only_end(leg: Leg, place: str, count: int, faults: list[Fault]) -> dict[str, Any]:
    """Which of `base` and `platform` is to be given for a chain with less than two centres."""
    names = [name for name in ("base", "platform") if getattr(leg, name) is not None]
    spare = names[count:]
    for name in spare:
        has = "one joint with a centre, at `base`" if count else "no joint with a centre"
        faults.append(Fault(f"{place}.{name}", shown(getattr(leg, name)), f"nothing: '{leg.chain}' has {has}"))
    return {name: getattr(leg, name) for name in (names[:count] or ["base"][:count])}


def count_legs(*ends: Any) -> int:
    """Number of legs: that of the points in the first list that can be read."""
    lists = [value for value in ends if isinstance(value, tuple) and value]
    return next((1 if _depth(value) < 2 else len(value) for value in lists), 1)


def _depth(value: Any) -> int:
    """Depth of nested lists, by their first items."""
    return 1 + _depth(value[0] if value else None) if isinstance(value, tuple) else 0


def points_of_legs(place: str, value: Any, legs: int, faults: list[Fault]) -> list[Point]:
    """One point for each leg."""
    if isinstance(value, tuple) and value and not any(isinstance(part, tuple) for part in value):
        return [_point(place, value, faults)] if legs == 1 else _wrong_count(place, 1, legs, faults)
    if not isinstance(value, tuple) or not value:
        faults.append(Fault(place, shown(value), "points of three numbers each, one for each leg"))
        return [Point(None, place)] * legs
    if len(value) != legs:
        return _wrong_count(place, len(value), legs, faults)
    return [_point(f"{place}[{index}]", each, faults) for index, each in enumerate(value)]


def _wrong_count(place: str, found: int, legs: int, faults: list[Fault]) -> list[Point]:
    points = "1 point" if found == 1 else f"{found} points"
    faults.append(Fault(place, points, f"{legs}, one for each leg, as in `base`"))
    return [Point(None, place)] * legs


def _point(place: str, value: Any, faults: list[Fault]) -> Point:
    wrong = list(number_faults(place, value, 3))
    faults += wrong
    return Point(None if wrong else value, place)


def _via(leg: Leg, place: str, joints: int, legs: int, faults: list[Fault]) -> list[list[Point]]:
    """The points of the joints between the ends, a list for each joint."""
    where, value = f"{place}.via", leg.via
    if joints < 1:
        if value is not None:
            expected = f"nothing: no joint of '{leg.chain}' with a centre is between `base` and `platform`"
            faults.append(Fault(where, shown(value), expected))
        return []
    if joints == 1 and _depth(value) < 3:
        return [points_of_legs(where, value, legs, faults)]
    flat = joints > 1 and legs > 1 and _depth(value) < 3
    if not isinstance(value, tuple) or len(value) != joints or flat:
        lists = "a list of points" if joints == 1 else f"{joints} lists of points, one for each joint"
        found = f"{len(value)} lists" if isinstance(value, tuple) and _depth(value) == 3 else shown(value)
        faults.append(Fault(where, found, f"{lists} of '{leg.chain}' between `base` and `platform`"))
        return [[Point(None, where)] * legs] * joints
    return [points_of_legs(f"{where}[{joint}]", each, legs, faults) for joint, each in enumerate(value)]
