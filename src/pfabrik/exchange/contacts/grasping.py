"""Hands on one object: arms, or fingers, and what they hold as one mechanism."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ...answers.status import Status
from ...common.arrays import Floats
from ...common.checks import require_mapping, require_type
from ...errors import InvalidArgument
from ...ik import solve_ik
from ...machine.description.contact import Contact, ContactLike, as_contact
from ...machine.description.mechanism import Mechanism, checked_mechanism
from ...machine.motion.other_home import with_home
from ...machine.poses import one_pose
from .joining import join

Grasp: TypeAlias = ContactLike | ArrayLike | tuple[ArrayLike, ContactLike]
"""How a hand holds: a contact where the arm is at home, or the hand's pose in the object's frame, or both."""


def grasp(
    object: str,
    holds: Mapping[str, tuple[Mechanism, Grasp]],
    *,
    at: ArrayLike | None = None,
    task: Sequence[str] | None = None,
    name: str | None = None,
) -> Mechanism:
    """Arms, or fingers, that hold an object, which is the end effector: a parallel mechanism.

    Poses of the object, as of every end effector, have no rotation at home, whatever that of `at`.
    Names of an arm's joints and bodies begin with its own and `_`, as `left_`; all stand on the base of the first.

    Parameters
    ----------
    object : str
        What the object is to be called.
    holds : mapping of str to tuple
        Name -> an arm, where it stands (`Mechanism.at`), and how its end effector holds: a contact as in `stand`, in
        the frame of the hand, which at home has no turn wherever the arm stands, with the arm as it is at home; or a
        pose (4, 4) of the hand in the frame of the object, to which the arm is moved, and which holds as "flat"; or
        such a pose and a contact.
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
    """
    for each in (object, *require_mapping("holds", holds, "arms and grasps by name")):
        require_type("object" if each is object else "holds", each, str, "a name")
    if not holds:
        raise InvalidArgument("holds", "none", "an arm and how it holds, by name")
    place = None if at is None else one_pose("at", at)
    held = {each: _held(f"holds['{each}']", grip, place) for each, grip in holds.items()}
    base = next(iter(held.values()))[0].base
    arms = [arm.at((0.0, 0.0, 0.0), prefix=f"{each}_", base=base) for each, (arm, _, _) in held.items()]
    called = f"{object} held by {', '.join(holds)}" if name is None else name
    contacts = [(frame, contact) for _, frame, contact in held.values()]
    return held_by(arms, object, contacts, None if place is None else place[:3, 3], task, called)


def held_by(
    arms: Sequence[Mechanism],
    held: str,
    contacts: Sequence[tuple[Floats, Contact]],
    reference: Floats | None,
    task: Sequence[str] | None,
    name: str | None,
) -> Mechanism:
    """Machines whose end effectors touch one body, which is new.

    Parameters
    ----------
    contacts : the frame (4, 4) of each end effector where it touches, and how.
    reference : the point of the body that targets place, (3,); None for the middle of the contacts.
    """
    if any(held in (*arm.bodies, arm.base) for arm in arms):
        raise InvalidArgument("object", f"'{held}', which is a body of a machine", "a name of its own")
    hands = [arm.end_effector_body for arm in arms]
    joints = [
        contact.joint(f"{hand}_{held}", (hand, held), frame, frame[:3, 2])
        for hand, (frame, contact) in zip(hands, contacts, strict=True)
    ]
    points = [frame[:3, :3] @ contact.at + frame[:3, 3] for frame, contact in contacts]
    middle = np.mean(points, axis=0) if reference is None else reference
    return join(*arms, joints=joints, end_effector=held, reference_point=middle, task=task, name=name)


def _held(argument: str, held: Any, place: Floats | None) -> tuple[Mechanism, Floats, Contact]:
    """An arm where it holds an object at a place, the frame (4, 4) of its hand there, and how that touches."""
    if not isinstance(held, tuple) or len(held) != 2:
        raise InvalidArgument(argument, type(held).__name__, "an arm, and how it holds")
    arm, given = checked_mechanism(held[0]), held[1]
    if isinstance(given, str | Mapping):
        return arm, np.asarray(arm.home_pose), as_contact(argument, given)
    pose, touch = given if isinstance(given, tuple) and len(given) == 2 else (given, "flat")
    if place is None:
        raise InvalidArgument("at", "none", f"the object's pose, in which {argument} has a pose of a hand")
    frame = place @ one_pose(argument, pose)
    return _moved(argument, arm, frame), frame, as_contact(argument, touch)


def _moved(argument: str, arm: Mechanism, target: Floats) -> Mechanism:
    """The arm with its hand at a pose, which is its home."""
    found = solve_ik(arm, target)
    if found.status is not Status.REACHED:
        off = f"{found.position_error:.4g} {arm.length_unit} and {np.degrees(found.rotation_error):.3g} deg off"
        raise InvalidArgument(
            argument, f"a hand that its arm brings no nearer than {off}: {found.reason}", "one in reach"
        )
    return with_home(arm, np.asarray(found.q))
