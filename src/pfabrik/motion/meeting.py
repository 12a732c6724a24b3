"""Joints between two bodies that others have put in place: their coordinates follow from how these are turned."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..arrays import Floats
from ..description.home_mobility import universal_axes
from ..description.joints import Joint
from ..description.mechanism import Mechanism
from ..rotations import from_rotvec, to_rotvec
from .displacements import columns, joint_displacements


@dataclass(frozen=True, eq=False)
class Meeting:
    """Joints that other joints leave nothing open of.

    Attributes
    ----------
    joints : those whose coordinates are told by where their bodies are.
    steps : the joints that put these in place, in order, each with whether its second body is the one that it places.
    """

    joints: tuple[Joint, ...]
    steps: tuple[tuple[Joint, bool], ...]


@lru_cache(maxsize=64)
def meeting_joints(mechanism: Mechanism, known: frozenset[int]) -> Meeting | None:
    """The joints whose coordinates are not among the `known` columns, if their bodies tell them.

    None where one slides, or where known joints do not put both of its bodies in place, from the base or from the end
    effector, whose pose is known if it is a body.
    """
    spans = columns(mechanism)
    is_known = {
        joint.name: known.issuperset(range(spans[joint.name].start, spans[joint.name].stop))
        for joint in mechanism.joints
    }
    placed = {mechanism.base} if mechanism.end_effector_is_joint else {mechanism.base, mechanism.end_effector_body}
    steps: list[tuple[Joint, bool]] = []
    waiting = [joint for joint in mechanism.joints if is_known[joint.name]]
    while ready := [joint for joint in waiting if len(placed.intersection(joint.connects)) == 1]:
        first, second = ready[0].connects
        steps.append((ready[0], first in placed))
        placed.update((first, second))
        waiting.remove(ready[0])
    open_ones = tuple(joint for joint in mechanism.joints if not is_known[joint.name])
    if any(joint.type not in ("revolute", "universal", "spherical") for joint in open_ones):
        return None
    return Meeting(open_ones, tuple(steps)) if placed.issuperset(b for j in open_ones for b in j.connects) else None


def put_meeting_joints(mechanism: Mechanism, meeting: Meeting, poses: Floats, q: Floats) -> None:
    """Write the coordinates of meeting joints into q, (n, c), deviations from home, at platform poses (n, 4, 4).

    Angles are those nearest to what q has there.
    """
    bodies = {mechanism.base: np.broadcast_to(np.eye(4), (len(q), 4, 4))}
    if not mechanism.end_effector_is_joint:
        bodies[mechanism.end_effector_body] = poses @ np.linalg.inv(mechanism.home_pose)
    for joint, is_forward in meeting.steps:
        first, second = joint.connects
        moved = joint_displacements(mechanism, joint.name, q[:, columns(mechanism)[joint.name]])
        bodies[second if is_forward else first] = (
            bodies[first] @ moved if is_forward else bodies[second] @ np.linalg.inv(moved)
        )
    for joint in meeting.joints:
        before, after = (bodies[body][:, :3, :3] for body in joint.connects)
        found, own = _coordinates(mechanism, joint, np.swapaxes(before, 1, 2) @ after), columns(mechanism)[joint.name]
        if joint.type != "spherical":
            found += 2.0 * np.pi * np.round((q[:, own] - found) / (2.0 * np.pi))
        q[:, own] = found


def _coordinates(mechanism: Mechanism, joint: Joint, turned: Floats) -> Floats:
    """Coordinates (n, own) of a joint whose second body is turned by rotations (n, 3, 3) against its first."""
    if joint.type == "spherical":
        return to_rotvec(turned)
    if joint.type == "revolute":
        return np.asarray(to_rotvec(turned) @ np.array(mechanism.home_axis(joint.name))[:, None])
    # turned = R(a, q1) R(b, q2) takes b to R(a, q1) b: the angle of that about a is q1, and the rest is q2 about b
    a, b = universal_axes(mechanism, joint)
    now, across = turned @ b, np.cross(a, b)
    first = np.arctan2(now @ across, now @ (b - a * (a @ b)))[:, None]
    rest = from_rotvec(-first * a) @ turned
    return np.concatenate([first, to_rotvec(rest) @ b[:, None]], axis=1)
