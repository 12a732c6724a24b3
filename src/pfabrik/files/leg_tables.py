"""`[[leg]]` tables of mechanism files to legs."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from ..description.chains import read_chain
from ..description.form_faults import shown
from ..description.legs import JOINT_KEYS, Leg
from ..errors import Fault
from .schema import MOST_FAULTS, LegJointTable, LegTable, read_table
from .units import in_radians


def read_leg(table: Any, place: str, angle_unit: str) -> tuple[Leg, list[Fault]]:
    """The legs that a table describes, as far as it can be read, and the faults of the table."""
    if not isinstance(table, dict):
        return Leg(""), [Fault(place, shown(table), "a [[leg]] table")]
    own = {key: value for key, value in table.items() if not _is_letter(key)}
    read, faults = read_table(LegTable, own, place)
    faults = [_with_hint(fault, place, read.chain) for fault in faults]
    values: dict[str, Any] = {name: getattr(read, name) for name in LegTable.model_fields if name != "copies"}
    if read.copies is not None:
        values["copies"] = {"count": read.copies.count, "axis": read.copies.axis}
    types = {step.letter: step.type for step in read_chain(read.chain)}
    by_letter = {}
    for letter in sorted(set(table) - set(own)):
        said, found = _read_joint(table[letter], f"{place}.{letter}", types.get(letter), angle_unit)
        by_letter[letter] = said
        faults += found
    if len(faults) > MOST_FAULTS:
        faults[MOST_FAULTS:] = [Fault(place, f"{len(faults) - MOST_FAULTS} more faults", "none")]
    return Leg(by_letter=by_letter, **values), faults


def _is_letter(key: str) -> bool:
    return re.fullmatch("[A-Z]", key) is not None


def _with_hint(fault: Fault, place: str, chain: Any) -> Fault:
    """The fault of an unknown key; one that names a joint, or is for single joints, is told where it goes."""
    key = fault.place.removeprefix(f"{place}.")
    letters = [step.letter for step in read_chain(chain)] or ["A"]
    if key.upper() in letters:
        return Fault(fault.place, f"an unknown key; did you mean '{key.upper()}'?", fault.expected)
    if key not in JOINT_KEYS or key in LegTable.model_fields:
        return fault
    meant = " or ".join(f"'{letter}.{key}'" for letter in letters)
    return Fault(fault.place, f"an unknown key; did you mean {meant}?", fault.expected)


def _read_joint(table: Any, place: str, type_: Any, angle_unit: str) -> tuple[dict[str, Any], list[Fault]]:
    """What is said of one joint, angles in radians, and the faults of that."""
    if not isinstance(table, dict):
        return {}, [Fault(place, shown(table), f"a table: {', '.join(JOINT_KEYS)}")]
    read, faults = read_table(LegJointTable, table, place)
    return dict(_given(read, type_, angle_unit)), faults


def _given(read: LegJointTable, type_: Any, angle_unit: str) -> Iterator[tuple[str, Any]]:
    for key in JOINT_KEYS:
        value = getattr(read, key)
        if value is None:
            continue
        if key in ("home", "range"):
            value = in_radians(value, type_, angle_unit)
        if key == "cone":
            half_angle = in_radians(value.half_angle, "revolute", angle_unit)
            value = {"axis": value.axis, "half_angle": half_angle, "fixed_to": value.fixed_to}
        yield key, value
