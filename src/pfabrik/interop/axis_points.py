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
"""Least sine between axes that meet: nearly parallel ones meet anywhere, up to rounding."""

RESIDUAL = 1e-13
"""Residual of meetings, relative to the places, from arithmetic alone. More is conditions that exclude each other."""

FURTHER = 3.0
"""Factor on its rounding by which a joint may be moved, for others are moved with it."""

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
    slack : distance by which they may miss each other besides their roundings [length].
    """
    lines = [meeting for bundle in bundles for meeting in _on_one_line(axes, bundle, slack)]
    return [*lines, *_merged(_in_one_point(axes, slack))]


def _on_one_line(axes: Sequence[Axis], bundle: Bundle, slack: float) -> Iterator[Meeting]:
    """Lines along one direction: of parallel axes, and of centres of balls."""
    candidates = [*bundle.members, *(index for index, axis in enumerate(axes) if axis.along is None)]
    pending = [index for index in candidates if axes[index].at is not None]
    while pending:
        first = axes[pending[0]]
        members = pending[:1]
        for index in pending[1:]:
            offset = axes[index].point - first.point
            along = float(offset @ bundle.along)
            off = np.linalg.norm(offset - along * bundle.along)
            rounding = first.rounding.length + axes[index].rounding.length + bundle.bound * abs(along)
            if off <= rounding + slack and abs(along) + off > slack:
                members.append(index)
        pending = [index for index in pending if index not in members]
        if len({axes[index].joint for index in members}) > 1:
            yield Meeting(frozenset(members), first.point, bundle.along)


def _in_one_point(axes: Sequence[Axis], slack: float) -> Iterator[Meeting]:
    """For every two that meet, all that go through their point.

    That of two alone counts if they are on one body, which keeps them there; else they meet by chance, at home.
    """
    placed = [index for index, axis in enumerate(axes) if axis.at is not None]
    for pair in combinations(placed, 2):
        one, other = (axes[index] for index in pair)
        crossing = None if one.joint == other.joint else _crossing(one, other, slack)
        if crossing is not None:
            point, bound = crossing
            members = [index for index in placed if axes[index].is_through(point, bound)]
            if len({*pair, *members}) > 2 or one.bodies & other.bodies:
                yield Meeting(frozenset({*pair, *members}), point)


def _crossing(one: Axis, other: Axis, slack: float) -> tuple[Floats, float] | None:
    """The point where two meet, and its bound [length]; None where they do not, or are parallel."""
    if one.along is None or other.along is None:
        ball, axis = (one, other) if one.along is None else (other, one)
        bound = ball.rounding.length + slack
        return (ball.point, bound) if axis.is_through(ball.point, bound) else None
    normal = np.cross(one.along, other.along)
    sine = float(np.linalg.norm(normal))
    if sine < CROSSING:
        return None
    between = other.point - one.point
    ends = [
        axis.point + float(np.cross(between, along) @ normal) / sine**2 * direction
        for axis, direction, along in ((one, one.along, other.along), (other, other.along, one.along))
    ]
    bound = one.error_at(ends[0]) + other.error_at(ends[1]) + slack
    if np.linalg.norm(ends[1] - ends[0]) > bound:
        return None
    return np.mean(ends, axis=0), bound / sine


def _merged(meetings: Iterator[Meeting]) -> list[Meeting]:
    """Meetings that are in no other; two that share two members are one."""
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
    """Joint -> its point for all to meet, moved as little as need be; and the meetings that could be kept."""
    size = max((float(np.abs(axis.at).max()) for axis in axes if axis.at is not None), default=0.0)
    kept = list(meetings)
    while kept:
        points, residuals = _least_moves(axes, kept, slack)
        too_far = _moved_too_far(axes, kept, points, slack)
        if max(residuals) <= RESIDUAL * size and not too_far:
            return points, kept
        wrong = [index for index, each in enumerate(kept) if too_far & {axes[member].joint for member in each.members}]
        wrong = sorted(wrong or [int(np.argmax(residuals))], key=lambda index: len(kept[index].members))
        given_up = set(wrong[: max(1, len(wrong) // AT_ONCE)])
        kept = [each for index, each in enumerate(kept) if index not in given_up]
    return {}, []


def _least_moves(
    axes: Sequence[Axis], meetings: Sequence[Meeting], slack: float
) -> tuple[dict[int, Floats], list[float]]:
    """Joint -> its point, by least squares in units of the roundings; and the residual of each meeting [length].

    Every axis goes through the point of its meeting: two linear conditions on the two points; a ball is in it: three.
    """
    joints = sorted({axes[index].joint for each in meetings for index in each.members})
    at = {axis.joint: axis.point for axis in axes if axis.at is not None}
    units = np.array([max(axis.rounding.length for axis in axes if axis.joint == joint) for joint in joints]) + slack
    columns = np.repeat([*units, *[1e3 * units.max()] * len(meetings)], 3)  # points of meetings are free
    rows, values, owners = [], [], []
    for number, meeting in enumerate(meetings):
        centre = 3 * (len(joints) + number)
        for index in meeting.members:
            along = axes[index].along if meeting.along is None else meeting.along
            across = np.eye(3) if along is None else square_to(along)
            block = np.zeros((len(across), len(columns)))
            first = 3 * joints.index(axes[index].joint)
            block[:, first : first + 3], block[:, centre : centre + 3] = across, -across
            rows.append(block)
            values.append(across @ (meeting.point - at[axes[index].joint]))
            owners += [number] * len(across)
    matrix, offsets = np.concatenate(rows), np.concatenate(values)
    moves = np.linalg.lstsq(matrix * columns, offsets, rcond=1e-12)[0] * columns
    errors = np.abs(matrix @ moves - offsets)
    residuals = [float(errors[np.array(owners) == number].max()) for number in range(len(meetings))]
    steps = moves[: 3 * len(joints)].reshape(-1, 3)
    return {joint: at[joint] + step for joint, step in zip(joints, steps, strict=True)}, residuals


def _moved_too_far(
    axes: Sequence[Axis], meetings: Sequence[Meeting], points: dict[int, Floats], slack: float
) -> set[int]:
    """Joints that are moved farther than rounding explains."""
    bounds: dict[int, float] = {}
    for meeting in meetings:
        error = max(axes[index].error_at(meeting.point) for index in meeting.members)
        for index in meeting.members:
            bounds[axes[index].joint] = max(error, bounds.get(axes[index].joint, 0.0))
    at = {axis.joint: axis.point for axis in axes if axis.at is not None}
    steps = {joint: float(np.linalg.norm(point - at[joint])) for joint, point in points.items()}
    return {joint for joint, step in steps.items() if step > FURTHER * (bounds[joint] + slack)}
