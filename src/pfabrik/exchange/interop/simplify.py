"""The same machine in fewer joints: without what the end effector does not depend on, and with joints merged.

Bodies that are welded are one body, two balls between two bodies a hinge, two hinges that cross a universal joint.
"""

from __future__ import annotations

import dataclasses
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from ...machine.description.graph import Edge, Tree, spanning_tree, welded
from ...machine.description.joints import Joint, JointType
from ...tolerances import TOLERANCES
from .notes import Note, note_names
from .opened import Loop, OpenMechanism

SKEW = 0.1
"""Least sine between the axes of a universal joint."""


def prune(opened: OpenMechanism, notes: list[Note]) -> OpenMechanism:
    """The machine with only those joints and loops on which the end effector's motion against the base depends.

    What hangs on one of its bodies by the others is held where it is: its mass is of that body.
    """
    edges = edges_between(opened.joints, opened.loops)
    tips = [edge for edge in edges if edge.joint.name == opened.end_effector]
    body = tips[0].bodies[0] if tips else opened.end_effector
    through = Edge(Joint("", "fixed", (opened.base, body)), (opened.base, body))
    blocks = loop_blocks(spanning_tree([*edges, through], opened.base))
    kept = next((block for block in blocks if len(edges) in block), [])
    names = {edges[index].joint.name for index in kept if index < len(edges)} | {edge.joint.name for edge in tips}
    omitted = tuple(edge.joint.name for edge in edges if edge.joint.name not in names)
    note_names(notes, "left out, for the end effector does not depend on them", omitted)
    joints = tuple(joint for joint in opened.joints if joint.name in names)
    loops = tuple(loop for loop in opened.loops if loop.name in names)
    pruned = dataclasses.replace(opened, joints=joints, loops=loops)
    return _carrying(pruned, [edge.joint for edge in edges if edge.joint.name in omitted], notes)


def _carrying(opened: OpenMechanism, omitted: Sequence[Joint], notes: list[Note]) -> OpenMechanism:
    """The machine with the masses of bodies that hang on its own by joints that are left out."""
    bodies = dict.fromkeys(body for edge in edges_between(opened.joints, opened.loops) for body in edge.bodies)
    hung = welded(omitted, opened.base, *bodies)
    carried = {each.body: None for each in opened.collision.masses if each.mass > 0.0 and each.body in hung}
    names = [body for body in carried if hung[body] != opened.base and hung[body] in bodies]
    note_names(notes, "held where they are, their masses go with what they hang on", names)
    masses = [dataclasses.replace(each, body=hung.get(each.body, each.body)) for each in opened.collision.masses]
    return dataclasses.replace(opened, collision=dataclasses.replace(opened.collision, masses=tuple(masses)))


def edges_between(joints: Sequence[Joint], loops: Sequence[Loop]) -> list[Edge]:
    """Joints, then loops, between their bodies."""
    every = [*joints, *(Joint(loop.name, loop.type, loop.connects) for loop in loops)]
    return [Edge(joint, joint.connects) for joint in every]


def loop_blocks(tree: Tree) -> list[list[int]]:
    """Edges that share loops, directly or through others."""
    blocks: list[set[int]] = []
    for loop in tree.loops:
        block = set(np.flatnonzero(loop).tolist())
        for other in [each for each in blocks if each & block]:
            blocks.remove(other)
            block |= other
        blocks.append(block)
    return [sorted(block) for block in blocks]


def merged_bodies(joints: Sequence[Joint], *kept: str) -> tuple[list[Joint], dict[str, str]]:
    """The joints between bodies of which those fixed to each other are one; and body -> the one it is part of.

    Parameters
    ----------
    kept : bodies that keep their names, and the fixed joints between them.
    """
    stands_for = welded([joint for joint in joints if joint.type == "fixed"], *kept)
    merged = [dataclasses.replace(joint, connects=merged_pair(joint.connects, stands_for)) for joint in joints]
    return [joint for joint in merged if joint.connects[0] != joint.connects[1]], stands_for


def merged_pair(pair: tuple[str, str], stands_for: Mapping[str, str]) -> tuple[str, str]:
    """The bodies that stand for two bodies."""
    return stands_for.get(pair[0], pair[0]), stands_for.get(pair[1], pair[1])


def merged_balls(joints: Sequence[Joint]) -> list[Joint]:
    """Balls that share their two bodies as one joint: two are a hinge, three that are not in line hold all."""
    between: dict[frozenset[str], list[Joint]] = defaultdict(list)
    for joint in joints:
        if joint.type == "spherical":
            between[frozenset(joint.connects)].append(joint)
    merged: dict[str, Joint | None] = {}
    for balls in between.values():
        points = np.array([ball.at for ball in balls])
        spread, axes = np.linalg.svd(points - points[0])[1:] if len(balls) > 1 else (np.zeros(3), np.eye(3))
        directions = int((spread > TOLERANCES.alignment * max(1e-300, float(np.abs(points).max()))).sum())
        if directions == 0:
            continue
        kind: JointType = "revolute" if directions == 1 else "fixed"
        axis = axes[0] if directions == 1 else None
        merged |= {ball.name: None for ball in balls}
        merged[balls[0].name] = dataclasses.replace(balls[0], type=kind, axis=axis)
    replaced = [merged.get(joint.name, joint) for joint in joints]
    return [joint for joint in replaced if joint is not None]


def combined(joints: Sequence[Joint], kept: Collection[str], notes: list[Note]) -> tuple[list[Joint], dict[str, str]]:
    """Two joints with nothing else on the body between them as one joint, unless that body is to be kept.

    Two passive hinges whose axes cross are a universal joint. J[0] and J[1], a hinge and a slide along it, are a
    cylindrical joint J: as this library writes it.

    Returns
    -------
    tuple : the joints; and body that is within one of them -> the body behind it.
    """
    on_body: dict[str, list[Joint]] = defaultdict(list)
    for joint in joints:
        for body in joint.connects:
            on_body[body].append(joint)
    made = {joint.name: joint for joint in joints}
    crossing: list[str] = []
    within: dict[str, str] = {}
    for between, pair in on_body.items():
        if len(pair) != 2 or between in kept or not all(made.get(joint.name) is joint for joint in pair):
            continue
        first, second = sorted(pair, key=lambda joint: joint.name.endswith("[1]"))
        one = _combination(first, second, between)
        if one is not None:
            within[between] = one.connects[1]
            made = {name: one if each is first else each for name, each in made.items() if each is not second}
            if one.name not in (_stem(first), _stem(second)):
                crossing.append(one.name)
    note_names(notes, "hinges whose axes cross are a universal joint", crossing)
    return list(made.values()), within


def _combination(first: Joint, second: Joint, between: str) -> Joint | None:
    """The joint that two are together, or None where they are not one."""
    kinds = (first.type, second.type)
    if kinds not in (("revolute", "revolute"), ("revolute", "prismatic")):
        return None
    if (first.range is None) != (second.range is None):
        return None
    signs = (1.0 if first.connects[1] == between else -1.0), (1.0 if second.connects[0] == between else -1.0)
    axes = np.array([first.axis, second.axis]) * np.reshape(signs, (2, 1))
    ends = [next(body for body in joint.connects if body != between) for joint in (first, second)]
    stem = _stem(first) if _stem(first) == _stem(second) else None
    range_ = None if first.range is None else (first.range, second.range)
    coordinates: dict[str, Any] = {"home": (first.home, second.home), "range": range_}
    driven = (first.actuated is True, second.actuated is True)
    if kinds[1] == "prismatic":
        is_along = np.linalg.norm(np.cross(*axes)) < TOLERANCES.alignment and axes[0] @ axes[1] > 0.0
        if stem is None or not is_along:
            return None
        return Joint(stem, "cylindrical", ends, first.at, axes[0], actuated=driven, **coordinates)
    if any(driven) or (stem is None and (_stem(first) or _stem(second) or not _is_crossing(first, second))):
        return None
    return Joint(stem or f"{first.name}+{second.name}", "universal", ends, first.at, axes=axes, **coordinates)


def _stem(joint: Joint) -> str | None:
    """The name of the joint of which this one is a coordinate, as `coordinate_names` writes it: J of J[0]."""
    return joint.name[:-3] if joint.name.endswith(("[0]", "[1]")) else None


def _is_crossing(first: Joint, second: Joint) -> bool:
    """True if two hinges are at one place and not nearly parallel."""
    points, axes = np.array([first.at, second.at]), np.array([first.axis, second.axis])
    apart, sine = np.linalg.norm(points[1] - points[0]), np.linalg.norm(np.cross(*axes))
    return bool(apart <= TOLERANCES.alignment * np.abs(points[0]).max() and sine >= SKEW)
