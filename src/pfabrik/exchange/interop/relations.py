"""Relations that axes of a file were meant to have: parallel, also to the base's axes, square, coplanar, concurrent.

Each is an equation on small displacements of the joints, a turn w [rad] and a shift s [L] at the joint's point. With a
an axis, p a point of it and c the common point, free, of what meets,

    a x d = 0,    a . b = 0,    det(a, b, c) = 0,    a x (p - c) = 0,    da = w x a,    dp = s.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats
from ...common.rotations import square_to
from ...machine.description.joints import Joint
from ...tolerances import TOLERANCES
from .digits import Rounding

ROUNDED = 1e-14
"""Sine that the arithmetic of a reader leaves of 0, beside the digits of the file."""

SKEW, CROSSING = 0.1, 0.02
"""Least sines between directions that make a plane, and between axes that meet: nearly parallel ones meet anywhere."""


class Axis(NamedTuple):
    """An axis or a centre of a joint; a universal joint has two axes.

    Attributes
    ----------
    joint : index of its joint.
    along : unit vector; None of a ball.
    at : a point on it [length]; None of a slide.
    rounding : how far it may be from what was meant.
    bodies : the two bodies of its joint.
    """

    joint: int
    along: Floats | None
    at: Floats | None
    rounding: Rounding
    bodies: frozenset[str]

    @property
    def point(self) -> Floats:
        """The point on it [length], of a hinge or ball."""
        return np.asarray(self.at)

    def error_at(self, point: Floats) -> float:
        """How far rounding puts it off at a point, at most [length]."""
        arm = 0.0 if self.along is None else abs(float((point - self.point) @ self.along))
        return self.rounding.length + self.rounding.angle * arm

    def is_through(self, point: Floats, bound: float) -> bool:
        """True if it is at a point up to its rounding and a bound [length]."""
        offset = point - self.point
        distance = np.linalg.norm(offset if self.along is None else np.cross(self.along, offset))
        return bool(distance <= self.error_at(point) + bound)


def axes_of(joints: Sequence[Joint], roundings: Sequence[Rounding]) -> list[Axis]:
    """All axes and centres of the joints."""
    axes = []
    for index, (joint, rounding) in enumerate(zip(joints, roundings, strict=True)):
        if joint.type == "fixed" or (joint.type == "prismatic" and joint.axis is None):
            continue
        at = None if joint.type == "prismatic" or joint.at is None else np.array(joint.at)
        for along in [joint.axis] if joint.axis is not None else [*(joint.axes or [None])]:
            direction = None if along is None else np.array(along) / np.linalg.norm(along)
            axes.append(Axis(index, direction, at, rounding, frozenset(joint.connects)))
    return axes


class Relation(NamedTuple):
    """Axes that stand in a relation.

    Attributes
    ----------
    kind : "parallel", "square" (of two axes, or of three in one plane) or "meeting".
    members : indices of axes.
    bound : how far rounding explains it to be missed [rad, or length].
    along : of what is parallel, the axis of the base that it is along, if any.
    line : of what is on one line, the axis that it is along; None of what meets in a point.
    """

    kind: str
    members: tuple[int, ...]
    bound: float
    along: Floats | None = None
    line: int | None = None


Slope = tuple[int, bool, Floats]
"""A slope (k, 3) by a joint's turn, or by its shift (True); by the common point where the joint's index is -1."""


def equations(
    axes: Sequence[Axis], relation: Relation, centre: Floats | None, length: float
) -> Iterator[tuple[Floats, list[Slope]]]:
    """Yield the values (k,) and slopes of each equation of a relation; `centre` is the common point, if any [L]."""
    first, *others = relation.members
    if relation.kind == "parallel":
        across = np.array(square_to(_along(axes[first])))  # along the axis nothing is asked
        if relation.along is not None:
            slopes: list[Slope] = [(axes[first].joint, False, across @ _tilt(axes[first], relation.along))]
            yield across @ np.cross(_along(axes[first]), relation.along), slopes
        for other in others:
            one, axis = axes[first], axes[other]
            tilts = across @ _tilt(axis, _along(one)), across @ _tilt(one, _along(axis))
            yield (
                across @ np.cross(_along(axis), _along(one)),
                [(axis.joint, False, tilts[0]), (one.joint, False, -tilts[1])],
            )
    elif relation.kind == "square":
        along = [_along(axes[index]) for index in relation.members]
        slopes = []
        for place, index in enumerate(relation.members):
            rest = along[:place] + along[place + 1 :]
            normal = (-1.0) ** place * np.cross(rest[0], rest[1]) if len(rest) == 2 else rest[0]
            slopes.append((axes[index].joint, False, np.cross(along[place], normal)[None]))
        normal = np.cross(along[1], along[2]) if len(along) == 3 else along[1]
        yield np.array([along[0] @ normal]), slopes
    else:
        for index in relation.members:
            axis = axes[index] if relation.line is None else axes[relation.line]
            offset = axes[index].point / length - np.asarray(centre)
            onto = np.eye(3) if axis.along is None else np.array(square_to(axis.along))
            across = onto if axis.along is None else onto @ _cross(axis.along)
            slopes = [(axes[index].joint, True, across), (-1, True, -across)]
            if axis.along is not None:
                slopes.append((axis.joint, False, onto @ _tilt(axis, offset)))
            yield across @ offset, slopes


def _along(axis: Axis) -> Floats:
    return np.asarray(axis.along)


def _cross(vector: Floats) -> Floats:
    """The matrix of a cross product with a vector from the left."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _tilt(axis: Axis, vector: Floats) -> Floats:
    """The slope of the cross product of an axis and a vector by the turn of the axis's joint."""
    return _cross(vector) @ _cross(_along(axis))


def directions(axes: Sequence[Axis], slack: float, most: float = TOLERANCES.alignment) -> list[Relation]:
    """Axes that are parallel, and of these those along an axis of the base, square to others, or in a plane of slides.

    Parameters
    ----------
    slack : what two directions may differ by besides their roundings [rad].
    most : turn [rad] by which axes are put along one of the base, along which targets count. By no more than counts as
        parallel they are not turned against what else their bodies carry.
    """
    lists: list[list[int]] = []
    for index in sorted(range(len(axes)), key=lambda index: axes[index].rounding.angle):
        axis = axes[index]
        if axis.along is None:
            continue
        for members in lists:
            bound = axes[members[0]].rounding.angle + axis.rounding.angle + slack
            if np.linalg.norm(np.cross(_along(axes[members[0]]), axis.along)) <= bound:
                members.append(index)
                break
        else:
            lists.append([index])
    bundles = [_bundle(axes, members, slack, most) for members in lists]
    means = [_mean(axes, each) if each.along is None else each.along for each in bundles]
    square = []
    for one, other in combinations(range(len(bundles)), 2):
        bound = bundles[one].bound + bundles[other].bound + slack
        is_fixed = bundles[one].along is not None and bundles[other].along is not None
        if abs(means[one] @ means[other]) <= bound and not is_fixed:
            square.append(Relation("square", (bundles[one].members[0], bundles[other].members[0]), bound))
    sliding = [n for n, each in enumerate(bundles) if any(axes[index].at is None for index in each.members)]
    for three in combinations(sliding, 3):
        along = np.array([means[number] for number in three])
        skew = min(np.linalg.norm(np.cross(*along[list(pair)])) for pair in combinations(range(3), 2))
        bound = sum(bundles[number].bound for number in three) + slack
        if skew >= SKEW and abs(np.linalg.det(along)) <= bound:
            square.append(Relation("square", tuple(bundles[number].members[0] for number in three), bound))
    return [*(each for each in bundles if each.along is not None or len(each.members) > 1), *square]


def _mean(axes: Sequence[Axis], bundle: Relation) -> Floats:
    """The direction of parallel axes, in which each counts by how well it is known."""
    along = np.array([axes[index].along for index in bundle.members])
    angles = np.array([axes[index].rounding.angle for index in bundle.members])
    weights = 1.0 / np.maximum(angles, 1e-6 * angles.max() + ROUNDED) ** 2
    mean = (np.sign(along @ along[0]) * weights) @ along
    return along[0] if len(along) == 1 else np.asarray(mean / np.linalg.norm(mean))


def _bundle(axes: Sequence[Axis], members: list[int], slack: float, most: float) -> Relation:
    """Parallel axes, and the axis of the base that they are along, if any."""
    angles = [axes[index].rounding.angle for index in members]
    bundle = Relation("parallel", tuple(members), max(angles))
    mean = _mean(axes, bundle)
    place = int(np.abs(mean).argmax())
    axis = np.sign(mean[place]) * np.eye(3)[place] + 0.0
    is_along = np.linalg.norm(mean - axis) <= min(*angles, most) + slack
    return bundle._replace(along=axis if is_along else None)


def meetings(axes: Sequence[Axis], slack: float) -> list[tuple[Relation, Floats]]:
    """Axes and centres that are on one line, or go through one point, and where [length].

    Parameters
    ----------
    axes : with directions that are exact.
    slack : distance by which they may miss each other besides their roundings [length].
    """
    return [*_on_one_line(axes, slack), *_merged(_in_one_point(axes, slack))]


def _on_one_line(axes: Sequence[Axis], slack: float) -> Iterator[tuple[Relation, Floats]]:
    """Lines along one direction: of parallel axes, and of centres of balls."""
    placed = [index for index, axis in enumerate(axes) if axis.at is not None]
    pending = [index for index in placed if axes[index].along is not None]
    balls = [index for index in placed if axes[index].along is None]
    while pending:
        line = _along(axes[pending[0]])
        parallel = [index for index in pending if np.linalg.norm(np.cross(line, _along(axes[index]))) <= ROUNDED]
        pending = [index for index in pending if index not in parallel]
        bound = max(axes[index].rounding.angle for index in parallel)
        waiting = [*parallel, *balls]
        while waiting:
            first, members, errors = axes[waiting[0]], waiting[:1], [0.0]
            for index in waiting[1:]:
                offset = axes[index].point - first.point
                along = float(offset @ line)
                off = float(np.linalg.norm(offset - along * line))
                error = first.rounding.length + axes[index].rounding.length + bound * abs(along)
                if off <= error + slack and abs(along) + off > slack:
                    members.append(index)
                    errors.append(error)
            waiting = [index for index in waiting if index not in members]
            if len({axes[index].joint for index in members}) > 1:
                yield Relation("meeting", tuple(members), max(errors), line=parallel[0]), first.point


def _in_one_point(axes: Sequence[Axis], slack: float) -> Iterator[tuple[Relation, Floats]]:
    """For every two that meet, all that go through their point.

    That of two alone counts if they are on one body, which keeps them there; else they meet by chance, at home.
    """
    placed = [index for index, axis in enumerate(axes) if axis.at is not None]
    for pair in combinations(placed, 2):
        one, other = (axes[index] for index in pair)
        crossing = None if one.joint == other.joint else _crossing(one, other, slack)
        if crossing is not None:
            point, bound = crossing
            members = {*pair, *(index for index in placed if axes[index].is_through(point, bound))}
            if len(members) > 2 or one.bodies & other.bodies:
                error = max(axes[index].error_at(point) for index in members)
                yield Relation("meeting", tuple(sorted(members)), error), point


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


def _merged(found: Iterator[tuple[Relation, Floats]]) -> list[tuple[Relation, Floats]]:
    """Meetings that are in no other; two that share two members are one."""
    kept: list[tuple[Relation, Floats]] = []
    for meeting, point in sorted(found, key=lambda each: -len(each[0].members)):
        for place, (other, at) in enumerate(kept):
            if len({*other.members} & {*meeting.members}) > 1:
                members = tuple(sorted({*other.members, *meeting.members}))
                kept[place] = (other._replace(members=members, bound=max(other.bound, meeting.bound)), at)
                break
        else:
            kept.append((meeting, point))
    return kept
