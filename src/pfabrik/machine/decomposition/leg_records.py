"""Legs as records, in the layout of `kernels.legs.records`."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest
from typing import Any

import numpy as np

from ...common.arrays import Records
from ...kernels.legs import records as K
from ...tolerances import TOLERANCES
from ..noted_numbers import largest
from ..noted_vectors import Vector, angle_of, area, cross, norm, sign, square_to
from .home_numbers import Fields, FilledRecords, HomeNumbers
from .leg_forms import ElementaryJoint, Ending, KeptAxis, LegForm, Pivot, RedundantJoint, Rod, keeps_from_spinning

_ENDINGS = {"weld": K.WELD, "hinge": K.HINGE, "cross": K.CROSS, "triple": K.TRIPLE, "ball": K.BALL}
_PROXIMAL = {"R": K.CRANK, "P": K.CARRIAGE}


def leg_records(home: HomeNumbers, forms: Sequence[LegForm]) -> FilledRecords:
    """A record of `LEG` for each leg."""
    fields = [_fields(home, form) | _orienting(form, after) for form, after in zip_longest(forms, forms[1:])]
    recorded = FilledRecords.of(fields, K.LEG)
    legs = recorded.records
    _put_frames(legs, forms)
    legs["first_row"] = np.cumsum(legs["n_rows"]) - legs["n_rows"]
    legs["has_rows"] = _has_rows(legs)
    return recorded


def _has_rows(legs: Records) -> list[bool]:
    """Flags `has_rows`: the leg, or a rod on the same proximal joint, contributes constraint rows.

    Rods on a proximal joint follow the one that has it. A redundant joint has rows if a leg on it has.
    """
    first_rods = np.maximum.accumulate(np.where(legs["proximal"] != K.SHARED, np.arange(len(legs)), 0))
    has_rows = [bool(np.sum(legs["n_rows"][first_rods == first_rod])) for first_rod in first_rods]
    for k in range(len(legs) - 1, -1, -1):
        for joint in (legs["redundant"][k], legs["mirror_of"][k]):
            if joint >= 0:
                has_rows[joint] |= has_rows[k]
    return has_rows


def _put_frames(legs: Records, forms: Sequence[LegForm]) -> None:
    """Number the frames of `kernels.legs.frames` and the coordinates of redundant joints."""
    numbers = {id(form): k for k, form in enumerate(forms)}
    legs["redundant"] = [-1 if form.on is None else numbers[id(form.on)] for form in forms]
    mirrored = [form.mirror_of if isinstance(form, RedundantJoint) else None for form in forms]
    legs["mirror_of"] = [-1 if mirror_of is None else numbers[id(mirror_of)] for mirror_of in mirrored]
    is_redundant = np.array([isinstance(form, RedundantJoint) for form in forms])
    is_own = is_redundant & (legs["mirror_of"] < 0)
    legs["makes"][is_redundant], legs["column"][is_own] = (
        K.FIXED + np.arange(is_redundant.sum()),
        np.arange(is_own.sum()),
    )
    legs["column"][is_redundant & ~is_own] = legs["column"][legs["mirror_of"][is_redundant & ~is_own]]
    for leg, form in zip(legs, forms, strict=True):
        is_inner = isinstance(form, RedundantJoint) and form.is_inner
        leg["inner"] = is_inner or (leg["redundant"] >= 0 and legs["inner"][leg["redundant"]])
    legs["frame"] = np.where(
        legs["redundant"] >= 0,
        legs["makes"][legs["redundant"]],
        np.where(legs["inner"], K.FROM_ITSELF, legs["reversed"]),
    )


def _orienting(form: LegForm, after: LegForm | None) -> Fields:
    """The side that a redundant joint that orients the rod after it takes at home."""
    if not (isinstance(form, RedundantJoint) and form.orients and isinstance(after, Rod)):
        return {}
    if form.element.kind != "R":
        return {}
    across = cross(form.element.axis, after.base_ending.elements[0].axis)
    return {"side": -sign(across @ (after.platform_end - form.element.point))}


def _fields(home: HomeNumbers, form: LegForm) -> Fields:
    if isinstance(form, Rod):
        return _rod_fields(home, form)
    if isinstance(form, RedundantJoint):
        return _redundant_fields(home, form)
    return _pivot_fields(home, form) if isinstance(form, Pivot) else _kept_axis_fields(form)


def _platform_point(home: HomeNumbers, point: Vector, is_reversed: bool) -> Vector:
    """A platform end at home, in the frame that `kernels.legs.frames` maps from [L]."""
    return point if is_reversed else point - home.reference_point


def _axes(ending: Ending, order: int = 1) -> list[Vector]:
    """The hinges of an ending, in their order or (-1) the reverse one."""
    return [] if ending.kind == "ball" else [element.axis for element in ending.elements[::order]]


def _pivot_fields(home: HomeNumbers, pivot: Pivot) -> Fields:
    kind = pivot.ending.kind
    centre = home.reference_point if pivot.ending.centre is None else pivot.ending.centre
    axes = _unit_vectors(home) if kind == "weld" else _axes(pivot.ending)
    slides = [element.axis for element in pivot.slides]
    fields: Fields = {
        "kind": K.PIVOT,
        "reversed": pivot.is_reversed,
        "slides": len(slides),
        "base_end": _ENDINGS[kind],
        "base_end_point": centre,
        "platform_end_point": _platform_point(home, centre, pivot.is_reversed),
        "base_end_axes": axes,
        "slide_rows": _inverse_rows(slides),
        "fixed_rows": _rows_square_to(slides) if slides else _unit_vectors(home),
    }
    if kind == "triple":
        fields |= {"side": _home_side(axes, axes[2]), "line": axes[2], "base_end_aimed": 1}
    return fields | _axis_rows(kind, axes, len(slides))


def _kept_axis_fields(form: KeptAxis) -> Fields:
    """The fields of a pivot with three slides, whose hinge is the axis."""
    axes = [form.ending.elements[0].axis]
    fields: Fields = {"kind": K.PIVOT, "base_end": K.HINGE, "slides": 3, "base_end_axes": axes}
    return fields | _axis_rows("hinge", axes, 3)


def _redundant_fields(home: HomeNumbers, form: RedundantJoint) -> Fields:
    element = form.element
    return {
        "kind": K.REDUNDANT,
        "reversed": form.is_reversed,
        "at_platform_end": form.at_platform_end,
        "proximal": _PROXIMAL[element.kind],
        "proximal_axis": element.axis,
        "proximal_point": _platform_point(home, element.point, form.is_reversed or not form.at_platform_end),
        "orients": form.orients,
        "implicit": not form.orients,
    }


def _unit_vectors(home: HomeNumbers) -> list[Vector]:
    return [Vector((1.0, 0.0, 0.0)), Vector((0.0, 1.0, 0.0)), Vector((0.0, 0.0, 1.0))]


def _inverse_rows(axes: Sequence[Vector]) -> list[Vector]:
    """Rows that give a displacement's components along independent axes: the pseudoinverse of these as columns."""
    if len(axes) == 1:
        return [axes[0] / (axes[0] @ axes[0])]
    if len(axes) == 2:
        a, b, normal = *axes, cross(*axes)
        return [cross(b, normal) / (normal @ normal), cross(normal, a) / (normal @ normal)]
    if len(axes) == 3:
        a, b, c = axes
        volume = cross(a, b) @ c
        return [cross(b, c) / volume, cross(c, a) / volume, cross(a, b) / volume]
    return []


def _rows_square_to(axes: Sequence[Vector]) -> list[Vector]:
    """Unit vectors square to one or more independent axes, and to each other."""
    if len(axes) == 1:
        return [*square_to(axes[0])]
    return [cross(*axes) / area(*axes)] if len(axes) == 2 else []


def _axis_rows(kind: str, axes: Sequence[Vector], n_slides: int) -> Fields:
    pairs = _axis_pairs(kind, axes)
    return {
        "n_rows": 3 - n_slides + len(pairs),
        "upright": {"hinge": 1, "weld": 3}.get(kind, 0),
        "kept": [kept for kept, _ in pairs],
        "moved": [moved for _, moved in pairs],
        "value": [kept @ moved for kept, moved in pairs],
    }


def _axis_pairs(kind: str, axes: Sequence[Vector]) -> list[tuple[Vector, Vector]]:
    """Pairs of directions, on base and platform, whose angle is constant."""
    if kind == "cross":
        return [(axes[0], axes[1])]
    if kind == "hinge":
        return [(across, axes[0]) for across in square_to(axes[0])]
    return [(axes[0], axes[1]), (axes[1], axes[2]), (axes[2], axes[0])] if kind == "weld" else []


def _home_side(axes: Sequence[Vector], line: Vector) -> Any:
    """The side of two crossed hinges at home; its sign as of `kernels.legs.endings.aim`."""
    return -sign(axes[0] @ cross(axes[1], line))


def _rod_fields(home: HomeNumbers, rod: Rod) -> Fields:
    length = norm(rod.platform_end - rod.base_end)
    line = (rod.platform_end - rod.base_end) / length
    twists, has_proximal = keeps_from_spinning(rod), rod.proximal is not None
    hinges = [ending.kind for ending in (rod.base_ending, rod.platform_ending)].count("hinge")
    fields: Fields = {
        "kind": K.ROD,
        "n_rows": (rod.slide is None and not has_proximal) + hinges + twists,
        "reversed": rod.is_reversed,
        "base_end_point": rod.base_end,
        "length": length,
        "line": line,
        "platform_end_point": _platform_point(home, rod.platform_end, rod.is_reversed),
        "slides": rod.slide is not None,
        "twists": twists,
        "proximal": K.SHARED if rod.is_shared else K.NO_PROXIMAL,
        "has_proximal": has_proximal,
    }
    for end, ending, order in (("base_end", rod.base_ending, 1), ("platform_end", rod.platform_ending, -1)):
        axes = _axes(ending, order)
        fields |= {end: _ENDINGS[ending.kind], f"{end}_axes": axes}
        if ending.kind == "cross":
            fields |= {
                f"{end}_side": _home_side(axes, line),
                f"{end}_aimed": twists or not _points_anywhere(axes, line),
            }
    if twists:
        fields["twist"] = _twist(rod.base_ending.elements[-1].axis, rod.platform_ending.elements[0].axis, line)
    if rod.proximal is not None:
        fields |= _proximal_fields(rod.proximal, rod.base_end, line)
    return fields


def _points_anywhere(axes: Sequence[Vector], line: Vector) -> bool:
    """True if two crossed hinges are square to each other, and the inner one to its rod."""
    return bool(largest([abs(axes[1] @ axes[0]), abs(axes[1] @ line)]) <= TOLERANCES.alignment)


def _twist(base_axis: Vector, platform_axis: Vector, line: Vector) -> Any:
    """The angle between two axes about a line."""
    cosine = base_axis @ platform_axis - (line @ base_axis) * (line @ platform_axis)
    return angle_of(line @ cross(base_axis, platform_axis), cosine)


def _proximal_fields(proximal: ElementaryJoint, base_end: Vector, line: Vector) -> Fields:
    axis = motion = proximal.axis
    fields: Fields = {"proximal": _PROXIMAL[proximal.kind], "proximal_axis": axis}
    if proximal.kind == "R":
        point = proximal.point + axis * (axis @ (base_end - proximal.point))
        motion = cross(axis, base_end - point)
        fields |= {"proximal_point": point, "crank": base_end - point, "crank_across": motion}
    # the side at home: of a carriage q = middle + side root, of a crank q = atan2(B, A) + side acos(...); its sign
    # is opposite to that of the base end's motion along the rod
    return fields | {"side": -sign(line @ motion + 0.0)}
