"""Directions of axes that are parallel, square to each other or in one plane up to rounding, made so exactly."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ..arrays import Floats
from ..tolerances import TOLERANCES
from .digits import Rounding

ROUNDED = 1e-14
"""Sine that the arithmetic of a reader leaves of 0, beside the digits of the file."""

SKEW = 0.1
"""Least sine between directions that make a plane."""

STEPS = 20
"""Most steps in which directions are made square; their error is squared in each."""


@dataclass
class Axis:
    """An axis or a centre of a joint; a universal joint has two axes.

    Attributes
    ----------
    joint : index of its joint.
    given : unit vector as it was read; None of a ball.
    at : a point on it [length]; None of a slide.
    rounding : how far it is from what was meant at most.
    bodies : the two bodies of its joint.
    along : unit vector as it has been turned since.
    """

    joint: int
    given: Floats | None
    at: Floats | None
    rounding: Rounding
    bodies: frozenset[str]

    def __post_init__(self) -> None:
        self.along = self.given

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

    def turn_to(self, direction: Floats) -> None:
        """Turn it to a direction, or to the opposite one if that is nearer."""
        if self.along is not None:
            self.along = np.sign(self.along @ direction) * direction


@dataclass
class Bundle:
    """Axes that are parallel up to rounding.

    Attributes
    ----------
    members : indices of axes.
    along : the direction of all.
    bound, stiff : how far it may be from what was meant [rad]: by the worst and by the best of its members.
    has_slide : one of them is the axis of a slide.
    """

    members: list[int]
    along: Floats
    bound: float
    stiff: float
    has_slide: bool


def bundles_of(axes: Sequence[Axis], slack: float) -> list[Bundle]:
    """The axes by their direction; directions square to each other up to rounding are made so.

    Parameters
    ----------
    slack : what two directions may differ by besides their roundings [rad].
    """
    bundles = [_bundle(axes, members) for members in _parallel(axes, slack)]
    for bundle in bundles:
        _turn_to_base(bundle, slack)
    _make_square(bundles, slack)
    return bundles


def _turn_to_base(bundle: Bundle, slack: float) -> None:
    """Turn a bundle onto the axis of the base that it is along up to rounding, for targets count along these.

    By no more than counts as parallel: so it is not turned against what else its body carries.
    """
    place = int(np.abs(bundle.along).argmax())
    axis = np.sign(bundle.along[place]) * np.eye(3)[place]
    if np.linalg.norm(bundle.along - axis) <= min(bundle.stiff, TOLERANCES.alignment) + slack:
        bundle.along, bundle.stiff = axis, 0.0


def _parallel(axes: Sequence[Axis], slack: float) -> list[list[int]]:
    """Indices of axes, in lists of those that are parallel to the one in each that is known best, the first."""
    lists: list[list[int]] = []
    for index in sorted(range(len(axes)), key=lambda index: axes[index].rounding.angle):
        if axes[index].along is None:
            continue
        members = next((each for each in lists if _is_parallel(axes[each[0]], axes[index], slack)), None)
        if members is None:
            lists.append([index])
        else:
            members.append(index)
    return lists


def _is_parallel(one: Axis, other: Axis, slack: float) -> bool:
    if one.along is None or other.along is None:
        return False
    bound = one.rounding.angle + other.rounding.angle + slack
    return bool(np.linalg.norm(np.cross(one.along, other.along)) <= bound)


def _bundle(axes: Sequence[Axis], members: list[int]) -> Bundle:
    """The bundle of some axes along their mean, in which each counts by how well it is known."""
    along = np.array([axes[index].along for index in members])
    angles = np.array([axes[index].rounding.angle for index in members])
    weights = 1.0 / np.maximum(angles, 1e-6 * angles.max() + ROUNDED) ** 2
    signs = np.sign(along @ along[0])
    mean = along[0] if len(members) == 1 else (signs * weights) @ along
    has_slide = any(axes[index].at is None for index in members)
    return Bundle(members, mean / np.linalg.norm(mean), float(angles.max()), float(angles.min()), has_slide)


def _make_square(bundles: Sequence[Bundle], slack: float) -> None:
    """Turn bundles as little as need be, by how well each is known, until all that are nearly square are square."""
    relations = list(_relations(bundles, slack))
    if not relations:
        return
    begin = [bundle.along for bundle in bundles]
    stiff = np.array([bundle.stiff for bundle in bundles]) + slack
    for _ in range(STEPS):
        rows, values = np.zeros((len(relations), 3 * len(bundles))), np.zeros(len(relations))
        for row, members in enumerate(relations):
            along = [bundles[index].along for index in members]
            for place, index in enumerate(members):
                first, *more = along[:place] + along[place + 1 :]
                slope = (-1.0) ** place * np.cross(first, more[0]) if more else first
                rows[row, 3 * index : 3 * index + 3] = slope * stiff[index]
            values[row] = along[0] @ (along[1] if len(along) == 2 else np.cross(along[1], along[2]))
        turns = -np.linalg.lstsq(rows, values, rcond=1e-9)[0].reshape(-1, 3) * stiff[:, None]
        for bundle, turn in zip(bundles, turns, strict=True):
            bundle.along = (bundle.along + turn) / np.linalg.norm(bundle.along + turn)
        if np.abs(values).max() <= 0.1 * ROUNDED:
            break
    turned = [np.linalg.norm(bundle.along - old) for bundle, old in zip(bundles, begin, strict=True)]
    if any(by > 2.0 * (bundle.bound + slack) for by, bundle in zip(turned, bundles, strict=True)):
        for bundle, old in zip(bundles, begin, strict=True):  # not all of them can have been meant
            bundle.along = old


def _relations(bundles: Sequence[Bundle], slack: float) -> Iterator[tuple[int, ...]]:
    """Pairs of bundles that are square to each other, and threes in one plane, if slides are along all of them."""
    for pair in combinations(range(len(bundles)), 2):
        one, other = (bundles[index] for index in pair)
        if abs(one.along @ other.along) <= one.bound + other.bound + slack:
            yield pair
    sliding = [index for index, bundle in enumerate(bundles) if bundle.has_slide]
    for three in combinations(sliding, 3):
        along = np.array([bundles[index].along for index in three])
        skew = min(np.linalg.norm(np.cross(*along[list(pair)])) for pair in combinations(range(3), 2))
        bound = sum(bundles[index].bound for index in three) + slack
        if skew >= SKEW and abs(np.linalg.det(along)) <= bound:
            yield three
