"""Everything that can be wrong with a description, found in one go."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator, Sequence
from typing import Any

from ..errors import Fault, near_miss
from .form_faults import is_name, joint_faults, name_faults, number_faults, shown
from .graph_faults import graph_faults
from .home_faults import home_faults
from .joint_types import TASK_COORDINATES, TASK_TURNS, WHOLE_TASK
from .joints import Joint
from .legs import LEG_KEYS
from .links import collisions_at_home
from .shape_faults import form_of_clearance, form_of_shapes, shape_faults
from .structure import Structure

_FIELDS = tuple(field.name for field in dataclasses.fields(Joint))
_FIELD = re.compile(r"joint\[\d+\]\.(\w+)")
_JOINT = re.compile(r"joint\[(\d+)\]")
_BODY = re.compile(r"body\[(\d+)\]")
_LEG = re.compile(r"leg\[(\d+)\](?:\.([A-Za-z]+))?")


def find_faults(mechanism: Structure) -> list[Fault]:
    """Every fault of a description, in its order; an empty list for a mechanism that can be built.

    Places are written as in a file: `joint[3].cone.half_angle`, with the index counted in `mechanism.joints`.
    """
    joints: Any = mechanism.joints
    if not isinstance(joints, tuple) or not all(map(_is_joint, joints)) or not joints:
        return [*_head_faults(mechanism), Fault("joint", _not_joints(joints), "at least one Joint")]
    form = [list(joint_faults(f"joint[{index}]", joint)) for index, joint in enumerate(joints)]
    sound = {joint.name: joint for joint, faults in zip(joints, form, strict=True) if not faults}
    faults = [*_head_faults(mechanism), *(fault for each in form for fault in each)]
    faults += [*_point_faults(mechanism), *graph_faults(mechanism), *home_faults(mechanism, sound)]
    if mechanism.shapes or mechanism.ignore or mechanism.clearance is not None:
        of_shapes = [*form_of_shapes(mechanism.shapes), *form_of_clearance(mechanism.clearance)]
        if not faults and not of_shapes:
            of_shapes = list(shape_faults(mechanism)) or list(collisions_at_home(mechanism))
        faults += of_shapes
    return in_order(faults)


def in_order(faults: Sequence[Fault]) -> list[Fault]:
    """The faults in the order of a description: the head first, then joint by joint and leg by leg, field by field."""
    return sorted(faults, key=lambda fault: _rank(fault.place))


def merged(first: Sequence[Fault], second: Sequence[Fault]) -> list[Fault]:
    """All faults in order, without those of the second list that only follow from one of the first."""
    places = [fault.place for fault in first]
    own = [fault for fault in second if not any(_same_place(fault.place, place) for place in places)]
    return in_order([*first, *own])


def _same_place(one: str, other: str) -> bool:
    """True if one place is the other, or within it."""
    short, long = sorted((one, other), key=len)
    return long == short or long.startswith(f"{short}.") or (short != "joint" and long.startswith(f"{short}["))


def _rank(place: str) -> tuple[int, int, int, str]:
    body = _BODY.match(place)
    if body is not None:
        return (2, int(body[1]), 0, "")
    leg = _LEG.match(place)
    if leg is None:
        return (0, joint_index(place), _field_rank(place), "")
    key = leg[2] or ""
    if key in LEG_KEYS:
        return (1, int(leg[1]), LEG_KEYS.index(key), "")
    return (1, int(leg[1]), len(LEG_KEYS), key if len(key) == 1 else "~")  # joints by their letters


def joint_index(place: str) -> int:
    """The index of the joint that a place is in, or -1 for the head."""
    match = _JOINT.match(place)
    return int(match[1]) if match else -1


def _field_rank(place: str) -> int:
    field = _FIELD.match(place)
    return _FIELDS.index(field[1]) if field and field[1] in _FIELDS else len(_FIELDS)


def _is_joint(value: object) -> bool:
    return all(hasattr(value, field) for field in ("name", "type", "connects", "cone", "along"))


def _not_joints(joints: Any) -> str:
    if not isinstance(joints, tuple):
        return shown(joints)
    strangers = [shown(joint) for joint in joints if not _is_joint(joint)]
    return strangers[0] if strangers else "no joints"


def _head_faults(mechanism: Structure) -> Iterator[Fault]:
    for field in ("name", "base", "end_effector"):
        yield from name_faults(field, getattr(mechanism, field))
    yield from name_faults("units.length", mechanism.length_unit)
    if mechanism.angle_unit not in ("deg", "rad"):
        yield Fault("units.angle", shown(mechanism.angle_unit), "'deg' or 'rad'")
    yield from _task_faults(mechanism.task, mechanism)


def _task_faults(task: Any, mechanism: Structure) -> Iterator[Fault]:
    """Faults of what targets set: at least one coordinate, none twice, and of the rotation all, the tilt or the yaw."""
    expected = f"some of {', '.join(TASK_COORDINATES)}"
    if not isinstance(task, tuple) or not task:
        yield Fault("task", shown(task), expected)
        return
    for each in task:
        if each not in TASK_COORDINATES:
            yield Fault("task", f"{shown(each)}{near_miss(each, TASK_COORDINATES)}", expected)
    if len(set(map(str, task))) < len(task):
        yield Fault("task", shown(list(task)), f"{expected}, none of them twice")
    turns = list(dict.fromkeys(each for each in map(str, task) if each in TASK_TURNS))
    if len(turns) > 1:
        expected = "one of the two: tilt and yaw are parts of the rotation, together all of it"
        yield Fault("task", f"both {turns[0]} and {turns[1]}", expected)
    if turns and mechanism.whole_task == WHOLE_TASK[:3]:
        yield Fault("task", turns[0], "some of x, y, z: the end effector is a joint, of which only the position counts")


def _point_faults(mechanism: Structure) -> Iterator[Fault]:
    """Faults of the reference point: needed for a body, given by the joint for a joint."""
    point: Any = mechanism.reference_point
    tip = next((joint for joint in mechanism.joints if joint.name == mechanism.end_effector), None)
    if not is_name(mechanism.end_effector):
        return
    if tip is not None:
        if point != tip.at:
            yield Fault("reference_point", shown(point), f"nothing: it is the centre of the joint '{tip.name}'")
    elif point is None and _moves(mechanism, mechanism.end_effector):
        yield Fault("reference_point", "nothing", "three numbers, the point of the end effector that targets place")
    elif point is not None:
        yield from number_faults("reference_point", point, 3)


def _moves(mechanism: Structure, name: str) -> bool:
    """True if the name is that of a body other than the base."""
    return name != mechanism.base and any(
        isinstance(joint.connects, tuple) and name in joint.connects for joint in mechanism.joints
    )
