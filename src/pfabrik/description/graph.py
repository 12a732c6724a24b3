"""A mechanism as a graph: its bodies, welded where joints are fixed, and the joints between them."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain, groupby

from .mechanism import Joint, Mechanism

TIP = "(tip)"
"""The point body that a joint end effector, cut in two, stands for."""


@dataclass(frozen=True)
class Edge:
    """A joint between two welded bodies."""

    joint: Joint
    bodies: tuple[str, str]

    def other(self, body: str) -> str:
        """The body on the other side."""
        return self.bodies[1] if self.bodies[0] == body else self.bodies[0]


@dataclass(frozen=True)
class Graph:
    """The edges in the order of the description, and the bodies that stand for the base and the end effector."""

    edges: tuple[Edge, ...]
    base: str
    end: str


@dataclass(frozen=True)
class Stage:
    """What every way from one body to another passes: a single joint, or joints that form loops between the two."""

    inward: str
    outward: str
    edges: tuple[Edge, ...]


def graph_of(mechanism: Mechanism) -> Graph:
    """The graph of a mechanism; a joint that is the end effector becomes two edges, each to the tip."""
    weld = _welded(mechanism)
    edges = []
    for joint in mechanism.joints:
        first, second = (weld[body] for body in joint.connects)
        if mechanism.end_effector_is_joint and joint.name == mechanism.end_effector:
            edges += [Edge(joint, (first, TIP)), Edge(joint, (second, TIP))]
        elif joint.type != "fixed":
            edges.append(Edge(joint, (first, second)))
    end = TIP if mechanism.end_effector_is_joint else weld[mechanism.end_effector]
    return Graph(tuple(edges), weld[mechanism.base], end)


def _welded(mechanism: Mechanism) -> dict[str, str]:
    """Each body's representative: bodies joined by fixed joints are one."""
    root = {body: body for body in mechanism.bodies}

    def find(body: str) -> str:
        while root[body] != body:
            body = root[body]
        return body

    for joint in mechanism.joints:
        if joint.type == "fixed" and joint.name != mechanism.end_effector:
            keep, drop = (find(body) for body in joint.connects)
            if drop == find(mechanism.base):
                keep, drop = drop, keep
            root[drop] = keep
    return {body: find(body) for body in root}


def components(edges: Sequence[Edge], *cut: str) -> list[list[Edge]]:
    """Groups of edges that hang together without passing through the bodies at which the graph is cut."""
    group_of: dict[str, int] = {}
    groups: dict[int, list[int]] = {}
    for number, edge in enumerate(edges):
        inner = [body for body in edge.bodies if body not in cut]
        found = sorted({group_of[body] for body in inner if body in group_of})
        target = found[0] if found else number
        groups[target] = [*chain.from_iterable(groups.pop(old) for old in found), number]
        for member in groups[target]:
            group_of.update({body: target for body in edges[member].bodies if body not in cut})
    return [[edges[member] for member in sorted(groups[number])] for number in sorted(groups)]


def is_tree(edges: Sequence[Edge], base: str, end: str) -> bool:
    """Whether edges that hang together form a tree with one joint to the base, once cut at the end effector."""
    bodies = {body for edge in edges for body in edge.bodies} - {base, end}
    between = [edge for edge in edges if end not in edge.bodies]  # a tree on n bodies and the base has n of them
    return sum(base in edge.bodies for edge in edges) == 1 and len(between) == len(bodies)


def leads(edges: Sequence[Edge], start: str, goal: str) -> bool:
    """Whether there is a way from one body to another."""
    return goal in _tree(edges, start)


def stages(edges: Sequence[Edge], start: str, goal: str) -> list[Stage]:
    """What lies between two bodies, in series; what does not lead from one to the other is left out.

    These are the blocks of the graph: edges that lie on a common loop belong to one. Edges on the loops that a spanning
    tree closes share a block if the loops share an edge, and every way to the goal passes the same blocks.
    """
    inward = _tree(edges, start)
    block = list(range(len(edges)))

    def path(body: str) -> list[int]:
        passed = []
        while body != start:
            passed.append(inward[body])
            body = edges[passed[-1]].other(body)
        return passed

    for number, edge in enumerate(edges):
        one, other = edge.bodies
        if one in inward and other in inward and number not in (inward.get(one), inward.get(other)):
            joined = {block[member] for member in {number} | set(path(one)) ^ set(path(other))}
            block = [number if own in joined else own for own in block]
    found, here = [], start
    for own, passed in groupby(reversed(path(goal)), key=block.__getitem__):
        there = here
        for member in passed:
            there = edges[member].other(there)
        found.append(Stage(here, there, tuple(edge for edge, its in zip(edges, block, strict=True) if its == own)))
        here = there
    return found


def _tree(edges: Sequence[Edge], start: str) -> dict[str, int]:
    """Body -> the edge that leads from it toward the start, of a spanning tree; the start itself with -1."""
    at: dict[str, list[int]] = defaultdict(list)
    for number, edge in enumerate(edges):
        for body in edge.bodies:
            at[body].append(number)
    inward, waiting = {start: -1}, deque([start])
    while waiting:
        body = waiting.popleft()
        for number in at[body]:
            other = edges[number].other(body)
            if other not in inward:
                inward[other] = number
                waiting.append(other)
    return inward
