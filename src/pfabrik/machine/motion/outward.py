"""Joint centres computed from poses and actuator values alone, without closing loops."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats
from ...common.derived import derived
from ...tolerances import TOLERANCES
from ..description.joints import Joint
from ..description.links import bodies_of_centre
from ..description.structure import Structure
from .displacements import columns, home_coordinates, joint_displacements


def centres_at(mechanism: Structure, poses: Floats, actuators: Floats) -> dict[str, Floats] | None:
    """Joint name -> position of its centre, (n, 3) [length], as of `centres`; None if they do not follow.

    Bodies are placed outward from the base, then from the end effector, through joints that are driven or locked. The
    centres follow if every one is a point of such a body.

    Parameters
    ----------
    poses, actuators : of the end effector, (n, 4, 4) [length], and values (n, n_a) [length or rad].
    """
    outward = _outward(mechanism)
    if outward is None:
        return None
    bodies = {mechanism.base: np.repeat(np.eye(4)[None], len(poses), axis=0)}
    if not mechanism.end_effector_is_joint:
        bodies[mechanism.end_effector_body] = poses @ np.linalg.inv(mechanism.home_pose)
    q = np.zeros((len(poses), len(home_coordinates(mechanism))))
    for place, drive in enumerate(mechanism.drives):
        q[:, drive.column] = actuators[:, place] - drive.home
    for joint, forward in outward.steps:
        first, second = joint.connects
        motion = joint_displacements(mechanism, joint.name, q[:, columns(mechanism)[joint.name]])
        if forward:
            bodies[second] = bodies[first] @ motion
        else:
            bodies[first] = bodies[second] @ np.linalg.inv(motion)
    return {
        joint.name: poses[:, :3, 3] if body is None else (bodies[body] @ np.array([*(joint.at or ()), 1.0]))[:, :3]
        for joint, body in outward.centre_bodies
    }


class _Outward(NamedTuple):
    """The order in which `centres_at` places bodies from the base and the end effector.

    Attributes
    ----------
    steps : the joints that place one body after the other; True if it is their second body.
    centre_bodies : every joint with a centre, and a placed body that contains it; None for a joint end effector.
    """

    steps: tuple[tuple[Joint, bool], ...]
    centre_bodies: tuple[tuple[Joint, str | None], ...]


@derived
def _outward(mechanism: Structure) -> _Outward | None:
    """The order of placing bodies; None if some joint's centre is on no placed body."""
    fixed = {drive.column for drive in mechanism.drives}
    fixed |= {coordinate.column for coordinate in mechanism.coordinates if coordinate.joint.is_rigid}
    spans = columns(mechanism)
    known = [
        joint for joint in mechanism.joints if fixed.issuperset(range(spans[joint.name].start, spans[joint.name].stop))
    ]
    placed, steps = [mechanism.base], list[tuple[Joint, bool]]()
    if not mechanism.end_effector_is_joint:
        placed.append(mechanism.end_effector_body)
    for body in placed:  # which grows
        for joint in known:
            first, second = joint.connects
            for start, end, forward in ((first, second, True), (second, first, False)):
                if start == body and end not in placed:
                    placed.append(end)
                    steps.append((joint, forward))
    centre_bodies: list[tuple[Joint, str | None]] = []
    for joint in mechanism.joints:
        if joint.at is None:
            continue
        bodies = [body for one in _in_its_place(mechanism, joint) for body in placed if body in bodies_of_centre(one)]
        if not bodies and joint.name != mechanism.end_effector:
            return None
        centre_bodies.append((joint, bodies[0] if bodies else None))
    return _Outward(tuple(steps), tuple(centre_bodies))


def _in_its_place(mechanism: Structure, joint: Joint) -> list[Joint]:
    """A joint, then those whose centres always are where its own is: at one point of one body."""
    bodies, near = set(bodies_of_centre(joint)), TOLERANCES.home_slack * mechanism.characteristic_length
    centre = np.array(joint.at)
    return [joint] + [
        other
        for other in mechanism.joints
        if other is not joint
        and other.at is not None
        and bodies.intersection(bodies_of_centre(other))
        and np.linalg.norm(np.array(other.at) - centre) <= near
    ]
