"""The joints of a path as elementary joints in series: hinges, slides and balls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from ..description.graph import Step
from ..description.joints import Joint
from ..tolerances import TOLERANCES
from .recorded_home import RecordedHome
from .tape import Vector, area

Kind = Literal["R", "P", "S"]

HAS_LOOP = "has a loop of its own"


class NoLeg(Exception):
    """The chain is no leg with closed forms; the text says why."""


@dataclass(frozen=True, eq=False)
class ElementaryJoint:
    """A hinge (R), slide (P) or ball (S) on a path from the base outward; lengths in L; numbers are on a tape.

    Attributes
    ----------
    place : which coordinate of its joint it is.
    sense : +1 if that coordinate moves the outer body, else -1.
    inward, outward : the two bodies of the joint, in the order of the path.
    """

    kind: Kind
    axis: Vector
    point: Vector
    joint: Joint
    place: int
    sense: float
    inward: str
    outward: str

    @property
    def back(self) -> ElementaryJoint:
        """This joint on the reverse path."""
        return replace(self, sense=-self.sense, inward=self.outward, outward=self.inward)


def elementary_joints(home: RecordedHome, steps: Sequence[Step]) -> list[ElementaryJoint]:
    """The joints of a path as hinges, slides and balls; slides before hinges that turn about their direction.

    A joint cut at the end effector is a point: a ball without coordinates.
    """
    elements = [element for step in steps for element in _of_step(home, step)]
    for last in range(1, len(elements)):
        i = last
        while i and _swaps(elements[i - 1], elements[i]):
            elements[i - 1], elements[i] = elements[i], elements[i - 1]
            i -= 1
    return elements


def _of_step(home: RecordedHome, step: Step) -> list[ElementaryJoint]:
    joint, point = step.joint, home.point(step.joint)
    bodies = joint.connects if step.forward else joint.connects[::-1]

    def element(kind: Kind, axis: Vector, place: int = 0) -> ElementaryJoint:
        return ElementaryJoint(kind, axis, point, joint, place, step.sign, *bodies)

    if step.ends or joint.type == "spherical":
        return [element("S", home.vector(0.0, 0.0, 0.0))]
    if joint.type == "universal":
        elements = [element("R", axis, place) for place, axis in enumerate(home.universal_axes(joint))]
        return elements if step.forward else elements[::-1]
    axis = home.axis(joint)
    if joint.type == "cylindrical":
        elements = [element("R", axis, 0), element("P", axis, 1)]
        return elements if step.forward else elements[::-1]
    return [element("R" if joint.type == "revolute" else "P", axis)]


def _swaps(inner: ElementaryJoint, outer: ElementaryJoint) -> bool:
    """True if a slide on a hinge can be swapped with it: the slide is along the hinge's axis."""
    return inner.kind == "R" and outer.kind == "P" and are_parallel(inner, outer)


def are_parallel(first: ElementaryJoint, second: ElementaryJoint) -> bool:
    return area(first.axis, second.axis) <= TOLERANCES.implied
