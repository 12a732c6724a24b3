"""Faults of single values, whatever they belong to: names, numbers, directions, keys of tables."""

from __future__ import annotations

import math
import re
import reprlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from ...errors import Fault, near_miss
from .joints import Coordinate

LARGEST_NUMBER = 1e12
"""Largest length or angle accepted: beyond it, squares and differences of lengths lose every digit that matters."""

MOST_FAULTS = 50
"""Most unknown keys of one table that are listed one by one: nobody reads on, and a hostile file may have 100 000."""


class _AsInFiles(reprlib.Repr):
    """Values as a file writes them, whatever they have become, and cut short."""

    def repr_tuple(self, value: tuple[Any, ...], level: int) -> str:
        return self.repr_list(list(value), level)

    def repr_float(self, value: float, _: int) -> str:
        return repr(value).removesuffix(".0")


_SHORT = _AsInFiles()
_SHORT.maxlevel, _SHORT.maxstring, _SHORT.maxother = 3, 60, 60


def shown(value: object) -> str:
    """A value as a fault shows it, the way a file has it, short whatever it is."""
    if value is None:
        return "nothing"
    try:
        return _SHORT.repr(value)
    except Exception:  # a value with a broken repr is still to be reported
        return f"a {type(value).__name__}"


def angle_text(angle: float) -> str:
    """An angle [rad] as a fault shows it, in both units that a description may be written in."""
    return f"{angle:.10g} rad ({math.degrees(angle):.10g} deg)"


def coordinate_text(value: float, coordinate: Coordinate) -> str:
    """The value of a coordinate as a fault shows it."""
    return angle_text(value) if coordinate == "angle" else f"{value:.10g}"


def range_text(bounds: tuple[float, float], coordinate: Coordinate) -> str:
    """A range as a fault shows it."""
    return f"{coordinate_text(bounds[0], coordinate)} to {coordinate_text(bounds[1], coordinate)}"


def is_name(value: object) -> bool:
    """True if the value can name something: a text, not blank, that a file can hold (no half of a surrogate pair)."""
    if not isinstance(value, str) or not value.strip():
        return False
    return value.isascii() or value == value.encode(errors="ignore").decode()


def is_pair_of_names(value: object) -> bool:
    """True if the value is a pair of names."""
    return isinstance(value, tuple) and len(value) == 2 and all(map(is_name, value))


def is_numbers(value: object, count: int) -> bool:
    """True if the value is a tuple of that many floats, finite or not."""
    return isinstance(value, tuple) and len(value) == count and all(isinstance(part, float) for part in value)


def is_point(value: object) -> bool:
    """True if the value is three finite floats."""
    return isinstance(value, tuple) and is_numbers(value, 3) and all(map(math.isfinite, value))


def key_faults(
    place: str,
    table: Mapping[str, Any],
    known: Sequence[str],
    hint: Callable[[str], str] | None = None,
    others: str = "",
) -> Iterator[Fault]:
    """The faults of keys that a table may not have.

    Parameters
    ----------
    hint : what to say of an unknown key; by default the known one that is nearly the same.
    others : what the table may hold beside the known keys.
    """
    unknown = [key for key in table if key not in known]
    for key in unknown[:MOST_FAULTS]:
        where = f"{place}.{_shown_key(key)}".removeprefix(".")
        meant = hint(key) if hint else near_miss(key, known)
        yield Fault(where, f"an unknown key{meant}", f"one of {', '.join(known)}{others}")
    if len(unknown) > MOST_FAULTS:
        yield Fault(place or "file", f"{len(unknown) - MOST_FAULTS} more faults", "none")


def table_faults(place: str, value: Any, known: Sequence[str]) -> Iterator[Fault]:
    """The faults of what should be a table with some keys."""
    if isinstance(value, Mapping):
        yield from key_faults(place, value, known)
    else:
        yield Fault(place, shown(value), f"a table: {', '.join(known)}")


def _shown_key(key: object) -> str:
    return key if isinstance(key, str) and re.fullmatch(r"[\w-]{1,40}", key) else shown(key)


def name_faults(place: str, value: object) -> Iterator[Fault]:
    """The fault of a value that does not name anything."""
    if not is_name(value):
        yield Fault(place, shown(value), "a text that is not empty")


def choice_faults(place: str, value: object, choices: Sequence[str]) -> Iterator[Fault]:
    """The fault of a value that is none of some words."""
    if not isinstance(value, str) or value not in choices:
        hint = near_miss(value, choices) if isinstance(value, str) else ""
        yield Fault(place, f"{shown(value)}{hint}", f"one of {', '.join(choices)}")


def number_faults(place: str, value: Any, count: int) -> Iterator[Fault]:
    """The fault of what should be `count` finite numbers of sensible size (a single one for a count of 1)."""
    numbers = (value,) if count == 1 else value
    what = "a number" if count == 1 else f"{_WORDS[count]} numbers"
    if not is_numbers(numbers, count):
        yield Fault(place, shown(value), what)
    elif not all(map(math.isfinite, numbers)):
        yield Fault(place, shown(value), f"{what}, finite")
    elif max(abs(float(number)) for number in numbers) > LARGEST_NUMBER:
        yield Fault(place, shown(value), f"{what}, at most {LARGEST_NUMBER:g} in magnitude")


_WORDS = {2: "two", 3: "three"}


def direction_faults(place: str, value: Any) -> Iterator[Fault]:
    """The fault of what should be a direction: three finite numbers, not all zero."""
    faults = list(number_faults(place, value, 3))
    yield from faults
    if not faults and not any(value):
        yield Fault(place, shown(value), "a direction that is not zero")
