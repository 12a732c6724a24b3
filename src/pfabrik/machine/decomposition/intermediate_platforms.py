"""Sub-chains whose legs meet before the platform, at intermediate platforms.

Intermediate platforms are found from the platform inward: bodies that lead on to several legs, joined to the platform
by hinges and slides alone. Joints in series at the base carry the rest, as redundant joints there. What is between two
of base, intermediate platforms and platform is a leg; between two intermediate platforms it is a rod, read in the
platform's frame. Legs that are not read from the base are on mirrored redundant joints, as `kernels.legs.frames` says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..description.graph import Edge, Step, components
from .closed_form_legs import legs_of_chain, placed_on, rigid_rod
from .decompose import SubChain, parts_between
from .graph_blocks import graph_of
from .home_numbers import HomeNumbers
from .leg_forms import HAS_LOOP, ElementaryJoint, LegForm, NoLeg, RedundantJoint, elementary_joints

MEETING, MOST_REDUNDANT = 3, 4
"""Least joints of an intermediate platform, and most redundant joints of a sub-chain: searches fail on linkages with
more."""


def legs_of_sub_chain(home: HomeNumbers, chain: SubChain) -> tuple[LegForm, ...]:
    """The legs of a sub-chain, and the redundant joints that they are on.

    Raises
    ------
    NoLeg : it has none; the text says why.
    """
    try:
        return legs_of_chain(home, chain)
    except NoLeg as reason:
        if str(reason) != HAS_LOOP or home.mechanism.end_effector_is_joint:
            raise
    return _legs_between(home, chain)


def _legs_between(home: HomeNumbers, chain: SubChain) -> tuple[LegForm, ...]:
    graph, names = graph_of(home.mechanism), frozenset(chain.joints)
    edges = [edge for edge in graph.edges if edge.joint.name in names]
    below, base, edges = _redundant_in_series(home, edges, graph.base)
    above, edges = _intermediate_platforms(home, edges, base, graph.end, below[-1] if below else None)
    if not below and not above:
        raise NoLeg(HAS_LOOP)
    if len(below) + len(above) > MOST_REDUNDANT:
        raise NoLeg("more redundant joints carry its legs than are supported")
    legs: list[LegForm] = [*below, *above.values()]
    for group in components(edges, base, graph.end, *above):
        bodies = {body for edge in group for body in edge.bodies}
        ends = [body for body in (base, graph.end, *above) if body in bodies]
        if len(ends) != 2:
            raise NoLeg(HAS_LOOP)
        inner, outer = ends
        sub_chain = SubChain(parts_between(home, group, inner, outer), None)
        if inner == base:
            chain_legs = legs_of_chain(home, sub_chain)
            redundant_joint = above.get(outer, below[-1] if below else None)
            legs += placed_on(redundant_joint, [leg for leg in chain_legs if not leg.is_reversed])
            legs += _from_platform(below, above.get(outer), [leg for leg in chain_legs if leg.is_reversed])
        elif all(isinstance(part, Step) for part in sub_chain.parts):
            legs += _rod_between(above.get(inner), above[outer], elementary_joints(home, sub_chain.steps))
        else:
            raise NoLeg(HAS_LOOP)
    return tuple(legs)


def _redundant_in_series(
    home: HomeNumbers, edges: Sequence[Edge], base: str
) -> tuple[list[RedundantJoint], str, list[Edge]]:
    """The hinges and slides that all paths from the base pass first, the body beyond, and the remaining edges."""
    redundant: list[RedundantJoint] = []
    remaining = list(edges)
    while True:
        base_edges = [edge for edge in remaining if base in edge.bodies]
        elements = _elements_of_edge(home, base_edges[0], base) if len(base_edges) == 1 else []
        if not _is_redundant(elements):
            return redundant, base, remaining
        redundant.append(RedundantJoint(elements[0], is_reversed=False, on=redundant[-1] if redundant else None))
        remaining.remove(base_edges[0])
        base = base_edges[0].other(base)


def _intermediate_platforms(
    home: HomeNumbers, edges: Sequence[Edge], base: str, end: str, below: RedundantJoint | None
) -> tuple[dict[str, RedundantJoint], list[Edge]]:
    """Redundant joints from the platform to intermediate platforms, by the body that each moves; remaining edges."""
    paths: dict[str, tuple[tuple[Edge, str], ...]] = {end: ()}
    bodies = [end]
    for body in bodies:  # grows while it is looked through
        for edge in edges:
            next_body = edge.other(body)
            if (
                body in edge.bodies
                and next_body != base
                and next_body not in paths
                and _is_redundant(_elements_of_edge(home, edge, body))
            ):
                paths[next_body] = (*paths[body], (edge, next_body))
                bodies.append(next_body)
    redundant: dict[str, RedundantJoint] = {}
    remaining = list(edges)
    for body in bodies[1:]:
        if sum(body in edge.bodies for edge in edges) < MEETING:
            continue
        previous, on = end, below
        for edge, next_body in paths[body]:
            if next_body not in redundant:
                element = _elements_of_edge(home, edge, previous)[0]
                redundant[next_body] = RedundantJoint(element, is_reversed=False, at_platform_end=True, on=on)
                remaining.remove(edge)
            previous, on = next_body, redundant[next_body]
    return redundant, remaining


def _elements_of_edge(home: HomeNumbers, edge: Edge, body: str) -> list[ElementaryJoint]:
    """The elementary joints of an edge, passed from one of its bodies."""
    return elementary_joints(home, [Step(edge.joint, edge.bodies[0] == body)])


def _is_redundant(elements: Sequence[ElementaryJoint]) -> bool:
    return len(elements) == 1 and elements[0].kind != "S"


def _from_platform(
    below: Sequence[RedundantJoint], outer: RedundantJoint | None, legs: Sequence[LegForm]
) -> tuple[LegForm, ...]:
    """Legs read from the platform or an intermediate platform, on mirrors of the redundant joints at both ends."""
    mirrors = _mirrors(_path_to(outer), below, is_inner=False) if legs else []
    return *mirrors, *placed_on(mirrors[-1] if mirrors else None, legs)


def _rod_between(
    inner: RedundantJoint | None, outer: RedundantJoint, elements: list[ElementaryJoint]
) -> tuple[LegForm, ...]:
    """A rod from an intermediate platform, or the platform, to another, on mirrors of their redundant joints."""
    mirrors = _mirrors(_path_to(inner), _path_to(outer), is_inner=True)
    return *mirrors, replace(rigid_rod(elements), on=mirrors[-1])


def _mirrors(
    base_ends: Sequence[RedundantJoint], platform_ends: Sequence[RedundantJoint], is_inner: bool
) -> list[RedundantJoint]:
    """Mirrors of redundant joints: those that move the body of the base ends, then that of the platform ends."""
    mirrors: list[RedundantJoint] = []
    for mirrored, at_platform_end in (
        *((mirrored, False) for mirrored in base_ends),
        *((mirrored, True) for mirrored in platform_ends),
    ):
        on = mirrors[-1] if mirrors else None
        mirrors.append(
            RedundantJoint(
                mirrored.element,
                is_reversed=True,
                at_platform_end=at_platform_end,
                on=on,
                mirror_of=mirrored,
                is_inner=is_inner,
            )
        )
    return mirrors


def _path_to(joint: RedundantJoint | None) -> list[RedundantJoint]:
    """The redundant joints between the platform and a body, in order from the platform."""
    path: list[RedundantJoint] = []
    while joint is not None and joint.at_platform_end:
        path.append(joint)
        joint = joint.on
    return path[::-1]
