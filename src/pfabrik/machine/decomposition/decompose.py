"""TDS, the topological decomposition of a mechanism's graph into serial or branched sub-chains."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from ...common.derived import derived
from ..description.graph import Edge, Step, components
from ..description.mechanism import Mechanism, checked_mechanism
from .graph_blocks import TIP, Block, blocks_between, graph_of, is_connected, is_tree
from .home_numbers import HomeNumbers
from .joint_nodes import NotExpressible
from .positions import BranchForm, Parallelogram, express_branch, express_trunk, parallelogram_of


@dataclass(frozen=True)
class Split:
    """Several paths from one body to another: branches, if that is the end effector, or a loop within the sub-chain.

    Attributes
    ----------
    ways : tuple of tuple of Part
        The parts of each path in order, from the base outward.
    parallelogram : Parallelogram or None
        The one that the paths form, if they are two equal and parallel rods.
    """

    ways: tuple[tuple[Part, ...], ...]
    parallelogram: Parallelogram | None

    @property
    def steps(self) -> tuple[Step, ...]:
        """All its joints, path by path."""
        return tuple(step for path in self.ways for part in path for step in part.steps)

    def __str__(self) -> str:
        if self.parallelogram and self.parallelogram.pinned:
            return "Pa" + "*" * any(step.joint.actuated for step in self.steps)
        return f"[{', '.join(map(_to_text, self.ways))}]"


@dataclass(frozen=True)
class Mesh:
    """Joints between two bodies that are neither in series nor side by side, such as a bridge."""

    steps: tuple[Step, ...]

    def __str__(self) -> str:
        return f"{{{', '.join(map(str, self.steps))}}}"


Part: TypeAlias = Step | Split | Mesh


@dataclass(frozen=True)
class SubChain:
    """One sub-chain: its parts in series, from the base to the end effector.

    Attributes
    ----------
    parts : tuple of Part
        Joints, and splits where the chain branches or holds a loop.
    reason : str or None
        Why positions alone cannot express it; else None.
    branch_forms : tuple of BranchForm
        Nodes, links and cones of each branch; empty where positions alone cannot express it.
    """

    parts: tuple[Part, ...]
    reason: str | None
    branch_forms: tuple[BranchForm, ...] = ()

    @property
    def trunk(self) -> tuple[Step, ...]:
        """The joints before the body at which a tree branches; empty for other chains."""
        return _trunk_and_branches(self.parts)[0]

    @property
    def branches(self) -> tuple[tuple[Step, ...], ...]:
        """The joints of each branch of a tree that branches once; one branch with all joints for other chains."""
        return _trunk_and_branches(self.parts)[1]

    @property
    def parallelograms(self) -> tuple[Parallelogram, ...]:
        """Its parallelograms, those of branches that end on the end effector included."""
        return tuple(_parallelograms(self.parts))

    @property
    def steps(self) -> tuple[Step, ...]:
        """All joints of the sub-chain, from the base outward, branch by branch."""
        return tuple(step for part in self.parts for step in part.steps)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of all its joints; a joint cut at the end effector belongs to every chain that ends there."""
        return tuple(step.joint.name for step in self.steps)

    def __str__(self) -> str:
        return _to_text(self.parts)


def _to_text(parts: Sequence[Part]) -> str:
    return "-".join(map(str, parts))


def _trunk_and_branches(parts: tuple[Part, ...]) -> tuple[tuple[Step, ...], tuple[tuple[Step, ...], ...]]:
    *trunk, last = parts
    if isinstance(last, Split) and _are_steps(trunk) and all(map(_are_steps, last.ways)):
        return _steps(trunk), tuple(map(_steps, last.ways))
    return (), (_steps(parts),)


def _are_steps(parts: Sequence[Part]) -> bool:
    return all(isinstance(part, Step) for part in parts)


def _steps(parts: Sequence[Part]) -> tuple[Step, ...]:
    return tuple(step for part in parts for step in part.steps)


def _parallelograms(parts: Sequence[Part]) -> Iterator[Parallelogram]:
    for part in parts:
        if isinstance(part, Split):
            if part.parallelogram:
                yield part.parallelogram
            for path in part.ways:
                yield from _parallelograms(path)


def decompose(mechanism: Mechanism) -> tuple[SubChain, ...]:
    """Split a mechanism into its sub-chains, in the order of their first joints.

    The graph is cut at the base and at the end effector (a joint end effector is cut in two, and stands for a point).
    Every connected component that joins the two is a sub-chain. It is decomposed likewise between the bodies that all
    its paths pass: several paths out of a body are branches if they end at the end effector, else a loop within the
    sub-chain. A sub-chain that positions alone cannot express has the reason.

    Source: the paper's TDS. Which chains positions can express: `decomposition.positions`.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    """
    chains = sub_chains(HomeNumbers(checked_mechanism(mechanism)))
    return tuple(_express(mechanism, chain) if chain.reason is None else chain for chain in chains)


def sub_chains(home: HomeNumbers) -> tuple[SubChain, ...]:
    """The sub-chains of a mechanism, not yet expressed in positions."""
    graph = graph_of(home.mechanism)
    groups = components(graph.edges, graph.base, graph.end)
    on_base = (group for group in groups if any(graph.base in edge.bodies for edge in group))
    return tuple(_sub_chain(home, group, graph.base, graph.end) for group in on_base)


def _sub_chain(home: HomeNumbers, edges: Sequence[Edge], base: str, end: str) -> SubChain:
    """The sub-chain of connected edges, at least one of them on the base."""
    if not is_connected(edges, base, end):
        return SubChain(tuple(Step(edge.joint) for edge in edges), "does not lead to the end effector")
    parts = parts_between(home, edges, base, end)
    return SubChain(parts, None if is_tree(edges, base, end) else "has a loop of its own")


def parts_between(home: HomeNumbers, edges: Sequence[Edge], start: str, goal: str) -> tuple[Part, ...]:
    """The parts between two bodies, in series."""
    return tuple(_part(home, block) for block in blocks_between(edges, start, goal))


def _part(home: HomeNumbers, block: Block) -> Part:
    """A single joint; parallel paths, each decomposed again; or a mesh, if paths share joints."""
    steps = tuple(Step(edge.joint, edge.bodies[0] == block.inward, TIP in edge.bodies) for edge in block.edges)
    if len(steps) == 1:
        return steps[0]
    groups = components(block.edges, block.inward, block.outward)
    if len(groups) == 1:
        return Mesh(steps)
    parts = tuple(parts_between(home, group, block.inward, block.outward) for group in groups)
    joints = [[step.joint for step in _steps(group)] for group in parts]
    return Split(parts, parallelogram_of(joints, home))


def _express(mechanism: Mechanism, chain: SubChain) -> SubChain:
    """A tree-like sub-chain with its branches expressed in positions, or with the reason why they cannot be."""
    splits = [part for part in chain.parts if isinstance(part, Split)]
    try:
        if splits and not chain.trunk:
            raise NotExpressible("branches more than once")
        express_trunk(mechanism, chain.trunk)
        forms = tuple(express_branch(mechanism, branch, on_base=not chain.trunk) for branch in chain.branches)
    except NotExpressible as reason:
        return SubChain(chain.parts, str(reason))
    return SubChain(chain.parts, None, forms)


def beyond_positions(mechanism: Mechanism) -> tuple[str, ...]:
    """The reasons why positions alone cannot express a mechanism: of sub-chains, or motors in none of them."""
    chains = decompose(mechanism)
    reasons = tuple(f"sub-chain {chain}: {chain.reason}" for chain in chains if chain.reason is not None)
    expressed = {step.joint.name for chain in chains for step in chain.trunk}
    expressed |= {measure.joint for chain in chains for form in chain.branch_forms for measure in form.measures}
    driven = dict.fromkeys(drive.joint.name for drive in mechanism.drives)
    missing = (f"actuated joint {name} is in no sub-chain" for name in driven if name not in expressed)
    return reasons or tuple(missing)


@derived
def positions_express(mechanism: Mechanism) -> bool:
    """True if positions alone express all chains of a mechanism, and its task sets the whole pose."""
    return mechanism.task == mechanism.whole_task and not beyond_positions(mechanism)
