"""Axes and centres that meet in a point, or lie on one line, up to rounding, moved so that they do exactly."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ..arrays import Floats
from ..rotations import square_to
from .axis_directions import Axis, Bundle

CROSSING = 0.02
"""Least sine between axes that are said to meet: nearly parallel ones meet anywhere, up to rounding."""

LEFT = 1e-13
"""What may be left where all meet, relative to the places: arithmetic. More is conditions that exclude each other."""

FURTHER = 3.0
"""How many times its rounding a joint may be moved, for others are moved with it."""

AT_ONCE = 4
"""Of meetings that ask for too much together, one of so many is given up at once: those of the fewest axes."""


@dataclass
class Meeting:
    """Axes and centres that go through one point, or lie on one line.

    Attributes
    ----------
    members : indices of axes.
    point : where, up to rounding [length].
    along : the direction of the line; None of a point.
    """

    members: frozenset[int]
    point: Floats
    along: Floats | None = None


def meetings_of(axes: Sequence[Axis], bundles: Sequence[Bundle], slack: float) -> list[Meeting]:
    """Every point in which axes meet, and every line on which several are.

    Parameters
    ----------
    axes : with directions that are exact.
    slack : what they may miss each other by besides their roundings [length].
    """
    lines = [meeting for bundle in bundles for meeting in _on_one_line(axes, bundle, slack)]
    return [*lines, *_largest(_in_one_point(axes, slack))]


def _on_one_line(axes: Sequence[Axis], bundle: Bundle, slack: float) -> Iterator[Meeting]:
    """Lines along one direction: of parallel axes, and of centres of balls."""
    candidates = [*bundle.members, *(index for index, axis in enumerate(axes) if axis.along is None)]
    pending = {index: at for index in candidates if (at := axes[index].at) is not None}
    while pending:
        first, begin = next(iter(pending.items()))
        members = [first]
        for index, at in pending.items():
            along = float((at - begin) @ bundle.along)
            off = np.linalg.norm(at - begin - along * bundle.along)
            rounding = axes[first].rounding.length + axes[index].rounding.length + bundle.bound * abs(along)
            if off <= rounding + slack and abs(along) + off > slack:
                members.append(index)
        pending = {index: at for index, at in pending.items() if index not in members}
        if len({axes[index].joint for index in members}) > 1:
            yield Meeting(frozenset(members), begin, bundle.along)


def _in_one_point(axes: Sequence[Axis], slack: float) -> Iterator[Meeting]:
    """For every two that meet, all that go through their point.

    That of two alone counts if they are on one body, which keeps them there; else they meet by chance, at home.
    """
    placed = [index for index, axis in enumerate(axes) if axis.at is not None]
    for pair in combinations(placed, 2):
        one, other = (axes[index] for index in pair)
        found = None if one.joint == other.joint else _crossing(one, other, slack)
        if found is not None:
            point, near = found
            members = [index for index in placed if _off(axes[index], point) <= _reach(axes[index], point) + near]
            if len({*pair, *members}) > 2 or one.bodies & other.bodies:
                yield Meeting(frozenset({*pair, *members}), point)


def _crossing(one: Axis, other: Axis, slack: float) -> tuple[Floats, float] | None:
    """Where two meet, and how exactly that is known; None where they do not, or are parallel."""
    if one.along is None or other.along is None:
        ball, axis = (one, other) if one.along is None else (other, one)
        point = np.asarray(ball.at)
        near = ball.rounding.length + slack
        return (point, near) if _off(axis, point) <= _reach(axis, point) + near else None
    normal = np.cross(one.along, other.along)
    sine = float(np.linalg.norm(normal))
    if sine < CROSSING:
        return None
    between = np.asarray(other.at) - np.asarray(one.at)
    arms = [float(np.cross(between, along) @ normal) / sine**2 for along in (other.along, one.along)]
    ends = [np.asarray(axis.at) + arm * np.asarray(axis.along) for axis, arm in zip((one, other), arms, strict=True)]
    near = _reach(one, ends[0]) + _reach(other, ends[1]) + slack
    if np.linalg.norm(ends[1] - ends[0]) > near:
        return None
    return np.mean(ends, axis=0), near / sine


def _off(axis: Axis, point: Floats) -> float:
    """How far an axis, or a centre, is from a point [length]."""
    offset = point - np.asarray(axis.at)
    return float(np.linalg.norm(offset if axis.along is None else np.cross(axis.along, offset)))


def _reach(axis: Axis, point: Floats) -> float:
    """How far rounding puts an axis off at a point at most [length]."""
    arm = 0.0 if axis.along is None else abs(float((point - np.asarray(axis.at)) @ axis.along))
    return axis.rounding.length + axis.rounding.angle * arm


def _largest(meetings: Iterator[Meeting]) -> list[Meeting]:
    """Those that are in no other; two that share two members are one."""
    kept: list[Meeting] = []
    for meeting in sorted(meetings, key=lambda each: -len(each.members)):
        same = next((each for each in kept if len(each.members & meeting.members) > 1), None)
        if same is None:
            kept.append(meeting)
        else:
            same.members |= meeting.members
    return kept


def moved_points(
    axes: Sequence[Axis], meetings: Sequence[Meeting], slack: float
) -> tuple[dict[int, Floats], list[Meeting]]:
    """Joint -> where it is to be for all to meet, moved as little as need be; and the meetings that could be kept.

    Every axis goes through the point of its meeting: two linear conditions on the two points; a ball is in it: three.
    """
    kept = list(meetings)
    while kept:
        points, left, over = _solved(axes, kept, slack)
        if max(left) <= LEFT * _size(axes) and not over:
            return points, kept
        wrong = [index for index, each in enumerate(kept) if over & {axes[place].joint for place in each.members}]
        wrong = sorted(wrong or [int(np.argmax(left))], key=lambda index: len(kept[index].members))
        given_up = set(wrong[: max(1, len(wrong) // AT_ONCE)])
        kept = [each for index, each in enumerate(kept) if index not in given_up]
    return {}, []


def _size(axes: Sequence[Axis]) -> float:
    return max((float(np.abs(axis.at).max()) for axis in axes if axis.at is not None), default=0.0)


def _solved(
    axes: Sequence[Axis], meetings: Sequence[Meeting], slack: float
) -> tuple[dict[int, Floats], list[float], set[int]]:
    """Joint -> its point; what is left open of each meeting [length]; joints that were moved further than they may."""
    joints = sorted({axes[index].joint for each in meetings for index in each.members})
    at = {axis.joint: np.asarray(axis.at) for axis in axes if axis.at is not None}
    stiff = np.array([max(axis.rounding.length for axis in axes if axis.joint == joint) for joint in joints]) + slack
    free = 1e3 * stiff.max()
    columns = np.repeat([*stiff, *[free] * len(meetings)], 3)
    rows, values, owners = [], [], []
    for number, meeting in enumerate(meetings):
        centre = 3 * (len(joints) + number)
        for index in meeting.members:
            along = axes[index].along if meeting.along is None else meeting.along
            across = np.eye(3) if along is None else square_to(along)
            block = np.zeros((len(across), len(columns)))
            place = 3 * joints.index(axes[index].joint)
            block[:, place : place + 3], block[:, centre : centre + 3] = across, -across
            rows.append(block)
            values.append(across @ (meeting.point - at[axes[index].joint]))
            owners += [number] * len(across)
    matrix, wanted = np.concatenate(rows), np.concatenate(values)
    moves = np.linalg.lstsq(matrix * columns, wanted, rcond=1e-12)[0] * columns
    off = np.abs(matrix @ moves - wanted)
    left = [float(off[np.array(owners) == number].max()) for number in range(len(meetings))]
    steps = moves[: 3 * len(joints)].reshape(-1, 3)
    sizes = np.linalg.norm(steps, axis=1)
    most = {joint: max(_most(axes, each) for each in meetings if _has(axes, each, joint)) for joint in joints}
    over = {joint for joint, size in zip(joints, sizes, strict=True) if size > FURTHER * (most[joint] + slack)}
    return {joint: at[joint] + step for joint, step in zip(joints, steps, strict=True)}, left, over


def _has(axes: Sequence[Axis], meeting: Meeting, joint: int) -> bool:
    return any(axes[index].joint == joint for index in meeting.members)


def _most(axes: Sequence[Axis], meeting: Meeting) -> float:
    """The largest rounding, at the point of a meeting, of its members."""
    return max(_reach(axes[index], meeting.point) for index in meeting.members)
