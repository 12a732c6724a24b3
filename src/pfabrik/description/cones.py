"""The line that a cone limit holds: from its joint to the next joint of the body opposite the cone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..errors import InvalidArgument

if TYPE_CHECKING:
    from .mechanism import Joint, Mechanism

PASSED_THROUGH = ("prismatic", "fixed")
"""Joint types that do not end a line: their two bodies keep their orientation relative to each other."""


def cone_line(mechanism: Mechanism, joint: Joint) -> tuple[Joint, Joint]:
    """The two joints between which the line limited by `joint.cone` runs.

    Returns
    -------
    The joint itself, and the nearest joint with a centre that is reached through the body that the cone is not fixed
    to, passing through prismatic joints (a strut's two parts carry one line).

    Raises
    ------
    InvalidArgument : the joint has no cone.
    """
    if joint.cone is None:
        raise InvalidArgument("joint", f"'{joint.name}', which has no cone", "a joint with a cone")
    return joint, next_joints(mechanism.joints, joint, opposite(joint))[0]


def opposite(joint: Joint) -> str:
    """The body whose line the joint's cone limits: the one that the cone is not fixed to."""
    first, second = joint.connects
    return second if joint.cone is not None and joint.cone.fixed_to == first else first


def next_joints(joints: Sequence[Joint], joint: Joint, body: str) -> list[Joint]:
    """The joints nearest to `joint` on its side `body`, in number of joints passed through; empty when it ends there.

    The bodies and names of all joints must be well formed.
    """
    seen, bodies = {*joint.connects}, [body]
    while bodies:
        around = [each for each in joints if each.name != joint.name and any(side in bodies for side in each.connects)]
        ends = [each for each in around if each.type not in PASSED_THROUGH]
        if ends:
            return ends
        bodies = [side for each in around for side in each.connects if side not in seen]
        seen.update(bodies)
    return []
