"""A mechanism as the text of a mechanism file, laid out for people to read."""

from __future__ import annotations

import dataclasses
import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from ..description.mechanism import Joint, Mass, Mechanism, Shape
from .reading import with_paths
from .units import IN_SI, MEASURED, converted, exact_degrees, measured

TABLES = ("joint", "leg", "body")
"""Keys of a file that are lists of tables, in their order."""


def dumps(mechanism: Mechanism, folder: Path | None = None) -> str:
    """The text of a mechanism file that describes this mechanism, joint by joint, exactly.

    A machine that was read from a file with dimensions is written as that file has it, with its dimensions,
    expressions, copies and legs. Angles of others are written in degrees if that is the mechanism's unit and every
    angle has exact degrees, else in radians. Paths of meshes are relative to a folder, or whole without one.
    """
    source = mechanism.__dict__.get("_source")
    if source is not None:
        return _as_read(with_paths(source.table, lambda file: _path_from(file, folder)))
    degrees = mechanism.angle_unit == "deg" and all(exact_degrees(angle) is not None for angle in _angles(mechanism))
    convert = _degrees if degrees else float
    tables = ["\n".join(_head(mechanism, "deg" if degrees else "rad"))]
    tables += ["\n".join(["[[joint]]", *_joint(joint, convert)]) for joint in mechanism.joints]
    tables += ["\n".join(["[[body]]", *_shape(shape, folder)]) for shape in mechanism.shapes]
    tables += ["\n".join(["[[body]]", *_mass(mass)]) for mass in mechanism.masses]
    return "\n\n".join(tables) + "\n"


def _mass(mass: Mass) -> Iterator[str]:
    yield f"name = {_value(mass.body)}"
    for field in dataclasses.fields(mass)[1:]:
        if (value := getattr(mass, field.name)) is not None:
            yield f"{field.name} = {_value(value)}"


def _shape(shape: Shape, folder: Path | None) -> Iterator[str]:
    yield f"name = {_value(shape.body)}"
    yield f"shape = {_value(shape.kind)}"
    for field in dataclasses.fields(shape)[2:]:
        value = getattr(shape, field.name)
        if value is not None:
            yield f"{field.name} = {_value(_path_from(value, folder) if field.name == 'file' else value)}"


def _path_from(file: str, folder: Path | None) -> str:
    """The path of a file from a folder, or as it is without one, or where there is no way from there."""
    try:
        return file if folder is None else Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:  # on another drive
        return file


def _as_read(table: dict[str, Any]) -> str:
    """The text of a parsed file."""
    head = [f"{key} = {_value(item)}" for key, item in table.items() if key not in ("dimensions", *TABLES)]
    parts = ["\n".join(head)]
    parts.append("\n".join(["[dimensions]", *_lines(table["dimensions"])]))
    parts += ["\n".join([f"[[{kind}]]", *_lines(each)]) for kind in TABLES for each in table.get(kind, [])]
    return "\n\n".join(parts) + "\n"


def _lines(table: dict[str, Any]) -> Iterator[str]:
    for key, item in table.items():
        yield f"{key} = {_value(item)}"


def _head(mechanism: Mechanism, angle_unit: str) -> Iterator[str]:
    yield "schema = 1"
    yield f"name = {_value(mechanism.name)}"
    yield f"units = {_value({'length': mechanism.length_unit, 'angle': angle_unit})}"
    yield f"base = {_value(mechanism.base)}"
    yield f"end_effector = {_value(mechanism.end_effector)}"
    if not mechanism.end_effector_is_joint:
        yield f"reference_point = {_value(mechanism.reference_point)}"
    if mechanism.task != mechanism.whole_task:
        yield f"task = {_value(mechanism.task)}"
    if mechanism.ignore:
        yield f"ignore = {_value(mechanism.ignore)}"
    if mechanism.clearance is not None:
        yield f"clearance = {_value(mechanism.clearance)}"


def _joint(joint: Joint, convert: Callable[[float], float]) -> Iterator[str]:
    for field in ("name", "type", "actuated", "connects", "at", "axis", "axes", "along", *MEASURED, *IN_SI):
        value = getattr(joint, field)
        if field in MEASURED:
            value = converted(value, measured(field, joint.type, joint.actuated), convert)
        left_out = value is None or value is False or (field == "home" and value in (0.0, (0.0, 0.0)))
        if not left_out:
            yield f"{field} = {_value(value)}"
    if joint.cone is not None:
        cone = joint.cone
        yield f"cone = {_value({'axis': cone.axis, 'half_angle': convert(cone.half_angle), 'fixed_to': cone.fixed_to})}"


def _angles(mechanism: Mechanism) -> Iterator[float]:
    """Every angle of the description [rad]."""
    angles: list[float] = []

    def note(angle: float) -> float:
        angles.append(angle)
        return angle

    for joint in mechanism.joints:
        for field in MEASURED:
            converted(getattr(joint, field), measured(field, joint.type, joint.actuated), note)
        yield from angles
        angles.clear()
        if joint.cone is not None:
            yield joint.cone.half_angle


def _degrees(angle: float) -> float:
    degrees = exact_degrees(angle)
    assert degrees is not None
    return degrees


def _value(value: Any) -> str:
    """A value in TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float | int):
        return repr(value + 0)  # no -0
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{key} = {_value(item)}' for key, item in value.items())} }}"
    return f'"{_ESCAPED.sub(_escape, value)}"'


_ESCAPED = re.compile(r'[\\"\x00-\x1f\x7f]')


def _escape(match: re.Match[str]) -> str:
    return f"\\u{ord(match[0]):04x}" if match[0] not in '\\"' else f"\\{match[0]}"
