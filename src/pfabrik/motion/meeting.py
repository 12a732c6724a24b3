"""Joints between two bodies that others have put in place: their coordinates follow from how these are turned."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..arrays import Floats
from ..description.graph import tree_of
from ..description.joints import Joint
from ..description.mechanism import Mechanism
from ..rotations import to_rotvec
from .displacements import columns, displacements


@lru_cache(maxsize=64)
def meeting_joints(mechanism: Mechanism, known: frozenset[int]) -> tuple[Joint, ...] | None:
    """The joints whose coordinates are not among the `known` columns, if their bodies and these tell them.

    None where one is no hinge or ball, or is on the way from the base to one of its bodies; where the end effector is a
    body, its pose puts it in place.
    """
    joints, spans = mechanism.joints, columns(mechanism)
    open_ones = [
        joint for joint in joints if not known.issuperset(range(spans[joint.name].start, spans[joint.name].stop))
    ]
    paths, index = tree_of(mechanism).paths, {joint.name: place for place, joint in enumerate(joints)}
    is_open = np.zeros(len(joints))
    is_open[[index[joint.name] for joint in open_ones]] = 1.0
    platform = None if mechanism.end_effector_is_joint else mechanism.end_effector_body
    for joint in open_ones:
        placed = all(body == platform or not (np.abs(paths[body]) @ is_open) for body in joint.connects)
        if not placed or joint.type not in ("revolute", "spherical"):
            return None
    return tuple(open_ones)


def put_meeting_joints(mechanism: Mechanism, joints: tuple[Joint, ...], poses: Floats, q: Floats) -> None:
    """Write the coordinates of meeting joints into q, (n, c), deviations from home, at platform poses (n, 4, 4)."""
    for joint in joints:
        q[:, columns(mechanism)[joint.name]] = 0.0
    bodies = displacements(mechanism, q)
    if not mechanism.end_effector_is_joint:
        bodies[mechanism.end_effector_body] = poses @ np.linalg.inv(mechanism.home_pose)
    for joint in joints:
        first, second = (bodies[body][:, :3, :3] for body in joint.connects)
        turned = to_rotvec(np.swapaxes(first, 1, 2) @ second)
        if joint.type == "revolute":
            turned = turned @ np.array(mechanism.home_axis(joint.name))[:, None]
        q[:, columns(mechanism)[joint.name]] = turned
