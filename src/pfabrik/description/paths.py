"""The ways from the base to the end effector through a mechanism's graph: between any two of them lies a loop."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce
from itertools import chain
from operator import xor

from ..errors import UnsupportedMechanism
from .mechanism import Joint, Mechanism

MOST_PATHS = 100_000
"""Most paths looked at: a graph as dense as that is no machine."""


@dataclass(frozen=True)
class Passage:
    """A joint on a path; `forward` if the path passes it from its first body to its second."""

    joint: Joint
    forward: bool


Path = tuple[Passage, ...]


def end_body(mechanism: Mechanism) -> str:
    """The body that the paths lead to; of a joint end effector, its first body that is not the base."""
    if not mechanism.end_effector_is_joint:
        return mechanism.end_effector
    first, second = mechanism.joint(mechanism.end_effector).connects
    return second if first == mechanism.base else first


def independent_paths(mechanism: Mechanism) -> tuple[Path, ...]:
    """Paths from the base to the end effector: enough that every loop of the graph lies between two of them.

    First those that pass no body twice, shortest first; then, for loops that none of them passes (a gripper's),
    detours around these. Paths count as sums of joints modulo two: those of all are spanned by as many as there are
    loops, and one.

    Raises
    ------
    UnsupportedMechanism : the graph has too many paths to look through.
    """
    most = len(mechanism.joints) - len(mechanism.bodies) + 2
    number = {joint.name: 1 << place for place, joint in enumerate(mechanism.joints)}
    chosen: list[Path] = []
    basis: list[int] = []
    direct = _paths(mechanism, end_body(mechanism))
    for path in chain(direct, (_detour(mechanism, joint, chosen[0]) for joint in mechanism.joints)):
        rest = _reduce(reduce(xor, (number[passage.joint.name] for passage in path), 0), basis)
        if rest:
            basis.append(rest)
            chosen.append(path)
        if len(chosen) == most:
            break
    return tuple(chosen)


def _detour(mechanism: Mechanism, joint: Joint, path: Path) -> Path:
    """A path that goes around a loop first: out to a joint, over it, and back from its other side."""
    out, back = (_way(mechanism, body, path) for body in joint.connects)
    walk: list[Passage] = []
    for passage in (*out, Passage(joint, True), *_reversed(back), *path):
        if walk and walk[-1] == Passage(passage.joint, not passage.forward):
            walk.pop()  # there and back again
        else:
            walk.append(passage)
    return tuple(walk)


def _way(mechanism: Mechanism, body: str, path: Path) -> Path:
    """A way from the base to a body, along a path as far as that leads."""
    passed = [mechanism.base, *(passage.joint.connects[1 if passage.forward else 0] for passage in path)]
    ways = {each: path[:place] for place, each in enumerate(passed)}
    while body not in ways:
        for joint in mechanism.joints:
            for forward, (here, there) in ((True, joint.connects), (False, joint.connects[::-1])):
                if here in ways and there not in ways:
                    ways[there] = (*ways[here], Passage(joint, forward))
    return ways[body]


def _reversed(path: Path) -> Path:
    return tuple(Passage(passage.joint, not passage.forward) for passage in reversed(path))


def _reduce(path: int, basis: list[int]) -> int:
    """What is left of a path after the sum of some of the basis is taken away; 0 if it follows from them."""
    for each in basis:
        path = min(path, path ^ each)
    return path


def _paths(mechanism: Mechanism, end: str) -> Iterator[Path]:
    """All paths that pass no body twice, the shortest first."""
    at: dict[str, list[Joint]] = {body: [] for body in mechanism.bodies}
    for joint in mechanism.joints:
        for body in joint.connects:
            at[body].append(joint)
    waiting: deque[tuple[str, frozenset[str], Path]] = deque([(mechanism.base, frozenset({mechanism.base}), ())])
    for _ in range(MOST_PATHS):
        if not waiting:
            return
        body, passed, path = waiting.popleft()
        if body == end:
            yield path
            continue
        for joint in at[body]:
            forward = joint.connects[0] == body
            other = joint.connects[1 if forward else 0]
            if other not in passed:
                waiting.append((other, passed | {other}, (*path, Passage(joint, forward))))
    raise UnsupportedMechanism(mechanism.name, [f"more than {MOST_PATHS} paths lead from base to end effector"])
