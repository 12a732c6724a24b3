"""Legs that closed forms answer for: which chains are a rod or a pivot, read from the base or from the platform.

With every joint as hinges (R), slides (P) and balls (S) in series, a chain is

- a rod: at most one carrier (R or P), a foot ending, a rigid or sliding rod, a head ending; the carrier of a rigid
  rod is turned until the rod reaches;
- a pivot: slides, then one ending of no length;
- arms, and legs on them: hinges and slides next to the base or the platform, which the pose alone does not tell. Their
  coordinates are free, below rods that reach wherever arms are, or follow from what the legs on them ask for.

Endings are a hinge, two that cross, three through one point, or a ball. Where a chain branches, its first branch places
the carrier and the others, parallel to it, are rods on it, or all are legs on its arms. Where they meet before the
platform, what is beyond are arms of it, see `stations`. A pinned parallelogram between two parallel hinges is a rod
between pairs of crossed hinges, and an axis that the platform keeps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise, product

import numpy as np

from ..arrays import Floats
from ..description.graph import Step
from ..description.mechanism import Mechanism
from ..tolerances import TOLERANCES
from .decompose import Part, Split, SubChain
from .items import HAS_LOOP, NO_AXIS, Item, NoLeg, are_parallel, area, items_of
from .leg_forms import (
    Ending,
    EndingKind,
    KeptAxis,
    LegForm,
    Pivot,
    RedundantJoint,
    Rod,
    keeps_from_spinning,
    told_places,
)

MOST_HINGES, MOST_REDUNDANT = 3, 3
"""Hinges of the largest ending, and arms of a chain."""


def legs_of_chain(mechanism: Mechanism, chain: SubChain) -> tuple[LegForm, ...]:
    """The legs that a sub-chain is: one, or one for each of its branches.

    Raises
    ------
    NoLeg : with the reason.
    """
    if not chain.parts:
        raise NoLeg("has no joints")
    if chain.trunk:
        return _branched(mechanism, chain)
    loops = [part for part in chain.parts if not isinstance(part, Step)]
    if not loops:
        return _leg(items_of(mechanism, chain.steps))
    split = loops[0]
    if len(loops) == 1 and isinstance(split, Split) and split.parallelogram is not None and split.parallelogram.pinned:
        return _with_parallelogram(mechanism, chain, split)
    raise NoLeg(HAS_LOOP)


def put_on(arm: RedundantJoint | None, legs: Sequence[LegForm]) -> tuple[LegForm, ...]:
    """Legs that are on an arm, those of them that are on none yet."""
    placed: dict[int, LegForm] = {}
    for leg in legs:
        on = arm if leg.on is None else placed[id(leg.on)]
        assert on is None or isinstance(on, RedundantJoint)
        placed[id(leg)] = replace(leg, on=on)
    return tuple(placed.values())


def _branched(mechanism: Mechanism, chain: SubChain) -> tuple[LegForm, ...]:
    """Rods on one carrier, or on arms."""
    trunk = items_of(mechanism, chain.trunk)
    first, *others = (items_of(mechanism, branch) for branch in chain.branches)
    if any(item.kind == "P" for item in first):
        return _on_redundant(trunk, (first, *others), is_reversed=False)
    if len(trunk) != 1:
        raise NoLeg("several joints carry its branches")
    main = _rod(trunk[0], first, is_reversed=False)
    rods = [_rod(None, other, is_reversed=False) for other in others]
    if _are_alike((main, *rods)):
        return (main, *(replace(rod, is_shared=True) for rod in rods))
    arm = RedundantJoint(trunk[0], is_reversed=False)
    return (arm, *put_on(arm, (replace(main, proximal=None), *rods)))


def _are_alike(rods: Sequence[Rod]) -> bool:
    """Whether rods are parallel at home and of one length, as those of a parallelogram.

    As long as the platform does not turn, all have the dead points of their carrier that one of them has; else where
    one has its own the others place the carrier, and beyond is no other working mode.
    """
    lines = [rod.platform_end - rod.base_end for rod in rods]
    return bool(np.ptp(lines, axis=0).max() <= TOLERANCES.nearly_implied)


def _on_redundant(trunk: Sequence[Item], branches: Sequence[list[Item]], is_reversed: bool) -> tuple[LegForm, ...]:
    """Sliding rods on arms: the platform is anywhere, wherever those are."""
    if len(trunk) > MOST_REDUNDANT or any(item.kind == "S" for item in trunk):
        raise NoLeg("several joints carry its branches")
    rods = [_rod(None, branch, is_reversed) for branch in branches]
    for rod in rods:
        ends = rod.base_ending, rod.platform_ending
        if rod.slide is None or any(end.kind == "hinge" for end in ends) or keeps_from_spinning(rod):
            raise NoLeg("arms carry rods that do not let the platform go wherever it may be wanted")
    redundant: list[RedundantJoint] = []
    for item in trunk:
        redundant.append(RedundantJoint(item, is_reversed, on=redundant[-1] if redundant else None))
    return (*redundant, *put_on(redundant[-1], rods))


def _with_parallelogram(mechanism: Mechanism, chain: SubChain, split: Split) -> tuple[LegForm, ...]:
    """A pinned parallelogram between two parallel hinges: its outer body turns as its inner one does."""
    place = chain.parts.index(split)
    before, after = (items_of(mechanism, _steps_of(parts)) for parts in (chain.parts[:place], chain.parts[place + 1 :]))
    (inner, outer), (inner_beside, outer_beside) = (items_of(mechanism, _steps_of(way)) for way in split.ways)
    reasons = []
    for is_reversed in (False, True):
        if is_reversed:
            before, after = [item.back for item in after[::-1]], [item.back for item in before[::-1]]
            inner, outer, inner_beside, outer_beside = outer.back, inner.back, outer_beside.back, inner_beside.back
        try:
            rod = _parallelogram_rod(before, inner, outer, after, is_reversed)
            beside = (_turned_as(inner, inner_beside), _turned_as(outer, outer_beside))
            return replace(rod, beside=beside), KeptAxis(
                Ending("hinge", rod.platform_ending.items[-1:], rod.platform_end)
            )
        except NoLeg as reason:
            reasons.append(str(reason))
    raise NoLeg(reasons[0])


def _steps_of(parts: Sequence[Part]) -> list[Step]:
    return [step for part in parts for step in part.steps]


def _turned_as(item: Item, other: Item) -> Item:
    """The other of two parallel pins that turn together, counted as about the axis of the first."""
    return _along(other, item.axis)


def _parallelogram_rod(
    before: Sequence[Item], inner: Item, outer: Item, after: Sequence[Item], is_reversed: bool
) -> Rod:
    """The rod that a parallelogram shifts its outer body by, from a hinge to a parallel one.

    Parameters
    ----------
    before, after : what carries its inner body, and the platform on its outer one.
    inner, outer : the pins of one of its rods.
    """
    *q_proximal, first = before or (inner,)
    if (
        len(after) != 1
        or len(q_proximal) > 1
        or {first.kind, after[0].kind} != {"R"}
        or not are_parallel(first, after[0])
    ):
        raise NoLeg("a parallelogram that is not between two parallel hinges")
    last, proximal = after[0], q_proximal[0] if q_proximal else None
    if proximal is not None and proximal.kind == "R" and not are_parallel(proximal, first):
        raise NoLeg("a crank whose axis is not parallel to the hinges beside its parallelogram")
    way = outer.point - inner.point
    way = way - inner.axis * (inner.axis @ way)
    if area(last.point - way - first.point, first.axis) > TOLERANCES.implied:
        raise NoLeg("a parallelogram that is not as long as the hinges beside it are apart")
    base_end = Ending("cross", (first, inner), first.point)
    platform_end = Ending("cross", (outer, last), first.point + way)
    if are_parallel(first, inner):
        raise NoLeg("a parallelogram whose pins are parallel to the hinges beside it")
    return _checked_rod(proximal, base_end, (), platform_end, is_reversed)


def _leg(items: list[Item]) -> tuple[LegForm, ...]:
    """The simplest leg that items in series are and that tells all their motors and limits.

    That is with the fewest carriers, then read from the base, then with the largest endings; then with arms.

    Raises
    ------
    NoLeg : why it is none with one carrier, read from the platform.
    """
    untold: tuple[LegForm, ...] | None = None
    reasons: list[str] = []
    for make in _readings(items):
        try:
            legs = make()
        except NoLeg as reason:
            reasons.append(str(reason))
            continue
        told = {(item.joint.name, item.place) for leg in legs for item, _ in told_places(leg)}
        asked = [item for item in items if item.joint.range is not None or item.place in item.joint.driven]
        if all((item.joint.name, item.place) in told for item in asked):
            return legs
        untold = untold or legs
    if untold is None:
        raise NoLeg(reasons[WITHOUT_REDUNDANT - 1])
    return untold


WITHOUT_REDUNDANT = 8
"""Readings without arms."""


def _readings(items: list[Item]) -> Iterator[Callable[[], tuple[LegForm, ...]]]:
    """Ways to read items in series, the simplest first."""
    ways = (items, False), ([item.back for item in items[::-1]], True)
    for n_carriers, (own, is_reversed), make in product((0, 1), ways, (_pivot, _rod_alone)):
        yield partial(make, own, n_carriers, is_reversed)
    for make_on, (own, is_reversed), n_carriers in product((_orienting, _led), ways, (0, 1)):
        yield partial(make_on, own, n_carriers, is_reversed)
    for n_arms, (own, is_reversed) in product(range(1, MOST_REDUNDANT + 1), ways):
        yield partial(_on_redundant, own[:n_arms], [own[n_arms:]], is_reversed)


def _orienting(items: list[Item], n_carriers: int, is_reversed: bool) -> tuple[LegForm, ...]:
    """A rod on an arm that turns, or shifts, the plane across the hinge at its foot to where the head is."""
    arm, rod = items[0], _rod_on(items[1:], n_carriers, is_reversed)
    if arm.kind == "S" or rod.base_ending.kind != "hinge" or (rod.proximal is None and rod.slide is None):
        raise NoLeg("several joints carry its rod")
    axis = rod.base_ending.items[0].axis
    lean = abs(arm.axis @ axis) if arm.kind == "P" else area(arm.axis, axis)
    if lean <= TOLERANCES.alignment:
        raise NoLeg("several joints carry its rod")
    if rod.proximal is not None:
        off = area(rod.proximal.axis, axis) if rod.proximal.kind == "R" else abs(rod.proximal.axis @ axis)
        if off > TOLERANCES.implied:
            raise NoLeg("several joints carry its rod")
    under = RedundantJoint(arm, is_reversed, faces=True)
    return under, *put_on(under, [rod])


def _led(items: list[Item], n_carriers: int, is_reversed: bool) -> tuple[LegForm, ...]:
    """A rod that asks something of the arm that it is on: not to spin, or to face the other end.

    One that asks for both tells by that where its carrier is, too; beyond the dead point of the carrier is no other
    working mode then, and it is an arm rather.
    """
    rod = _rod_on(items[1:], n_carriers, is_reversed)
    hinges = [end for end in (rod.base_ending, rod.platform_ending) if end.kind == "hinge"]
    asks = len(hinges) + keeps_from_spinning(rod)
    if items[0].kind == "S" or asks == 0 or (n_carriers == 1 and asks > 1):
        raise NoLeg("several joints carry its rod")
    under = RedundantJoint(items[0], is_reversed)
    return under, *put_on(under, [rod])


def _pivot(items: list[Item], n_carriers: int, is_reversed: bool) -> tuple[LegForm]:
    """Slides and one ending; whatever `n_carriers` says, all slides at the foot count."""
    slides = tuple(item for item in items if item.kind == "P")
    ending = _ending(items[len(slides) :])
    if n_carriers or [item.kind for item in items[: len(slides)]] != ["P"] * len(slides) or ending is None:
        raise NoLeg("no pivot")
    if len(slides) > 3 or (slides and np.linalg.svd([item.axis for item in slides])[1].min() < TOLERANCES.alignment):
        raise NoLeg("slides that are not independent")
    return (Pivot(slides, ending, is_reversed),)


def rigid_rod(items: list[Item]) -> Rod:
    """A rod of items in series without a carrier, read as if from the platform."""
    return _rod(None, items, is_reversed=True)


def _rod_alone(items: list[Item], n_carriers: int, is_reversed: bool) -> tuple[LegForm]:
    return (_rod_on(items, n_carriers, is_reversed),)


def _rod_on(items: list[Item], n_carriers: int, is_reversed: bool) -> Rod:
    return _rod(items[0] if n_carriers else None, items[n_carriers:], is_reversed)


def _rod(proximal: Item | None, items: list[Item], is_reversed: bool) -> Rod:
    """A rod of items in series on a carrier, with the largest endings that fit."""
    if proximal is not None and proximal.kind == "S":
        raise NoLeg("a ball carries the rod")
    sizes = range(MOST_HINGES, 0, -1)
    reason = "its joints do not meet in two points"
    for foot_size, head_size in sorted(product(sizes, sizes), key=sum, reverse=True):
        if foot_size + head_size > len(items):
            continue
        base_end, platform_end = _ending(items[:foot_size]), _ending(items[len(items) - head_size :])
        if base_end is None or platform_end is None:
            continue
        try:
            return _checked_rod(
                proximal, base_end, items[foot_size : len(items) - head_size], platform_end, is_reversed
            )
        except NoLeg as found:
            reason = str(found)
    raise NoLeg(reason)


def _ending(items: Sequence[Item]) -> Ending | None:
    """Items as an ending; None where they do not meet in a point."""
    if not items:
        return Ending("weld", (), NO_AXIS)
    if [item.kind for item in items] == ["S"]:
        return Ending("ball", tuple(items), items[0].point)
    if any(item.kind != "R" for item in items) or len(items) > MOST_HINGES:
        return None
    if len(items) == 1:
        return Ending("hinge", tuple(items), items[0].point)
    if any(are_parallel(*pair) for pair in pairwise(items)):
        return None
    centre = _crossing(items[0], items[1])
    off = max(area(centre - item.point, item.axis) for item in items)
    kind: EndingKind = "cross" if len(items) == 2 else "triple"
    return Ending(kind, tuple(items), centre) if off <= TOLERANCES.implied else None


def _crossing(first: Item, second: Item) -> Floats:
    """The point of the first of two axes that is nearest to the second."""
    normal = np.cross(first.axis, second.axis)
    along = np.cross(second.point - first.point, second.axis) @ normal / (normal @ normal)
    return np.asarray(first.point + along * first.axis)


def _checked_rod(
    proximal: Item | None, base_end: Ending, middle: Sequence[Item], platform_end: Ending, is_reversed: bool
) -> Rod:
    start, end = _ends(base_end, platform_end)
    line = end - start
    if np.linalg.norm(line) <= TOLERANCES.alignment:
        raise NoLeg("a rod of no length")
    line /= np.linalg.norm(line)
    if any(item.kind == "S" or area(item.axis, line) > TOLERANCES.implied for item in middle):
        raise NoLeg("a joint between the ends of its rod that is not along it")
    slides, twists = ([_along(item, line) for item in middle if item.kind == kind] for kind in "PR")
    if len(slides) > 1 or len(twists) > 1:
        raise NoLeg("several joints along its rod")
    for ending, axes in ((base_end, base_end.items), (platform_end, platform_end.items[::-1])):
        if ending.kind in ("hinge", "cross") and _is_singular([item.axis for item in axes], line):
            raise NoLeg("a hinge along its rod")
        if ending.kind == "triple" and any(abs(a.axis @ b.axis) > TOLERANCES.alignment for a, b in pairwise(axes)):
            raise NoLeg("three hinges through a point that are not square to each other")
    if proximal is not None:
        if slides:
            raise NoLeg("a carrier below a sliding rod")
        if proximal.kind == "R" and area(proximal.axis, start - proximal.point) <= TOLERANCES.alignment:
            raise NoLeg("a crank of no length")
    slide, twist = (found[0] if found else None for found in (slides, twists))
    return Rod(proximal, base_end, slide, twist, platform_end, start, end, is_reversed)


def _along(item: Item, line: Floats) -> Item:
    """The same slide or hinge, its axis in the direction of a line parallel to it."""
    return item if item.axis @ line > 0.0 else replace(item, axis=-item.axis, sense=-item.sense)


def _is_singular(axes: Sequence[Floats], line: Floats) -> bool:
    """Whether hinges, in order from their body, cannot aim a line to all sides."""
    if len(axes) == 1:
        return area(axes[0], line) <= TOLERANCES.alignment
    return bool(abs(np.cross(axes[0], line) @ axes[1]) <= TOLERANCES.alignment)


def _ends(base_end: Ending, platform_end: Ending) -> tuple[Floats, Floats]:
    """The two ends of a rod: on a single hinge the point nearest to the other end."""
    if base_end.kind == "hinge" and platform_end.kind == "hinge":
        first, second = base_end.items[0], platform_end.items[0]
        if are_parallel(first, second):
            return first.point + first.axis * (first.axis @ (second.point - first.point)), second.point
        return _crossing(first, second), _crossing(second, first)
    if base_end.kind == "hinge":
        item = base_end.items[0]
        return item.point + item.axis * (item.axis @ (platform_end.centre - item.point)), platform_end.centre
    if platform_end.kind == "hinge":
        item = platform_end.items[0]
        return base_end.centre, item.point + item.axis * (item.axis @ (base_end.centre - item.point))
    return base_end.centre, platform_end.centre
