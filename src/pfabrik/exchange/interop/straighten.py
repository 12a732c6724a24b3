"""Axes that were meant to be parallel, square, or to meet, and do so up to the digits of a file, made to do so exactly.

A spherical linkage whose axes miss their common point by a ten-millionth of a metre does not move. Nor does a loop of
hinges whose axes are off by a millionth of a radian, which is what `1.5708` leaves of a quarter turn. They are locked
by no more than rounding. In the assembled home configuration joints can be moved without opening a loop, so every joint
is moved by itself, no further than rounding may have put it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ...common.arrays import Floats
from ...machine.description.home_mobility import unclear_conditions, unclear_joints
from ...machine.description.joints import Joint, Vector
from ...machine.description.structure import Structure
from ...machine.motion.loops import loop_errors_here
from ...tolerances import TOLERANCES
from .closing import radius_around
from .digits import NOTHING, Rounding, worst
from .nearest_geometry import HOLDS, Kept, Moving, nearest_geometry, walked
from .notes import Note
from .opened import OpenMechanism
from .relations import ROUNDED, axes_of, directions, meetings

OPEN = 3e-13
"""Largest loop error with which the machine found counts as one that moves [L and rad]."""

MARGIN, CLEAR = 3.0, 1.5e-2
"""Factor on what rounding can do to first order to a singular value, and the value [L and rad] from which a condition
is one, whatever the digits of a file."""

NOT_NOTED = 1e-12
"""Angle [rad] or share of the size by which what is moved is not worth a note: what closing the loops leaves."""


def straighten(
    joints: Sequence[Joint], opened: OpenMechanism, reference: Floats | None, slack: float, notes: list[Note]
) -> Sequence[Joint]:
    """The joints with the geometry that axes were meant to have, where their roundings allow it.

    Joints of loops that all but lock are moved as far as rounding may have put them; others no further than what counts
    as parallel or aligned anyway, or, where nothing is known of the digits, not at all.

    Parameters
    ----------
    reference : the reference point [length].
    slack : by how much closing the loops may have moved joints out of place, besides [rad or size].
    """
    given = _structure(joints, opened, reference)
    below = _least_clear(opened, joints)
    has_roundings, unclear = bool(opened.roundings), unclear_conditions(given, below)
    if not has_roundings and not unclear:
        return joints
    size, more = _size(joints), slack + ROUNDED
    roundings = _roundings(given, opened, size, below)
    allowed = [Rounding(each.length + more * size, each.angle + more) for each in roundings]
    most = np.inf if opened.is_asked else TOLERANCES.alignment
    kept: Kept = [(each, None) for each in directions(axes_of(joints, roundings), more, most)]
    exact, kept = nearest_geometry(given, allowed, kept)
    kept += meetings(axes_of(exact.joints, roundings), more * size)
    exact, kept = nearest_geometry(exact, [each._replace(angle=0.0) for each in allowed], kept)
    why = "as asked for" if opened.is_asked else "within the digits of the file"
    before, after = len(unclear), len(unclear_conditions(exact, below))
    if after > before or (after == before and not has_roundings):
        return joints
    notes += _notes(given, exact, kept, size, opened.length_unit, why)
    return exact.joints


def unlocked(
    joints: Sequence[Joint], opened: OpenMechanism, reference: Floats | None, slack: float, notes: list[Note]
) -> Sequence[Joint]:
    """The joints of the nearest machine that moves, where loops all but lock and roundings explain that.

    Lengths and angles may agree in ways that no pair of axes shows: a third rod of a parallelogram. Arguments as of
    `straighten`, with joints that nothing merges any more.
    """
    given = _structure(joints, opened, reference)
    below = _least_clear(opened, joints)
    if not unclear_conditions(given, below):
        return joints
    size, more = _size(joints), slack + ROUNDED
    roundings = _roundings(given, opened, size, below)
    if not opened.roundings:
        default = Rounding(TOLERANCES.alignment * size, TOLERANCES.alignment)
        roundings = [default if each.angle > 0.0 else each for each in roundings]
    allowed = [Rounding(each.length + more * size, each.angle + more) for each in roundings]
    axes = axes_of(joints, [NOTHING] * len(joints))
    kept: Kept = [*((each, None) for each in directions(axes, HOLDS)), *meetings(axes, HOLDS * size)]
    moving = _moving(given, allowed, kept, below)
    if moving is None:
        return joints
    notes.append(_note_of_moving(joints, moving.joints, opened.length_unit))
    return moving.joints


def _structure(joints: Sequence[Joint], opened: OpenMechanism, reference: Floats | None) -> Structure:
    point: Any = None if reference is None else tuple(reference)
    return Structure(opened.name, tuple(joints), opened.end_effector, point, opened.base)


def _size(joints: Sequence[Joint]) -> float:
    return radius_around([joint.at for joint in joints if joint.at is not None])


def _least_clear(opened: OpenMechanism, joints: Sequence[Joint]) -> float:
    """Singular value [L and rad] from which a condition of the loops is one, whatever the digits of the file."""
    worst_of_all = worst(opened.roundings.values())
    return max(TOLERANCES.nearly_implied, _reach([worst_of_all] * len(joints), _size(joints)))


def _reach(roundings: Sequence[Rounding], length: float) -> float:
    """What roundings do to first order to a singular value, with a margin [L and rad]."""
    most = np.sqrt(3.0 * sum(each.angle**2 + (each.length / length) ** 2 for each in roundings))
    return min(MARGIN * float(most), CLEAR)


def _moving(structure: Structure, allowed: Sequence[Rounding], kept: Kept, below: float) -> Structure | None:
    """The nearest machine that moves, to one whose loops all but lock; None where rounding does not explain it."""
    threshold = _reach(allowed, structure.characteristic_length)
    before = unclear_conditions(structure, below)
    if not any(value <= threshold for value in before):
        return None
    for relations in (kept, []):
        moving = Moving(structure, threshold)
        found, _ = nearest_geometry(structure, allowed, relations, moving)
        if len(unclear_conditions(found, below)) < len(before):
            elsewhere = walked(found, moving.rank, 1)
            if np.abs(loop_errors_here(found, elsewhere)).max() <= OPEN:
                return found
    return None


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


def _roundings(given: Structure, opened: OpenMechanism, size: float, below: float) -> list[Rounding]:
    """The rounding of every joint; where nothing is known, that of the worst digits of files."""
    joints, known = given.joints, dict(opened.roundings) | dict(_roundings_of_hinges(opened, given.joints))
    locked = frozenset(range(len(joints))) if opened.is_asked else unclear_joints(given, below)
    coarsest = worst(known.values()) if known else Rounding(TOLERANCES.file_gap * size, TOLERANCES.file_angle)
    aligned = Rounding(TOLERANCES.alignment * size, TOLERANCES.file_angle) if known else NOTHING
    roundings = []
    for index, joint in enumerate(joints):
        parts = [known[name] for name in (joint.name, *joint.merged) if name in known]
        rounding, most = worst(parts) if parts else coarsest, coarsest if index in locked else aligned
        roundings.append(Rounding(min(rounding.length, most.length), min(rounding.angle, most.angle)))
    return roundings


def _notes(given: Structure, exact: Structure, kept: Kept, size: float, unit: str, why: str) -> Iterator[Note]:
    """Which axes were turned, with those that they are parallel to or else square, and which joints were moved."""
    joints, nothing = given.joints, [NOTHING] * len(given.joints)
    old, new = axes_of(joints, nothing), axes_of(exact.joints, nothing)
    square: dict[str, float] = {}
    for relation, point in kept:
        names = tuple(dict.fromkeys(joints[old[index].joint].name for index in relation.members))
        if point is not None:
            shift = max(_apart(old[index].at, new[index].at) for index in relation.members)
            if shift > NOT_NOTED * size:
                what = "meet in one point" if relation.line is None else "be on one line"
                yield Note(f"made to {what} {why}, moved by up to {shift:.1g} {unit}", names)
            continue
        turns = {
            joints[old[index].joint].name: _apart(old[index].along, new[index].along) for index in relation.members
        }
        turned = {name: turn for name, turn in turns.items() if turn > NOT_NOTED}
        if turned and relation.kind == "parallel" and len(names) > 1:
            yield Note(f"axes made parallel {why}, turned by up to {max(turned.values()):.1g} rad", names)
        else:
            square |= turned
    parallel = {
        old[i].joint for each, _ in kept if each.kind == "parallel" and len(each.members) > 1 for i in each.members
    }
    square = {name: turn for name, turn in square.items() if name not in {joints[index].name for index in parallel}}
    if square:
        yield Note(f"axes made square to others {why}, by up to {max(square.values()):.1g} rad", tuple(square))


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
