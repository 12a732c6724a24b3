"""Rules for descriptions, as tables: the place, the fault that is found there, and what is expected instead."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from ...errors import Fault
from ...tolerances import TOLERANCES
from .form_faults import (
    angle_text,
    choice_faults,
    direction_faults,
    is_name,
    is_numbers,
    is_pair_of_names,
    name_faults,
    number_faults,
    range_text,
    shown,
)
from .joints import DRIVE_FIELDS, JOINT_TYPES, KINDS, Coordinate, Joint, JointKind


class Rule:
    """Something that a field must not be.

    Attributes
    ----------
    field : below the thing that has it: `axis`, or `cone.axis`, which is asked where there is a cone. With `?` behind
        it the rule is asked of a value only; without, also where there is none.
    faults : of the place, the value of the field, the thing, and what else the rules of a table are about.
    """

    def __init__(self, field: str, faults: Callable[..., Iterable[Fault]]) -> None:
        self.field, self.faults = field.removesuffix("?"), faults
        self.owner, _, self.inner = self.field.partition(".")
        self.needs_owner = field.endswith("?") or self.inner != ""


def wrong(field: str, found: Callable[..., Any], expected: str) -> Rule:
    """A rule with one fault.

    Parameters
    ----------
    found : of the value of the field, the thing, and what else the rules are about: nothing where all is well; else
        what is found, in words, or True for the value as it is.
    expected : in words, with `{0}` for the thing and `{1}` for what else there is.
    """

    def faults(place: str, value: Any, *of: Any) -> Iterable[Fault]:
        words = found(value, *of)
        return [Fault(place, shown(value) if words is True else words, expected.format(*of))] if words else ()

    return Rule(field, faults)


def form(field: str, faults: Callable[..., Iterable[Fault]], *arguments: Any) -> Rule:
    """A rule of what a value looks like by itself: a function of its place and of the value."""
    return Rule(field, lambda place, value, *of: faults(place, value, *arguments))


def faults_by(rules: Sequence[Rule], place: str, *of: Any) -> list[Fault]:
    """The faults that rules find in a thing at a place: where one is, or within it, the rules after it do not look."""
    faults: list[Fault] = []
    for rule in rules:
        value = getattr(of[0], rule.owner)
        if value is None and rule.needs_owner:
            continue
        where = f"{place}.{rule.field}" if place else rule.field
        if not (faults and any(is_same_place(where, fault.place) for fault in faults)):
            faults += rule.faults(where, getattr(value, rule.inner) if rule.inner else value, *of)
    return faults


def is_same_place(one: str, other: str) -> bool:
    """True if one place is the other, or within it."""
    short, long = sorted((one, other), key=len)
    return long == short or long.startswith(f"{short}.") or (short != "joint" and long.startswith(f"{short}["))


def kind_of(joint: Joint) -> JointKind | None:
    """The kind that describes the joint's type; None if there is no such type."""
    return KINDS.get(joint.type) if isinstance(joint.type, str) else None


def joint_faults(place: str, joint: Joint) -> list[Fault]:
    """All faults of a joint that can be seen without looking at the others."""
    kind = kind_of(joint)
    return faults_by(OF_JOINTS if kind is None else OF_KNOWN_JOINTS, place, joint, kind)


def is_pair(value: Any) -> bool:
    """True if the value is a tuple of two."""
    return isinstance(value, tuple) and len(value) == 2


def each_of(place: str, values: Any, faults: Callable[..., Iterable[Fault]], *arguments: Any) -> Iterator[Fault]:
    """The faults of each of several values."""
    for index, value in enumerate(values):
        yield from faults(f"{place}[{index}]", value, *arguments)


def sine(a: tuple[float, float, float], b: tuple[float, float, float]) -> float:
    return math.hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _range_faults(place: str, limits: Any, _: Joint, kind: JointKind) -> Iterator[Fault]:
    if len(kind.coordinates) == 1:
        yield from _bounds_faults(place, limits, kind.coordinates[0])
    else:
        for index, coordinate in enumerate(kind.coordinates):
            yield from _bounds_faults(f"{place}[{index}]", limits[index], coordinate)


def _bounds_faults(place: str, bounds: Any, coordinate: Coordinate) -> Iterator[Fault]:
    if is_numbers(bounds, 2) and any(map(math.isinf, bounds)):
        open_end = "two numbers, finite: where nothing limits one end, a number that is never reached"
        yield Fault(place, range_text(bounds, coordinate), open_end)
        return
    faults = list(number_faults(place, bounds, 2))
    yield from faults
    if not faults and bounds[0] > bounds[1]:
        yield Fault(place, range_text(bounds, coordinate), "the lowest value first, then the highest")


def _pace_faults(place: str, value: Any, joint: Joint, _: object) -> Iterator[Fault]:
    """Faults of a speed, or another number of a drive: positive, and one for each coordinate that something drives."""
    count = len(joint.driven)
    faults = list(number_faults(place, value, count or 1))
    yield from faults
    if not faults and min(value if count > 1 else (value,)) <= 0.0:
        yield Fault(place, shown(value), "a number greater than 0" if count < 2 else "numbers greater than 0")
    elif not faults and joint.actuated is False:
        yield Fault(place, shown(value), "nothing: the joint is not actuated")


def _friction_faults(place: str, value: Any, joint: Joint, _: object) -> Iterator[Fault]:
    """Faults of friction: dry and viscous, neither negative, for each coordinate that something drives."""
    two = len(joint.driven) == 2
    pairs = value if two and isinstance(value, tuple) else (value,)
    what = "two numbers, dry and viscous, 0 or more" + ", for each coordinate" * two
    if len(pairs) != 1 + two or not all(
        is_numbers(pair, 2) and 0.0 <= min(pair) <= max(pair) < math.inf for pair in pairs
    ):
        yield Fault(place, shown(value), what)
    elif joint.actuated is False:
        yield Fault(place, shown(value), "nothing: the joint is not actuated")


def _drives_two(kind: JointKind | None) -> bool:
    return kind is not None and kind.actuatable and len(kind.coordinates) == 2


def _are_truths(value: Any) -> bool:
    return isinstance(value, tuple) and [type(each) for each in value] == [bool, bool]


OF_JOINTS = (
    form("name", name_faults),
    form("type", choice_faults, JOINT_TYPES),
    wrong("connects", lambda v, j, k: not is_pair_of_names(v), "the names of two bodies"),
    wrong("connects", lambda v, j, k: v[0] == v[1] and f"'{v[0]}' twice", "two different bodies"),
    wrong("at?", lambda v, j, k: j.along is not None, "nothing: `along` already says where the joint is"),
    form("at?", number_faults, 3),
    form("axis?", direction_faults),
    wrong("axes?", lambda v, j, k: not is_pair(v), "two directions of three numbers each"),
    form("axes?", each_of, direction_faults),
    wrong("axes?", lambda v, j, k: sine(*v) <= TOLERANCES.alignment and "two parallel axes",
          "axes of two different directions"),
    wrong("along?", lambda v, j, k: not is_pair_of_names(v), "the names of two joints"),
    wrong("along?", lambda v, j, k: v[0] == v[1] and f"'{v[0]}' twice", "two different joints"),
    wrong("along?", lambda v, j, k: j.axis is not None and "both `axis` and `along`", "one of them"),
    wrong("actuated", lambda v, j, k: not isinstance(v, bool) and not _drives_two(k), "true or false"),
    *(Rule(f"{field}?", _pace_faults) for field in DRIVE_FIELDS if field != "friction"),
    Rule("friction?", _friction_faults),
    wrong("cone?", lambda v, j, k: not all(hasattr(v, field) for field in ("axis", "half_angle", "fixed_to")),
          "a cone: its axis, half_angle and fixed_to"),
    form("cone.axis", direction_faults),
    form("cone.half_angle", number_faults, 1),
    wrong("cone.half_angle", lambda v, j, k: not 0.0 < v <= math.pi and angle_text(v),
          "more than 0 and at most half a turn"),
    wrong("cone.fixed_to", lambda v, j, k: not is_pair_of_names(j.connects) and not is_name(v), "a body"),
    wrong("cone.fixed_to", lambda v, j, k: is_pair_of_names(j.connects) and v not in j.connects,
          "{0.connects[0]!r} or {0.connects[1]!r}"),
)  # fmt: skip
"""Of a joint, and of the kind of its type; here that may be None."""

OF_KNOWN_JOINTS = (
    wrong("at", lambda v, j, k: v is None and j.type != "prismatic", "three numbers, the centre of the {0.type} joint"),
    wrong("axis?", lambda v, j, k: k.direction != "axis", "nothing: a {0.type} joint has no axis"),
    wrong("axis", lambda v, j, k: v is None and j.along is None and k.direction == "axis",
          "three numbers, the direction of the {0.type} joint's axis"),
    wrong("axes?", lambda v, j, k: k.direction != "axes", "nothing: a {0.type} joint has no axes"),
    wrong("along?", lambda v, j, k: j.type != "prismatic", "nothing: a {0.type} joint does not run along others"),
    wrong("actuated", lambda v, j, k: _drives_two(k) and not isinstance(v, bool) and not _are_truths(v),
          "true, false, or a pair of them: {1.coordinates[0]}, {1.coordinates[1]}"),
    wrong("actuated", lambda v, j, k: v is True and not k.actuatable and f"an actuated {j.type} joint",
          "an actuator on an R, P or C joint"),
    wrong("home", lambda v, j, k: v != 0.0 and not k.ranged, "nothing: it counts from home"),
    wrong("home", lambda v, j, k: v != 0.0 and j.along is not None,
          "nothing: its home is the distance of the joints of `along`"),
    Rule("home", lambda place, v, j, k: number_faults(place, v, len(k.coordinates)) if k.ranged else ()),
    wrong("range?", lambda v, j, k: k.coned and not k.ranged,
          "nothing: a {0.type} joint has no range, its limit is a cone"),
    wrong("range?", lambda v, j, k: not k.ranged, "nothing: a {0.type} joint has no range, it does not move"),
    wrong("range?", lambda v, j, k: j.type == "universal" and j.axes is None,
          "`axes` as well: a range counts the angles about them"),
    wrong("range?", lambda v, j, k: len(k.coordinates) == 2 and not is_pair(v),
          "two pairs (lowest, highest), {1.coordinates[0]} and {1.coordinates[1]}"),
    Rule("range?", _range_faults),
    wrong("cone?", lambda v, j, k: not k.coned and "a cone", "nothing: a {0.type} joint has no cone"),
    *OF_JOINTS,
)  # fmt: skip
"""Of a joint whose type is one."""
