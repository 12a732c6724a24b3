"""TDS, the topological decomposition: the mechanism's graph falls apart into serial or branched sub-chains."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from itertools import chain
from typing import Literal

from .forms import BranchForm, NotExpressible, TrunkForm
from .joint_types import KINDS
from .mechanism import Joint, Mechanism
from .positions import express_branch, express_trunk

TIP = "(tip)"


@dataclass(frozen=True)
class Step:
    """A joint on the way from the base to the end effector; `forward` if its second body is the outward one."""

    joint: Joint
    forward: bool = True
    ends: bool = False  # this joint, cut, is the end effector

    @property
    def sign(self) -> float:
        """+1 if the joint's coordinate moves the outward body relative to the inward one, else -1."""
        return 1.0 if self.forward else -1.0

    @property
    def inward(self) -> str:
        """The body nearer to the base."""
        return self.joint.connects[0 if self.forward else 1]

    def __str__(self) -> str:
        return KINDS[self.joint.type].letter + ("*" if self.joint.actuated else "")


@dataclass(frozen=True)
class SubChain:
    """One sub-chain: a trunk common to all its branches (empty for a serial one), and the branches.

    Attributes
    ----------
    trunk, branches : the joints in order, from the base outward.
    reason : why positions alone cannot express it, or None.
    """

    trunk: tuple[Step, ...]
    branches: tuple[tuple[Step, ...], ...]
    reason: str | None
    trunk_form: TrunkForm | None
    branch_forms: tuple[BranchForm, ...]

    @property
    def engine(self) -> Literal["reaching", "closure"]:
        """The engine that serves this chain."""
        return "reaching" if self.reason is None else "closure"

    @property
    def steps(self) -> tuple[Step, ...]:
        """All joints of the sub-chain, the trunk's first."""
        return self.trunk + tuple(step for branch in self.branches for step in branch)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of all its joints; a joint cut at the end effector belongs to every chain that ends there."""
        return tuple(step.joint.name for step in self.steps)

    def __str__(self) -> str:
        written = ["-".join(map(str, branch)) for branch in self.branches]
        ends = written[0] if len(written) == 1 else f"[{', '.join(written)}]"
        return "-".join([*map(str, self.trunk), ends])


@dataclass(frozen=True)
class _Edge:
    joint: Joint
    bodies: tuple[str, str]

    def other(self, body: str) -> str:
        return self.bodies[1] if self.bodies[0] == body else self.bodies[0]


def decompose(mechanism: Mechanism) -> tuple[SubChain, ...]:
    """Split a mechanism into its sub-chains, in the order of their first joints.

    The graph is cut at the base and at the end effector (a joint end effector is cut in two, and stands for a point).
    Every connected rest with one joint to the base and no loop of its own is a sub-chain, branched where several of
    its joints lead to the end effector. Each says which engine serves it, and why.

    Source: the paper's TDS; DESIGN of restrictions on positions in `pfabrik.positions`.
    """
    edges = _edges(mechanism)
    weld = _welded(mechanism)
    base = weld[mechanism.base]
    end = TIP if mechanism.end_effector_is_joint else weld[mechanism.end_effector]
    found = [_sub_chain(mechanism, group, base, end) for group in _components(edges, base, end)]
    return tuple(sub_chain for sub_chain in found if sub_chain is not None)


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


def _edges(mechanism: Mechanism) -> list[_Edge]:
    """The graph's edges between welded bodies; a joint that is the end effector becomes two, each to the tip."""
    weld = _welded(mechanism)
    edges = []
    for joint in mechanism.joints:
        first, second = (weld[body] for body in joint.connects)
        if mechanism.end_effector_is_joint and joint.name == mechanism.end_effector:
            edges += [_Edge(joint, (first, TIP)), _Edge(joint, (second, TIP))]
        elif joint.type != "fixed":
            edges.append(_Edge(joint, (first, second)))
    return edges


def _components(edges: list[_Edge], base: str, end: str) -> list[list[_Edge]]:
    """Groups of edges that hang together without passing through the base or the end effector."""
    group_of: dict[str, int] = {}
    groups: dict[int, list[_Edge]] = {}
    for number, edge in enumerate(edges):
        inner = [body for body in edge.bodies if body not in (base, end)]
        found = sorted({group_of[body] for body in inner if body in group_of})
        target = found[0] if found else number
        merged = [*chain.from_iterable(groups.pop(old) for old in found), edge]
        groups[target] = merged
        for member in merged:
            group_of.update({body: target for body in member.bodies if body not in (base, end)})
    return [groups[number] for number in sorted(groups)]


def _sub_chain(mechanism: Mechanism, edges: list[_Edge], base: str, end: str) -> SubChain | None:
    """The sub-chain made of `edges`; None for a tool that hangs on the end effector alone."""
    bodies = {body for edge in edges for body in edge.bodies} - {base, end}
    to_base = [edge for edge in edges if base in edge.bodies]
    if not to_base:
        return None
    between = [edge for edge in edges if end not in edge.bodies]  # a tree on n bodies and the base has n of them
    if len(to_base) > 1 or len(between) != len(bodies):
        steps = tuple(Step(edge.joint) for edge in edges)
        return SubChain((), (steps,), "has a loop of its own", None, ())
    paths = _paths(edges, base, end)
    if not paths:
        steps = tuple(Step(edge.joint) for edge in edges)
        return SubChain((), (steps,), "does not lead to the end effector", None, ())
    return _express(mechanism, *_split(paths))


def _paths(edges: list[_Edge], base: str, end: str) -> list[tuple[Step, ...]]:
    """The ways from base to end effector through a tree, in the order of the description."""
    at: dict[str, list[_Edge]] = defaultdict(list)
    for edge in edges:
        for body in edge.bodies:
            at[body].append(edge)
    paths: list[tuple[Step, ...]] = []
    open_paths: list[tuple[str, tuple[Step, ...]]] = [(base, ())]
    while open_paths:
        body, path = open_paths.pop(0)
        if body == end:
            paths.append(path)
            continue
        came_by = path[-1].joint if path else None
        for edge in at[body]:
            if edge.joint is not came_by:
                open_paths.append(
                    (edge.other(body), (*path, Step(edge.joint, edge.bodies[0] == body, TIP in edge.bodies)))
                )
    return paths


def _split(paths: list[tuple[Step, ...]]) -> tuple[tuple[Step, ...], tuple[tuple[Step, ...], ...]]:
    """What all paths share, and what is left of each."""
    if len(paths) == 1:
        return (), (paths[0],)
    shared = 0
    while len({path[shared].joint.name for path in paths}) == 1:
        shared += 1
    return paths[0][:shared], tuple(path[shared:] for path in paths)


def _express(mechanism: Mechanism, trunk: tuple[Step, ...], branches: tuple[tuple[Step, ...], ...]) -> SubChain:
    names = [step.joint.name for branch in branches for step in branch if not step.ends]
    try:
        if len(set(names)) != len(names):
            raise NotExpressible("branches more than once")
        trunk_form = express_trunk(mechanism, trunk) if trunk else None
        forms = tuple(express_branch(mechanism, branch, on_base=not trunk) for branch in branches)
    except NotExpressible as reason:
        return SubChain(trunk, branches, str(reason), None, ())
    return SubChain(trunk, branches, None, trunk_form, forms)
