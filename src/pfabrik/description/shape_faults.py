"""Faults of shapes: of single ones, and of the bodies and joints that they name."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any, cast

from ..errors import Fault, near_miss
from ..meshes import UnusableMesh, hull_of
from ..tolerances import TOLERANCES
from .body_shapes import SHAPE_FIELDS, SHAPE_KINDS, Shape
from .form_faults import direction_faults, is_pair_of_names, number_faults, shown
from .graph import PASSED_THROUGH
from .joints import Joint
from .structure import Structure

MOST_SHAPES = 300
"""Most shapes of one mechanism, copies included: all pairs of them are checked at home, in about a second."""

BETWEEN = "the names of two of its joints, or `ends`, two points"


def form_of_shapes(shapes: Any) -> Iterator[Fault]:
    """Faults of shapes by themselves."""
    if not isinstance(shapes, tuple) or not all(isinstance(shape, Shape) for shape in shapes):
        yield Fault("body", shown(shapes), "a list of Shape")
        return
    if len(shapes) > MOST_SHAPES:
        yield Fault("body", f"{len(shapes)} shapes, with copies and links of legs", f"at most {MOST_SHAPES}")
        return
    for index, shape in enumerate(shapes):
        yield from _form_faults(f"body[{index}]", shape)


def form_of_clearance(clearance: Any) -> Iterator[Fault]:
    """Faults of a clearance by itself."""
    faults = [] if clearance is None else list(number_faults("clearance", clearance, 1))
    yield from faults
    if clearance is not None and not faults and clearance < 0.0:
        yield Fault("clearance", shown(clearance), "0 or more")


def _form_faults(place: str, shape: Shape) -> Iterator[Fault]:
    if not isinstance(cast(Any, shape.body), str):
        yield Fault(f"{place}.name", shown(shape.body), "the name of a body")
    if shape.kind not in SHAPE_KINDS:
        hint = near_miss(shape.kind, SHAPE_KINDS) if isinstance(shape.kind, str) else ""
        yield Fault(f"{place}.shape", f"{shown(shape.kind)}{hint}", f"one of {', '.join(SHAPE_KINDS)}")
        return
    needed, optional = SHAPE_FIELDS[shape.kind]
    found: list[Fault] = []
    for field in _FIELDS:
        value, where = getattr(shape, field), f"{place}.{field}"
        if value is None and field in needed:
            found.append(Fault(where, "nothing", f"{_WORDS[field]}, for a {shape.kind}"))
        elif value is not None and field not in needed + optional:
            found.append(Fault(where, shown(value), f"nothing: a {shape.kind} has no {field}"))
        elif value is not None:
            found += _value_faults(where, field, value)
    yield from found
    if not found and shape.kind == "mesh":
        yield from _mesh_faults(f"{place}.file", shape)
    if shape.between is not None and shape.ends is not None:
        yield Fault(f"{place}.ends", "both `between` and `ends`", "one of them")


_FIELDS = tuple(field.name for field in dataclasses.fields(Shape))[2:]
_WORDS = {
    "thickness": "a number",
    "diameter": "a number",
    "at": "three numbers, its centre",
    "size": "three numbers, the lengths of its edges",
    "axis": "three numbers, the direction of its axis",
    "file": "the path of a mesh file",
}


def _value_faults(place: str, field: str, value: Any) -> Iterator[Fault]:
    if field in ("thickness", "diameter", "size", "scale"):
        count = 3 if field == "size" else 1
        faults = list(number_faults(place, value, count))
        yield from faults
        if not faults and min(value if count > 1 else (value,)) <= 0.0:
            yield Fault(place, shown(value), "more than 0")
    elif field == "at":
        yield from number_faults(place, value, 3)
    elif field == "axis":
        yield from direction_faults(place, value)
    elif field == "file":
        if not isinstance(value, str) or not value or "\0" in value:
            yield Fault(place, shown(value), _WORDS["file"])
    elif field == "between":
        if not is_pair_of_names(value) or value[0] == value[1]:
            yield Fault(place, shown(value), "the names of two joints")
    elif not isinstance(value, tuple) or len(value) != 2:
        yield Fault(place, shown(value), "two points" if field == "ends" else "two directions")
    else:
        check = number_faults if field == "ends" else _edge_faults
        faults = [fault for k, part in enumerate(value) for fault in check(f"{place}[{k}]", part, 3)]
        yield from faults
        if field == "axes" and not faults and abs(sum(a * b for a, b in zip(*value, strict=True))) > SQUARE:
            yield Fault(place, shown(value), "two directions square to each other")


SQUARE = TOLERANCES.rotation_matrix
"""Cosine of the angle between the axes of a box up to which they count as square, as the rows of a rotation do."""


def _edge_faults(place: str, value: Any, _: int) -> Iterator[Fault]:
    yield from direction_faults(place, value)


def _mesh_faults(place: str, shape: Shape) -> Iterator[Fault]:
    try:
        hull_of(cast(str, shape.file))
    except UnusableMesh as error:
        yield Fault(place, error.found, error.expected)


def shape_faults(mechanism: Structure) -> Iterator[Fault]:
    """Faults of what shapes and `ignore` name, in a mechanism of which all else is sound."""
    for index, shape in enumerate(mechanism.shapes):
        place = f"body[{index}]"
        if shape.body not in mechanism.bodies:
            found = f"'{shape.body}': no such body{near_miss(shape.body, mechanism.bodies)}"
            yield Fault(f"{place}.name", found, "a body that a joint connects")
        elif shape.between is not None:
            yield from _between_faults(f"{place}.between", shape, mechanism)
        elif shape.kind == "capsule" and shape.ends is None:
            joints = joints_with_centre(mechanism, shape.body)
            if len(joints) != 2:
                found = f"nothing, and '{shape.body}' has {len(joints)} joints with a centre"
                yield Fault(f"{place}.between", found, BETWEEN)
    yield from _ignore_faults(mechanism)


def _between_faults(place: str, shape: Shape, mechanism: Structure) -> Iterator[Fault]:
    names = [joint.name for joint in mechanism.joints]
    bodies = sliding_along(mechanism, shape.body)
    for name in shape.between or ():
        if name not in names:
            yield Fault(place, f"'{name}': no such joint{near_miss(name, names)}", "the names of two joints")
            continue
        joint = mechanism.joint(name)
        if joint.at is None:
            yield Fault(place, f"'{name}', a joint without a centre", "joints with a centre")
        elif not bodies.intersection(joint.connects):
            expected = f"joints of '{shape.body}', or of a body that slides along it"
            yield Fault(place, f"'{name}', between {_quoted(joint.connects)}", expected)


def _ignore_faults(mechanism: Structure) -> Iterator[Fault]:
    ignore: Any = mechanism.ignore
    if not isinstance(ignore, tuple):
        yield Fault("ignore", shown(ignore), "pairs of bodies that may touch")
        return
    for pair in ignore:
        if not is_pair_of_names(pair):
            yield Fault("ignore", shown(pair), "the names of two bodies that may touch")
            continue
        for name in pair:
            if name not in mechanism.bodies:
                found = f"'{name}': no such body{near_miss(name, mechanism.bodies)}"
                yield Fault("ignore", found, "the names of two bodies that may touch")


def joints_with_centre(mechanism: Structure, body: str) -> list[Joint]:
    """The joints of a body that have a centre."""
    return [joint for joint in mechanism.joints if body in joint.connects and joint.at is not None]


def sliding_along(mechanism: Structure, body: str) -> set[str]:
    """A body, and those that prismatic or fixed joints connect with it, the base left out."""
    found, grown = {body}, True
    while grown:
        passed = (joint for joint in mechanism.joints if joint.type in PASSED_THROUGH and joint.at is None)
        around = {each for joint in passed if found.intersection(joint.connects) for each in joint.connects}
        grown = not around - {mechanism.base} <= found
        found |= around - {mechanism.base}
    return found


def _quoted(names: Sequence[str]) -> str:
    return " and ".join(f"'{name}'" for name in names)
