"""Mechanism files: TOML text to a mechanism and back, with every fault of a file reported in one go."""

from __future__ import annotations

import os
import secrets
import shutil
import tomllib
import warnings
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, cast

from ..catalog import catalog, catalog_file
from ..description.coercion import unit_vector
from ..description.copies import Copy, Layout, Pattern, count_of
from ..description.faults import in_order, joint_index, merged
from ..description.form_faults import direction_faults, joint_faults, shown
from ..description.leg_joints import LegJoint, at_legs, count_joints, placed_joints
from ..description.legs import Leg
from ..description.mechanism import Cone, Joint, Mechanism, checked_mechanism
from ..errors import Fault, InvalidArgument, InvalidMechanism, UnknownName
from .leg_tables import read_leg
from .schema import MOST_JOINTS, HeadTable, JointTable, read_table
from .units import in_radians
from .writing import dumps

__all__ = ["LARGEST_FILE", "dumps", "load", "loads", "save"]

LARGEST_FILE = 1_000_000
"""Largest file read [bytes]: a hundred times any machine, and quickly refused when it is something else."""

MOST_DOTS = 200
"""Most dots in one line: no line needs more than a few, and a key of many parts takes the parser quadratic time."""


def load(source: str | os.PathLike[str]) -> Mechanism:
    """The mechanism of a file.

    Parameters
    ----------
    source : a catalogue name (a text equal to one of `catalog()`), or the path of a mechanism file.

    Raises
    ------
    UnknownName : neither a file nor a catalogue name.
    InvalidMechanism : the file does not describe a mechanism; carries every fault found.
    """
    if isinstance(source, str) and source in catalog():
        return loads(catalog_file(source).read_text(encoding="utf-8"), source)
    if not isinstance(source, str | os.PathLike):
        raise InvalidArgument("source", shown(source), "a path or a catalogue name")
    path = Path(source)
    if not os.path.exists(path):  # unlike Path.exists, it also answers for paths that no system could have
        raise UnknownName("mechanism file or catalogue name", str(path), catalog())
    try:
        return loads(_text(path), str(path))
    except InvalidMechanism as error:
        raise InvalidMechanism(error.faults, str(path)) from None


def loads(text: str, source: str | None = None) -> Mechanism:
    """The mechanism that a text in the format of a mechanism file describes.

    Parameters
    ----------
    source : what to call the text in an error, usually the name of its file.

    Raises
    ------
    InvalidMechanism : the text does not describe a mechanism; carries every fault found.
    """
    if not isinstance(text, str):
        raise InvalidArgument("text", shown(text), "the text of a mechanism file")
    try:
        return _mechanism(_parsed(text))
    except InvalidMechanism as error:
        raise InvalidMechanism(error.faults, source) from None


def save(mechanism: Mechanism, path: str | os.PathLike[str]) -> None:
    """Write a mechanism to a file that `load` turns into an equal one.

    The file is replaced as a whole or not at all. Copies and shorthands of a file it came from are not kept.
    """
    checked_mechanism(mechanism)
    target = Path(path).resolve()
    draft = target.with_name(f".{secrets.token_hex(8)}.tmp")
    try:
        draft.write_bytes(dumps(mechanism).encode())
        if target.exists():
            shutil.copymode(target, draft)
        os.replace(draft, target)
    except OSError as error:
        if error.errno is None:
            raise
        raise OSError(error.errno, error.strerror, os.fspath(path)) from error  # the name that the caller knows
    finally:
        with suppress(OSError):
            draft.unlink()


def _text(path: Path) -> str:
    """The text of a file that could be a mechanism file; a fault when it cannot be one."""
    if not path.is_file():
        raise _unusable("a directory or device", "a mechanism file")
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
        _refuse_large(content)
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise _unusable(f"no UTF-8 text at byte {error.start}", "a text file in UTF-8") from None
    except OSError as error:
        raise _unusable(f"a file that cannot be read ({error.strerror})", "a readable file") from None


def _parsed(text: str) -> dict[str, Any]:
    _refuse_large(text)
    try:
        if max(line.count(".") for line in text.split("\n") if not line.startswith("#")) > MOST_DOTS:
            raise RecursionError
        return tomllib.loads(text)
    except RecursionError:
        raise _unusable("values nested too deeply", "tables and lists a few levels deep") from None
    except ValueError as error:  # a syntax error with its line and column, or a number of too many digits
        raise _unusable(f"no TOML: {error}", "TOML") from None


def _refuse_large(content: str | bytes) -> None:
    if len(content) > LARGEST_FILE:
        raise _unusable(f"more than {LARGEST_FILE} bytes", f"at most {LARGEST_FILE}")


def _unusable(found: str, expected: str) -> InvalidMechanism:
    return InvalidMechanism([Fault("file", found, expected)])


def _mechanism(table: dict[str, Any]) -> Mechanism:
    """The mechanism of a parsed file. Faults of single tables are found first, then those of the whole."""
    head, faults = read_table(HeadTable, table, "")
    for kind, tables in (("joint", head.joint), ("leg", head.leg)):
        if len(tables) > MOST_JOINTS:
            noun = "joints" if kind == "joint" else "[[leg]] tables"
            raise InvalidMechanism([*faults, Fault(kind, f"{len(tables)} {noun}", f"at most {MOST_JOINTS}")])
    patterns, legs = [], []
    for index, joint in enumerate(head.joint):
        pattern, found = _pattern(joint, f"joint[{index}]", head.units.angle)
        patterns.append(pattern)
        faults += found
    for index, leg in enumerate(head.leg):
        read, found = read_leg(leg, f"leg[{index}]", head.units.angle)
        legs.append(read)
        faults += found
    return _expanded(head, patterns, legs, faults)


def _pattern(table: Any, place: str, angle_unit: str) -> tuple[Pattern, list[Fault]]:
    """The joint that a table describes, as far as it can be read, and the faults of the table."""
    if not isinstance(table, dict):
        return Pattern(_joint(JointTable.model_validate({}), angle_unit)), [
            Fault(place, shown(table), "a [[joint]] table")
        ]
    read, faults = read_table(JointTable, table, place)
    joint = _joint(read, angle_unit)
    if read.copies is None:
        return Pattern(joint), faults
    axis = unit_vector(read.copies.axis)
    misdirected = list(direction_faults(f"{place}.copies.axis", axis))
    if misdirected:
        return Pattern(joint), faults + misdirected
    return Pattern(joint, read.copies.count, axis), faults


def _joint(read: JointTable, angle_unit: str) -> Joint:
    values: dict[str, Any] = {name: getattr(read, name) for name in JointTable.model_fields if name != "copies"}
    for name in ("home", "range"):
        values[name] = in_radians(values[name], read.type, angle_unit)
    if read.cone is not None:
        half_angle = in_radians(read.cone.half_angle, "revolute", angle_unit)
        values["cone"] = Cone(cast(Any, read.cone.axis), half_angle, cast(Any, read.cone.fixed_to))
    return Joint(**values)


def _expanded(head: HeadTable, patterns: Sequence[Pattern], legs: Sequence[Leg], faults: list[Fault]) -> Mechanism:
    """The mechanism of all copies and legs. When it is not clear what is copied, or where legs are, only the joints'
    own faults are looked for."""
    unclear = head.end_effector is None or any(map(_hides_joints, faults))
    placed, found = _placed(head, patterns, legs)
    faults = merged(faults, found)
    joints = [*patterns, *(Pattern(each.joint) for each in placed)]
    layout = Layout(tuple(joints), head.base, cast(str, head.end_effector))
    if not unclear and not found:
        misfits = at_legs(list(_misfits(layout)), len(patterns), placed)
        unclear, faults = bool(misfits), [*faults, *misfits]
    if unclear or found:
        alone = [fault for index, each in enumerate(joints) for fault in joint_faults(f"joint[{index}]", each.joint)]
        raise InvalidMechanism(merged(faults, [*_missing(head), *at_legs(alone, len(patterns), placed)]))
    return _built(head, layout, placed, faults)


def _placed(head: HeadTable, patterns: Sequence[Pattern], legs: Sequence[Leg]) -> tuple[list[LegJoint], list[Fault]]:
    """The joints of all legs, and the faults of what they are made from."""
    count = sum(map(count_joints, legs))
    if count > MOST_JOINTS:
        return [], [Fault("leg", f"legs with {count} joints", f"at most {MOST_JOINTS}")]
    return placed_joints(legs, head.base, head.end_effector or "platform", [each.joint.name for each in patterns])


def _misfits(layout: Layout) -> Iterator[Fault]:
    count = count_of(layout.patterns)
    if count > MOST_JOINTS:
        yield Fault("joint", f"{count} joints with their copies", f"at most {MOST_JOINTS}")
    else:
        yield from layout.faults()


def _hides_joints(fault: Fault) -> bool:
    """Whether a fault leaves open which joints and bodies there are, or what their numbers mean."""
    root, _, field = fault.place.partition(".")
    if root.startswith("leg["):
        return field.partition(".")[0] in ("", "chain", "name", "connects", "copies")
    return root in ("base", "end_effector", "units", "joint", "leg") or ".copies" in fault.place


def _missing(head: HeadTable) -> Iterator[Fault]:
    if head.name is None:
        yield Fault("name", "nothing", "a text that is not empty")
    if head.end_effector is None:
        yield Fault("end_effector", "nothing", "a text that is not empty")


def _built(head: HeadTable, layout: Layout, placed: Sequence[LegJoint], faults: list[Fault]) -> Mechanism:
    copies = layout.expanded()
    try:
        with warnings.catch_warnings():
            if faults:
                warnings.simplefilter("ignore")
            mechanism = Mechanism(
                name=cast(str, head.name),
                joints=tuple(copy.joint for copy in copies),
                end_effector=layout.end_effector,
                reference_point=cast(Any, head.reference_point),
                base=head.base,
                length_unit=head.units.length,
                angle_unit=head.units.angle,
                task=cast(Any, head.task),
            )
    except InvalidMechanism as error:
        own = len(layout.patterns) - len(placed)
        faults = merged(faults, at_legs(_as_written(error.faults, layout, copies), own, placed))
    if faults:
        raise InvalidMechanism(in_order(faults))
    return mechanism


def _as_written(faults: Sequence[Fault], layout: Layout, copies: Sequence[Copy]) -> list[Fault]:
    """The faults of expanded joints at the places of their file, each place reported from one copy only."""
    written: list[Fault] = []
    reporter: dict[str, int] = {}
    for fault in faults:
        if joint_index(fault.place) < 0:
            written.append(fault)
            continue
        copy = copies[joint_index(fault.place)]
        place = f"joint[{copy.index}]{fault.place.partition(']')[2]}"
        if reporter.setdefault(place, copy.number) == copy.number:
            written.append(Fault(place, layout.as_written(fault.found, copy), layout.as_written(fault.expected, copy)))
    return written
