"""Rods: bodies between two passive joints, and those among them that are not as long as their neighbours or copies."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats
from ...machine.description.graph import welded
from ...machine.description.joints import Joint
from ...machine.description.structure import Structure
from ...tolerances import TOLERANCES

ENDS = ("revolute", "universal", "spherical")
SIDE_BY_SIDE = 0.3
"""Angle up to which two rods between the same two bodies count as a pair [rad]: one that is too long leans a little."""


class RodBody(NamedTuple):
    """A body that two passive joints hold.

    Attributes
    ----------
    between : the two bodies that it connects, in the order of their names.
    kind : types of its joints at these, which tell it from rods of other legs.
    span : from one joint to the other, (3,) [length].
    """

    name: str
    between: tuple[str, str]
    kind: tuple[tuple[str, bool], tuple[str, bool]]
    span: Floats

    @property
    def length(self) -> float:
        """Of the rod."""
        return float(np.linalg.norm(self.span))


def rods_of(mechanism: Structure) -> list[RodBody]:
    """All rods, in the order of their bodies; a cross between hinges that meet in a point is part of a joint."""
    graph, found = _Graph(mechanism), []
    for name, (one, other) in graph.held.items():
        if name in graph.crosses:
            continue
        ends = sorted([(graph.beyond(one, name), one), (graph.beyond(other, name), other)], key=lambda end: end[0])
        (first, foot), (last, head) = ends
        if first != last:
            tip = mechanism.end_effector
            kinds = sorted([(foot.type, first == tip), (head.type, last == tip)])
            found.append(RodBody(name, (first, last), (kinds[0], kinds[1]), _place(head) - _place(foot)))
    return found


class _Graph:
    """Bodies between two passive joints.

    Attributes
    ----------
    held : body -> its two joints.
    crosses : those of them whose joints are in one place.
    """

    def __init__(self, mechanism: Structure) -> None:
        fixed = [joint for joint in mechanism.joints if joint.type == "fixed"]
        self._whole = welded(fixed, mechanism.base, mechanism.end_effector)
        joints: dict[str, list[Joint]] = defaultdict(list)
        for joint in mechanism.joints:
            first, last = self._bodies(joint)
            for body in (first, last) if first != last else ():
                joints[body].append(joint)
        small = TOLERANCES.alignment * mechanism.characteristic_length
        ends = (mechanism.base, mechanism.end_effector)
        self.held = {
            body: (each[0], each[1])
            for body, each in joints.items()
            if len(each) == 2 and body not in ends and all(map(_may_end, each))
        }
        self.crosses = {
            body for body, (one, other) in self.held.items() if np.linalg.norm(_place(one) - _place(other)) <= small
        }

    def _bodies(self, joint: Joint) -> tuple[str, str]:
        first, last = joint.connects
        return self._whole.get(first, first), self._whole.get(last, last)

    def beyond(self, joint: Joint, body: str) -> str:
        """The body on the other side of a joint, and of the crosses that are part of it."""
        for _ in range(1 + len(self.crosses)):
            first, last = self._bodies(joint)
            body = last if body == first else first
            if body not in self.crosses:
                break
            one, other = self.held[body]
            joint = other if joint is one else one
        return body


def _may_end(joint: Joint) -> bool:
    return joint.type in ENDS and not joint.actuated and joint.at is not None


def _place(joint: Joint) -> Floats:
    return np.array(joint.at, dtype=float)


def uneven_rods(mechanism: Structure) -> list[tuple[RodBody, ...]]:
    """Rods that stand side by side between the same two bodies, and are not of one length."""
    small = TOLERANCES.alignment * mechanism.characteristic_length
    found = []
    for rods in _by_bodies(rods_of(mechanism)):
        uneven = {
            rod.name
            for pair in combinations(rods, 2)
            for rod in pair
            if _are_side_by_side(*pair) and abs(pair[0].length - pair[1].length) > small
        }
        if uneven:
            found.append(tuple(rod for rod in rods if rod.name in uneven))
    return found


def odd_rods(mechanism: Structure) -> list[tuple[tuple[RodBody, ...], tuple[RodBody, ...]]]:
    """The rods of one leg that are not as long as those of all its copies, with those."""
    small = TOLERANCES.alignment * mechanism.characteristic_length
    alike: dict[object, list[tuple[RodBody, ...]]] = defaultdict(list)
    for rods in _by_bodies(rods_of(mechanism)):
        if np.ptp([rod.length for rod in rods]) <= small:
            alike[len(rods), rods[0].kind].append(tuple(rods))
    found = []
    for legs in alike.values():
        lengths = np.array([rods[0].length for rods in legs])
        off = np.abs(lengths - np.median(lengths)) > small
        if len(legs) >= 3 and off.sum() == 1:
            odd = int(off.argmax())
            others = tuple(rod for place, rods in enumerate(legs) for rod in rods if place != odd)
            found.append((legs[odd], others))
    return found


def with_lengths(rods: Sequence[RodBody], unit: str) -> str:
    """Rods by name, each with its length: 'a' (250 mm) and 'b' (273 mm)."""
    told = [f"'{rod.name}' ({rod.length:.9g} {unit})" for rod in rods]
    return " and ".join([", ".join(told[:-1]), told[-1]]) if len(told) > 1 else told[0]


def _by_bodies(rods: Sequence[RodBody]) -> list[list[RodBody]]:
    found: dict[tuple[str, str], list[RodBody]] = defaultdict(list)
    for rod in rods:
        found[rod.between].append(rod)
    return list(found.values())


def _are_side_by_side(one: RodBody, other: RodBody) -> bool:
    cosine = float(one.span @ other.span) / (one.length * other.length)
    return bool(cosine >= np.cos(SIDE_BY_SIDE))
