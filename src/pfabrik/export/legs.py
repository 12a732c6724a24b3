"""Legs as an exported file states them: of which shape each is, and its numbers.

Lengths are in the mechanism's unit. A leg that is read from the platform has its numbers as the platform sees them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Literal, NamedTuple

import numpy as np

from ..arrays import Floats
from ..decomposition.items import Item
from ..decomposition.leg_forms import LegForm, Pivot, Rod, keeps_from_spinning
from ..decomposition.leg_table import LegTable
from ..description.mechanism import Mechanism
from ..errors import UnsupportedMechanism
from ..kernels.legs import records as K
from ..kernels.legs.records import Record
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


def leg_codes(mechanism: Mechanism, table: LegTable) -> list[LegCode]:
    """The legs of a mechanism.

    Raises
    ------
    UnsupportedMechanism : a kind of leg that has no code here; names its joints.
    """
    codes: list[LegCode] = []
    main = 0
    for place, (form, leg) in enumerate(zip(table.forms, table.legs, strict=True)):
        _require_known(mechanism, form)
        if isinstance(form, Pivot):
            codes.append(LegCode(_pivot_shape(form), place, _pivot_numbers(mechanism, form, leg), _names(form.items)))
            continue
        assert isinstance(form, Rod)
        main = main if form.is_shared else place
        first = table.forms[main]
        assert isinstance(first, Rod)
        codes.append(LegCode(_rod_shape(form, first), main, _rod_numbers(mechanism, form, leg), _names(form.items)))
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


def _rod_shape(rod: Rod, main: Rod) -> RodShape:
    carrier = CARRIERS[main.carrier.kind] if main.carrier is not None else ""
    foot, head, twists = rod.foot_ending.kind, rod.head_ending.kind, keeps_from_spinning(rod)
    return RodShape(carrier, rod.is_shared, rod.slide is not None, twists, foot, head, rod.is_reversed)


def _rod_numbers(mechanism: Mechanism, rod: Rod, leg: Record) -> dict[str, Number]:
    length = mechanism.characteristic_length
    span = (rod.head - rod.foot) * length
    numbers: dict[str, Number] = {
        "foot": leg["foot_point"] * length,
        "head": _head_point(mechanism, rod.head, rod.is_reversed),
        "length": float(np.linalg.norm(span)),
        "line": span / np.linalg.norm(span),
    }
    for end, ending in (("foot", rod.foot_ending), ("head", rod.head_ending)):
        if ending.kind in ("hinge", "cross"):
            numbers[f"{end}_axes"] = leg[f"{end}_axes"]
        if ending.kind == "cross":
            numbers[f"{end}_side"] = float(leg[f"{end}_side"])
    if leg["twists"]:
        numbers["twist"] = float(leg["twist"])
    if rod.carrier is not None:
        numbers |= _carrier_numbers(rod, leg, length)
    return numbers


def _carrier_numbers(rod: Rod, leg: Record, length: float) -> dict[str, Number]:
    """Of a crank the spoke from its axis to the foot, and that a quarter turn on; which solution is home's.

    What is to be reached at home counts from a crank's axis, or from the foot on a carriage.
    """
    is_crank = leg["carrier"] == K.CRANK
    begin = leg["carrier_point"] if is_crank else rod.foot
    numbers: dict[str, Number] = {"axis": leg["carrier_axis"], "reach": (rod.head - begin) * length}
    if is_crank:
        fields = {"centre": "carrier_point", "spoke": "spoke", "across": "spoke_across"}
        numbers |= {name: leg[field] * length for name, field in fields.items()}
    # a carriage has q = middle + side root, a crank q = middle + side acos: home's foot leaves the line or goes along
    return numbers | {"side": float(leg["side"])}


def _pivot_shape(pivot: Pivot) -> PivotShape:
    return PivotShape(len(pivot.slides), pivot.ending.kind, pivot.is_reversed)


def _pivot_numbers(mechanism: Mechanism, pivot: Pivot, leg: Record) -> dict[str, Number]:
    kind, n_slides = pivot.ending.kind, len(pivot.slides)
    numbers: dict[str, Number] = {
        "foot": leg["foot_point"] * mechanism.characteristic_length,
        "head": _head_point(mechanism, leg["foot_point"], pivot.is_reversed),
    }
    if kind != "ball":
        numbers["foot_axes"] = leg["foot_axes"]
    if n_slides:
        numbers["slides"] = leg["slide_rows"]
    if n_slides < 3:
        numbers["fixed"] = leg["fixed_rows"]
    last = {"hinge": 1, "cross": 2, "triple": 3}.get(kind, 0)
    if last:
        numbers["square"] = square_to(leg["foot_axes"][last - 1])[0]
    if kind == "hinge":
        numbers["kept"] = leg["kept"]
    if kind == "triple":
        numbers["foot_side"] = float(leg["side"])
    return numbers


def _head_point(mechanism: Mechanism, point: Floats, is_reversed: bool) -> Floats:
    """A head at home, seen from the reference point; of a leg read from the platform, from the base's origin.

    It is told in the mechanism's unit, where round numbers stay so.
    """
    head = point * mechanism.characteristic_length
    return head if is_reversed else head - np.asarray(mechanism.reference_point)


def _names(items: Sequence[Item]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(item.joint.name for item in items))
