"""Hands on one object: arms, or fingers, and what they hold as one mechanism."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ...answers.solution import Status
from ...common.arrays import Floats
from ...common.checks import require_mapping, require_type
from ...errors import InvalidArgument
from ...ik import solve_ik
from ...machine.description.mechanism import Mechanism, checked_mechanism
from ...machine.motion.other_home import with_home
from ...machine.poses import one_pose
from .contact import AnyContact, as_contact
from .joining import join

Grasp: TypeAlias = AnyContact | ArrayLike | tuple[ArrayLike, AnyContact]
"""How a hand holds: a contact where the arm is at home, or the hand's pose in the object's frame, or both."""


def grasp(
    object: str,  # noqa: A002
    holds: Mapping[str, tuple[Mechanism, Grasp]],
    *,
    at: ArrayLike | None = None,
    task: Sequence[str] | None = None,
    name: str | None = None,
) -> Mechanism:
    """Arms, or fingers, that hold an object, which is the end effector: a parallel mechanism.

    The names of each arm's joints and bodies begin with its own and `_`, as `left_`; all stand on the base of the first.

    Parameters
    ----------
    object : str
        What the object is to be called.
    holds : mapping of str to tuple
        Name -> an arm, where it stands (`Mechanism.at`), and how its end effector holds: a contact as in `stand`, in
        the frame of the hand, which is unturned at home, with the arm as it is at home; or a pose (4, 4) of the hand
        in the frame of the object, to which the arm is moved, and which holds as "flat"; or such a pose and a contact.
    at : array (4, 4) or (3,), optional
        The object at home, in base coordinates [length]: its frame, whose origin targets place. Default: the middle of
        the contacts, unturned.
    task : sequence of str, optional
        As in `Mechanism`.
    name : str, optional
        Of the machine. Default: "<object> held by <names>".

    Raises
    ------
    InvalidArgument
        A hold that is none, a pose of a hand without `at`, or one that its arm does not reach, with how far off.
    InvalidMechanism
        What comes out is no mechanism, with every fault.

    Notes
    -----
    Poses of the object are as at home unturned, as those of every end effector: a target of `at` is its home pose where
    `at` has no rotation.
    """
    require_type("object", object, str, "a name")
    if not require_mapping("holds", holds, "arms and grasps by name"):
        raise InvalidArgument("holds", "none", "an arm and how it holds, by name")
    place = None if at is None else one_pose("at", at)
    arms, joints, points = [], [], []
    for each, held in holds.items():
        argument = f"holds['{each}']"
        if not isinstance(held, tuple) or len(held) != 2:
            raise InvalidArgument(argument, type(held).__name__, "an arm, and how it holds")
        arm, pose, given = checked_mechanism(held[0]), *_parts(argument, held[1])
        contact = as_contact(argument, given)
        if pose is not None:
            if place is None:
                raise InvalidArgument("at", "none", f"the object's pose, in which {argument} has a pose of a hand")
            arm = _moved(argument, arm, place @ pose)
        arm = arm.at(np.eye(4), prefix=f"{each}_", task=arm.task)
        hand, frame = arm.end_effector_body, np.array(arm.home_pose)
        normal = frame[:3, :3] @ (0.0, 0.0, 1.0)
        joint = contact.joint(f"{each}_{object}", (hand, object), frame, normal)
        points.append(frame[:3, :3] @ contact.at + frame[:3, 3])
        joints.append(joint)
        arms.append(arm if arm.base == (arms[0].base if arms else arm.base) else arm.at(np.eye(4), base=arms[0].base))
    reference = np.mean(points, axis=0) if place is None else place[:3, 3]
    called = f"{object} held by {', '.join(holds)}" if name is None else name
    return join(*arms, joints=joints, end_effector=object, reference_point=reference, task=task, name=called)


def _parts(argument: str, given: Any) -> tuple[Floats | None, Any]:
    """The pose of a hand in the frame of the object, if there is one, and the contact."""
    if isinstance(given, str | Mapping):
        return None, given
    if isinstance(given, tuple) and len(given) == 2 and isinstance(given[1], str | Mapping):
        return one_pose(argument, given[0]), given[1]
    return one_pose(argument, given), "flat"


def _moved(argument: str, arm: Mechanism, target: Floats) -> Mechanism:
    """The arm with its hand at a pose, which is its home."""
    found = solve_ik(arm, target)
    if found.status is not Status.REACHED:
        raise InvalidArgument(argument, f"a hand that its arm does not bring there: {found.reason}", "one within reach")
    return with_home(arm, np.asarray(found.q))
