"""Legs as records, in the layout of `kernels.legs.records`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate, pairwise

import numpy as np

from ..arrays import Floats, Records
from ..description.mechanism import Mechanism
from ..kernels.legs import records as K
from ..rotations import square_to
from .elementary_joints import ElementaryJoint
from .leg_forms import KeptAxis, LegForm, Pivot, RedundantJoint, Rod, keeps_from_spinning

_ENDINGS = {"weld": K.WELD, "hinge": K.HINGE, "cross": K.CROSS, "triple": K.TRIPLE, "ball": K.BALL}
_PROXIMAL = {"R": K.CRANK, "P": K.CARRIAGE}


def leg_records(mechanism: Mechanism, forms: Sequence[LegForm]) -> Records:
    """A record of `LEG` for each leg."""
    legs = np.array([_record(mechanism, form) for form in forms], K.LEG).reshape(-1)
    _put_frames(legs, forms)
    _put_orienting(legs, forms)
    counts = row_counts(legs)
    legs["first_row"] = [0, *accumulate(counts)][:-1]
    legs["has_rows"] = _has_rows(legs, counts)
    return legs


def row_counts(legs: Records) -> list[int]:
    """The number of constraints of each leg."""
    counts = []
    for leg in legs:
        if leg["kind"] == K.PIVOT:
            counts.append(int(3 - leg["slides"] + leg["axis_rows"]))
            continue
        if leg["kind"] == K.REDUNDANT:
            counts.append(0)
            continue
        is_rigid = not leg["slides"] and leg["proximal"] in (K.NO_PROXIMAL, K.SHARED)
        hinges = int(leg["base_end"] == K.HINGE) + int(leg["platform_end"] == K.HINGE)
        counts.append(int(is_rigid) + hinges + int(leg["twists"]))
    return counts


def _has_rows(legs: Records, counts: Sequence[int]) -> list[bool]:
    """Flags `has_rows`: the leg, or a rod on the same proximal joint, contributes constraint rows.

    Rods on a proximal joint follow the one that has it. A redundant joint has rows if a leg on it has.
    """
    first_rods = np.maximum.accumulate(np.where(legs["proximal"] != K.SHARED, np.arange(len(legs)), 0))
    has_rows = [bool(np.sum(np.array(counts)[first_rods == first_rod])) for first_rod in first_rods]
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
    is_redundant = legs["kind"] == K.REDUNDANT
    is_own = is_redundant & (legs["mirror_of"] < 0)
    legs["makes"][is_redundant], legs["column"][is_own] = (
        K.FIXED + np.arange(is_redundant.sum()),
        np.arange(is_own.sum()),
    )
    legs["column"][is_redundant & ~is_own] = legs["column"][legs["mirror_of"][is_redundant & ~is_own]]
    for leg, form in zip(legs, forms, strict=True):
        is_own = isinstance(form, RedundantJoint) and form.is_inner
        leg["inner"] = is_own or (leg["redundant"] >= 0 and legs["inner"][leg["redundant"]])
    legs["frame"] = np.where(
        legs["redundant"] >= 0,
        legs["makes"][legs["redundant"]],
        np.where(legs["inner"], K.FROM_ITSELF, legs["reversed"]),
    )


def _put_orienting(legs: Records, forms: Sequence[LegForm]) -> None:
    """Mark the redundant joints that orient the rod after them, with the side that they take at home."""
    for k, (form, after) in enumerate(pairwise(forms)):
        if isinstance(form, RedundantJoint) and form.orients and isinstance(after, Rod):
            across = np.cross(form.element.axis, after.base_ending.elements[0].axis)
            legs["orients"][k] = 1
            if form.element.kind == "R":
                legs["side"][k] = -math.copysign(1.0, across @ (after.platform_end - form.element.point))


def _record(mechanism: Mechanism, form: LegForm) -> Records:
    if isinstance(form, Rod):
        return _rod_record(mechanism, form)
    if isinstance(form, RedundantJoint):
        return _redundant_record(mechanism, form)
    return _pivot_record(mechanism, form) if isinstance(form, Pivot) else _kept_axis_record(form)


def _platform_point(mechanism: Mechanism, point: Floats, is_reversed: bool) -> Floats:
    """A platform end at home, in the frame that `kernels.legs.frames` maps from [L]."""
    reference = np.asarray(mechanism.reference_point) / mechanism.characteristic_length
    return point if is_reversed else point - reference


def _axes(elements: Sequence[ElementaryJoint]) -> Floats:
    axes = np.zeros((3, 3))
    for place, element in enumerate(elements):
        axes[place] = element.axis
    return axes


def _pivot_record(mechanism: Mechanism, pivot: Pivot) -> Records:
    record = np.zeros((), K.LEG)
    kind = pivot.ending.kind
    centre = pivot.ending.centre
    if not pivot.ending.elements:
        centre = np.asarray(mechanism.reference_point) / mechanism.characteristic_length
    axes = np.eye(3) if kind == "weld" else _axes(pivot.ending.elements)
    record["kind"], record["reversed"], record["base_end"] = K.PIVOT, pivot.is_reversed, _ENDINGS[kind]
    record["base_end_point"], record["platform_end_point"] = (
        centre,
        _platform_point(mechanism, centre, pivot.is_reversed),
    )
    record["base_end_axes"], n_slides = axes, len(pivot.slides)
    record["slides"] = n_slides
    directions = np.array([element.axis for element in pivot.slides]).reshape(-1, 3)
    record["slide_rows"][:n_slides] = np.linalg.pinv(directions.T) if n_slides else 0.0
    record["fixed_rows"][: 3 - n_slides] = np.linalg.svd(directions)[2][n_slides:] if n_slides else np.eye(3)
    _put_axis_rows(record, kind, axes)
    if kind == "triple":
        record["side"] = _home_side(axes, axes[2])
    return record


def _kept_axis_record(form: KeptAxis) -> Records:
    """The record of a pivot with three slides, whose hinge is the axis."""
    record = np.zeros((), K.LEG)
    record["kind"], record["base_end"], record["slides"] = K.PIVOT, K.HINGE, 3
    record["base_end_axes"][0] = form.ending.elements[0].axis
    _put_axis_rows(record, "hinge", record["base_end_axes"])
    return record


def _redundant_record(mechanism: Mechanism, form: RedundantJoint) -> Records:
    record, point = np.zeros((), K.LEG), form.element.point
    record["kind"], record["reversed"], record["at_platform_end"] = K.REDUNDANT, form.is_reversed, form.at_platform_end
    record["proximal"], record["proximal_axis"] = _PROXIMAL[form.element.kind], form.element.axis
    record["proximal_point"] = _platform_point(mechanism, point, form.is_reversed) if form.at_platform_end else point
    return record


def _put_axis_rows(record: Records, kind: str, axes: Floats) -> None:
    pairs = _axis_pairs(kind, axes)
    record["axis_rows"], record["upright"] = len(pairs), {"hinge": 1, "weld": 3}.get(kind, 0)
    for row, (kept, moved) in enumerate(pairs):
        record["kept"][row], record["moved"][row], record["value"][row] = kept, moved, kept @ moved


def _axis_pairs(kind: str, axes: Floats) -> list[tuple[Floats, Floats]]:
    """Pairs of directions, on base and platform, whose angle is constant."""
    x, y, z = axes
    if kind == "cross":
        return [(x, y)]
    if kind == "hinge":
        return [(across, x) for across in square_to(x)]
    return [(x, y), (y, z), (z, x)] if kind == "weld" else []


def _home_side(axes: Floats, line: Floats) -> float:
    """The side of two crossed hinges at home; its sign as of `kernels.legs.endings.aim`."""
    return -math.copysign(1.0, axes[0] @ np.cross(axes[1], line))


def _rod_record(mechanism: Mechanism, rod: Rod) -> Records:
    record = np.zeros((), K.LEG)
    line = rod.platform_end - rod.base_end
    length = np.linalg.norm(line)
    line = line / length
    record["kind"], record["reversed"] = K.ROD, rod.is_reversed
    record["base_end_point"], record["length"], record["line"] = rod.base_end, length, line
    record["platform_end_point"] = _platform_point(mechanism, rod.platform_end, rod.is_reversed)
    record["slides"] = rod.slide is not None
    for end, ending, order in (("base_end", rod.base_ending, 1), ("platform_end", rod.platform_ending, -1)):
        axes = _axes(ending.elements[::order])
        record[end], record[f"{end}_axes"] = _ENDINGS[ending.kind], axes
        record[f"{end}_side"] = _home_side(axes, line) if ending.kind == "cross" else 0.0
    record["twists"] = keeps_from_spinning(rod)
    base_axis, platform_axis = rod.base_ending.elements[-1].axis, rod.platform_ending.elements[0].axis
    cosine = base_axis @ platform_axis - (line @ base_axis) * (line @ platform_axis)
    record["twist"] = math.atan2(line @ np.cross(base_axis, platform_axis), cosine)
    record["proximal"] = K.SHARED if rod.is_shared else K.NO_PROXIMAL
    if rod.proximal is not None:
        _put_proximal(record, rod.proximal, rod.base_end, line)
    return record


def _put_proximal(record: Records, proximal: ElementaryJoint, base_end: Floats, line: Floats) -> None:
    axis = proximal.axis
    record["proximal"], record["proximal_axis"] = _PROXIMAL[proximal.kind], axis
    motion = axis
    if proximal.kind == "R":
        point = proximal.point + axis * (axis @ (base_end - proximal.point))
        record["proximal_point"], record["crank"] = point, base_end - point
        record["crank_across"] = motion = np.cross(axis, base_end - point)
    # the side at home: of a carriage q = middle + side root, of a crank q = atan2(B, A) + side acos(...); its sign
    # is opposite to that of the base end's motion along the rod
    record["side"] = -1.0 if line @ motion >= 0.0 else 1.0
