"""Where the joints of legs are: the points of a description, joint by joint and leg by leg."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..errors import Fault
from .form_faults import number_faults, shown
from .joints import Vector
from .legs import ChainJoint, Leg


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
    found = {name: _row(f"{place}.{name}", value, legs, faults) for name, value in ends.items()}
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


def _row(place: str, value: Any, legs: int, faults: list[Fault]) -> list[Point]:
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
        return [_row(where, value, legs, faults)]
    flat = joints > 1 and legs > 1 and _depth(value) < 3
    if not isinstance(value, tuple) or len(value) != joints or flat:
        lists = "a list of points" if joints == 1 else f"{joints} lists of points, one for each joint"
        found = f"{len(value)} lists" if isinstance(value, tuple) and _depth(value) == 3 else shown(value)
        faults.append(Fault(where, found, f"{lists} of '{leg.chain}' between `base` and `platform`"))
        return [[Point(None, where)] * legs] * joints
    return [_row(f"{where}[{joint}]", each, legs, faults) for joint, each in enumerate(value)]
