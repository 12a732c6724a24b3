"""The ways from the base to the end effector through a mechanism's graph: between any two of them lies a loop."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Iterator
from functools import reduce
from itertools import chain
from operator import xor

from ..errors import UnsupportedMechanism
from .graph import Edge, Step, edges_of, spanning_tree
from .structure import Structure

MOST_PATHS = 100_000
"""Most paths looked at: a graph as dense as that is no machine."""

Path = tuple[Step, ...]


def independent_paths(mechanism: Structure, *, detours: bool = True) -> tuple[Path, ...]:
    """Paths from the base to the end effector: enough that every loop of the graph lies between two of them.

    First those that pass no body twice, shortest first; then, for loops that none of them passes (a gripper's),
    detours around these. Paths count as sums of joints modulo two: those of all are spanned by as many as there are
    loops, and one.

    Parameters
    ----------
    detours : whether loops that hang beside every path (a gripper's) are gone around too.

    Raises
    ------
    UnsupportedMechanism : the graph has too many paths to look through.
    """
    most = len(mechanism.joints) - len(mechanism.bodies) + 2
    number = {joint.name: 1 << place for place, joint in enumerate(mechanism.joints)}
    chosen: list[Path] = []
    basis: list[int] = []
    around = _detours(mechanism, chosen) if detours else ()
    for path in chain(_simple_paths(mechanism), around):
        rest = _reduce(reduce(xor, (number[step.joint.name] for step in path), 0), basis)
        if rest:
            basis.append(rest)
            chosen.append(path)
        if len(chosen) == most:
            break
    return tuple(chosen)


def _detours(mechanism: Structure, chosen: list[Path]) -> Iterator[Path]:
    """Paths that go around a loop first: out to a joint, over it, back from its other side, then the first chosen."""
    direct = chosen[0]
    on_path = {step.joint.name for step in direct}
    edges: list[Edge] = sorted(edges_of(mechanism.joints), key=lambda edge: edge.joint.name not in on_path)
    tree = spanning_tree(edges, mechanism.base)  # holds the path, whose joints come first

    def way(body: str) -> Path:
        return tuple(Step(edges[index].joint, forward) for index, forward in tree.way(body))

    for joint in mechanism.joints:
        out, back = map(way, joint.connects)
        walk: list[Step] = []
        for step in (*out, Step(joint), *(each.back for each in reversed(back)), *direct):
            if walk and walk[-1] == step.back:
                walk.pop()  # there and back again
            else:
                walk.append(step)
        yield tuple(walk)


def _reduce(path: int, basis: list[int]) -> int:
    """What is left of a path after the sum of some of the basis is taken away; 0 if it follows from them."""
    for each in basis:
        path = min(path, path ^ each)
    return path


def _simple_paths(mechanism: Structure) -> Iterator[Path]:
    """All paths from the base to the end effector that pass no body twice, the shortest first."""
    touching: dict[str, list[Edge]] = defaultdict(list)
    for edge in edges_of(mechanism.joints):
        for body in edge.bodies:
            touching[body].append(edge)
    waiting: deque[tuple[str, frozenset[str], Path]] = deque([(mechanism.base, frozenset({mechanism.base}), ())])
    for _ in range(MOST_PATHS):
        if not waiting:
            return
        body, passed, path = waiting.popleft()
        if body == mechanism.end_effector_body:
            yield path
            continue
        for edge in touching[body]:
            other = edge.other(body)
            if other not in passed:
                step = Step(edge.joint, edge.bodies[0] == body)
                waiting.append((other, passed | {other}, (*path, step)))
    raise UnsupportedMechanism(mechanism.name, [f"more than {MOST_PATHS} paths lead from base to end effector"])
