"""Legs with closed forms: chains read as a rod or a pivot, from the base or from the platform.

With every joint as hinges (R), slides (P) and balls (S) in series, a chain is

- a rod: at most one proximal joint (R or P), a base ending, a rigid or sliding rod, a platform ending; the proximal
  joint of a rigid rod follows from the rod's length;
- a pivot: slides, then one ending of no length;
- redundant joints, and legs on them: hinges and slides next to the base or the platform that the pose alone does not
  determine. Their coordinates are free below sliding rods, or follow from the constraints of the legs on them.

Endings are a hinge, two that cross, three through one point, or a ball. Where a chain branches, its first branch
determines the proximal joint and the others, parallel to it, are rods on it; or all are legs on redundant joints. Where
branches meet before the platform, `intermediate_platforms` splits the chain. A pinned parallelogram between two
parallel hinges is a rod between pairs of crossed hinges, and an axis that the platform keeps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise, product

from ...tolerances import TOLERANCES
from ..description.graph import Step
from ..noted_numbers import largest
from ..noted_vectors import Vector, area, cross, norm, spread
from .decompose import Part, Split, SubChain
from .home_numbers import HomeNumbers
from .leg_forms import (
    HAS_LOOP,
    ElementaryJoint,
    Ending,
    EndingKind,
    KeptAxis,
    LegForm,
    NoLeg,
    NoRod,
    Pivot,
    RedundantJoint,
    Rod,
    are_parallel,
    closed_form_coordinates,
    elementary_joints,
    keeps_from_spinning,
)

MOST_HINGES, MOST_REDUNDANT = 3, 3
"""Hinges of the largest ending, and redundant joints of a chain."""


def legs_of_chain(home: HomeNumbers, chain: SubChain) -> tuple[LegForm, ...]:
    """The legs of a sub-chain: one, or one for each of its branches.

    Raises
    ------
    NoLeg : it has none; the text says why.
    """
    if not chain.parts:
        raise NoLeg("has no joints")
    if chain.trunk:
        return _branched(home, chain)
    loops = [part for part in chain.parts if not isinstance(part, Step)]
    if not loops:
        return _leg(elementary_joints(home, chain.steps))
    split = loops[0]
    if len(loops) == 1 and isinstance(split, Split) and split.parallelogram is not None and split.parallelogram.pinned:
        return _with_parallelogram(home, chain, split)
    raise NoLeg(HAS_LOOP)


def placed_on(redundant_joint: RedundantJoint | None, legs: Sequence[LegForm]) -> tuple[LegForm, ...]:
    """Legs with those that are on no redundant joint yet placed on the given one."""
    placed: dict[int, LegForm] = {}
    for leg in legs:
        on = redundant_joint if leg.on is None else placed[id(leg.on)]
        assert on is None or isinstance(on, RedundantJoint)
        placed[id(leg)] = replace(leg, on=on)
    return tuple(placed.values())


def _branched(home: HomeNumbers, chain: SubChain) -> tuple[LegForm, ...]:
    """Rods on one proximal joint, or on redundant joints."""
    trunk = elementary_joints(home, chain.trunk)
    first_branch, *other_branches = (elementary_joints(home, branch) for branch in chain.branches)
    if any(element.kind == "P" for element in first_branch):
        return _on_redundant(trunk, (first_branch, *other_branches), is_reversed=False)
    if len(trunk) != 1:
        raise NoLeg("several joints carry its branches")
    try:
        first_rod = _rod(trunk[0], first_branch, is_reversed=False)
        rods = [_rod(None, branch, is_reversed=False) for branch in other_branches]
    except NoRod as reason:
        name = trunk[0].joint.name
        raise NoLeg(f"{reason}; with the body that joint {name} carries as the base closed forms may answer") from None
    if _are_alike((first_rod, *rods)):
        return (first_rod, *(replace(rod, is_shared=True) for rod in rods))
    redundant_joint = RedundantJoint(trunk[0], is_reversed=False)
    return (redundant_joint, *placed_on(redundant_joint, (replace(first_rod, proximal=None), *rods)))


def _are_alike(rods: Sequence[Rod]) -> bool:
    """True if rods are parallel at home and of one length, as those of a parallelogram.

    As long as the platform does not turn, they share the dead points of their proximal joint. Other rods have dead
    points of their own, at which the others determine the joint: no other working mode is beyond.
    """
    return spread([rod.platform_end - rod.base_end for rod in rods]) <= TOLERANCES.nearly_implied


def _on_redundant(
    trunk: Sequence[ElementaryJoint], branches: Sequence[list[ElementaryJoint]], is_reversed: bool
) -> tuple[LegForm, ...]:
    """Sliding rods on free redundant joints: whatever their coordinates, rods leave the platform all its freedoms."""
    if len(trunk) > MOST_REDUNDANT or any(element.kind == "S" for element in trunk):
        raise NoLeg("several joints carry its branches")
    rods = [_rod(None, branch, is_reversed) for branch in branches]
    for rod in rods:
        ends = rod.base_ending, rod.platform_ending
        if rod.slide is None or any(end.kind == "hinge" for end in ends) or keeps_from_spinning(rod):
            raise NoLeg("redundant joints carry rods that constrain the platform")
    redundant: list[RedundantJoint] = []
    for element in trunk:
        redundant.append(RedundantJoint(element, is_reversed, on=redundant[-1] if redundant else None))
    return (*redundant, *placed_on(redundant[-1], rods))


def _with_parallelogram(home: HomeNumbers, chain: SubChain, split: Split) -> tuple[LegForm, ...]:
    """A pinned parallelogram between two parallel hinges: its outer body turns as its inner one does."""
    place = chain.parts.index(split)
    before, after = (
        elementary_joints(home, _steps_of(parts)) for parts in (chain.parts[:place], chain.parts[place + 1 :])
    )
    (inner, outer), (inner_beside, outer_beside) = (elementary_joints(home, _steps_of(path)) for path in split.ways)
    reasons = []
    for is_reversed in (False, True):
        if is_reversed:
            before, after = [element.back for element in after[::-1]], [element.back for element in before[::-1]]
            inner, outer, inner_beside, outer_beside = outer.back, inner.back, outer_beside.back, inner_beside.back
        try:
            rod = _parallelogram_rod(before, inner, outer, after, is_reversed)
            beside = (_turned_as(inner, inner_beside), _turned_as(outer, outer_beside))
            return replace(rod, beside=beside), KeptAxis(
                Ending("hinge", rod.platform_ending.elements[-1:], rod.platform_end)
            )
        except NoLeg as reason:
            reasons.append(str(reason))
    raise NoLeg(reasons[0])


def _steps_of(parts: Sequence[Part]) -> list[Step]:
    return [step for part in parts for step in part.steps]


def _turned_as(element: ElementaryJoint, other: ElementaryJoint) -> ElementaryJoint:
    """The other of two parallel pins that turn together, its sense that of the first pin's axis."""
    return _along(other, element.axis)


def _parallelogram_rod(
    before: Sequence[ElementaryJoint],
    inner: ElementaryJoint,
    outer: ElementaryJoint,
    after: Sequence[ElementaryJoint],
    is_reversed: bool,
) -> Rod:
    """A parallelogram between two parallel hinges, as the rod that joins them.

    Parameters
    ----------
    before, after : the joints before its inner body, and after its outer one.
    inner, outer : the pins of one of its rods.
    """
    *q_proximal, inner_hinge = before or (inner,)
    if (
        len(after) != 1
        or len(q_proximal) > 1
        or {inner_hinge.kind, after[0].kind} != {"R"}
        or not are_parallel(inner_hinge, after[0])
    ):
        raise NoLeg("a parallelogram that is not between two parallel hinges")
    outer_hinge, proximal = after[0], q_proximal[0] if q_proximal else None
    if proximal is not None and proximal.kind == "R" and not are_parallel(proximal, inner_hinge):
        raise NoLeg("a crank whose axis is not parallel to the hinges beside its parallelogram")
    offset = outer.point - inner.point
    offset = offset - inner.axis * (inner.axis @ offset)
    if area(outer_hinge.point - offset - inner_hinge.point, inner_hinge.axis) > TOLERANCES.implied:
        raise NoLeg("a parallelogram that is not as long as the hinges beside it are apart")
    base_end = Ending("cross", (inner_hinge, inner), inner_hinge.point)
    platform_end = Ending("cross", (outer, outer_hinge), inner_hinge.point + offset)
    if are_parallel(inner_hinge, inner):
        raise NoLeg("a parallelogram whose pins are parallel to the hinges beside it")
    return _checked_rod(proximal, base_end, (), platform_end, is_reversed)


def _leg(elements: list[ElementaryJoint]) -> tuple[LegForm, ...]:
    """The simplest leg of elementary joints in series that has closed forms for all their motors and limits.

    Simplest is without a proximal joint, then read from the base, then with the largest endings; then with redundant
    joints.

    Raises
    ------
    NoLeg : there is none; the reason is that of a rod with a proximal joint, read from the platform.
    """
    incomplete: tuple[LegForm, ...] | None = None
    reasons: list[str] = []
    for make in _readings(elements):
        try:
            legs = make()
        except NoLeg as reason:
            reasons.append(str(reason))
            continue
        coordinates = {
            (element.joint.name, element.place) for leg in legs for element, _ in closed_form_coordinates(leg)
        }
        required = [
            element for element in elements if element.joint.range is not None or element.place in element.joint.driven
        ]
        if all((element.joint.name, element.place) in coordinates for element in required):
            return legs
        incomplete = incomplete or legs
    if incomplete is None:
        raise NoLeg(reasons[WITHOUT_REDUNDANT - 1])
    return incomplete


WITHOUT_REDUNDANT = 8
"""Number of readings without redundant joints; they come first."""


def _readings(elements: list[ElementaryJoint]) -> Iterator[Callable[[], tuple[LegForm, ...]]]:
    """The readings of elementary joints in series, the simplest first."""
    readings = (elements, False), ([element.back for element in elements[::-1]], True)
    for n_proximal, (elements_read, is_reversed), make in product((0, 1), readings, (_pivot, _rod_alone)):
        yield partial(make, elements_read, n_proximal, is_reversed)
    hinge_first = [(_with_hinge_first(elements_read), is_reversed) for elements_read, is_reversed in readings]
    for make_on_redundant, readings_of_kind in (
        (_on_orienting_joint, [*readings, *hinge_first]),
        (_on_implicit_joint, readings),
    ):
        for (elements_read, is_reversed), n_proximal in product(readings_of_kind, (0, 1)):
            yield partial(make_on_redundant, elements_read, n_proximal, is_reversed)
    for n_redundant, (elements_read, is_reversed) in product(range(1, MOST_REDUNDANT + 1), readings):
        yield partial(_on_redundant, elements_read[:n_redundant], [elements_read[n_redundant:]], is_reversed)


def _with_hinge_first(elements: list[ElementaryJoint]) -> list[ElementaryJoint]:
    """Elements of which the first two, a slide along a hinge's axis and this hinge, are swapped: their order is free.

    The hinge may then orient a rod on the slide. A rod on the hinge, the slide following, would be at a dead point
    wherever the rod's own hinge faces its end: everywhere, if that hinge is square to the axis.
    """
    if len(elements) < 2 or (elements[0].kind, elements[1].kind) != ("P", "R") or not are_parallel(*elements[:2]):
        return elements
    return [elements[1], elements[0], *elements[2:]]


def _on_orienting_joint(elements: list[ElementaryJoint], n_proximal: int, is_reversed: bool) -> tuple[LegForm, ...]:
    """A rod on a redundant joint with a closed form.

    The joint moves the plane across the hinge at the rod's base end until it contains the platform end.
    """
    element, rod = elements[0], _rod_on_proximal(elements[1:], n_proximal, is_reversed)
    if element.kind == "S" or rod.base_ending.kind != "hinge" or (rod.proximal is None and rod.slide is None):
        raise NoLeg("several joints carry its rod")
    axis = rod.base_ending.elements[0].axis
    deviation_of_axis = abs(element.axis @ axis) if element.kind == "P" else area(element.axis, axis)
    if deviation_of_axis <= TOLERANCES.alignment:
        raise NoLeg("several joints carry its rod")
    if rod.proximal is not None:
        deviation = area(rod.proximal.axis, axis) if rod.proximal.kind == "R" else abs(rod.proximal.axis @ axis)
        if deviation > TOLERANCES.implied:
            raise NoLeg("several joints carry its rod")
    redundant_joint = RedundantJoint(element, is_reversed, orients=True)
    return redundant_joint, *placed_on(redundant_joint, [rod])


def _on_implicit_joint(elements: list[ElementaryJoint], n_proximal: int, is_reversed: bool) -> tuple[LegForm, ...]:
    """A rod on an implicit joint, which a constraint of the rod determines: it must not spin, or a hinge faces its end.

    A rod with several such constraints determines its proximal joint by them too. Then no other working mode is beyond
    a dead point of this joint: it is a redundant joint rather than a proximal one.
    """
    rod = _rod_on_proximal(elements[1:], n_proximal, is_reversed)
    hinges = [end for end in (rod.base_ending, rod.platform_ending) if end.kind == "hinge"]
    n_constraints = len(hinges) + keeps_from_spinning(rod)
    if elements[0].kind == "S" or n_constraints == 0 or (n_proximal == 1 and n_constraints > 1):
        raise NoLeg("several joints carry its rod")
    redundant_joint = RedundantJoint(elements[0], is_reversed)
    return redundant_joint, *placed_on(redundant_joint, [rod])


def _pivot(elements: list[ElementaryJoint], n_proximal: int, is_reversed: bool) -> tuple[LegForm]:
    """Slides and one ending. With `n_proximal` 1 there is none: all slides count as the pivot's own."""
    slides = tuple(element for element in elements if element.kind == "P")
    ending = _ending(elements[len(slides) :])
    if n_proximal or [element.kind for element in elements[: len(slides)]] != ["P"] * len(slides) or ending is None:
        raise NoLeg("no pivot")
    if not _are_independent([slide.axis for slide in slides]):
        raise NoLeg("slides that are not independent")
    return (Pivot(slides, ending, is_reversed),)


def _are_independent(axes: Sequence[Vector]) -> bool:
    """True if directions span a space of as many dimensions: by their area, or volume."""
    if len(axes) < 2:
        return True
    if len(axes) == 2:
        return area(*axes) > TOLERANCES.alignment
    return len(axes) == 3 and abs(cross(axes[0], axes[1]) @ axes[2]) > TOLERANCES.alignment


def rigid_rod(elements: list[ElementaryJoint]) -> Rod:
    """A rod of elementary joints in series without a proximal joint, read as if from the platform."""
    return _rod(None, elements, is_reversed=True)


def _rod_alone(elements: list[ElementaryJoint], n_proximal: int, is_reversed: bool) -> tuple[LegForm]:
    return (_rod_on_proximal(elements, n_proximal, is_reversed),)


def _rod_on_proximal(elements: list[ElementaryJoint], n_proximal: int, is_reversed: bool) -> Rod:
    return _rod(elements[0] if n_proximal else None, elements[n_proximal:], is_reversed)


def _rod(proximal: ElementaryJoint | None, elements: list[ElementaryJoint], is_reversed: bool) -> Rod:
    """A rod of elementary joints in series, on a proximal joint if given, with the largest endings that fit."""
    if proximal is not None and proximal.kind == "S":
        raise NoLeg("a ball joint carries the rod")
    sizes = range(MOST_HINGES, 0, -1)
    reason = NoLeg("its joints do not meet in two points")
    for n_base, n_platform in sorted(product(sizes, sizes), key=sum, reverse=True):
        if n_base + n_platform > len(elements):
            continue
        base_end, platform_end = _ending(elements[:n_base]), _ending(elements[len(elements) - n_platform :])
        if base_end is None or platform_end is None:
            continue
        try:
            return _checked_rod(
                proximal, base_end, elements[n_base : len(elements) - n_platform], platform_end, is_reversed
            )
        except NoLeg as error:
            reason = error
    raise reason


def _ending(elements: Sequence[ElementaryJoint]) -> Ending | None:
    """Items as an ending; None where they do not meet in a point."""
    if not elements:
        return Ending("weld", (), None)
    if [element.kind for element in elements] == ["S"]:
        return Ending("ball", tuple(elements), elements[0].point)
    if any(element.kind != "R" for element in elements) or len(elements) > MOST_HINGES:
        return None
    if len(elements) == 1:
        return Ending("hinge", tuple(elements), elements[0].point)
    if any(are_parallel(*pair) for pair in pairwise(elements)):
        return None
    centre = _crossing(elements[0], elements[1])
    off = largest(area(centre - element.point, element.axis) for element in elements)
    kind: EndingKind = "cross" if len(elements) == 2 else "triple"
    return Ending(kind, tuple(elements), centre) if off <= TOLERANCES.implied else None


def _crossing(first: ElementaryJoint, second: ElementaryJoint) -> Vector:
    """The point of the first of two axes that is nearest to the second."""
    normal = cross(first.axis, second.axis)
    along = cross(second.point - first.point, second.axis) @ normal / (normal @ normal)
    return first.point + first.axis * along


def _checked_rod(
    proximal: ElementaryJoint | None,
    base_end: Ending,
    middle: Sequence[ElementaryJoint],
    platform_end: Ending,
    is_reversed: bool,
) -> Rod:
    start, end = _ends(base_end, platform_end)
    length = norm(end - start)
    if length <= TOLERANCES.alignment:
        names = dict.fromkeys(element.joint.name for element in (*base_end.elements, *platform_end.elements))
        raise NoRod(f"joints {', '.join(names)} meet in one point, where a rod should be")
    line = (end - start) / length
    for element in middle:
        if element.kind == "S" or area(element.axis, line) > TOLERANCES.implied:
            raise NoLeg(f"joint {element.joint.name}, between the ends of its rod, is not along it")
    slides, twists = ([_along(element, line) for element in middle if element.kind == kind] for kind in "PR")
    if len(slides) > 1 or len(twists) > 1:
        raise NoLeg("several joints along its rod")
    for ending, axes in ((base_end, base_end.elements), (platform_end, platform_end.elements[::-1])):
        if ending.kind in ("hinge", "cross") and _is_singular([element.axis for element in axes], line):
            raise NoLeg("a hinge along its rod")
        if ending.kind == "triple" and any(abs(a.axis @ b.axis) > TOLERANCES.alignment for a, b in pairwise(axes)):
            raise NoLeg("three hinges through a point that are not square to each other")
    if proximal is not None:
        if slides:
            raise NoLeg("a proximal joint below a sliding rod")
        if proximal.kind == "R" and area(proximal.axis, start - proximal.point) <= TOLERANCES.alignment:
            raise NoLeg("a crank of no length")
    slide, twist = (along_rod[0] if along_rod else None for along_rod in (slides, twists))
    return Rod(proximal, base_end, slide, twist, platform_end, start, end, is_reversed)


def _along(element: ElementaryJoint, line: Vector) -> ElementaryJoint:
    """A slide or hinge with its axis in the direction of a line parallel to it."""
    return element if element.axis @ line > 0.0 else replace(element, axis=-element.axis, sense=-element.sense)


def _is_singular(axes: Sequence[Vector], line: Vector) -> bool:
    """True if hinges, in order from their body, cannot turn a line in all directions near home."""
    if len(axes) == 1:
        return area(axes[0], line) <= TOLERANCES.alignment
    return abs(cross(axes[0], line) @ axes[1]) <= TOLERANCES.alignment


def _ends(base_end: Ending, platform_end: Ending) -> tuple[Vector, Vector]:
    """The two ends of a rod; on a single hinge, the point nearest to the other end."""
    start, end = base_end.centre, platform_end.centre
    assert start is not None
    assert end is not None
    if base_end.kind == "hinge" and platform_end.kind == "hinge":
        first, second = base_end.elements[0], platform_end.elements[0]
        return (_foot(first, end), end) if are_parallel(first, second) else _nearest(first, second)
    if base_end.kind == "hinge":
        return _foot(base_end.elements[0], end), end
    return start, _foot(platform_end.elements[0], start) if platform_end.kind == "hinge" else end


def _foot(hinge: ElementaryJoint, point: Vector) -> Vector:
    """The point of a hinge's axis that is nearest to a point."""
    return hinge.point + hinge.axis * (hinge.axis @ (point - hinge.point))


def _nearest(first: ElementaryJoint, second: ElementaryJoint) -> tuple[Vector, Vector]:
    """The points of two axes that are nearest to each other."""
    return _crossing(first, second), _crossing(second, first)
