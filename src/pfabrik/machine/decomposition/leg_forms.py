"""The forms of a leg (a rod, a pivot, a kept axis, a redundant joint) and the elementary joints of its path."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from ...kernels.legs import records as K
from ...tolerances import TOLERANCES
from ..description.graph import Step
from ..description.joints import Joint
from ..noted_vectors import Vector, area
from .home_numbers import HomeNumbers

Kind = Literal["R", "P", "S"]

HAS_LOOP = "has a loop of its own"


class NoLeg(Exception):
    """The chain is no leg with closed forms; the text says why."""


class NoRod(NoLeg):
    """Its two ends are in one point."""


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


def elementary_joints(home: HomeNumbers, steps: Sequence[Step]) -> list[ElementaryJoint]:
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


def _of_step(home: HomeNumbers, step: Step) -> list[ElementaryJoint]:
    joint, point = step.joint, home.point(step.joint)
    bodies = joint.connects if step.forward else joint.connects[::-1]

    def element(kind: Kind, axis: Vector, place: int = 0) -> ElementaryJoint:
        return ElementaryJoint(kind, axis, point, joint, place, step.sign, *bodies)

    if step.ends or joint.type == "spherical":
        return [element("S", Vector((0.0, 0.0, 0.0)))]
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


EndingKind = Literal["weld", "hinge", "cross", "triple", "ball"]


@dataclass(frozen=True, eq=False)
class Ending:
    """An end of a rod: its elementary joints, in the order in which the leg is read, and the point where they meet.

    The point of a single hinge is its joint's centre; a weld has none.
    """

    kind: EndingKind
    elements: tuple[ElementaryJoint, ...]
    centre: Vector | None


@dataclass(frozen=True, eq=False)
class Rod:
    """A rod, with its proximal joint if it has one.

    Attributes
    ----------
    slide, twist : elementary joints along the rod, or None.
    base_end, platform_end : its ends at home [L].
    is_reversed : it is read from the platform, which then has its base end.
    is_shared : it is on the proximal joint of the rod before it.
    beside : of a parallelogram, the pins of the other rod: they turn as the last hinge of the base end does, and as the
        first one of the platform end.
    on : the redundant joint that it is on.
    """

    proximal: ElementaryJoint | None
    base_ending: Ending
    slide: ElementaryJoint | None
    twist: ElementaryJoint | None
    platform_ending: Ending
    base_end: Vector
    platform_end: Vector
    is_reversed: bool
    is_shared: bool = False
    beside: tuple[ElementaryJoint, ...] = ()
    on: RedundantJoint | None = None

    @property
    def elements(self) -> tuple[ElementaryJoint, ...]:
        between = tuple(element for element in (self.proximal, self.slide, self.twist) if element is not None)
        return (*between, *self.base_ending.elements, *self.platform_ending.elements)


@dataclass(frozen=True, eq=False)
class Pivot:
    """Slides and an ending of no length."""

    slides: tuple[ElementaryJoint, ...]
    ending: Ending
    is_reversed: bool
    on: RedundantJoint | None = None

    @property
    def elements(self) -> tuple[ElementaryJoint, ...]:
        return (*self.slides, *self.ending.elements)


@dataclass(frozen=True, eq=False)
class KeptAxis:
    """A direction fixed both to the base and to the platform: that of a hinge on the platform."""

    ending: Ending
    is_reversed: bool = False
    on: RedundantJoint | None = None

    @property
    def elements(self) -> tuple[ElementaryJoint, ...]:
        return self.ending.elements


@dataclass(frozen=True, eq=False)
class RedundantJoint:
    """A hinge or slide that legs are on, and whose coordinate the pose does not determine.

    Attributes
    ----------
    at_platform_end : it moves the body that the platform ends of these legs are on.
    on : the redundant joint that it is on.
    orients : it has a closed form: it turns the hinge at the base end of the one rod on it towards the platform end.
    mirror_of : the joint whose coordinate it has, for legs that are read in reverse, or in the platform's frame.
    is_inner : it is for a rod between intermediate platforms.
    """

    element: ElementaryJoint
    is_reversed: bool
    at_platform_end: bool = False
    on: RedundantJoint | None = None
    orients: bool = False
    mirror_of: RedundantJoint | None = None
    is_inner: bool = False

    @property
    def elements(self) -> tuple[ElementaryJoint, ...]:
        return (self.element,)


LegForm = Rod | Pivot | KeptAxis | RedundantJoint


def keeps_from_spinning(rod: Rod) -> bool:
    """True if both ends keep a rod from spinning about itself, and no joint along it lets it: a constraint."""
    return holds_spin(rod.base_ending) and holds_spin(rod.platform_ending) and rod.twist is None and not rod.beside


def holds_spin(ending: Ending) -> bool:
    """True if an ending keeps a rod from spinning about itself."""
    return ending.kind in ("hinge", "cross")


def closed_form_coordinates(form: LegForm) -> Iterator[tuple[ElementaryJoint, int]]:
    """The elementary joints whose coordinates a leg has in closed form, each with its place in the leg's values."""
    if isinstance(form, KeptAxis):
        return
    if isinstance(form, RedundantJoint):
        if form.mirror_of is None:
            yield form.element, K.Q_PROXIMAL
        return
    if isinstance(form, Pivot):
        yield from ((element, K.PLATFORM_END + place) for place, element in enumerate(form.slides))
        if form.ending.kind != "ball":
            yield from ((element, K.BASE_END + place) for place, element in enumerate(form.ending.elements))
        return
    if form.proximal is not None:
        yield form.proximal, K.Q_PROXIMAL
    if form.slide is not None:
        yield form.slide, K.SLIDE
    if holds_spin(form.base_ending):
        yield from ((element, K.BASE_END + place) for place, element in enumerate(form.base_ending.elements))
    if holds_spin(form.platform_ending):
        # in the frame of the body beyond the rod
        yield from (
            (element.back, K.PLATFORM_END + place) for place, element in enumerate(form.platform_ending.elements[::-1])
        )
    if form.beside:
        inner, outer = form.beside
        yield from ((inner, K.BASE_END + 1), (outer.back, K.PLATFORM_END + 1))
