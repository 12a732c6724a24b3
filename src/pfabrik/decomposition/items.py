"""The joints of a way as what legs are made of: hinges, slides and balls in series."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ..arrays import Floats
from ..description.graph import Step
from ..description.home_mobility import universal_axes
from ..description.joints import Joint
from ..description.mechanism import Mechanism
from ..tolerances import TOLERANCES

Kind = Literal["R", "P", "S"]

NO_AXIS = np.zeros(3)


HAS_LOOP = "has a loop of its own"


class NoLeg(Exception):
    """Why a chain is no leg that closed forms answer for."""


@dataclass(frozen=True, eq=False)
class Item:
    """A hinge, slide or ball on a way outward; lengths in L.

    Attributes
    ----------
    place : which coordinate of its joint it is.
    sense : +1 if that coordinate moves the outer body, else -1.
    inward, outward : the two bodies of the joint, in the order of the way.
    """

    kind: Kind
    axis: Floats
    point: Floats
    joint: Joint
    place: int
    sense: float
    inward: str
    outward: str

    @property
    def back(self) -> Item:
        """The same, passed the other way."""
        return replace(self, sense=-self.sense, inward=self.outward, outward=self.inward)


def items_of(mechanism: Mechanism, steps: Sequence[Step]) -> list[Item]:
    """The joints of a way as hinges, slides and balls; slides before hinges that turn about their direction.

    A joint cut at the end effector is a point: a ball without coordinates.
    """
    items = [item for step in steps for item in _items_of_step(mechanism, step)]
    for end in range(1, len(items)):
        place = end
        while place and _swaps(items[place - 1], items[place]):
            items[place - 1], items[place] = items[place], items[place - 1]
            place -= 1
    return items


def _items_of_step(mechanism: Mechanism, step: Step) -> list[Item]:
    joint, length = step.joint, mechanism.characteristic_length
    point = np.zeros(3) if joint.at is None else np.array(joint.at) / length
    bodies = joint.connects if step.forward else joint.connects[::-1]

    def item(kind: Kind, axis: Floats, place: int = 0) -> Item:
        return Item(kind, axis, point, joint, place, step.sign, *bodies)

    if step.ends or joint.type == "spherical":
        return [item("S", NO_AXIS)]
    if joint.type == "universal":
        found = [item("R", axis, place) for place, axis in enumerate(universal_axes(mechanism, joint))]
        return found if step.forward else found[::-1]
    axis = np.array(mechanism.home_axis(joint.name))
    if joint.type == "cylindrical":
        found = [item("R", axis, 0), item("P", axis, 1)]
        return found if step.forward else found[::-1]
    return [item("R" if joint.type == "revolute" else "P", axis)]


def _swaps(inner: Item, outer: Item) -> bool:
    """Whether a slide on a hinge moves as it would below it."""
    return inner.kind == "R" and outer.kind == "P" and are_parallel(inner, outer)


def are_parallel(first: Item, second: Item) -> bool:
    return area(first.axis, second.axis) <= TOLERANCES.implied


def area(a: Floats, b: Floats) -> float:
    return float(np.linalg.norm(np.cross(a, b)))
