"""Turns a parsed mechanism file into its mechanism, or into every fault of it at its place in the file.

The keys of tables and the number of joints are checked here, the values by `description`, which finds the same faults
in a file as in a call.
"""

from __future__ import annotations

import dataclasses
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

from ...errors import Fault, InvalidArgument, InvalidMechanism, near_miss
from ..description.body_masses import Mass
from ..description.body_shapes import Shape
from ..description.copies import Pattern, read_copies
from ..description.expanded import Described, expanded
from ..description.form_faults import key_faults, shown
from ..description.joints import Cone, Joint, set_fields
from ..description.leg_joints import count_joints
from ..description.legs import BODY_KEYS, CONE_KEYS, JOINT_KEYS, LEG_KEYS, ChainJoint, Leg, is_listed, read_chain
from ..description.mechanism import Mechanism
from ..description.structure import Structure
from .dimensions import NoNumber, dimension_values, number_of, with_numbers
from .units import angle_in_radians, in_radians

DESCRIBED = ("name", "base", "end_effector", "reference_point", "task", "ignore", "clearance")
HEAD_KEYS = ("schema", "units", *DESCRIBED, "dimensions", "joint", "leg", "body")
UNIT_KEYS = ("length", "angle")
MASS_KEYS = tuple(field.name for field in dataclasses.fields(Mass)[1:])
SHAPE_KEYS = ("name", "shape", *(field.name for field in dataclasses.fields(Shape)[2:]))
_JOINT_FIELDS = tuple(field.name for field in dataclasses.fields(Joint))

MOST_JOINTS = 1000
"""Most joints of one mechanism, copies included: far above any machine, low enough to be checked in seconds."""

Table = dict[str, Any]


def read_mechanism(table: Table, folder: Path | None = None) -> Mechanism:
    """The mechanism of a parsed file; `InvalidMechanism` with every fault.

    Faults of dimensions and expressions come first, then those of tables, then those of the whole. Paths of meshes are
    relative to the file's folder.
    """
    table = with_paths(table, lambda file: os.path.abspath(os.path.join(folder or "", file)))
    if "dimensions" not in table:
        return _read(table, Mechanism)
    numbers_in, values = _with_numbers(table)
    mechanism = _read(numbers_in, Mechanism)
    set_fields(mechanism, _source=Source(table, values))
    return mechanism


def with_paths(table: Table, change: Callable[[str], str]) -> Table:
    """The table of a file with other paths of meshes."""
    bodies = table.get("body")
    if not isinstance(bodies, list):
        return table
    changed = [
        {**body, "file": change(body["file"])}
        if isinstance(body, dict) and isinstance(body.get("file"), str) and body["file"]
        else body
        for body in bodies
    ]
    return table | {"body": changed}


def _with_numbers(table: Table) -> tuple[Table, dict[str, float]]:
    """The table of a file with numbers in place of its expressions, and the values of its dimensions."""
    faults: list[Fault] = []
    unit = str(_units(table).get("angle", "deg"))
    values = dimension_values(table["dimensions"], unit, faults)
    rest = {key: value for key, value in table.items() if key != "dimensions"}
    numbers_in = with_numbers(rest, values, unit, "", faults)
    if faults:
        raise InvalidMechanism(faults)
    return numbers_in, values


@dataclasses.dataclass(frozen=True)
class Source:
    """The parsed file that a mechanism was read from, if it has dimensions, and the values of these."""

    table: Table
    dimensions: dict[str, float]

    @property
    def independent(self) -> tuple[str, ...]:
        """Names of the dimensions that are numbers; the others are computed from them."""
        return tuple(name for name, said in self.table["dimensions"].items() if not isinstance(said, str))

    def read_with(self, values: Mapping[str, float]) -> Mechanism:
        """The mechanism with other values of some dimensions; those that follow from them change with them."""
        return read_mechanism(self._table_with(values))

    def sketch_with(self, values: Mapping[str, float]) -> Structure:
        """The description with other values of some dimensions, without the checks of a mechanism."""
        return _read(_with_numbers(self._table_with(values))[0], Structure)

    def value_of(self, expression: str, values: Mapping[str, float], argument: str = "expression") -> float:
        """The value of an expression of dimensions, with other values of some; InvalidArgument if it has none.

        Parameters
        ----------
        argument : its name in the error.
        """
        faults: list[Fault] = []
        unit = str(_units(self.table).get("angle", "deg"))
        known = dimension_values(self._table_with(values)["dimensions"], unit, faults)
        try:
            return number_of(expression, known, unit, ())
        except NoNumber as reason:
            raise InvalidArgument(argument, str(reason), f"an expression of {', '.join(known)}") from None

    def _table_with(self, values: Mapping[str, float]) -> Table:
        return self.table | {"dimensions": self.table["dimensions"] | dict(values)}


def _read(table: Table, kind: type[Described]) -> Described:
    faults = list(_head_faults(table))
    tables = {kind: _tables(table, kind, faults) for kind in ("joint", "leg", "body")}
    unit = _units(table).get("angle", "deg")
    patterns = [_pattern(each, f"joint[{index}]", unit, faults) for index, each in enumerate(tables["joint"])]
    legs = [_leg(each, f"leg[{index}]", unit, faults) for index, each in enumerate(tables["leg"])]
    shapes = [_shape(each, f"body[{index}]", faults) for index, each in enumerate(tables["body"])]
    masses = [_mass(each) for each in tables["body"]]
    in_legs = sum(map(count_joints, legs))
    count = in_legs + sum(pattern.count or 1 for pattern in patterns)
    if in_legs > MOST_JOINTS:
        legs = []
        faults.append(Fault("leg", f"legs with {in_legs} joints", f"at most {MOST_JOINTS}"))
    elif count > MOST_JOINTS:
        faults.append(Fault("joint", f"{count} joints with their copies", f"at most {MOST_JOINTS}"))
    head = {"name": None, "end_effector": None} | {key: table[key] for key in DESCRIBED if key in table}
    head |= {f"{key}_unit": value for key, value in _units(table).items() if key in UNIT_KEYS}
    return expanded(kind, head, (patterns, legs, shapes, masses), faults)


def _head_faults(table: Table) -> Iterator[Fault]:
    yield from key_faults("", table, HEAD_KEYS, lambda key: near_miss(key, HEAD_KEYS))
    if type(table.get("schema")) is not int or table["schema"] != 1:
        yield Fault("schema", shown(table.get("schema")), "1")
    if isinstance(table.get("units", {}), dict):
        yield from _unknown_keys("units", _units(table), UNIT_KEYS)
    else:
        yield Fault("units", shown(table["units"]), f"a table: {', '.join(UNIT_KEYS)}")


def _unknown_keys(place: str, table: Table, known: Sequence[str]) -> Iterator[Fault]:
    """Faults of keys; a key of the file's head was probably meant for it, but TOML adds it to the last table."""

    def hint(key: str) -> str:
        of_the_file = key in HEAD_KEYS
        return " here: it is one of the file, above its first table" if of_the_file else near_miss(key, known)

    return key_faults(place, table, known, hint)


def _units(table: Table) -> Table:
    return table["units"] if isinstance(table.get("units"), dict) else {}


def _tables(table: Table, kind: str, faults: list[Fault]) -> list[Table]:
    """The [[joint]], [[leg]] or [[body]] tables of a file."""
    tables = table.get(kind, [])
    if not isinstance(tables, list):
        faults.append(Fault(kind, shown(tables), f"[[{kind}]] tables"))
        return []
    if len(tables) > MOST_JOINTS:
        noun = "joints" if kind == "joint" else f"[[{kind}]] tables"
        raise InvalidMechanism([*faults, Fault(kind, f"{len(tables)} {noun}", f"at most {MOST_JOINTS}")])
    others = [(index, each) for index, each in enumerate(tables) if not isinstance(each, dict)]
    faults += [Fault(f"{kind}[{index}]", shown(each), f"a [[{kind}]] table") for index, each in others]
    return [each if isinstance(each, dict) else {} for each in tables]


def _pattern(table: Table, place: str, angle_unit: str, faults: list[Fault]) -> Pattern:
    """The joint that a table describes, with its copies, as far as it can be read."""
    faults += _unknown_keys(place, table, (*_JOINT_FIELDS, "copies"))
    values: dict[str, Any] = {"name": None, "type": None, "connects": None}
    given = {key: table[key] for key in _JOINT_FIELDS if key in table}
    kind, actuated = given.get("type"), given.get("actuated", False)
    values |= {key: in_radians(key, value, kind, actuated, angle_unit) for key, value in given.items()}
    if "cone" in values:
        values["cone"] = _cone(values["cone"], f"{place}.cone", angle_unit, faults)
    joint = Joint(**values)
    copies = read_copies(f"{place}.copies", table["copies"], faults) if "copies" in table else None
    return Pattern(joint, *(copies or ()))


def _cone(table: Any, place: str, angle_unit: str, faults: list[Fault]) -> Cone | None:
    if not isinstance(table, dict):
        faults.append(Fault(place, shown(table), f"a table: {', '.join(CONE_KEYS)}"))
        return None
    faults += _unknown_keys(place, table, CONE_KEYS)
    half_angle = angle_in_radians(table.get("half_angle"), angle_unit)
    return Cone(cast(Any, table.get("axis")), half_angle, cast(Any, table.get("fixed_to")))


def _mass(table: Table) -> Mass | None:
    """The mass that a table describes, as far as it can be read; None if it says nothing of one."""
    values = {key: table[key] for key in MASS_KEYS if key in table}
    return Mass(**{"body": table.get("name"), "mass": None, **values}) if values else None


def _shape(table: Table, place: str, faults: list[Fault]) -> Shape | None:
    """The shape that a table describes, as far as it can be read; None if it only has a mass."""
    faults += _unknown_keys(place, table, (*SHAPE_KEYS, *MASS_KEYS))
    if set(table).intersection(MASS_KEYS) and not set(table).intersection(SHAPE_KEYS[1:]):
        return None
    values = {key: table[key] for key in SHAPE_KEYS[2:] if key in table}
    return Shape(cast(Any, table.get("name")), table.get("shape", "capsule"), **values)


def _leg(table: Table, place: str, angle_unit: str, faults: list[Fault]) -> Leg:
    """The legs that a table describes, as far as it can be read."""
    letters = sorted(key for key in table if re.fullmatch("[A-Z]{1,2}", key))
    steps = {step.letter: step for step in read_chain(table.get("chain"))}
    leg_fields = {key: value for key, value in table.items() if key not in letters}
    alternative = ", or the letter of one of its joints, or the two of a body: A, B, AB, ..."
    faults += key_faults(place, leg_fields, LEG_KEYS, lambda key: _leg_hint(key, list(steps) or ["A"]), alternative)
    by_letter = {letter: _joint_fields(table[letter], steps.get(letter), angle_unit) for letter in letters}
    values = {"chain": None} | {key: leg_fields[key] for key in LEG_KEYS if key in leg_fields}
    return Leg(by_letter=by_letter, **values)


def _leg_hint(key: str, letters: Sequence[str]) -> str:
    """A hint for an unknown key of a leg: a joint, a key of a joint, of the file's head, or of a leg."""
    if key.upper() in letters:
        return f"; did you mean '{key.upper()}'?"
    if key in BODY_KEYS:
        meant = " or ".join(f"'{a}{b}.{key}'" for a, b in pairwise(letters)) or "a table [[body]]"
        return f"; did you mean {meant}?"
    if key in JOINT_KEYS:
        meant = " or ".join(f"'{letter}.{key}'" for letter in letters)
        return f"; did you mean {meant}?"
    of_the_file = key in HEAD_KEYS
    return " here: it is one of the file, above its first table" if of_the_file else near_miss(key, LEG_KEYS)


def _joint_fields(table: Any, step: ChainJoint | None, angle_unit: str) -> Any:
    """The table of one joint of a leg, with angles in radians; anything but a table as it is."""
    if not isinstance(table, dict):
        return table
    kind, actuated = (step.type, table.get("actuated", step.actuated)) if step is not None else (None, False)
    fields = {}
    for key, value in table.items():
        listed = kind is not None and key in ("home", "range") and is_listed(key, kind, value)
        each = [in_radians(key, item, kind, actuated, angle_unit) for item in (value if listed else [value])]
        fields[key] = each if listed else each[0]
    cone = fields.get("cone")
    if isinstance(cone, dict) and "half_angle" in cone:
        fields["cone"] = cone | {"half_angle": angle_in_radians(cone["half_angle"], angle_unit)}
    return fields
