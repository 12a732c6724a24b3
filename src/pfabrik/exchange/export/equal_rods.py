"""Rods of a pair that single precision cannot tell apart."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats
from ...machine.description.joints import Joint
from ...machine.description.mechanism import Mechanism
from ...tolerances import TOLERANCES

EQUAL = 1e-6
"""Difference of two rods at home up to which they are equal [L], and sine up to which the axis of a crank is parallel
to the line between them: ten times the rounding of single precision. A pair then keeps the orientation to the last
digit, which otherwise is searched for at every target."""


class _Rod(NamedTuple):
    """A rod between two bodies, by their names: where it ends on them, and its joint on the second."""

    name: str
    bodies: tuple[str, str]
    ends: tuple[Floats, Floats]
    last: Joint

    @property
    def line(self) -> Floats:
        return np.asarray(self.ends[1] - self.ends[0])


def with_equal_rods(mechanism: Mechanism) -> tuple[Mechanism, list[str]]:
    """The machine with equal rods where two between the same bodies nearly are, and the names of those that change.

    Of a pair the second has its second end where the first, put at its first end, would have it. A crank that carries a
    pair turns about the line between its rods, if it nearly does.
    """
    length, names, first_rods = mechanism.characteristic_length, [], list[_Rod]()
    changed: dict[str, Joint] = {}
    for rod in _rods(mechanism):
        alike = (other for other in first_rods if other.bodies == rod.bodies)
        first = next((other for other in alike if np.abs(rod.line - other.line).max() <= EQUAL * length), None)
        if first is None:
            first_rods.append(rod)
            continue
        turned = _turned_cranks(mechanism, rod, first)
        if np.abs(rod.line - first.line).max() > TOLERANCES.implied * length:
            x, y, z = map(float, rod.ends[0] + first.line)
            changed[rod.last.name] = replace(rod.last, at=(x, y, z))
        if turned or rod.last.name in changed:
            names.append(rod.name)
        changed |= turned
    if not changed:
        return mechanism, []
    return mechanism._with_joints(changed.get(joint.name, joint) for joint in mechanism.joints), names


def _rods(mechanism: Mechanism) -> list[_Rod]:
    """Bodies between two joints that have a place and are not driven."""
    rods = []
    for body in mechanism.bodies:
        ends = [joint for joint in mechanism.joints if body in joint.connects]
        if len(ends) == 2 and all(end.at is not None and not end.actuated for end in ends):
            others = {next(other for other in end.connects if other != body): end for end in ends}
            if len(others) == 2:
                (a, first), (b, last) = sorted(others.items())
                rods.append(_Rod(body, (a, b), (np.array(first.at), np.array(last.at)), last))
    return rods


def _turned_cranks(mechanism: Mechanism, rod: _Rod, first: _Rod) -> dict[str, Joint]:
    """The hinges, by name, of bodies that carry two rods, about the line between the ends of these there."""
    turned = {}
    for body, end, other in zip(rod.bodies, rod.ends, first.ends, strict=True):
        hinges = [joint for joint in mechanism.joints if body in joint.connects and joint.type == "revolute"]
        across = end - other
        size = np.linalg.norm(across)
        if len(hinges) != 1 or not size > 0.0:
            continue
        axis = np.array(hinges[0].axis)
        along = across * (np.copysign(1.0, axis @ across) / size)
        if TOLERANCES.implied < np.linalg.norm(axis - along) <= EQUAL:
            turned[hinges[0].name] = replace(hinges[0], axis=along)
    return turned
