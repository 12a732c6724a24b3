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
from .notes import Note
from .opened import OpenMechanism

NOT_NOTED = 1e-12
"""Angle [rad] or share of the size by which what is moved is not worth a note: what closing the loops leaves."""


def straighten(
    joints: Sequence[Joint], opened: OpenMechanism, reference: Floats | None, slack: float, notes: list[Note]
) -> Sequence[Joint]:
    """The joints with exact geometry where their roundings allow it: first axis by axis, then the nearest that moves.

    Joints of loops that all but lock are moved as far as rounding may have put them; others no further than what counts
    as parallel or aligned anyway, or, where nothing is known of the digits, not at all.

    Parameters
    ----------
    reference : the reference point [length].
    slack : by how much closing the loops may have moved joints out of place, besides [rad or size].
    """

    def structure(joints: Sequence[Joint]) -> Structure:
        point: Any = None if reference is None else tuple(reference)
        return Structure(opened.name, tuple(joints), opened.end_effector, point, opened.base)

    has_roundings, unclear = bool(opened.roundings), unclear_conditions(structure(joints))
    if not has_roundings and not unclear:
        return joints
    size = _size(joints)
    known = dict(opened.roundings) | dict(_roundings_of_hinges(opened, joints))
    locked = frozenset(range(len(joints))) if opened.is_asked else unclear_joints(structure(joints))
    roundings = _roundings(joints, known, size, locked)
    exact, exact_notes = _made_exact(joints, roundings, slack, size, opened.length_unit)
    exact_unclear = unclear_conditions(structure(exact))
    before, after = _severity(unclear), _severity(exact_unclear)
    if after < before or (after == before and has_roundings):
        notes += exact_notes
    else:
        exact, exact_unclear = list(joints), unclear
    if not exact_unclear:
        return exact
    if not has_roundings:
        default = Rounding(TOLERANCES.alignment * size, TOLERANCES.alignment)
        roundings = [default if each.angle > 0.0 else each for each in roundings]
    allowed = [Rounding(each.length + slack * size, each.angle + slack) for each in roundings]
    moving = nearest_moving(structure(exact), allowed)
    if moving is None:
        return exact
    notes.append(_note_of_moving(exact, moving, opened.length_unit))
    return moving


def _severity(unclear: Sequence[float]) -> tuple[int, float]:
    """How nearly loops lock: fewer conditions are better, then smaller ones."""
    return len(unclear), max(unclear, default=0.0)


def _size(joints: Sequence[Joint]) -> float:
    points = np.array([joint.at for joint in joints if joint.at is not None]).reshape(-1, 3)
    return float(np.linalg.norm(points - points.mean(axis=0), axis=1).max()) if len(points) > 1 else 1.0


def _roundings_of_hinges(opened: OpenMechanism, joints: Sequence[Joint]) -> Iterator[tuple[str, Rounding]]:
    """Roundings of hinges that two balls make: axes lean by what the balls are off, over the distance of these."""
    balls = {loop.name: loop for loop in opened.loops if loop.type == "spherical" and loop.name in opened.roundings}
    for joint in joints:
        if joint.type == "revolute" and joint.name in balls:
            rounding, ball = opened.roundings[joint.name], balls[joint.name]
            pair = [each for each in balls.values() if set(each.connects) == set(ball.connects)]
            apart = max(float(np.linalg.norm(each.at[0] - ball.at[0])) for each in pair)
            if apart > 0.0:
                yield joint.name, Rounding(rounding.length, rounding.angle + 2.0 * rounding.length / apart)


def _roundings(joints: Sequence[Joint], known: Mapping[str, Rounding], size: float, locked: Set[int]) -> list[Rounding]:
    """The rounding of every joint; where nothing is known, that of the worst digits of files."""
    coarsest = worst(known.values()) if known else Rounding(TOLERANCES.file_gap * size, TOLERANCES.file_angle)
    aligned = Rounding(TOLERANCES.alignment * size, TOLERANCES.file_angle) if known else NOTHING
    roundings = []
    for index, joint in enumerate(joints):
        rounding, most = known.get(joint.name, coarsest), coarsest if index in locked else aligned
        roundings.append(Rounding(min(rounding.length, most.length), min(rounding.angle, most.angle)))
    return roundings


def _made_exact(
    joints: Sequence[Joint], roundings: Sequence[Rounding], slack: float, size: float, unit: str
) -> tuple[list[Joint], list[Note]]:
    """Axes parallel and square to each other where they are up to rounding, then meeting, or on one line."""
    axes = list(_axes(joints, roundings))
    bundles = bundles_of(axes, slack + ROUNDED)
    for bundle in bundles:
        for index in bundle.members:
            axes[index].turn_to(bundle.along)
    slack_length = (slack + ROUNDED) * size
    points, meetings = moved_points(axes, meetings_of(axes, bundles, slack_length), slack_length)
    exact = []
    for index, joint in enumerate(joints):
        along = [axis.along for axis in axes if axis.joint == index]
        changes: dict[str, Any] = {"at": points[index]} if index in points else {}
        if joint.axis is not None:
            changes["axis"] = along[0]
        if joint.axes is not None:
            changes["axes"] = along
        exact.append(dataclasses.replace(joint, **changes))
    notes = [*_notes_of_turns(joints, axes, bundles), *_notes_of_moves(joints, axes, meetings, points, size, unit)]
    return exact, notes


def _axes(joints: Sequence[Joint], roundings: Sequence[Rounding]) -> Iterator[Axis]:
    for index, (joint, rounding) in enumerate(zip(joints, roundings, strict=True)):
        if joint.type == "fixed" or (joint.type == "prismatic" and joint.axis is None):
            continue
        at = None if joint.type == "prismatic" or joint.at is None else np.array(joint.at)
        for along in [joint.axis] if joint.axis is not None else [*(joint.axes or [None])]:
            direction = None if along is None else np.array(along)
            yield Axis(index, direction, at, rounding, frozenset(joint.connects))


def _notes_of_turns(joints: Sequence[Joint], axes: Sequence[Axis], bundles: Sequence[Bundle]) -> Iterator[Note]:
    """Which axes were turned, and by how much: with those that they are parallel to, or else square."""
    square: dict[str, float] = {}
    for bundle in bundles:
        turn = max(_apart(axes[index].given, axes[index].along) for index in bundle.members)
        if turn <= NOT_NOTED:
            continue
        names = tuple(dict.fromkeys(joints[axes[index].joint].name for index in bundle.members))
        if len(names) > 1:
            yield Note(f"axes made parallel within the digits of the file, turned by up to {turn:.1g} rad", names)
        else:
            square[names[0]] = turn
    if square:
        most = max(square.values())
        yield Note(f"axes made square to others within the digits of the file, by up to {most:.1g} rad", tuple(square))


def _notes_of_moves(
    joints: Sequence[Joint],
    axes: Sequence[Axis],
    meetings: Sequence[Meeting],
    points: Mapping[int, Floats],
    size: float,
    unit: str,
) -> Iterator[Note]:
    """Which joints were moved to meet in a point or to be on one line, and by how much."""
    for meeting in meetings:
        members = sorted({axes[index].joint for index in meeting.members})
        shift = max(_apart(points[joint], joints[joint].at) for joint in members)
        if shift > NOT_NOTED * size:
            what = "meet in one point" if meeting.along is None else "be on one line"
            names = tuple(joints[joint].name for joint in members)
            yield Note(f"made to {what} within the digits of the file, moved by up to {shift:.1g} {unit}", names)


def _note_of_moving(joints: Sequence[Joint], moving: Sequence[Joint], unit: str) -> Note:
    """Which joints were moved to the nearest machine that moves, and how far."""
    shifts = [_apart(old.at, new.at) for old, new in zip(joints, moving, strict=True)]
    turns = [_apart(old.axis, new.axis) for old, new in zip(joints, moving, strict=True)]
    moved = zip(joints, shifts, turns, strict=True)
    names = tuple(joint.name for joint, shift, turn in moved if shift + turn > NOT_NOTED)
    what = "the digits of the file lock the loops: made the nearest machine that moves, by up to"
    return Note(f"{what} {max(shifts, default=0.0):.1g} {unit} and {max(turns, default=0.0):.1g} rad", names)


def _apart(one: Vector | Floats | None, other: Vector | Floats | None) -> float:
    return 0.0 if one is None or other is None else float(np.linalg.norm(np.subtract(one, other)))
