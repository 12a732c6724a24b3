"""Bodies as a tree: which joints lead to a body each, and which are cut, because they close loops."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..description.joints import Joint
from ..description.structure import Structure

CUT_AS_THEY_ARE = ("spherical", "fixed")
"""Joint types that an equality of a simulation model stands for: two points, or two frames, that stay together."""


@dataclass(frozen=True)
class Branch:
    """A joint of the tree and the body that hangs on it.

    Attributes
    ----------
    forward : whether the joint leads from its first body to its second.
    twin_of : the body that this one doubles, where the joint closes a loop and no equality stands for it; else None.
    """

    joint: Joint
    parent: str
    body: str
    forward: bool = True
    twin_of: str | None = None


@dataclass(frozen=True)
class CutTree:
    """A mechanism as a tree from its base, parents before children, and what is cut.

    Attributes
    ----------
    cuts : the joints that an equality stands for. Other joints that close loops lead to a twin of their second body.
    """

    branches: tuple[Branch, ...]
    cuts: tuple[Joint, ...]


def cut_tree(mechanism: Structure) -> CutTree:
    """The tree of a mechanism's bodies; balls are cut first, and motors last."""
    kept = _kept(mechanism)
    branches = list(_grown(mechanism.base, [joint for joint in mechanism.joints if joint in kept]))
    closing = [joint for joint in mechanism.joints if joint not in kept]
    taken = {*mechanism.bodies}
    for joint in closing:
        if joint.type not in CUT_AS_THEY_ARE:
            parent, body = joint.connects
            branches.append(Branch(joint, parent, unique(f"{body}:{joint.name}", taken), twin_of=body))
    return CutTree(tuple(branches), tuple(joint for joint in closing if joint.type in CUT_AS_THEY_ARE))


def unique(name: str, taken: set[str]) -> str:
    """The name, or the name with a number if it is taken; it counts as taken from now on."""
    free, number = name, 1
    while free in taken:
        number += 1
        free = f"{name}_{number}"
    taken.add(free)
    return free


def _kept(mechanism: Structure) -> set[Joint]:
    """A spanning tree of the joints that are worst to cut."""
    leads_to = {body: body for body in mechanism.bodies}

    def root(body: str) -> str:
        while leads_to[body] != body:
            body = leads_to[body]
        return body

    kept = set()
    for joint in sorted(mechanism.joints, key=_ease_of_cutting):
        first, second = map(root, joint.connects)
        if first != second:
            leads_to[first] = second
            kept.add(joint)
    return kept


def _ease_of_cutting(joint: Joint) -> int:
    if joint.driven:
        return 0
    return 2 if joint.type == "spherical" else 1


def _grown(base: str, joints: Sequence[Joint]) -> list[Branch]:
    """The joints of a tree, from the base outward."""
    ends, grown = [base], list[Branch]()
    for body in ends:  # grows while it is looked through
        for joint in joints:
            if body in joint.connects and all(branch.joint is not joint for branch in grown):
                forward = joint.connects[0] == body
                grown.append(Branch(joint, body, joint.connects[1 if forward else 0], forward))
                ends.append(grown[-1].body)
    return grown
