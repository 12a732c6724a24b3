"""Legs as an exported file states them: of which shape each is, and its numbers.

Lengths are in the mechanism's unit. A leg that is read from the platform has its numbers as the platform sees them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Literal, NamedTuple

import numpy as np

from ..arrays import Floats
from ..decomposition.items import Item
from ..decomposition.leg_forms import LegForm, Pivot, Rod, holds_spin
from ..description.mechanism import Mechanism
from ..errors import UnsupportedMechanism
from ..rotations import square_to

Number = float | Floats
End = Literal["foot", "head"]

CARRIERS = {"R": "crank", "P": "carriage"}
ENDINGS = ("weld", "hinge", "cross", "triple", "ball")


class RodShape(NamedTuple):
    """What tells the functions of two rods apart.

    Attributes
    ----------
    carrier : what the foot is on: "crank", "carriage", or "".
    is_shared : whether that is another rod's.
    slides, twists : whether the rod changes its length; whether both ends keep it from spinning.
    """

    carrier: str
    is_shared: bool
    slides: bool
    twists: bool
    foot: str
    head: str
    is_reversed: bool


class PivotShape(NamedTuple):
    """What tells the functions of two pivots apart: slides, the ending, the side that it is read from."""

    slides: int
    ending: str
    is_reversed: bool


@dataclass(frozen=True)
class LegCode:
    """A leg to write.

    Attributes
    ----------
    main : the leg whose carrier it is on; its own place if it shares none.
    numbers : constants by the name of their field in C.
    """

    shape: RodShape | PivotShape
    main: int
    numbers: dict[str, Number]
    joints: tuple[str, ...]


_KNOWN = {
    Rod: ("carrier", "foot_ending", "slide", "twist", "head_ending", "foot", "head", "is_reversed", "is_shared"),
    Pivot: ("slides", "ending", "is_reversed"),
}


def leg_codes(mechanism: Mechanism, forms: Sequence[LegForm]) -> list[LegCode]:
    """The legs of a mechanism.

    Raises
    ------
    UnsupportedMechanism : a kind of leg that has no code here; names its joints.
    """
    codes: list[LegCode] = []
    main = 0
    for place, form in enumerate(forms):
        _require_known(mechanism, form)
        if isinstance(form, Pivot):
            codes.append(_pivot(mechanism, form, place))
            continue
        assert isinstance(form, Rod)
        main = main if form.is_shared else place
        first = forms[main]
        assert isinstance(first, Rod)
        codes.append(_rod(mechanism, form, first, main))
    return codes


def _require_known(mechanism: Mechanism, form: LegForm) -> None:
    """Refuse legs that say more than what is written here."""
    known = _KNOWN.get(type(form), ())
    strange = [each.name for each in fields(form) if each.name not in known and _says_something(form, each.name)]
    endings = [getattr(form, name) for name in ("foot_ending", "head_ending", "ending") if hasattr(form, name)]
    strange += [ending.kind for ending in endings if ending.kind not in ENDINGS]
    if isinstance(form, Rod) and form.carrier is not None and form.carrier.kind not in CARRIERS:
        strange.append(f"a carrier of kind {form.carrier.kind}")
    if strange or not known:
        names = ", ".join(dict.fromkeys(item.joint.name for item in form.items))
        what = ", ".join(strange) or type(form).__name__
        raise UnsupportedMechanism(mechanism.name, [f"no code for the leg of joints {names}: {what}"], "exported")


def _says_something(form: LegForm, name: str) -> bool:
    value = getattr(form, name)
    return not (value is None or value is False or (isinstance(value, tuple) and not value))


def _rod(mechanism: Mechanism, rod: Rod, main: Rod, place: int) -> LegCode:
    length = mechanism.characteristic_length
    span = (rod.head - rod.foot) * length
    line = span / np.linalg.norm(span)
    foot, head = rod.foot_ending, rod.head_ending
    twists = holds_spin(foot) and holds_spin(head) and rod.twist is None
    carrier = CARRIERS[main.carrier.kind] if main.carrier is not None else ""
    numbers: dict[str, Number] = {
        "foot": rod.foot * length,
        "head": _head_point(mechanism, rod.head, rod.is_reversed),
        "length": float(np.linalg.norm(span)),
        "line": line,
    }
    for end, items in (("foot", foot.items), ("head", head.items[::-1])):
        kind = foot.kind if end == "foot" else head.kind
        if kind in ("hinge", "cross"):
            numbers[f"{end}_axes"] = _axes(items)
        if kind == "cross":
            numbers[f"{end}_side"] = _aiming_side(numbers[f"{end}_axes"], line)
    if twists:
        first, last = foot.items[-1].axis, head.items[0].axis
        flat = first @ last - (line @ first) * (line @ last)
        numbers["twist"] = math.atan2(line @ np.cross(first, last), flat)
    if rod.carrier is not None:
        numbers |= _carrier_numbers(rod.carrier, rod.foot, rod.head, length)
    shape = RodShape(carrier, rod.is_shared, rod.slide is not None, twists, foot.kind, head.kind, rod.is_reversed)
    return LegCode(shape, place, numbers, _names(rod.items))


def _carrier_numbers(carrier: Item, foot: Floats, head: Floats, length: float) -> dict[str, Number]:
    """Of a crank the spoke from its axis to the foot, and that a quarter turn on; which solution is home's.

    What is to be reached at home counts from a crank's axis, or from the foot on a carriage.
    """
    axis = carrier.axis
    numbers: dict[str, Number] = {"axis": axis, "reach": (head - foot) * length}
    motion = axis
    if carrier.kind == "R":
        centre = carrier.point + axis * (axis @ (foot - carrier.point))
        motion = np.cross(axis, foot - centre)
        numbers["reach"] = (head - centre) * length
        numbers |= {"centre": centre * length, "spoke": (foot - centre) * length, "across": motion * length}
    # a carriage has q = middle + side root, a crank q = middle + side acos: home's foot leaves the line or goes along
    numbers["side"] = -1.0 if (head - foot) @ motion >= 0.0 else 1.0
    return numbers


def _pivot(mechanism: Mechanism, pivot: Pivot, place: int) -> LegCode:
    kind, n_slides = pivot.ending.kind, len(pivot.slides)
    reference = np.asarray(mechanism.reference_point) / mechanism.characteristic_length
    centre = pivot.ending.centre if pivot.ending.items else reference
    directions = np.array([item.axis for item in pivot.slides]).reshape(-1, 3)
    fixed = np.linalg.svd(directions)[2][n_slides:] if n_slides else np.eye(3)
    axes = np.eye(3) if kind == "weld" else _axes(pivot.ending.items)
    numbers: dict[str, Number] = {
        "foot": centre * mechanism.characteristic_length,
        "head": _head_point(mechanism, centre, pivot.is_reversed),
    }
    if kind != "ball":
        numbers["foot_axes"] = axes
    if n_slides:
        numbers["slides"] = _padded(np.linalg.pinv(directions.T))
    if n_slides < 3:
        numbers["fixed"] = _padded(fixed)
    last = {"hinge": 1, "cross": 2, "triple": 3}.get(kind, 0)
    if last:
        numbers["square"] = square_to(axes[last - 1])[0]
    if kind == "hinge":
        numbers["kept"] = _padded(square_to(axes[0]))
    if kind == "triple":
        numbers["foot_side"] = _aiming_side(axes, axes[2])
    return LegCode(PivotShape(n_slides, kind, pivot.is_reversed), place, numbers, _names(pivot.items))


def _head_point(mechanism: Mechanism, point: Floats, is_reversed: bool) -> Floats:
    """A head at home, seen from the reference point; of a leg read from the platform, from the base's origin."""
    head = point * mechanism.characteristic_length
    return head if is_reversed else head - np.asarray(mechanism.reference_point)


def _axes(items: Sequence[Item]) -> Floats:
    return _padded(np.array([item.axis for item in items]).reshape(-1, 3))


def _padded(rows: Floats) -> Floats:
    """Three rows, the last of them zero where there are fewer."""
    return np.vstack([rows, np.zeros((3 - len(rows), 3))])


def _aiming_side(axes: Number, line: Floats) -> float:
    """Which of the two ways to aim two crossed hinges is home's."""
    first, second, *_ = np.asarray(axes)
    return -math.copysign(1.0, first @ np.cross(second, line))


def _names(items: Sequence[Item]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(item.joint.name for item in items))
