"""Faults of shapes: of single ones, and of the bodies and joints that they name."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

from ..errors import Fault, near_miss
from ..meshes import UnusableMesh, hull_of
from ..tolerances import TOLERANCES
from .body_shapes import SHAPE_FIELDS, SHAPE_KINDS, Shape
from .form_faults import choice_faults, direction_faults, is_pair_of_names, number_faults, shown
from .graph import joints_with_centre, sliding_along
from .rules import Rule, each_of, faults_by, form, is_pair, wrong
from .structure import Structure

MOST_SHAPES = 300
"""Most shapes of one mechanism, copies included: all pairs of them are checked at home, in about a second."""

SQUARE = TOLERANCES.rotation_matrix
"""Cosine of the angle between the axes of a box up to which they count as square, as the rows of a rotation do."""

_FIELDS = tuple(field.name for field in dataclasses.fields(Shape))[2:]
_WORDS = {
    "thickness": "a number",
    "diameter": "a number",
    "at": "three numbers, its centre",
    "size": "three numbers, the lengths of its edges",
    "axis": "three numbers, the direction of its axis",
    "file": "the path of a mesh file",
}


def _field_rules(field: str) -> Iterator[Rule]:
    """Each kind of shape needs some fields, and may have others beside."""
    if field in _WORDS:
        yield wrong(
            field, lambda v, s, needed, known: v is None and field in needed, f"{_WORDS[field]}, for a {{0.kind}}"
        )
    yield wrong(f"{field}?", lambda v, s, needed, known: field not in known, f"nothing: a {{0.kind}} has no {field}")


def _mesh_faults(place: str, shape: Shape) -> Iterator[Fault]:
    try:
        hull_of(str(shape.file))
    except UnusableMesh as error:
        yield Fault(place, error.found, error.expected)


OF_SHAPES = (
    *(rule for field in _FIELDS for rule in _field_rules(field)),
    *(form(f"{field}?", number_faults, 1) for field in ("thickness", "diameter", "scale")),
    *(wrong(f"{field}?", lambda v, *_: v <= 0.0, "more than 0") for field in ("thickness", "diameter", "scale")),
    form("size?", number_faults, 3),
    wrong("size?", lambda v, *_: min(v) <= 0.0, "more than 0"),
    form("at?", number_faults, 3),
    form("axis?", direction_faults),
    wrong("file?", lambda v, *_: not isinstance(v, str) or not v or "\0" in v, _WORDS["file"]),
    wrong("between?", lambda v, *_: not is_pair_of_names(v) or v[0] == v[1], "the names of two joints"),
    wrong("ends?", lambda v, *_: not is_pair(v), "two points"),
    form("ends?", each_of, number_faults, 3),
    wrong("ends?", lambda v, s, *_: s.between is not None and "both `between` and `ends`", "one of them"),
    wrong("axes?", lambda v, *_: not is_pair(v), "two directions"),
    form("axes?", each_of, direction_faults),
    wrong("axes?", lambda v, *_: abs(sum(a * b for a, b in zip(*v, strict=True))) > SQUARE,
          "two directions square to each other"),
)  # fmt: skip
"""Of a shape, of the fields that its kind needs, and of those that it may have."""


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


def _form_faults(place: str, shape: Shape) -> Iterator[Fault]:
    body: Any = shape.body
    if not isinstance(body, str):
        yield Fault(f"{place}.name", shown(body), "the name of a body")
    unknown = list(choice_faults(f"{place}.shape", shape.kind, SHAPE_KINDS))
    yield from unknown
    if not unknown:
        needed, optional = SHAPE_FIELDS[shape.kind]
        faults = faults_by(OF_SHAPES, place, shape, needed, needed + optional)
        yield from faults or (_mesh_faults(f"{place}.file", shape) if shape.kind == "mesh" else ())


def form_of_clearance(clearance: Any) -> Iterator[Fault]:
    """Faults of a clearance by itself."""
    faults = [] if clearance is None else list(number_faults("clearance", clearance, 1))
    yield from faults
    if clearance is not None and not faults and clearance < 0.0:
        yield Fault("clearance", shown(clearance), "0 or more")


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
                yield Fault(f"{place}.between", found, "the names of two of its joints, or `ends`, two points")
    yield from _ignore_faults(mechanism)


def _between_faults(place: str, shape: Shape, mechanism: Structure) -> Iterator[Fault]:
    joints = {joint.name: joint for joint in mechanism.joints}
    bodies = sliding_along(mechanism, shape.body)
    for name in shape.between or ():
        if name not in joints:
            yield Fault(place, f"'{name}': no such joint{near_miss(name, joints)}", "the names of two joints")
        elif joints[name].at is None:
            yield Fault(place, f"'{name}', a joint without a centre", "joints with a centre")
        elif not bodies.intersection(joints[name].connects):
            between = " and ".join(f"'{body}'" for body in joints[name].connects)
            yield Fault(
                place, f"'{name}', between {between}", f"joints of '{shape.body}', or of a body that slides along it"
            )


def _ignore_faults(mechanism: Structure) -> Iterator[Fault]:
    ignore: Any = mechanism.ignore
    if not isinstance(ignore, tuple):
        yield Fault("ignore", shown(ignore), "pairs of bodies that may touch")
        return
    for pair in ignore:
        strangers = [name for name in pair if name not in mechanism.bodies] if is_pair_of_names(pair) else [None]
        for name in strangers:
            found = shown(pair) if name is None else f"'{name}': no such body{near_miss(name, mechanism.bodies)}"
            yield Fault("ignore", found, "the names of two bodies that may touch")
