"""Faults of the home configuration: it must have a size, and lie within its own limits."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..errors import Fault
from ..tolerances import TOLERANCES
from .enclosing import enclosing_radius
from .form_faults import angle_text, coordinate_text, is_pair_of_names, is_point, kind_of, range_text, shown
from .graph import next_joints, opposite
from .joint_types import Coordinate
from .joints import Joint
from .structure import Structure

SMALLEST_LENGTH = 1e-9
"""Smallest characteristic length accepted: below it, a unit is wrong or joints are meant to coincide."""


FARTHEST = 1e6
"""How far from the origin joints may be, in sizes of the machine: coordinates of 16 digits then tell places apart to
1e-10 of it, and loops close to 1e-9."""


def home_faults(mechanism: Structure, sound: dict[str, Joint]) -> Iterator[Fault]:
    """All faults of the home configuration that can be seen in the joints that have no other fault.

    Parameters
    ----------
    sound : the joints without a fault of their own, by name; only they are looked at.
    """
    radius = enclosing_radius([joint.at for joint in sound.values() if joint.at is not None])
    if 0.0 < radius < SMALLEST_LENGTH:
        yield Fault("joint", f"joint centres within {radius:.3g} of each other", f"at least {SMALLEST_LENGTH:g}")
        return
    yield from _distance_faults(mechanism, sound)
    for index, joint in enumerate(mechanism.joints):
        if _is_one_of(joint, sound):
            yield from _stroke_faults(f"joint[{index}]", joint, sound, radius or 1.0)
            yield from _angle_faults(f"joint[{index}].cone", joint, mechanism, sound)


def _distance_faults(mechanism: Structure, sound: dict[str, Joint]) -> Iterator[Fault]:
    """The place that is farthest from the origin, where that is too far for the size of the machine."""
    if len(sound) < len(mechanism.joints) or not is_point(mechanism.reference_point):
        return  # then its size is not known
    places = {f"joint[{index}].at": joint.at for index, joint in enumerate(mechanism.joints) if joint.at is not None}
    places["reference_point"] = mechanism.reference_point
    place, farthest = max(places.items(), key=lambda item: math.hypot(*item[1]))
    size = mechanism.characteristic_length
    if math.hypot(*farthest) > FARTHEST * size:
        found = f"{shown(farthest)}, {math.hypot(*farthest) / size:.3g} times the size of the machine from the origin"
        yield Fault(
            place, found, f"at most {FARTHEST:g} times, so that coordinates tell its places apart: move the origin"
        )


def _is_one_of(joint: Joint, sound: dict[str, Joint]) -> bool:
    return any(joint is each for each in sound.values())


def _stroke_faults(place: str, joint: Joint, sound: dict[str, Joint], scale: float) -> Iterator[Fault]:
    """Home outside the joint's range; two joints at one place, which leave `along` without a direction."""
    home: Any = joint.home
    if joint.along is not None:
        if not all(name in sound and is_point(sound[name].at) for name in joint.along):
            return
        home = math.dist(*(sound[name].at or () for name in joint.along))
        if home <= TOLERANCES.home_slack * scale:
            yield Fault(f"{place}.along", "two joints at the same place", "two joints at some distance")
            return
    kind = kind_of(joint)
    if joint.range is None or kind is None:
        return
    if len(kind.coordinates) == 1:
        yield from _outside(f"{place}.range", home, joint.range, kind.coordinates[0], scale)
        return
    for number, (value, bounds, coordinate) in enumerate(zip(home, joint.range, kind.coordinates, strict=True)):
        yield from _outside(f"{place}.range[{number}]", value, bounds, coordinate, scale)


def _outside(place: str, value: float, bounds: Any, coordinate: Coordinate, scale: float) -> Iterator[Fault]:
    slack = TOLERANCES.home_slack * (scale if coordinate == "length" else 1.0)
    if not bounds[0] - slack <= value <= bounds[1] + slack:
        expected = f"a range that contains home, {coordinate_text(value, coordinate)}"
        yield Fault(place, range_text(bounds, coordinate), expected)


def _angle_faults(place: str, joint: Joint, mechanism: Structure, sound: dict[str, Joint]) -> Iterator[Fault]:
    """Home outside the joint's cone, or no line to measure."""
    if joint.cone is None or not all(is_pair_of_names(each.connects) for each in mechanism.joints):
        return
    ends = next_joints(mechanism.joints, joint, opposite(joint))
    if len(ends) != 1 or not _is_one_of(ends[0], sound):
        return
    line = np.asarray(ends[0].at) - np.asarray(joint.at)
    if not line.any():
        yield Fault(place, f"'{ends[0].name}' at the same place", "a next joint at some distance")
        return
    angle = _angle(np.asarray(joint.cone.axis), line)
    if angle > joint.cone.half_angle + TOLERANCES.home_slack:
        expected = f"at least the angle at home to '{ends[0].name}', {angle_text(angle)}"
        yield Fault(f"{place}.half_angle", angle_text(joint.cone.half_angle), expected)


def _angle(axis: Any, line: Any) -> float:
    return math.atan2(float(np.linalg.norm(np.cross(axis, line))), float(axis @ line))
