"""Everything that can be wrong with a description, found in one go."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from itertools import chain
from typing import Any

from ...errors import Fault
from .body_masses import Mass
from .body_shapes import Shape
from .form_faults import shown
from .joints import Joint
from .legs import LEG_KEYS
from .links import collisions_at_home
from .rules import is_same_place, joint_faults
from .structure import Structure
from .whole_rules import (
    form_of_clearance,
    form_of_shapes,
    graph_faults,
    head_faults,
    home_faults,
    mass_faults,
    shape_faults,
)

_FIELDS: dict[str, tuple[str, ...]] = {
    "joint": tuple(field.name for field in dataclasses.fields(Joint)),
    "leg": LEG_KEYS,
    "body": ("name", "shape", *(field.name for field in dataclasses.fields(Shape)[2:])),
    "mass": tuple(field.name for field in dataclasses.fields(Mass)),
}
"""The tables of a description, and what is in them, in order."""

_PLACE = re.compile(r"(joint|leg|body|mass)\[(\d+)\]\.?(\w*)")


def find_faults(mechanism: Structure) -> list[Fault]:
    """Every fault of a description, in its order; an empty list for a mechanism that can be built.

    Places are written as in a file: `joint[3].cone.half_angle`, with the index counted in `mechanism.joints`.
    """
    joints: Any = mechanism.joints
    if not isinstance(joints, tuple) or not all(map(_is_joint, joints)) or not joints:
        return [*head_faults(mechanism), Fault("joint", _not_joints(joints), "at least one Joint")]
    form = [joint_faults(f"joint[{index}]", joint) for index, joint in enumerate(joints)]
    sound = {joint.name: joint for joint, faults in zip(joints, form, strict=True) if not faults}
    faults = [*head_faults(mechanism), *chain.from_iterable(form)]
    faults += [*graph_faults(mechanism), *home_faults(mechanism, sound)]
    if mechanism.shapes or mechanism.ignore or mechanism.clearance is not None:
        of_shapes = [*form_of_shapes(mechanism.shapes), *form_of_clearance(mechanism.clearance)]
        if not faults and not of_shapes:
            of_shapes = list(shape_faults(mechanism)) or list(collisions_at_home(mechanism))
        faults += of_shapes
    if mechanism.masses and not faults:
        faults += mass_faults(mechanism)
    return in_order(faults)


def in_order(faults: Sequence[Fault]) -> list[Fault]:
    """The faults in the order of a description: the head first, then joint by joint and leg by leg, field by field."""
    return sorted(faults, key=lambda fault: _rank(fault.place))


def merged(first: Sequence[Fault], second: Sequence[Fault]) -> list[Fault]:
    """All faults in order, without those of the second list that only follow from one of the first."""
    places = [fault.place for fault in first]
    own = [fault for fault in second if not any(is_same_place(fault.place, place) for place in places)]
    return in_order([*first, *own])


def _rank(place: str) -> tuple[int, int, int, str]:
    match = _PLACE.match(place)
    if match is None:
        return (0, -1, 0, "")
    table, index, field = match.groups()
    known = _FIELDS[table]
    rank = known.index(field) if field in known else len(known)
    return (
        list(_FIELDS).index(table),
        int(index),
        rank,
        field if len(field) <= 2 else "~",
    )  # a leg's joints and bodies by letters


def joint_index(place: str) -> int:
    """The index of the joint that a place is in, or -1 for the head."""
    match = _PLACE.match(place)
    return int(match[2]) if match and match[1] == "joint" else -1


def _is_joint(value: object) -> bool:
    return all(hasattr(value, field) for field in ("name", "type", "connects", "cone", "along"))


def _not_joints(joints: Any) -> str:
    if not isinstance(joints, tuple):
        return shown(joints)
    strangers = [shown(joint) for joint in joints if not _is_joint(joint)]
    return strangers[0] if strangers else "no joints"
