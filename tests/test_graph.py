"""The graph of bodies and joints: what lies in series between two bodies, by looking at every single way."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from pfabrik import Joint
from pfabrik.machine.decomposition.graph_blocks import blocks_between, is_tree
from pfabrik.machine.description.graph import Edge, components

START, GOAL = "start", "goal"
BODIES = (START, "a", "b", "c", "d", GOAL)


def random_edges(random: np.random.Generator) -> list[Edge]:
    """Four to ten joints between any two of six bodies, some side by side; one way at least leads to the goal."""
    while True:
        pairs = [random.choice(BODIES, 2, replace=False) for _ in range(random.integers(4, 11))]
        edges = edges_of(*((str(one), str(other)) for one, other in pairs))
        if any(ways(edges)):
            return edges


def edges_of(*pairs: tuple[str, str]) -> list[Edge]:
    return [Edge(Joint(f"j{k}", "spherical", pair, at=(0, 0, 0)), pair) for k, pair in enumerate(pairs)]


def ways(edges: list[Edge], passed: tuple[str, ...] = (START,)) -> Iterator[tuple[tuple[str, ...], tuple[str, ...]]]:
    """All ways to the goal that pass no body twice: the bodies, and the joints between them."""
    if passed[-1] == GOAL:
        yield passed, ()
        return
    for edge in edges:
        if passed[-1] in edge.bodies and edge.other(passed[-1]) not in passed:
            for bodies, joints in ways(edges, (*passed, edge.other(passed[-1]))):
                yield bodies, (edge.joint.name, *joints)


def test_blocks_are_what_every_path_passes_in_that_order() -> None:
    random = np.random.default_rng(0)
    for _ in range(100):
        edges = random_edges(random)
        all_ways = list(ways(edges))
        common = set.intersection(*(set(bodies) for bodies, _ in all_ways))
        in_turn = [body for body in all_ways[0][0] if body in common]
        blocks = blocks_between(edges, START, GOAL)
        assert [(block.inward, block.outward) for block in blocks] == list(pairwise(in_turn))
        for block in blocks:
            passed = set()
            for bodies, joints in all_ways:
                passed |= set(joints[bodies.index(block.inward) : bodies.index(block.outward)])
            assert [edge.joint.name for edge in block.edges] == [e.joint.name for e in edges if e.joint.name in passed]


def test_groups_keep_the_order_of_the_description() -> None:
    edges = edges_of((START, "a"), (START, "b"), ("b", GOAL), ("c", GOAL), ("a", "c"))
    groups = [[edge.joint.name for edge in group] for group in components(edges, START, GOAL)]
    assert groups == [["j0", "j3", "j4"], ["j1", "j2"]]


def test_a_tree_has_one_joint_to_the_base_and_no_loop_before_the_end() -> None:
    assert is_tree(edges_of((START, "a"), ("a", GOAL), ("a", GOAL)), START, GOAL)
    assert not is_tree(edges_of((START, "a"), (START, "a"), ("a", GOAL)), START, GOAL)
    assert not is_tree(edges_of((START, "a"), ("a", "b"), ("b", "c"), ("c", "a"), ("a", GOAL)), START, GOAL)
