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
from .items import Item
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
    legs["has_rows"] = _note_rows(legs, counts)
    return legs


def row_counts(legs: Records) -> list[int]:
    """How many constraints each leg has."""
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


def _note_rows(legs: Records, counts: Sequence[int]) -> list[bool]:
    """Whether each leg, or a rod on its carrier, leaves a constraint: these follow the leg that has the carrier. Of an
    arm, whether a leg on it does."""
    mains = np.maximum.accumulate(np.where(legs["proximal"] != K.SHARED, np.arange(len(legs)), 0))
    bear = [bool(np.sum(np.array(counts)[mains == main])) for main in mains]
    for k in range(len(legs) - 1, -1, -1):
        for arm in (legs["redundant"][k], legs["mirror_of"][k]):
            if arm >= 0:
                bear[arm] |= bear[k]
    return bear


def _put_frames(legs: Records, forms: Sequence[LegForm]) -> None:
    """Number the frames, see `kernels.legs.frames`, and the coordinates of arms."""
    numbers = {id(form): k for k, form in enumerate(forms)}
    legs["redundant"] = [-1 if form.on is None else numbers[id(form.on)] for form in forms]
    mirrors = [form.mirror_of if isinstance(form, RedundantJoint) else None for form in forms]
    legs["mirror_of"] = [-1 if mirror_of is None else numbers[id(mirror_of)] for mirror_of in mirrors]
    redundant = legs["kind"] == K.REDUNDANT
    own = redundant & (legs["mirror_of"] < 0)
    legs["makes"][redundant], legs["column"][own] = K.FIXED + np.arange(redundant.sum()), np.arange(own.sum())
    legs["column"][redundant & ~own] = legs["column"][legs["mirror_of"][redundant & ~own]]
    for leg, form in zip(legs, forms, strict=True):
        own = isinstance(form, RedundantJoint) and form.is_inner
        leg["inner"] = own or (leg["redundant"] >= 0 and legs["inner"][leg["redundant"]])
    legs["frame"] = np.where(
        legs["redundant"] >= 0,
        legs["makes"][legs["redundant"]],
        np.where(legs["inner"], K.FROM_ITSELF, legs["reversed"]),
    )


def _put_orienting(legs: Records, forms: Sequence[LegForm]) -> None:
    """Which arms have the rod after them face its head, and which of two solutions is home's."""
    for k, (form, after) in enumerate(pairwise(forms)):
        if isinstance(form, RedundantJoint) and form.faces and isinstance(after, Rod):
            across = np.cross(form.item.axis, after.base_ending.items[0].axis)
            legs["orients"][k] = 1
            if form.item.kind == "R":
                legs["side"][k] = -math.copysign(1.0, across @ (after.platform_end - form.item.point))


def _record(mechanism: Mechanism, form: LegForm) -> Records:
    if isinstance(form, Rod):
        return _rod_record(mechanism, form)
    if isinstance(form, RedundantJoint):
        return _redundant_record(mechanism, form)
    return _pivot_record(mechanism, form) if isinstance(form, Pivot) else _kept_axis_record(form)


def _platform_point(mechanism: Mechanism, point: Floats, is_reversed: bool) -> Floats:
    """A head at home as `frames` map it [L]."""
    reference = np.asarray(mechanism.reference_point) / mechanism.characteristic_length
    return point if is_reversed else point - reference


def _axes(items: Sequence[Item]) -> Floats:
    axes = np.zeros((3, 3))
    for place, item in enumerate(items):
        axes[place] = item.axis
    return axes


def _pivot_record(mechanism: Mechanism, pivot: Pivot) -> Records:
    record = np.zeros((), K.LEG)
    kind = pivot.ending.kind
    centre = pivot.ending.centre
    if not pivot.ending.items:
        centre = np.asarray(mechanism.reference_point) / mechanism.characteristic_length
    axes = np.eye(3) if kind == "weld" else _axes(pivot.ending.items)
    record["kind"], record["reversed"], record["base_end"] = K.PIVOT, pivot.is_reversed, _ENDINGS[kind]
    record["base_end_point"], record["platform_end_point"] = (
        centre,
        _platform_point(mechanism, centre, pivot.is_reversed),
    )
    record["base_end_axes"], n_slides = axes, len(pivot.slides)
    record["slides"] = n_slides
    directions = np.array([item.axis for item in pivot.slides]).reshape(-1, 3)
    record["slide_rows"][:n_slides] = np.linalg.pinv(directions.T) if n_slides else 0.0
    record["fixed_rows"][: 3 - n_slides] = np.linalg.svd(directions)[2][n_slides:] if n_slides else np.eye(3)
    _put_axis_rows(record, kind, axes)
    if kind == "triple":
        record["side"] = _home_side(axes, axes[2])
    return record


def _kept_axis_record(form: KeptAxis) -> Records:
    """A pivot that slides to all sides, and whose hinge is the axis."""
    record = np.zeros((), K.LEG)
    record["kind"], record["base_end"], record["slides"] = K.PIVOT, K.HINGE, 3
    record["base_end_axes"][0] = form.ending.items[0].axis
    _put_axis_rows(record, "hinge", record["base_end_axes"])
    return record


def _redundant_record(mechanism: Mechanism, arm: RedundantJoint) -> Records:
    record, point = np.zeros((), K.LEG), arm.item.point
    record["kind"], record["reversed"], record["at_platform_end"] = K.REDUNDANT, arm.is_reversed, arm.at_platform_end
    record["proximal"], record["proximal_axis"] = _PROXIMAL[arm.item.kind], arm.item.axis
    record["proximal_point"] = _platform_point(mechanism, point, arm.is_reversed) if arm.at_platform_end else point
    return record


def _put_axis_rows(record: Records, kind: str, axes: Floats) -> None:
    pairs = _axis_pairs(kind, axes)
    record["axis_rows"], record["upright"] = len(pairs), {"hinge": 1, "weld": 3}.get(kind, 0)
    for row, (kept, moved) in enumerate(pairs):
        record["kept"][row], record["moved"][row], record["value"][row] = kept, moved, kept @ moved


def _axis_pairs(kind: str, axes: Floats) -> list[tuple[Floats, Floats]]:
    """Pairs of directions, of base and platform, that keep their angle."""
    x, y, z = axes
    if kind == "cross":
        return [(x, y)]
    if kind == "hinge":
        return [(across, x) for across in square_to(x)]
    return [(x, y), (y, z), (z, x)] if kind == "weld" else []


def _home_side(axes: Floats, line: Floats) -> float:
    """Which of the two solutions of two crossed hinges has them at home: see `kernels.legs.endings.aim`."""
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
        axes = _axes(ending.items[::order])
        record[end], record[f"{end}_axes"] = _ENDINGS[ending.kind], axes
        record[f"{end}_side"] = _home_side(axes, line) if ending.kind == "cross" else 0.0
    record["twists"] = keeps_from_spinning(rod)
    foot_mark, head_mark = rod.base_ending.items[-1].axis, rod.platform_ending.items[0].axis
    flat = foot_mark @ head_mark - (line @ foot_mark) * (line @ head_mark)
    record["twist"] = math.atan2(line @ np.cross(foot_mark, head_mark), flat)
    record["proximal"] = K.SHARED if rod.is_shared else K.NO_PROXIMAL
    if rod.proximal is not None:
        _put_proximal(record, rod.proximal, rod.base_end, line)
    return record


def _put_proximal(record: Records, proximal: Item, base_end: Floats, line: Floats) -> None:
    axis = proximal.axis
    record["proximal"], record["proximal_axis"] = _PROXIMAL[proximal.kind], axis
    motion = axis
    if proximal.kind == "R":
        point = proximal.point + axis * (axis @ (base_end - proximal.point))
        record["proximal_point"], record["crank"] = point, base_end - point
        record["crank_across"] = motion = np.cross(axis, base_end - point)
    # home's solution, of a carriage q = middle +- root, of a crank q = atan2(B, A) +- acos: the foot leaves the line
    # forward, or backward
    record["side"] = -1.0 if line @ motion >= 0.0 else 1.0
