"""Bodies as a tree: the joints that lead to a body each, and those that are cut because they close loops."""

from __future__ import annotations

from dataclasses import dataclass

from ...machine.description.graph import edges_of, spanning_tree
from ...machine.description.joints import Joint
from ...machine.description.structure import Structure
from .names import unique

CUT_AS_THEY_ARE = ("spherical", "fixed")
"""Joint types that an equality of a simulation model stands for: two points, or two frames, that stay together."""


@dataclass(frozen=True)
class Branch:
    """A joint of the tree and the body that hangs on it.

    Attributes
    ----------
    forward : True if the joint leads from its first body to its second.
    double_of : the body that this one doubles, where the joint closes a loop and no equality stands for it; else None.
    """

    joint: Joint
    parent: str
    body: str
    forward: bool = True
    double_of: str | None = None


@dataclass(frozen=True)
class CutTree:
    """A mechanism as a tree from its base, parents before children, and what is cut.

    Attributes
    ----------
    cuts : the joints that an equality stands for. Other joints that close loops lead to a double of their second body.
    """

    branches: tuple[Branch, ...]
    cuts: tuple[Joint, ...]


def cut_tree(mechanism: Structure) -> CutTree:
    """The tree of a mechanism's bodies; balls are cut first, and motors last."""
    ease = {joint: 0 if joint.driven else 2 if joint.type == "spherical" else 1 for joint in mechanism.joints}
    worst_first = edges_of(sorted(mechanism.joints, key=ease.__getitem__))
    closing = {worst_first[index].joint for index in spanning_tree(worst_first, mechanism.base).closing}
    uncut = [joint for joint in mechanism.joints if joint not in closing]
    branches: list[Branch] = []
    for index, forward in spanning_tree(edges_of(uncut), mechanism.base).steps:
        parent, body = uncut[index].connects if forward else uncut[index].connects[::-1]
        branches.append(Branch(uncut[index], parent, body, forward))
    cuts, taken = [], {*mechanism.bodies}
    for joint in mechanism.joints:
        if joint in closing and joint.type in CUT_AS_THEY_ARE:
            cuts.append(joint)
        elif joint in closing:
            parent, body = joint.connects
            branches.append(Branch(joint, parent, unique(f"{body}:{joint.name}", taken), double_of=body))
    return CutTree(tuple(branches), tuple(cuts))
