"""Struts between base and end effector, U-P*-S: the length of each is the distance of its two ends."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from pfabrik import Mechanism, SubChain

from ..arrays import Floats, Records
from ..step import Step
from ..tolerances import ALIGNMENT
from .compiled import kernel, routine
from .facts import NO_CONE, centre, home_of, is_parallel, least_cosine, range_of, require, tolerances
from .targets import BLOCK, FREE, OVER, REACHED, Statuses, load_block

_vector = ("f8", (3,))
STRUT = np.dtype(
    [
        ("head", *_vector),  # centre of S, relative to the reference point
        ("low", "f8"),  # distance of the ends, tolerance included
        ("high", "f8"),
        ("foot_cosine", "f8"),  # of the cone at the foot, about an axis of the body that U stands on
        ("head_axis", *_vector),  # of the cone at the head, fixed to the end effector
        ("head_cosine", "f8"),
        ("sign", "f8"),  # coordinate = offset + sign * distance
        ("offset", "f8"),
        ("column", "i8"),  # place among the actuators
    ]
)
# A foot: centre of U, then the axis of its cone; both in base coordinates.
FOOT_SIZE = 6


class StrutPlan(NamedTuple):
    """Struts as arrays."""

    struts: Records  # (k,)
    feet: Floats  # (k, FOOT_SIZE)
    far: float


def plan_struts(mechanism: Mechanism, chains: Sequence[SubChain]) -> StrutPlan:
    """Struts that stand on the base."""
    require(not mechanism.end_effector_is_joint, "its end effector is a joint")
    struts = [read_strut(mechanism, chain.branches[0]) for chain in chains]
    return StrutPlan(strut_records(struts), np.array([foot for _, foot in struts]), tolerances(mechanism)[1])


def strut_records(struts: Sequence[tuple[dict[str, Any], Floats]]) -> Records:
    """What was read of struts, as records."""
    records = np.zeros(len(struts), STRUT)
    for record, (fields, _) in zip(records, struts, strict=True):
        for name, value in fields.items():
            record[name] = value
    return records


def read_strut(mechanism: Mechanism, steps: Sequence[Step]) -> tuple[dict[str, Any], Floats]:
    """The fields of a strut, and its foot at home, (FOOT_SIZE,)."""
    universal, slide, spherical = steps
    foot, head = centre(universal), centre(spherical)
    length = float(np.linalg.norm(head - foot))
    require(length > ALIGNMENT * mechanism.characteristic_length, f"{slide.joint.name} has no length at home")
    sign, offset = _count(mechanism, steps, (head - foot) / length, length)
    low, high = sorted((bound - offset) * sign for bound in range_of(slide))
    slack, _ = tolerances(mechanism)
    foot_axis, foot_cosine = _cone(universal, on_link=False)
    head_axis, head_cosine = _cone(spherical, on_link=True)
    fields = {
        "head": head - mechanism.reference_point,
        "low": low - slack,
        "high": high + slack,
        "foot_cosine": foot_cosine,
        "head_axis": head_axis,
        "head_cosine": head_cosine,
        "sign": sign,
        "offset": offset,
        "column": mechanism.actuator_names.index(slide.joint.name),
    }
    return fields, np.concatenate([foot, foot_axis])


def _count(mechanism: Mechanism, steps: Sequence[Step], direction: Floats, length: float) -> tuple[float, float]:
    """Sign and offset of a strut's coordinate, over the distance of its ends."""
    universal, slide, spherical = steps
    name, along = slide.joint.name, slide.joint.along
    if along is not None:
        require(set(along) == {universal.joint.name, spherical.joint.name}, f"{name} is not measured along its strut")
        return 1.0, 0.0
    axis = np.array(mechanism.home_axis(name)) * slide.sign
    require(is_parallel(axis, direction), f"{name} does not point along its strut")
    sign = math.copysign(1.0, float(axis @ direction))
    return sign, home_of(mechanism, slide) - sign * length


def _cone(step: Step, on_link: bool) -> tuple[Floats, float]:
    """Axis at home and least cosine of the cone at one end of a strut, whose line leads to the other end.

    `on_link` says whether the strut is the inward body of this joint; the cone must be fixed to the opposite one.
    """
    joint = step.joint
    require(joint.range is None, f"{joint.name} has ranges about two axes")
    if joint.cone is None:
        return np.zeros(3), NO_CONE
    require((joint.cone.fixed_to != step.inward) == on_link, f"the cone of {joint.name} turns with its strut")
    return np.array(joint.cone.axis), least_cosine(joint.cone.half_angle)


@kernel
def solve_struts(
    plan: StrutPlan, targets: Floats, starts: Floats, at_home: bool, actuators: Floats, status: Statuses
) -> int:
    """Lengths of the struts at every target; how many rows are no poses.

    The length of a strut is |p + R h - f|, with h its head in platform coordinates and f its foot. One solution, and
    no choice of branch: `starts` are not read. Degenerate where head and foot coincide: the length is 0, the strut has
    no direction, and every cone counts as kept. Source: Merlet.
    """
    table = np.zeros((FREE + plan.struts.shape[0], BLOCK))
    invalid = 0
    for row in range(0, targets.shape[0], BLOCK):
        n = min(BLOCK, targets.shape[0] - row)
        invalid += load_block(targets, row, n, plan.far, table, status)
        for k in range(plan.struts.shape[0]):
            measure_strut(plan.struts[k], plan.feet[k], n, table, OVER, FREE + k)
        for k in range(plan.struts.shape[0]):
            write_strut(plan.struts[k], row, n, table, FREE + k, actuators)
        write_status(row, n, table, status)
    return invalid


@routine
def measure_strut(strut: Records, foot: Floats, n: int, table: Floats, over: int, length: int) -> None:
    """Length of a strut for `n` columns into row `length`, and 1 more in row `over` where it exceeds a limit."""
    fx, fy, fz, ax, ay, az = foot[0], foot[1], foot[2], foot[3], foot[4], foot[5]
    hx, hy, hz = strut["head"][0], strut["head"][1], strut["head"][2]
    bx, by, bz = strut["head_axis"][0], strut["head_axis"][1], strut["head_axis"][2]
    low, high = strut["low"], strut["high"]
    foot_cosine, head_cosine = strut["foot_cosine"], strut["head_cosine"]
    for i in range(n):
        x = table[0, i] * hx + table[1, i] * hy + table[2, i] * hz + table[3, i] - fx
        y = table[4, i] * hx + table[5, i] * hy + table[6, i] * hz + table[7, i] - fy
        z = table[8, i] * hx + table[9, i] * hy + table[10, i] * hz + table[11, i] - fz
        u = table[0, i] * bx + table[1, i] * by + table[2, i] * bz
        v = table[4, i] * bx + table[5, i] * by + table[6, i] * bz
        w = table[8, i] * bx + table[9, i] * by + table[10, i] * bz
        distance = math.sqrt(x * x + y * y + z * z)
        kept = (
            (distance >= low)
            & (distance <= high)
            & (ax * x + ay * y + az * z >= foot_cosine * distance)
            & (u * x + v * y + w * z <= -head_cosine * distance)
        )
        table[length, i] = distance
        table[over, i] += 0.0 if kept else 1.0


@routine
def write_strut(strut: Records, row: int, n: int, table: Floats, length: int, actuators: Floats) -> None:
    """The coordinate of a strut; NaN where anything is exceeded."""
    sign, offset, column = strut["sign"], strut["offset"], strut["column"]
    for i in range(n):
        actuators[row + i, column] = offset + sign * table[length, i] if table[OVER, i] == 0.0 else math.nan


@routine
def write_status(row: int, n: int, table: Floats, status: Statuses) -> None:
    """REACHED where nothing is exceeded; what is no pose stays so."""
    for i in range(n):
        if table[OVER, i] == 0.0:
            status[row + i] = REACHED
