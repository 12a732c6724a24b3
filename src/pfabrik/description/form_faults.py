"""Faults of single values and of single joints: what each field must look like, whatever the other joints are."""

from __future__ import annotations

import math
import re
import reprlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, cast

from ..errors import Fault, near_miss
from ..tolerances import TOLERANCES
from .joint_types import JOINT_TYPES, KINDS, Coordinate, JointKind
from .joints import Cone, Joint

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
    return isinstance(value, str) and value.strip() != "" and value == value.encode(errors="ignore").decode()


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


def _shown_key(key: object) -> str:
    return key if isinstance(key, str) and re.fullmatch(r"[\w-]{1,40}", key) else shown(key)


def name_faults(place: str, value: object) -> Iterator[Fault]:
    """The fault of a value that does not name anything."""
    if not is_name(value):
        yield Fault(place, shown(value), "a text that is not empty")


def number_faults(place: str, value: Any, count: int) -> Iterator[Fault]:
    """The fault of what should be `count` finite numbers of sensible size (a single one for a count of 1)."""
    numbers = (value,) if count == 1 else value
    what = "a number" if count == 1 else f"{_WORDS[count]} numbers"
    if not is_numbers(numbers, count):
        yield Fault(place, shown(value), what)
    elif not all(map(math.isfinite, numbers)):
        yield Fault(place, shown(value), f"{what}, finite")
    elif max(map(abs, numbers)) > LARGEST_NUMBER:
        yield Fault(place, shown(value), f"{what}, at most {LARGEST_NUMBER:g} in magnitude")


_WORDS = {2: "two", 3: "three"}


def direction_faults(place: str, value: Any) -> Iterator[Fault]:
    """The fault of what should be a direction: three finite numbers, not all zero."""
    faults = list(number_faults(place, value, 3))
    yield from faults
    if not faults and not any(value):
        yield Fault(place, shown(value), "a direction that is not zero")


def joint_faults(place: str, joint: Joint) -> Iterator[Fault]:
    """All faults of a joint that can be seen without looking at the others."""
    yield from name_faults(f"{place}.name", joint.name)
    yield from _type_faults(f"{place}.type", joint)
    yield from _connects_faults(f"{place}.connects", joint)
    yield from _centre_faults(f"{place}.at", joint)
    yield from _axis_faults(place, joint)
    yield from _along_faults(f"{place}.along", joint)
    yield from _actuated_faults(f"{place}.actuated", joint)
    yield from _home_faults(f"{place}.home", joint)
    yield from _range_faults(f"{place}.range", joint)
    yield from _cone_faults(f"{place}.cone", joint)
    yield from _pace_faults(f"{place}.max_speed", joint, joint.max_speed)
    yield from _pace_faults(f"{place}.max_acceleration", joint, joint.max_acceleration)


def kind_of(joint: Joint) -> JointKind | None:
    """What the joint's type is described by; None when there is no such type."""
    return KINDS.get(joint.type) if isinstance(joint.type, str) else None


def _type_faults(place: str, joint: Joint) -> Iterator[Fault]:
    if kind_of(joint) is None:
        hint = near_miss(joint.type, JOINT_TYPES) if isinstance(joint.type, str) else ""
        yield Fault(place, f"{shown(joint.type)}{hint}", f"one of {', '.join(JOINT_TYPES)}")


def _connects_faults(place: str, joint: Joint) -> Iterator[Fault]:
    if not is_pair_of_names(joint.connects):
        yield Fault(place, shown(joint.connects), "the names of two bodies")
    elif joint.connects[0] == joint.connects[1]:
        yield Fault(place, f"'{joint.connects[0]}' twice", "two different bodies")


def _centre_faults(place: str, joint: Joint) -> Iterator[Fault]:
    if joint.at is not None:
        yield from number_faults(place, joint.at, 3)
        if joint.along is not None:
            yield Fault(place, shown(joint.at), "nothing: `along` already says where the joint is")
    elif kind_of(joint) is not None and joint.type != "prismatic":
        yield Fault(place, "nothing", f"three numbers, the centre of the {joint.type} joint")


def _axis_faults(place: str, joint: Joint) -> Iterator[Fault]:
    kind = kind_of(joint)
    if joint.axis is not None:
        yield from direction_faults(f"{place}.axis", joint.axis)
    if joint.axes is not None:
        yield from _axes_faults(f"{place}.axes", joint.axes)
    if kind is None:
        return
    for field in ("axis", "axes"):
        value = getattr(joint, field)
        if value is not None and kind.direction != field:
            yield Fault(f"{place}.{field}", shown(value), f"nothing: a {joint.type} joint has no {field}")
    if kind.direction == "axis" and joint.axis is None and joint.along is None:
        yield Fault(f"{place}.axis", "nothing", f"three numbers, the direction of the {joint.type} joint's axis")


def _axes_faults(place: str, axes: Any) -> Iterator[Fault]:
    if not (isinstance(axes, tuple) and len(axes) == 2):
        yield Fault(place, shown(axes), "two directions of three numbers each")
        return
    faults = [fault for index, axis in enumerate(axes) for fault in direction_faults(f"{place}[{index}]", axis)]
    yield from faults
    if not faults and _sine(*axes) <= TOLERANCES.alignment:
        yield Fault(place, "two parallel axes", "axes of two different directions")


def _sine(a: tuple[float, float, float], b: tuple[float, float, float]) -> float:
    return math.hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _along_faults(place: str, joint: Joint) -> Iterator[Fault]:
    if joint.along is None:
        return
    if kind_of(joint) is not None and joint.type != "prismatic":
        yield Fault(place, shown(joint.along), f"nothing: a {joint.type} joint does not run along others")
    elif joint.axis is not None:
        yield Fault(place, "both `axis` and `along`", "one of them")
    if not is_pair_of_names(joint.along):
        yield Fault(place, shown(joint.along), "the names of two joints")
    elif joint.along[0] == joint.along[1]:
        yield Fault(place, f"'{joint.along[0]}' twice", "two different joints")


def _actuated_faults(place: str, joint: Joint) -> Iterator[Fault]:
    kind, actuated = kind_of(joint), cast(Any, joint.actuated)
    if kind is not None and kind.actuatable and len(kind.coordinates) == 2:
        pair = isinstance(actuated, tuple) and len(actuated) == 2 and all(isinstance(each, bool) for each in actuated)
        if not isinstance(actuated, bool) and not pair:
            yield Fault(place, shown(actuated), f"true, false, or a pair of them: {', '.join(kind.coordinates)}")
    elif not isinstance(actuated, bool):
        yield Fault(place, shown(actuated), "true or false")
    elif actuated and kind is not None and not kind.actuatable:
        yield Fault(place, f"an actuated {joint.type} joint", "an actuator on an R, P or C joint")


def _home_faults(place: str, joint: Joint) -> Iterator[Fault]:
    kind = kind_of(joint)
    if kind is None:
        return
    if not kind.ranged or joint.along is not None:
        if joint.home != 0.0:
            reason = "its home is the distance of the joints of `along`" if kind.ranged else "it counts from home"
            yield Fault(place, shown(joint.home), f"nothing: {reason}")
        return
    yield from number_faults(place, joint.home, len(kind.coordinates))


def _range_faults(place: str, joint: Joint) -> Iterator[Fault]:
    kind, limits = kind_of(joint), cast(Any, joint.range)
    if limits is None or kind is None:
        return
    if not kind.ranged:
        limit = "its limit is a cone" if kind.coned else "it does not move"
        yield Fault(place, shown(limits), f"nothing: a {joint.type} joint has no range, {limit}")
    elif joint.type == "universal" and joint.axes is None:
        yield Fault(place, shown(limits), "`axes` as well: a range counts the angles about them")
    elif len(kind.coordinates) == 1:
        yield from _bounds_faults(place, limits, kind.coordinates[0])
    elif not (isinstance(limits, tuple) and len(limits) == 2):
        yield Fault(place, shown(limits), f"two pairs (lowest, highest), {' and '.join(kind.coordinates)}")
    else:
        for index, (bounds, coordinate) in enumerate(zip(limits, kind.coordinates, strict=True)):
            yield from _bounds_faults(f"{place}[{index}]", bounds, coordinate)


def _bounds_faults(place: str, bounds: Any, coordinate: Coordinate) -> Iterator[Fault]:
    faults = list(number_faults(place, bounds, 2))
    if is_numbers(bounds, 2) and any(map(math.isinf, bounds)):
        open_end = "two numbers, finite: where nothing limits one end, a number that is never reached"
        faults = [Fault(place, range_text(bounds, coordinate), open_end)]
    yield from faults
    if not faults and bounds[0] > bounds[1]:
        yield Fault(place, range_text(bounds, coordinate), "the lowest value first, then the highest")


def _pace_faults(place: str, joint: Joint, value: Any) -> Iterator[Fault]:
    """Faults of a speed or an acceleration: positive, and one for each coordinate that something drives."""
    if value is None:
        return
    count = len(joint.driven)
    faults = list(number_faults(place, value, count or 1))
    yield from faults
    if not faults and min(value if count > 1 else (value,)) <= 0.0:
        yield Fault(place, shown(value), "a number greater than 0" if count < 2 else "numbers greater than 0")
    elif not faults and joint.actuated is False:
        yield Fault(place, shown(value), "nothing: the joint is not actuated")


def _cone_faults(place: str, joint: Joint) -> Iterator[Fault]:
    kind, cone = kind_of(joint), joint.cone
    if cone is None:
        return
    if kind is not None and not kind.coned:
        yield Fault(place, "a cone", f"nothing: a {joint.type} joint has no cone")
    if not all(hasattr(cone, field) for field in ("axis", "half_angle", "fixed_to")):
        yield Fault(place, shown(cone), "a cone: its axis, half_angle and fixed_to")
        return
    yield from direction_faults(f"{place}.axis", cone.axis)
    yield from _half_angle_faults(f"{place}.half_angle", cone.half_angle)
    yield from _fixed_to_faults(f"{place}.fixed_to", joint, cone)


def _half_angle_faults(place: str, half_angle: Any) -> Iterator[Fault]:
    faults = list(number_faults(place, half_angle, 1))
    yield from faults
    if not faults and not 0.0 < half_angle <= math.pi:
        yield Fault(place, angle_text(half_angle), "more than 0 and at most half a turn")


def _fixed_to_faults(place: str, joint: Joint, cone: Cone) -> Iterator[Fault]:
    if not is_pair_of_names(joint.connects) and is_name(cone.fixed_to):
        return
    if not is_name(cone.fixed_to) or cone.fixed_to not in joint.connects:
        one_of = " or ".join(map(shown, joint.connects)) if is_pair_of_names(joint.connects) else "a body"
        yield Fault(place, shown(cone.fixed_to), one_of)
