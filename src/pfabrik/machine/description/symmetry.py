"""Joints that are nearly, but not quite, copies of each other by turns about an axis: probably slips.

A machine of n equal legs falls onto itself when it is turned by 1/n of a full turn. If most of its joints do so, and
the others miss by little, these were probably meant to.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from itertools import combinations, permutations
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints
from .joints import Joint
from .structure import Structure

EXACT, NEAR = 1e-3, 2e-2
"""Distance up to which a joint counts as a copy, as files give lengths to some digits, and as nearly one [L]."""

GAP = 10.0
"""How many times farther off slips are than copies, at least: measured machines are off everywhere."""

COUNTS = range(3, 9)
MOST_JOINTS, MOST_OF_A_KIND = 48, 12
"""Most joints of a machine that is looked at, and most of a kind that axes are sought from."""

MOST_AXES = 8


class NearCopy(NamedTuple):
    """A joint beside the place where another one comes by a turn.

    Attributes
    ----------
    distance : from there [length].
    angle, axis, centre : of the turn [rad], unit vector (3,), a point on it [length].
    n_turns : turns by the least angle that make a full one.
    n_exact, n_joints : joints that are copies of each other, of those that should be.
    """

    joint: str
    like: str
    distance: float
    angle: float
    axis: Floats
    centre: Floats
    n_turns: int
    n_exact: int
    n_joints: int


class _Fit(NamedTuple):
    """How many joints are copies, how far off at most, and the others: (joint, like, turns, distance) [length]."""

    exact: int
    farthest: float
    slips: list[tuple[int, int, int, float]]

    def has_slips(self) -> bool:
        """True if most joints are copies, and the others miss by little, but by much more than these."""
        nearest = min((distance for *_, distance in self.slips), default=0.0)
        return self.exact >= max(4, 2 * len(self.slips)) and nearest > GAP * self.farthest


def near_copies(mechanism: Structure) -> list[NearCopy]:
    """The joints that miss their places among copies; none where all are copies, or many are not."""
    joints = [joint for joint in mechanism.joints if joint.at is not None]
    has_loops = len(mechanism.joints) >= len({body for joint in mechanism.joints for body in joint.connects})
    if not has_loops or not 2 * COUNTS[0] <= len(joints) <= MOST_JOINTS:
        return []
    size = mechanism.characteristic_length
    points = np.array([joint.at for joint in joints], float)
    kinds = _kinds(mechanism, joints)
    best: list[NearCopy] = []
    for axis, centre in _axes(points, kinds, mechanism):
        for count in COUNTS:
            fit = _fit(points - centre, kinds, axis, count, size)
            if fit is None or not fit.exact:
                continue
            if not fit.slips:
                return []  # by design: what is nearly a copy by other turns is one by these
            if fit.has_slips() and (not best or fit.exact > best[0].n_exact):
                best = [
                    NearCopy(
                        joint=joints[odd].name,
                        like=joints[like].name,
                        distance=distance,
                        angle=2.0 * np.pi * turns / count,
                        axis=axis,
                        centre=centre,
                        n_turns=count,
                        n_exact=fit.exact,
                        n_joints=fit.exact + len(fit.slips),
                    )
                    for odd, like, turns, distance in fit.slips
                ]
    return best


def _kinds(mechanism: Structure, joints: Sequence[Joint]) -> list[Ints]:
    """Indices of joints of one type, driven or not, and on the base or end effector alike."""
    ends = (mechanism.base, mechanism.end_effector)
    found: dict[object, list[int]] = defaultdict(list)
    for index, joint in enumerate(joints):
        found[joint.type, joint.actuated, tuple(end in joint.connects for end in ends)].append(index)
    return [np.array(indices) for indices in found.values()]


def _axes(points: Floats, kinds: Sequence[Ints], mechanism: Structure) -> Iterator[tuple[Floats, Floats]]:
    """Axes of possible turns: those of coordinates, and of three points that may be corners of a regular polygon."""
    middle = np.array(mechanism.reference_point, float)
    for axis in np.eye(3):
        yield axis, np.zeros(3)
        if np.linalg.norm(np.cross(axis, middle)) > 0.0:
            yield axis, middle - axis * (axis @ middle)
    votes: Counter[tuple[float, ...]] = Counter()
    size = mechanism.characteristic_length
    for kind in kinds:
        if len(kind) <= MOST_OF_A_KIND:
            for triple in permutations(points[kind], 3):
                if (found := _axis_of(*triple, size)) is not None:
                    votes[tuple(np.round([*found[0], *(found[1] / size)], 3) + 0.0)] += 1
    for values, _ in votes.most_common(MOST_AXES):
        axis, centre = np.array(values[:3]), size * np.array(values[3:])
        yield _unrounded(axis / np.linalg.norm(axis), centre, points, kinds, size)


def _axis_of(first: Floats, middle: Floats, last: Floats, size: float) -> tuple[Floats, Floats] | None:
    """Axis and centre of the regular polygon that three points are successive corners of, if they may be."""
    one, other = first - middle, last - middle
    lengths = np.linalg.norm(one), np.linalg.norm(other)
    if min(lengths) < NEAR * size or abs(lengths[0] - lengths[1]) > EXACT * size:
        return None
    inner = np.arccos(np.clip(one @ other / (lengths[0] * lengths[1]), -1.0, 1.0))
    count = round(2.0 * np.pi / max(np.pi - inner, 1e-3))
    if count not in COUNTS or abs(np.pi - inner - 2.0 * np.pi / count) > EXACT:
        return None
    axis = np.cross(other, one)
    axis *= np.sign(axis[np.abs(axis).argmax()]) / np.linalg.norm(axis)
    inward = one + other
    radius = lengths[0] / (2.0 * np.sin(np.pi / count))
    centre = middle + radius * inward / np.linalg.norm(inward)
    return axis, centre - axis * (axis @ centre)


def _unrounded(
    axis: Floats, centre: Floats, points: Floats, kinds: Sequence[Ints], size: float
) -> tuple[Floats, Floats]:
    """The first axis of three points that is like a rounded one."""
    for kind in kinds:
        for triple in permutations(points[kind], 3) if len(kind) <= MOST_OF_A_KIND else ():
            found = _axis_of(*triple, size)
            if found and found[0] @ axis > 1.0 - EXACT and np.linalg.norm(found[1] - centre) < 2.0 * EXACT * size:
                return found
    return axis, centre


def _fit(points: Floats, kinds: Sequence[Ints], axis: Floats, count: int, size: float) -> _Fit | None:
    """How points (n, 3) fall onto those of their kind by turns about an axis through the origin [length].

    None if some point has too few copies to tell where it belongs. Kinds of fewer points than turns do not count, nor
    do points on the axis.
    """
    turned = np.stack([points @ _turn(axis, 2.0 * np.pi * step / count).T for step in range(count)])
    off_axis = np.linalg.norm(points - np.outer(points @ axis, axis), axis=1) > NEAR * size
    fit = _Fit(0, 0.0, [])
    for kind in kinds:
        pending = [int(index) for index in kind if off_axis[index]]
        if len(pending) < count:
            continue
        while pending:
            if len(pending) < count:
                return None
            orbits = [_orbit(index, pending, points, turned[:, index]) for index in pending]
            distances = np.array([each for _, each in orbits])
            best = int(np.lexsort((distances.sum(axis=1), -(distances <= EXACT * size).sum(axis=1)))[0])
            first, (members, away) = pending[best], orbits[best]
            is_exact = away <= EXACT * size
            if away.max() > NEAR * size or 2 * is_exact.sum() <= count:
                return None
            slips = [(members[turns], first, turns, float(away[turns])) for turns in np.flatnonzero(~is_exact).tolist()]
            farthest = max(fit.farthest, float(away[is_exact].max()))
            fit = _Fit(fit.exact + int(is_exact.sum()), farthest, fit.slips + slips)
            pending = [index for index in pending if index not in members]
    return fit


def _orbit(index: int, pending: Sequence[int], points: Floats, images: Floats) -> tuple[list[int], Floats]:
    """The point nearest to each image (count, 3) of a point, each taken once; and how far they are from there."""
    members, away = [index], [0.0]
    others = [each for each in pending if each != index]
    for image in images[1:]:
        distances = np.linalg.norm(points[others] - image, axis=1)
        nearest = int(distances.argmin())
        members.append(others.pop(nearest))
        away.append(float(distances[nearest]))
    return members, np.array(away)


def _turn(axis: Floats, angle: float) -> Floats:
    """The matrix of a rotation (3, 3), by Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn: Floats = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return turn


class Round(NamedTuple):
    """Joints whose names end in 1, 2, 3…, and that stand round an axis in this order.

    Attributes
    ----------
    names : of the joints, in order.
    axis : unit vector (3,) that they are turned about, right-handed.
    """

    names: tuple[str, ...]
    axis: Floats


def crossed_rounds(mechanism: Structure) -> list[tuple[Round, Round]]:
    """Numbered joints that share the bodies of each number, and go round different axes, or round one the other way.

    Their bodies cannot be copies of each other.
    """
    rounds = list(_rounds(mechanism))
    bodies = {joint.name: set(joint.connects) - {mechanism.base, mechanism.end_effector} for joint in mechanism.joints}
    return [
        (one, other)
        for one, other in combinations(rounds, 2)
        if len(one.names) == len(other.names)
        and all(bodies[first] & bodies[second] for first, second in zip(one.names, other.names, strict=True))
        and one.axis @ other.axis < 1.0 - NEAR
    ]


def _rounds(mechanism: Structure) -> Iterator[Round]:
    families: dict[str, dict[int, Joint]] = defaultdict(dict)
    for joint in mechanism.joints:
        if joint.at is not None and (parts := re.fullmatch(r"(.*?)([1-9][0-9]?)", joint.name)):
            families[parts[1]][int(parts[2])] = joint
    size = mechanism.characteristic_length
    for family in families.values():
        count = len(family)
        if count not in COUNTS or set(family) != set(range(1, count + 1)):
            continue
        points = np.array([family[number].at for number in range(1, count + 1)], float)
        offsets = points - points.mean(axis=0)
        area = np.cross(offsets, np.roll(offsets, -1, axis=0)).sum(axis=0)
        if np.linalg.norm(area) <= (NEAR * size) ** 2:
            continue
        axis = area / np.linalg.norm(area)
        turned = offsets @ _turn(axis, 2.0 * np.pi / count).T
        if np.linalg.norm(turned - np.roll(offsets, -1, axis=0), axis=1).max() <= EXACT * size:
            yield Round(tuple(family[number].name for number in range(1, count + 1)), axis)
