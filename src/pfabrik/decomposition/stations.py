"""Sub-chains whose legs meet before the platform: at stations, bodies that arms of the platform place.

Stations are found from the platform: bodies that lead on to several legs, as far as hinges and slides alone reach. What
is in series at the base carries all of it, as arms there. What is left between two of base, stations and platform is a
leg, or a rod between stations, which is read as the platform sees these. Legs that are not read from the base are on
twins of the arms, see `kernels.legs.frames`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..description.graph import Edge, Step, components
from ..description.mechanism import Mechanism
from .decompose import SubChain, parts_between
from .items import HAS_LOOP, Item, NoLeg, items_of
from .leg_forms import LegForm, RedundantJoint
from .legs import legs_of_chain, put_on, rigid_rod
from .stages import graph_of

MEETING, MOST_REDUNDANT = 3, 4
"""Joints of a body where legs meet, and arms of a sub-chain: one with more is a linkage, in which searches get lost."""


def legs_of_sub_chain(mechanism: Mechanism, chain: SubChain) -> tuple[LegForm, ...]:
    """The legs that a sub-chain is, and the arms that those are on.

    Raises
    ------
    NoLeg : with the reason.
    """
    try:
        return legs_of_chain(mechanism, chain)
    except NoLeg as reason:
        if str(reason) != HAS_LOOP or mechanism.end_effector_is_joint:
            raise
    return _between_stations(mechanism, chain)


def _between_stations(mechanism: Mechanism, chain: SubChain) -> tuple[LegForm, ...]:
    graph, names = graph_of(mechanism), frozenset(chain.joints)
    edges = [edge for edge in graph.edges if edge.joint.name in names]
    below, base, edges = _redundant_in_series(mechanism, edges, graph.base)
    above, edges = _stations(mechanism, edges, base, graph.end, below[-1] if below else None)
    if not below and not above:
        raise NoLeg(HAS_LOOP)
    if len(below) + len(above) > MOST_REDUNDANT:
        raise NoLeg("more arms carry its legs than are answered for")
    found: list[LegForm] = [*below, *above.values()]
    for group in components(edges, base, graph.end, *above):
        bodies = {body for edge in group for body in edge.bodies}
        ends = [body for body in (base, graph.end, *above) if body in bodies]
        if len(ends) != 2:
            raise NoLeg(HAS_LOOP)
        inner, outer = ends
        between = SubChain(parts_between(mechanism, group, inner, outer), None)
        if inner == base:
            legs = legs_of_chain(mechanism, between)
            carries = above.get(outer, below[-1] if below else None)
            found += put_on(carries, [leg for leg in legs if not leg.is_reversed])
            found += _from_platform(below, above.get(outer), [leg for leg in legs if leg.is_reversed])
        elif all(isinstance(part, Step) for part in between.parts):
            found += _rod_between(above.get(inner), above[outer], items_of(mechanism, between.steps))
        else:
            raise NoLeg(HAS_LOOP)
    return tuple(found)


def _redundant_in_series(
    mechanism: Mechanism, edges: Sequence[Edge], base: str
) -> tuple[list[RedundantJoint], str, list[Edge]]:
    """The hinges and slides that all ways from the base pass first, the body beyond, and the edges that are left."""
    redundant: list[RedundantJoint] = []
    left = list(edges)
    while True:
        own = [edge for edge in left if base in edge.bodies]
        items = _passed(mechanism, own[0], base) if len(own) == 1 else []
        if not _is_redundant(items):
            return redundant, base, left
        redundant.append(RedundantJoint(items[0], is_reversed=False, on=redundant[-1] if redundant else None))
        left.remove(own[0])
        base = own[0].other(base)


def _stations(
    mechanism: Mechanism, edges: Sequence[Edge], base: str, end: str, below: RedundantJoint | None
) -> tuple[dict[str, RedundantJoint], list[Edge]]:
    """The arms that place stations, and the bodies on the way to them, in order from the platform; the edges left."""
    ways: dict[str, tuple[tuple[Edge, str], ...]] = {end: ()}
    bodies = [end]
    for body in bodies:  # grows while it is looked through
        for edge in edges:
            other = edge.other(body)
            if (
                body in edge.bodies
                and other != base
                and other not in ways
                and _is_redundant(_passed(mechanism, edge, body))
            ):
                ways[other] = (*ways[body], (edge, other))
                bodies.append(other)
    redundant: dict[str, RedundantJoint] = {}
    left = list(edges)
    for body in bodies[1:]:
        if sum(body in edge.bodies for edge in edges) < MEETING:
            continue
        before, on = end, below
        for edge, other in ways[body]:
            if other not in redundant:
                item = _passed(mechanism, edge, before)[0]
                redundant[other] = RedundantJoint(item, is_reversed=False, at_platform_end=True, on=on)
                left.remove(edge)
            before, on = other, redundant[other]
    return redundant, left


def _passed(mechanism: Mechanism, edge: Edge, body: str) -> list[Item]:
    """An edge as passed from one of its bodies."""
    return items_of(mechanism, [Step(edge.joint, edge.bodies[0] == body)])


def _is_redundant(items: Sequence[Item]) -> bool:
    return len(items) == 1 and items[0].kind != "S"


def _from_platform(
    below: Sequence[RedundantJoint], outer: RedundantJoint | None, legs: Sequence[LegForm]
) -> tuple[LegForm, ...]:
    """Legs read from the platform, or a body that its arms place, on twins of these arms and of those below."""
    mirrors = _mirrors(_way_to(outer), below, is_inner=False) if legs else []
    return *mirrors, *put_on(mirrors[-1] if mirrors else None, legs)


def _rod_between(inner: RedundantJoint | None, outer: RedundantJoint, items: list[Item]) -> tuple[LegForm, ...]:
    """A rod between two bodies that arms place, the inner one maybe the platform, on twins of these arms."""
    mirrors = _mirrors(_way_to(inner), _way_to(outer), is_inner=True)
    return *mirrors, replace(rigid_rod(items), on=mirrors[-1])


def _mirrors(
    base_ends: Sequence[RedundantJoint], platform_ends: Sequence[RedundantJoint], is_inner: bool
) -> list[RedundantJoint]:
    """Arms with the coordinates of others, that move the body of the feet, then that of the heads."""
    mirrors: list[RedundantJoint] = []
    for arm, at_platform_end in (*((each, False) for each in base_ends), *((each, True) for each in platform_ends)):
        on = mirrors[-1] if mirrors else None
        mirrors.append(
            RedundantJoint(
                arm.item, is_reversed=True, at_platform_end=at_platform_end, on=on, mirror_of=arm, is_inner=is_inner
            )
        )
    return mirrors


def _way_to(arm: RedundantJoint | None) -> list[RedundantJoint]:
    """The arms of the platform that place a body, in order from the platform."""
    way: list[RedundantJoint] = []
    while arm is not None and arm.at_platform_end:
        way.append(arm)
        arm = arm.on
    return way[::-1]
