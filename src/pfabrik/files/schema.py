"""The tables of a mechanism file: which keys there are and what each holds. Only types are checked here."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ..description.form_faults import shown
from ..errors import Fault, near_miss

MOST_COPIES = 100
"""Most copies of one joint: a typing error beyond it, and a file of one line must not ask for a million joints."""

MOST_JOINTS = 1000
"""Most joints of one mechanism, copies included: far above any machine, low enough to be checked in seconds."""

MOST_FAULTS = 50
"""Most faults of one table that are listed one by one: nobody reads on, and a hostile file may have 100 000."""


class Table(BaseModel):
    """A TOML table: no unknown keys, and no value taken for another type."""

    model_config = ConfigDict(strict=True, extra="forbid")

    others: ClassVar[str] = ""
    """What a table may hold beside its keys, for faults."""


Three = Annotated[list[float], Field(min_length=3, max_length=3)]
Two = Annotated[list[float], Field(min_length=2, max_length=2)]
TwoNames = Annotated[list[str], Field(min_length=2, max_length=2)]


class ConeTable(Table):
    """`cone = { axis, half_angle, fixed_to }`."""

    axis: Three | None = Field(None, description="three numbers")
    half_angle: float | None = Field(None, description="a number")
    fixed_to: str | None = Field(None, description="the name of a body")


class CopiesTable(Table):
    """`copies = { count, axis }`."""

    count: int = Field(ge=1, le=MOST_COPIES, description=f"a whole number from 1 to {MOST_COPIES}")
    axis: Three = Field(description="three numbers")


class UnitsTable(Table):
    """`units = { length, angle }`."""

    length: str = Field("mm", description="the name of a unit")
    angle: Literal["deg", "rad"] = Field("deg", description="'deg' or 'rad'")


class JointTable(Table):
    """`[[joint]]`. What a joint of its type lacks is found with the mechanism's other faults."""

    name: str | None = Field(None, description="a text")
    type: str | None = Field(None, description="the name of a joint type")
    connects: TwoNames | None = Field(None, description="the names of two bodies")
    at: Three | None = Field(None, description="three numbers")
    axis: Three | None = Field(None, description="three numbers")
    axes: Annotated[list[Three], Field(min_length=2, max_length=2)] | None = Field(
        None, description="two directions of three numbers each"
    )
    along: TwoNames | None = Field(None, description="the names of two joints")
    actuated: bool = Field(False, description="true or false")
    home: float | Two = Field(0.0, description="a number, or two for a joint with two coordinates")
    range: Two | Annotated[list[Two], Field(min_length=2, max_length=2)] | None = Field(
        None, description="two numbers, or two pairs of them for a joint with two coordinates"
    )
    cone: ConeTable | None = Field(None, description="a table: axis, half_angle, fixed_to")
    copies: CopiesTable | None = Field(None, description="a table: count, axis")


class LegConeTable(Table):
    """The `cone` of one joint of a leg. Directions are looked at with the points of the leg."""

    axis: Any = Field(None, description="a direction")
    half_angle: float | None = Field(None, description="a number")
    fixed_to: str | None = Field(None, description="the name of a body")


class LegJointTable(Table):
    """What a `[[leg]]` says of one joint of its chain."""

    axis: Any = Field(None, description="a direction")
    axes: Any = Field(None, description="two directions")
    home: float | Two | None = Field(None, description="a number, or two for a joint with two coordinates")
    range: Two | Annotated[list[Two], Field(min_length=2, max_length=2)] | None = Field(
        None, description="two numbers, or two pairs of them for a joint with two coordinates"
    )
    cone: LegConeTable | None = Field(None, description="a table: half_angle, axis, fixed_to")


class LegTable(Table):
    """`[[leg]]` without the tables of single joints. Its chain, points and directions are looked at together."""

    others: ClassVar[str] = ", or the letter of one of its joints: A, B, ..."

    chain: str | None = Field(None, description="joints from the base outward, such as 'U-P*-S'")
    name: str = Field("", description="a text")
    connects: TwoNames | None = Field(None, description="the names of two bodies")
    base: Any = Field(None, description="points")
    via: Any = Field(None, description="points")
    platform: Any = Field(None, description="points")
    axis: Any = Field(None, description="a direction")
    stroke: Two | None = Field(None, description="two numbers, the range of its prismatic joint")
    copies: CopiesTable | None = Field(None, description="a table: count, axis")


class HeadTable(Table):
    """All of a file but its joints and legs."""

    version: int = Field(alias="schema", ge=1, le=1, description="1")
    name: str | None = Field(None, description="a text")
    units: UnitsTable = Field(default_factory=lambda: UnitsTable.model_validate({}), description="length, angle")
    base: str = Field("base", description="the name of a body")
    end_effector: str | None = Field(None, description="the name of a body or joint")
    reference_point: Three | None = Field(None, description="three numbers")
    task: list[str] | None = Field(None, description="a list of some of x, y, z, rotation, tilt")
    joint: list[Any] = Field(default_factory=list, description="[[joint]] tables")
    leg: list[Any] = Field(default_factory=list, description="[[leg]] tables")


AnyTable = TypeVar("AnyTable", bound=Table)
_NESTED: dict[str, type[Table]] = {"cone": ConeTable, "copies": CopiesTable, "units": UnitsTable}


def read_table(model: type[AnyTable], table: dict[str, Any], place: str) -> tuple[AnyTable, list[Fault]]:
    """The table as its model, and its faults; what is faulty is left out of the model.

    Parameters
    ----------
    place : where the table is in its file, empty for the file itself.
    """
    try:
        return model.model_validate(table), []
    except ValidationError as error:
        details = error.errors(include_url=False, include_context=False, include_input=False)
    paths = dict.fromkeys(_path(table, detail["loc"]) for detail in details)
    faults = [_fault(model, table, place, path) for path in list(paths)[:MOST_FAULTS]]
    if len(paths) > MOST_FAULTS:
        faults.append(Fault(place or "file", f"{len(paths) - MOST_FAULTS} more faults", "none"))
    return model.model_validate(_DEFAULTS.get(model, {}) | _without(table, list(paths))), faults


_DEFAULTS: dict[type[Table], dict[str, Any]] = {HeadTable: {"schema": 1}}

_HEAD_KEYS = {field.alias or name for name, field in HeadTable.model_fields.items()}
"""Keys of the file itself, which TOML takes for those of the last table when they come after one."""


def _path(table: Any, location: tuple[int | str, ...]) -> tuple[str, ...]:
    """The keys that lead to a fault; not further than a value that is no table, nor than a key that is missing."""
    path: list[str] = []
    for key in location:
        if not isinstance(table, dict) or not isinstance(key, str):
            break
        path.append(key)
        table = table.get(key) if key in _NESTED else None
    return tuple(path)


def _fault(model: type[Table], table: dict[str, Any], place: str, path: tuple[str, ...]) -> Fault:
    for key in path[:-1]:
        model, table = _NESTED[key], table[key]
    expected = {field.alias or name: str(field.description) for name, field in model.model_fields.items()}
    where = ".".join([place] * bool(place) + [_shown_key(key) for key in path])
    key = path[-1]
    if key not in expected:
        known = f"one of {', '.join(expected)}{model.others}"
        of_the_file = model is not HeadTable and key in _HEAD_KEYS
        hint = " here: it is one of the file, above its first table" if of_the_file else near_miss(key, expected)
        return Fault(where, f"an unknown key{hint}", known)
    return Fault(where, shown(table.get(key)), expected[key])


def _shown_key(key: str) -> str:
    return key if re.fullmatch(r"[\w-]{1,40}", key) else shown(key)


def _without(table: Mapping[str, Any], paths: list[tuple[str, ...]]) -> dict[str, Any]:
    """The table without the keys that the paths lead to, and without the tables that lack a key of theirs."""
    dropped = {path[0] for path in paths if len(path) == 1 or path[-1] not in table[path[0]]}
    nested = {key: [path[1:] for path in paths if path[0] == key and key not in dropped] for key in table}
    dropped |= {"copies"} & {path[0] for path in paths}
    return {
        key: _without(value, nested[key]) if nested[key] else value
        for key, value in table.items()
        if key not in dropped
    }
