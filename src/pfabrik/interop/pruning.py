"""What of a machine the end effector's motion against the base depends on; the rest of a robot is left out."""

from __future__ import annotations

import dataclasses

import numpy as np

from ..description.graph import Edge, spanning_tree
from ..description.joints import Joint
from .opened import Note, OpenMechanism


def prune(opened: OpenMechanism, told: list[Note]) -> OpenMechanism:
    """The machine with those joints and loops only that lie on some way from the base to the end effector."""
    edges = [Edge(joint, joint.connects) for joint in opened.joints]
    edges += [Edge(Joint(loop.name, loop.type, loop.connects), loop.connects) for loop in opened.loops]
    tips = [edge for edge in edges if edge.joint.name == opened.end_effector]
    body = tips[0].bodies[0] if tips else opened.end_effector
    kept = _together([*edges, Edge(Joint("", "fixed", (opened.base, body)), (opened.base, body))], opened.base)
    names = {edges[index].joint.name for index in kept if index < len(edges)} | {edge.joint.name for edge in tips}
    left = tuple(edge.joint.name for edge in edges if edge.joint.name not in names)
    if left:
        told.append(Note("left out, for the end effector does not depend on them", left))
    joints = tuple(joint for joint in opened.joints if joint.name in names)
    loops = tuple(loop for loop in opened.loops if loop.name in names)
    return dataclasses.replace(opened, joints=joints, loops=loops)


def _together(edges: list[Edge], base: str) -> set[int]:
    """The edges that share a loop with the last one, or with one that does, and so on."""
    loops = spanning_tree(edges, base).loops != 0.0
    kept = np.zeros(len(edges), bool)
    kept[-1] = True
    while True:
        touched = loops[(loops & kept).any(axis=1)].any(axis=0) | kept
        if (touched == kept).all():
            return set(np.flatnonzero(kept).tolist())
        kept = touched
