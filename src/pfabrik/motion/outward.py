"""Where joints are as far as poses and actuators alone tell: no loop is closed for it."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..arrays import Floats
from ..description.joints import Joint
from ..description.structure import Structure
from .displacements import columns, home_coordinates, joint_displacements


def centres_at(mechanism: Structure, poses: Floats, actuators: Floats) -> dict[str, Floats] | None:
    """Joint name -> position of its centre, (n, 3) [length], as of `centres`; None if poses and actuators do not tell.

    Bodies are placed outward from the base, then from the end effector, through joints that are driven or locked.
    Where a joint is on no such body, they do not tell.

    Parameters
    ----------
    poses, actuators : of the end effector, (n, 4, 4) [length], and values (n, n_a) [length or rad].
    """
    outward = _outward(mechanism)
    if outward is None:
        return None
    known = {mechanism.base: np.repeat(np.eye(4)[None], len(poses), axis=0)}
    if not mechanism.end_effector_is_joint:
        known[mechanism.end_effector_body] = poses @ np.linalg.inv(mechanism.home_pose)
    q = np.zeros((len(poses), len(home_coordinates(mechanism))))
    for place, drive in enumerate(mechanism.drives):
        q[:, drive.column] = actuators[:, place] - drive.home
    for joint, forward in outward.steps:
        first, second = joint.connects
        motion = joint_displacements(mechanism, joint.name, q[:, columns(mechanism)[joint.name]])
        if forward:
            known[second] = known[first] @ motion
        else:
            known[first] = known[second] @ np.linalg.inv(motion)
    return {
        joint.name: poses[:, :3, 3] if body is None else (known[body] @ np.array([*(joint.at or ()), 1.0]))[:, :3]
        for joint, body in outward.told_by
    }


class _Outward(NamedTuple):
    """How `centres_at` places bodies from the base and the end effector.

    Attributes
    ----------
    steps : the joints that place one body after the other, and whether it is their second.
    told_by : every joint with a centre, and a placed body that this is a point of; None for a joint end effector.
    """

    steps: tuple[tuple[Joint, bool], ...]
    told_by: tuple[tuple[Joint, str | None], ...]


@lru_cache(maxsize=64)
def _outward(mechanism: Structure) -> _Outward | None:
    """None where some joint's centre is a point of no body that is placed."""
    driven = {drive.column for drive in mechanism.drives}
    driven |= {each.column for each in mechanism.coordinates if each.joint.is_rigid}
    spans = columns(mechanism)
    known = [
        each for each in mechanism.joints if driven.issuperset(range(spans[each.name].start, spans[each.name].stop))
    ]
    placed, steps = [mechanism.base], list[tuple[Joint, bool]]()
    if not mechanism.end_effector_is_joint:
        placed.append(mechanism.end_effector_body)
    for body in placed:  # which grows
        for joint in known:
            first, second = joint.connects
            for here, there, forward in ((first, second, True), (second, first, False)):
                if here == body and there not in placed:
                    placed.append(there)
                    steps.append((joint, forward))
    told_by: list[tuple[Joint, str | None]] = []
    for joint in mechanism.joints:
        if joint.at is None:
            continue
        slides = joint.type in ("prismatic", "cylindrical")  # the centre is a point of its first body
        bodies = [body for body in placed if body in (joint.connects[:1] if slides else joint.connects)]
        if not bodies and joint.name != mechanism.end_effector:
            return None
        told_by.append((joint, bodies[0] if bodies else None))
    return _Outward(tuple(steps), tuple(told_by))
