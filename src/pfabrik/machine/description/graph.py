"""The graph of a mechanism, bodies joined by joints, and the walks and paths through it.

- `spanning_tree`: which joints lead from one body to every other, and the loops that the other joints close;
- `components`: what hangs together once the graph is cut at some bodies; `welded`: bodies that are as one;
- `next_joints`: where the rigid parts around a joint end.
"""

from __future__ import annotations

from collections import Counter, defaultdict, deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from heapq import heappop, heappush
from itertools import chain
from operator import xor

import numpy as np

from ...common.arrays import Floats
from ...common.derived import derived
from ...errors import InvalidArgument, UnsupportedMechanism
from .joints import KINDS, Joint
from .structure import Structure

PASSED_THROUGH = ("prismatic", "fixed")
"""Joint types that do not end a line: their two bodies keep their orientation relative to each other."""


@dataclass(frozen=True)
class Edge:
    """A joint and the two bodies it is between: its own, or those that stand for them."""

    joint: Joint
    bodies: tuple[str, str]

    def other(self, body: str) -> str:
        """The body on the other side."""
        return self.bodies[1] if self.bodies[0] == body else self.bodies[0]


@dataclass(frozen=True)
class Step:
    """A joint on a way through the graph; `forward` if its second body is the one it leads to."""

    joint: Joint
    forward: bool = True
    ends: bool = False  # this joint, cut, is the end effector

    @property
    def sign(self) -> float:
        """+1 if the joint's coordinate moves the body it leads to relative to the one before, else -1."""
        return 1.0 if self.forward else -1.0

    @property
    def inward(self) -> str:
        """The body that the way comes from."""
        return self.joint.connects[0 if self.forward else 1]

    @property
    def back(self) -> Step:
        """The joint, passed in the other direction."""
        return Step(self.joint, not self.forward, self.ends)

    @property
    def steps(self) -> tuple[Step, ...]:
        """Itself, as the only joint of this part of a sub-chain."""
        return (self,)

    def __str__(self) -> str:
        return KINDS[self.joint.type].letter + ("*" if self.joint.actuated else "")


@dataclass(frozen=True)
class Tree:
    """The edges that lead from one body, the root, to all others, and the loops that the other edges close.

    Attributes
    ----------
    steps : index of each of the tree's edges, in the order in which it grows, and whether it leads from the edge's
        first body to the second.
    closing : indices of the edges that close a loop each.
    paths : body -> (edges,): +1 for an edge that the way from the root passes from its first body to its second, -1
        for one that it passes backward, 0 for the others. Bodies that cannot be reached are missing.
    loops : the same for every loop, (loops, edges); the closing edge has -1.
    """

    steps: tuple[tuple[int, bool], ...]
    closing: tuple[int, ...]
    paths: Mapping[str, Floats]
    loops: Floats

    def way(self, body: str) -> list[tuple[int, bool]]:
        """The steps from the root to a body, in order."""
        return [step for step in self.steps if self.paths[body][step[0]]]


def edges_of(joints: Sequence[Joint]) -> tuple[Edge, ...]:
    """Every joint between its own two bodies."""
    return tuple(Edge(joint, joint.connects) for joint in joints)


def tree_of(mechanism: Structure) -> Tree:
    """The spanning tree of a mechanism's joints that grows from the base."""
    return spanning_tree(edges_of(mechanism.joints), mechanism.base)


def spanning_tree(edges: Sequence[Edge], root: str) -> Tree:
    """The tree that grows from the root, always by the first edge that touches a body already on it."""
    touching: dict[str, list[int]] = defaultdict(list)
    for index, edge in enumerate(edges):
        for body in edge.bodies:
            touching[body].append(index)
    one = np.eye(len(edges))
    paths = {root: np.zeros(len(edges))}
    steps: list[tuple[int, bool]] = []
    loops: dict[int, Floats] = {}
    waiting = list(touching[root])
    taken = set(waiting)
    while waiting:
        index = heappop(waiting)
        first, second = edges[index].bodies
        if first in paths and second in paths:
            loops[index] = paths[second] - paths[first] - one[index]
            continue
        forward = first in paths
        steps.append((index, forward))
        reached = second if forward else first
        paths[reached] = paths[first] + one[index] if forward else paths[second] - one[index]
        for new in touching[reached]:
            if new not in taken:
                taken.add(new)
                heappush(waiting, new)
    return Tree(tuple(steps), tuple(loops), paths, np.reshape(list(loops.values()), (len(loops), len(edges))))


def components(edges: Sequence[Edge], *cut: str) -> list[list[Edge]]:
    """Groups of edges that hang together without passing through the bodies at which the graph is cut.

    Groups come in the order of their first edges, and edges in their own order.
    """
    group_of: dict[str, int] = {}
    groups: dict[int, list[int]] = {}
    for number, edge in enumerate(edges):
        inner = [body for body in edge.bodies if body not in cut]
        found = sorted({group_of[body] for body in inner if body in group_of})
        target = found[0] if found else number
        groups[target] = [*chain.from_iterable(groups.pop(old) for old in found), number]
        for member in groups[target] if len(found) > 1 else [number]:
            group_of.update({body: target for body in edges[member].bodies if body not in cut})
    return [[edges[member] for member in sorted(groups[number])] for number in sorted(groups)]


def welded(joints: Sequence[Joint], *kept: str) -> dict[str, str]:
    """Bodies that joints hold together -> the one that stands for them: the first of those that are kept, or of all.

    What is kept stands for itself; bodies that stand for themselves may be missing.
    """
    stands_for: dict[str, str] = {}
    for group in components(edges_of(joints)):
        bodies = [body for edge in group for body in edge.bodies]
        first = next((body for body in kept if body in bodies), bodies[0])
        stands_for |= {body: first for body in bodies if body not in kept}
    return stands_for


@derived
def steps_from_base(mechanism: Structure) -> Mapping[str, int]:
    """Body -> how many joints the shortest way from the base to it has; bodies that cannot be reached are missing."""
    steps = {mechanism.base: 0}
    ends = [mechanism.base]
    for body in ends:  # grows while it is looked through
        for joint in mechanism.joints:
            for other in joint.connects:
                if body in joint.connects and other not in steps:
                    steps[other] = steps[body] + 1
                    ends.append(other)
    return steps


def next_joints(joints: Sequence[Joint], joint: Joint, body: str) -> list[Joint]:
    """The joints nearest to `joint` on its side `body`, in number of joints passed through; empty when it ends there.

    Prismatic and fixed joints are passed through. The bodies and names of all joints must be well formed.
    """
    seen, bodies = {*joint.connects}, [body]
    while bodies:
        around = [each for each in joints if each.name != joint.name and any(side in bodies for side in each.connects)]
        ends = [each for each in around if each.type not in PASSED_THROUGH]
        if ends:
            return ends
        bodies = [side for each in around for side in each.connects if side not in seen]
        seen.update(bodies)
    return []


def opposite(joint: Joint) -> str:
    """The body whose line the joint's cone limits: the one that the cone is not fixed to."""
    first, second = joint.connects
    return second if joint.cone is not None and joint.cone.fixed_to == first else first


def cone_line(mechanism: Structure, joint: Joint) -> tuple[Joint, Joint]:
    """The two joints between which the line limited by `joint.cone` runs.

    Returns
    -------
    The joint itself, and the nearest joint with a centre that is reached through the body that the cone is not fixed
    to, passing through prismatic joints (a strut's two parts carry one line).

    Raises
    ------
    InvalidArgument : the joint has no cone.
    """
    if joint.cone is None:
        raise InvalidArgument("joint", f"'{joint.name}', which has no cone", "a joint with a cone")
    return joint, next_joints(mechanism.joints, joint, opposite(joint))[0]


def joints_with_centre(mechanism: Structure, body: str) -> list[Joint]:
    """The joints of a body that have a centre."""
    return [joint for joint in mechanism.joints if body in joint.connects and joint.at is not None]


def sliding_along(mechanism: Structure, body: str) -> set[str]:
    """A body, and those that prismatic or fixed joints connect with it, the base left out."""
    found, grown = {body}, True
    while grown:
        passed = (joint for joint in mechanism.joints if joint.type in PASSED_THROUGH and joint.at is None)
        around = {each for joint in passed if found.intersection(joint.connects) for each in joint.connects}
        grown = not around - {mechanism.base} <= found
        found |= around - {mechanism.base}
    return found


def leaves(mechanism: Structure) -> Iterator[tuple[int, Joint, str]]:
    """Bodies that one joint alone connects, as a finger of a gripper, with that joint and its index.

    Not the base, nor the end effector, nor what hangs on an end effector that is a joint: that is the tool.
    """
    counts = Counter(body for joint in mechanism.joints for body in joint.connects)
    for index, joint in enumerate(mechanism.joints):
        if joint.name == mechanism.end_effector and mechanism.end_effector not in counts:
            continue
        for body in joint.connects:
            if counts[body] == 1 and body not in (mechanism.base, mechanism.end_effector):
                yield index, joint, body


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
    """The remainder of a path modulo the basis; 0 if the path is a sum of its members."""
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
