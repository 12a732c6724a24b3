"""Axes that were meant to be parallel, square, or to meet, and do so up to the digits of a file, made to do so exactly.

A spherical linkage whose axes miss their common point by a ten-millionth of a metre does not move. Nor does a loop of
hinges whose axes are off by a millionth of a radian, which is what `1.5708` leaves of a quarter turn. They are locked
by no more than rounding. In the assembled home configuration joints can be moved without opening a loop, so every joint
is moved by itself, no further than rounding may have put it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence, Set
from typing import Any

import numpy as np

from ..arrays import Floats
from ..description.home_mobility import unclear_conditions, unclear_joints
from ..description.joints import Joint, Vector
from ..description.structure import Structure
from ..tolerances import TOLERANCES
from .axis_directions import ROUNDED, Axis, Bundle, bundles_of
from .axis_points import Meeting, meetings_of, moved_points
from .digits import NOTHING, Rounding, worst
from .nearest_moving import nearest_moving
from .opened import Note, OpenMechanism

UNTOLD = 1e-12
"""Angle [rad] or share of the size by which what is moved is not worth a note: what closing the loops leaves."""


def straightened(
    joints: Sequence[Joint], opened: OpenMechanism, reference: Floats | None, slack: float, told: list[Note]
) -> Sequence[Joint]:
    """The joints with what was meant exactly made exact, as far as the roundings tell it; and what was done, told.

    Joints of loops that all but lock are moved as far as rounding may have put them; others no further than what counts
    as parallel or aligned anyway, or, where nothing is known of the digits, not at all.

    Parameters
    ----------
    reference : the reference point [length].
    slack : by how much closing the loops may have moved joints out of place, besides [rad or size].
    """

    def structure(made: Sequence[Joint]) -> Structure:
        point: Any = None if reference is None else tuple(reference)
        return Structure(opened.name, tuple(made), opened.end_effector, point, opened.base)

    def unclear(made: Sequence[Joint]) -> list[float]:
        return unclear_conditions(structure(made))

    before, left = unclear(joints), len(told)
    if not opened.roundings and not before:
        return joints
    size = _size(joints)
    known = dict(opened.roundings) | dict(_of_hinges(opened, joints))
    roundings = _roundings(joints, known, size, unclear_joints(structure(joints)))
    straight = _made_exact(joints, list(_axes(joints, roundings)), slack, size, opened.length_unit, told)
    after = unclear(straight)
    if _order(after) > _order(before) or (not opened.roundings and _order(after) == _order(before)):
        del told[left:]
        straight, after = list(joints), before
    if not after:
        return straight
    if not opened.roundings:
        same = Rounding(TOLERANCES.alignment * size, TOLERANCES.alignment)
        roundings = [same if each.angle > 0.0 else each for each in roundings]
    moving = nearest_moving(
        structure(straight), [Rounding(each.length + slack * size, each.angle + slack) for each in roundings]
    )
    if moving is None:
        return straight
    told.append(_note_of_moving(straight, moving, opened.length_unit))
    return moving


def _order(unclear: Sequence[float]) -> tuple[int, float]:
    """How nearly loops lock: fewer are better, then smaller ones."""
    return len(unclear), max(unclear, default=0.0)


def _note_of_moving(joints: Sequence[Joint], moving: Sequence[Joint], unit: str) -> Note:
    """How far joints were moved to the nearest machine that moves."""
    pairs = list(zip(joints, moving, strict=True))
    shift = max((_apart(old.at, new.at) for old, new in pairs), default=0.0)
    turn = max((_apart(old.axis, new.axis) for old, new in pairs), default=0.0)
    names = tuple(old.name for old, new in pairs if _apart(old.at, new.at) + _apart(old.axis, new.axis) > UNTOLD)
    what = "the digits of the file lock the loops: made the nearest machine that moves, by up to"
    return Note(f"{what} {shift:.1g} {unit} and {turn:.1g} rad", names)


def _apart(one: Vector | Floats | None, other: Vector | Floats | None) -> float:
    return 0.0 if one is None or other is None else float(np.linalg.norm(np.subtract(one, other)))


def _size(joints: Sequence[Joint]) -> float:
    points = np.array([joint.at for joint in joints if joint.at is not None]).reshape(-1, 3)
    return float(np.linalg.norm(points - points.mean(axis=0), axis=1).max()) if len(points) > 1 else 1.0


def _of_hinges(opened: OpenMechanism, joints: Sequence[Joint]) -> Iterator[tuple[str, Rounding]]:
    """Roundings of hinges that two balls make: axes lean by what the balls are off, over the distance of these."""
    balls = {loop.name: loop for loop in opened.loops if loop.type == "spherical" and loop.name in opened.roundings}
    for joint in joints:
        if joint.type == "revolute" and joint.name in balls:
            own, first = opened.roundings[joint.name], balls[joint.name]
            others = [ball for ball in balls.values() if set(ball.connects) == set(first.connects)]
            apart = max(float(np.linalg.norm(ball.at[0] - first.at[0])) for ball in others)
            if apart > 0.0:
                yield joint.name, Rounding(own.length, own.angle + 2.0 * own.length / apart)


def _roundings(joints: Sequence[Joint], known: Mapping[str, Rounding], size: float, locked: Set[int]) -> list[Rounding]:
    """Of every joint; where nothing is known, what the digits of files are at worst."""
    other = worst(known.values()) if known else Rounding(TOLERANCES.file_gap * size, TOLERANCES.file_angle)
    same = Rounding(TOLERANCES.alignment * size, TOLERANCES.alignment) if known else NOTHING
    found = []
    for index, joint in enumerate(joints):
        own = known.get(joint.name, other)
        most = other if index in locked else same
        found.append(Rounding(min(own.length, most.length), min(own.angle, most.angle)))
    return found


def _axes(joints: Sequence[Joint], roundings: Sequence[Rounding]) -> Iterator[Axis]:
    for index, (joint, rounding) in enumerate(zip(joints, roundings, strict=True)):
        at = None if joint.at is None or joint.type == "prismatic" else np.array(joint.at)
        if joint.type == "fixed" or (joint.type == "prismatic" and joint.axis is None):
            continue
        along = [joint.axis] if joint.axis is not None else [*(joint.axes or [None])]
        for place, axis in enumerate(along):
            yield Axis(index, place, None if axis is None else np.array(axis), at, rounding, frozenset(joint.connects))


def _made_exact(
    joints: Sequence[Joint], axes: list[Axis], slack: float, size: float, unit: str, notes: list[Note]
) -> list[Joint]:
    bundles = bundles_of(axes, slack + ROUNDED)
    turned = _turned(axes, bundles)
    names = [joint.name for joint in joints]
    for axis, along in turned:
        axis.along = along
    room = (slack + ROUNDED) * size
    points, meetings = moved_points(axes, meetings_of(axes, bundles, room), room)
    notes += _notes_of_turns(names, axes, bundles, joints)
    notes += _notes_of_moves(names, axes, meetings, joints, points, size, unit)
    made = []
    for index, joint in enumerate(joints):
        own = [axis.along for axis in axes if axis.joint == index]
        changes: dict[str, Any] = {"at": points[index]} if index in points else {}
        if joint.axis is not None:
            changes["axis"] = own[0]
        if joint.axes is not None:
            changes["axes"] = own
        made.append(dataclasses.replace(joint, **changes))
    return made


def _turned(axes: Sequence[Axis], bundles: Sequence[Bundle]) -> Iterator[tuple[Axis, Floats]]:
    """Every axis, and the direction of its bundle, to its own side."""
    for bundle in bundles:
        for index in bundle.members:
            along = axes[index].along
            if along is not None:
                yield axes[index], np.sign(along @ bundle.along) * bundle.along


def _was(joints: Sequence[Joint], axis: Axis) -> Floats:
    joint = joints[axis.joint]
    return np.array(joint.axis if joint.axes is None else joint.axes[axis.place])


def _notes_of_turns(
    names: Sequence[str], axes: Sequence[Axis], bundles: Sequence[Bundle], joints: Sequence[Joint]
) -> Iterator[Note]:
    """Which axes were turned, and by how much: with those that they are parallel to, or else square."""
    square: dict[str, float] = {}
    for bundle in bundles:
        by = [_apart(_was(joints, axes[index]), axes[index].along) for index in bundle.members]
        if max(by) <= UNTOLD:
            continue
        members = tuple(dict.fromkeys(names[axes[index].joint] for index in bundle.members))
        if len(members) > 1:
            yield Note(f"axes made parallel within the digits of the file, turned by up to {max(by):.1g} rad", members)
        else:
            square[members[0]] = max(by)
    if square:
        most = max(square.values())
        yield Note(f"axes made square to others within the digits of the file, by up to {most:.1g} rad", tuple(square))


def _notes_of_moves(
    names: Sequence[str],
    axes: Sequence[Axis],
    meetings: Sequence[Meeting],
    joints: Sequence[Joint],
    points: Mapping[int, Floats],
    size: float,
    unit: str,
) -> Iterator[Note]:
    """What was moved to meet in a point or to be on one line, and by how much."""
    for meeting in meetings:
        members = sorted({axes[index].joint for index in meeting.members})
        by = max(float(np.linalg.norm(points[joint] - np.array(joints[joint].at))) for joint in members)
        if by > UNTOLD * size:
            what = "meet in one point" if meeting.along is None else "be on one line"
            found = tuple(names[joint] for joint in members)
            yield Note(f"made to {what} within the digits of the file, moved by up to {by:.1g} {unit}", found)
