"""What a leg may be: a rod, a pivot, an axis that is kept, or an arm that others are on; see `legs`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from ..arrays import Floats
from ..kernels.legs import records as K
from .items import Item

EndingKind = Literal["weld", "hinge", "cross", "triple", "ball"]


@dataclass(frozen=True, eq=False)
class Ending:
    """Where a rod ends: its items, in the order in which the leg is read, and the point that all of them meet in.

    Of a single hinge that is its joint's centre.
    """

    kind: EndingKind
    items: tuple[Item, ...]
    centre: Floats


@dataclass(frozen=True, eq=False)
class Rod:
    """A rod and what carries it.

    Attributes
    ----------
    foot, head : its ends at home [L].
    beside : of a parallelogram, the pins of the other rod: they turn as the last hinge at the foot does, and as the
        first one at the head.
    """

    proximal: Item | None
    base_ending: Ending
    slide: Item | None
    twist: Item | None
    platform_ending: Ending
    base_end: Floats
    platform_end: Floats
    is_reversed: bool
    is_shared: bool = False
    beside: tuple[Item, ...] = ()
    on: RedundantJoint | None = None

    @property
    def items(self) -> tuple[Item, ...]:
        between = tuple(item for item in (self.proximal, self.slide, self.twist) if item is not None)
        return (*between, *self.base_ending.items, *self.platform_ending.items)


@dataclass(frozen=True, eq=False)
class Pivot:
    """Slides and an ending of no length."""

    slides: tuple[Item, ...]
    ending: Ending
    is_reversed: bool
    on: RedundantJoint | None = None

    @property
    def items(self) -> tuple[Item, ...]:
        return (*self.slides, *self.ending.items)


@dataclass(frozen=True, eq=False)
class KeptAxis:
    """A direction that is the same on the base and on the platform: that of a hinge on the platform."""

    ending: Ending
    is_reversed: bool = False
    on: RedundantJoint | None = None

    @property
    def items(self) -> tuple[Item, ...]:
        return self.ending.items


@dataclass(frozen=True, eq=False)
class RedundantJoint:
    """A hinge or slide that legs are on.

    Attributes
    ----------
    at_head : whether it moves the body that their heads are on.
    on : the arm that it is on.
    faces : whether it has the hinge at the foot of the one rod on it face the rod's head.
    twin : the arm whose coordinate it has, for legs that are read the other way, or as the platform sees them.
    is_inner : whether it is for a rod between bodies that arms of the platform place.
    """

    item: Item
    is_reversed: bool
    at_platform_end: bool = False
    on: RedundantJoint | None = None
    faces: bool = False
    mirror_of: RedundantJoint | None = None
    is_inner: bool = False

    @property
    def items(self) -> tuple[Item, ...]:
        return (self.item,)


LegForm = Rod | Pivot | KeptAxis | RedundantJoint


def keeps_from_spinning(rod: Rod) -> bool:
    """Whether both ends keep a rod from spinning about itself, and nothing along it lets it: a constraint."""
    return holds_spin(rod.base_ending) and holds_spin(rod.platform_ending) and rod.twist is None and not rod.beside


def holds_spin(ending: Ending) -> bool:
    """Whether an ending keeps a rod from spinning about itself."""
    return ending.kind in ("hinge", "cross")


def told_places(form: LegForm) -> Iterator[tuple[Item, int]]:
    """Items whose coordinates a leg tells, each with its place in the leg's values."""
    if isinstance(form, KeptAxis):
        return
    if isinstance(form, RedundantJoint):
        if form.mirror_of is None:
            yield form.item, K.Q_PROXIMAL
        return
    if isinstance(form, Pivot):
        yield from ((item, K.PLATFORM_END + place) for place, item in enumerate(form.slides))
        if form.ending.kind != "ball":
            yield from ((item, K.BASE_END + place) for place, item in enumerate(form.ending.items))
        return
    if form.proximal is not None:
        yield form.proximal, K.Q_PROXIMAL
    if form.slide is not None:
        yield form.slide, K.SLIDE
    if holds_spin(form.base_ending):
        yield from ((item, K.BASE_END + place) for place, item in enumerate(form.base_ending.items))
    if holds_spin(form.platform_ending):
        # as the body beyond sees the rod
        yield from ((item.back, K.PLATFORM_END + place) for place, item in enumerate(form.platform_ending.items[::-1]))
    if form.beside:
        inner, outer = form.beside
        yield from ((inner, K.BASE_END + 1), (outer.back, K.PLATFORM_END + 1))
