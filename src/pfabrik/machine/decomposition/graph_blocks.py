"""A mechanism's graph between base and end effector, rigid joints welded, and its biconnected blocks in series."""

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
class Block:
    """A biconnected block of the graph: a single joint, or joints that form loops between two bodies.

    Every path through it enters at `inward` and leaves at `outward`.
    """

    inward: str
    outward: str
    edges: tuple[Edge, ...]


def graph_of(mechanism: Structure) -> Graph:
    """The graph of a mechanism; a joint that is the end effector becomes two edges, each to the tip."""
    rigid = [joint for joint in mechanism.joints if joint.is_rigid and joint.name != mechanism.end_effector]
    root_of = welded(rigid, mechanism.base)
    edges = []
    for joint in mechanism.joints:
        first_body, second_body = (root_of.get(body, body) for body in joint.connects)
        if mechanism.end_effector_is_joint and joint.name == mechanism.end_effector:
            edges += [Edge(joint, (first_body, TIP)), Edge(joint, (second_body, TIP))]
        elif not joint.is_rigid:
            edges.append(Edge(joint, (first_body, second_body)))
    end = TIP if mechanism.end_effector_is_joint else root_of.get(mechanism.end_effector, mechanism.end_effector)
    return Graph(tuple(edges), mechanism.base, end)


def is_tree(edges: Sequence[Edge], base: str, end: str) -> bool:
    """True if connected edges, cut at the end effector, form a tree with one joint to the base."""
    bodies = {body for edge in edges for body in edge.bodies} - {base, end}
    inner_edges = [edge for edge in edges if end not in edge.bodies]  # a tree on n bodies and the base has n of them
    return sum(base in edge.bodies for edge in edges) == 1 and len(inner_edges) == len(bodies)


def is_connected(edges: Sequence[Edge], start: str, goal: str) -> bool:
    """True if there is a path from one body to another."""
    return goal in spanning_tree(edges, start).paths


def blocks_between(edges: Sequence[Edge], start: str, goal: str) -> list[Block]:
    """The biconnected blocks on the paths between two bodies, in series; the other blocks are left out.

    Edges on a common loop belong to one block. The fundamental loops of a spanning tree that share an edge share a
    block, and every path to the goal passes the same blocks.
    """
    tree = spanning_tree(edges, start)
    labels = list(range(len(edges)))
    for loop in tree.loops:
        joined = {labels[member] for member in np.flatnonzero(loop)}
        labels = [min(joined) if label in joined else label for label in labels]
    blocks, inward = [], start
    for label, members in groupby((index for index, _ in tree.way(goal)), key=labels.__getitem__):
        outward = inward
        for member in members:
            outward = edges[member].other(outward)
        blocks.append(
            Block(inward, outward, tuple(edge for edge, its in zip(edges, labels, strict=True) if its == label))
        )
        inward = outward
    return blocks
