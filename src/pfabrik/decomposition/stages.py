"""A mechanism's graph between base and end effector, rigid joints welded: what lies in series, what in parallel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from ..description.graph import Edge, spanning_tree, welded
from ..description.structure import Structure

TIP = "(tip)"
"""The point body that a joint end effector, cut in two, stands for."""


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


def graph_of(mechanism: Structure) -> Graph:
    """The graph of a mechanism; a joint that is the end effector becomes two edges, each to the tip."""
    rigid = [joint for joint in mechanism.joints if joint.is_rigid and joint.name != mechanism.end_effector]
    weld = welded(rigid, mechanism.base)
    edges = []
    for joint in mechanism.joints:
        first, second = (weld.get(body, body) for body in joint.connects)
        if mechanism.end_effector_is_joint and joint.name == mechanism.end_effector:
            edges += [Edge(joint, (first, TIP)), Edge(joint, (second, TIP))]
        elif not joint.is_rigid:
            edges.append(Edge(joint, (first, second)))
    end = TIP if mechanism.end_effector_is_joint else weld.get(mechanism.end_effector, mechanism.end_effector)
    return Graph(tuple(edges), mechanism.base, end)


def is_tree(edges: Sequence[Edge], base: str, end: str) -> bool:
    """Whether edges that hang together form a tree with one joint to the base, once cut at the end effector."""
    bodies = {body for edge in edges for body in edge.bodies} - {base, end}
    between = [edge for edge in edges if end not in edge.bodies]  # a tree on n bodies and the base has n of them
    return sum(base in edge.bodies for edge in edges) == 1 and len(between) == len(bodies)


def leads(edges: Sequence[Edge], start: str, goal: str) -> bool:
    """Whether there is a way from one body to another."""
    return goal in spanning_tree(edges, start).paths


def stages(edges: Sequence[Edge], start: str, goal: str) -> list[Stage]:
    """What lies between two bodies, in series; what does not lead from one to the other is left out.

    These are the blocks of the graph: edges that lie on a common loop belong to one. Edges on the loops that a spanning
    tree closes share a block if the loops share an edge, and every way to the goal passes the same blocks.
    """
    tree = spanning_tree(edges, start)
    block = list(range(len(edges)))
    for loop in tree.loops:
        joined = {block[member] for member in np.flatnonzero(loop)}
        block = [min(joined) if own in joined else own for own in block]
    found, here = [], start
    for own, passed in groupby((index for index, _ in tree.way(goal)), key=block.__getitem__):
        there = here
        for member in passed:
            there = edges[member].other(there)
        found.append(Stage(here, there, tuple(edge for edge, its in zip(edges, block, strict=True) if its == own)))
        here = there
    return found
