"""Motions that are asked for: of the end effector, of actuators, or of other joints; and those of paths with times."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..answers.tracked import Track, refuse_leaps
from ..arrays import Floats, Mask
from ..checks import names_of
from ..description.mechanism import Mechanism
from ..errors import InvalidArgument
from ..kinematics import actuator_units, joint_path, task_of
from ..rotations import to_rotvec

NEIGHBOURS = 5
"""Steps of a path through which a polynomial gives the rates and accelerations of one: of the fourth degree."""


def axes_of(mechanism: Mechanism, at: str | tuple[str, ...], poses: Floats) -> Floats:
    """The components of the end effector's twist that `at` names, at poses (n, 4, 4), (n, k, 6); those of coordinates
    are none of these."""
    if at == "task":
        return task_axes(mechanism, poses)
    whole = (3 if mechanism.end_effector_is_joint else 6) if at == "path" else 0
    return np.tile(np.eye(whole, 6), (len(poses), 1, 1))


def task_axes(mechanism: Mechanism, poses: Floats) -> Floats:
    """The components of twists that the task sets, at poses (n, 4, 4), (n, k, 6): along and about axes of the base,
    tilts about the platform's x and y axes."""
    task = task_of(mechanism)
    lines, turns = np.eye(3)[list(task.axes)], np.eye(3)[None]
    if task.rotations == 2:
        turns = np.swapaxes(poses[:, :3, :3], 1, 2)
    turns = turns[:, list(task.turns) if not mechanism.end_effector_is_joint else []]
    axes = np.zeros((len(poses), len(lines) + turns.shape[1], 6))
    axes[:, : len(lines), :3], axes[:, len(lines) :, 3:] = lines, turns
    return axes


def are_lengths(mechanism: Mechanism, at: str | tuple[str, ...]) -> Mask:
    """True for the components of "task", "actuators" or named joints that are lengths, False for angles, (k,)."""
    if at == "task":
        axes = task_axes(mechanism, np.eye(4)[None])[0]
        return np.asarray(axes[:, :3].any(axis=1))
    drives = mechanism.drives if at == "actuators" else joint_path(mechanism, at).coordinates
    return np.array([each.kind == "length" for each in drives], bool)


def checked_at(mechanism: Mechanism, at: Any) -> str | tuple[str, ...]:
    """ "task", "actuators", or names of joints in series; raises the errors of `mass_matrix` for others."""
    if isinstance(at, str) and at in ("task", "actuators"):
        return at
    names = names_of("at", at)
    joint_path(mechanism, names)
    return names


def motion_of(track: Track) -> tuple[Floats, Floats]:
    """Rates and accelerations of a path with times, (n, r + n_a) each: of its end effector, and of its actuators.

    In the machine's units; those of the polynomial through each step and its neighbours, as the times have them.

    Raises
    ------
    InvalidArgument : no times, or such as no motion has; steps that were not reached, or jump.
    """
    mechanism, times = track.mechanism, track.times
    if times is None:
        raise InvalidArgument("track", "a path without times", "one that `track` got `sample_time` or `times` for")
    stops = np.flatnonzero(~(np.diff(times) > 0.0)) + 1
    if len(track) < 3 or len(stops):
        found = f"{len(track)} steps" if len(track) < 3 else "times that do not rise"
        raise InvalidArgument(
            "track", found, "three steps or more, each later than the one before", rows=stops[:5].tolist()
        )
    refuse_leaps(track)
    k = min(NEIGHBOURS, len(track))
    windows = np.clip(np.arange(len(track)) - k // 2, 0, len(track) - k)[:, None] + np.arange(k)
    late = times[windows] - times[:, None]
    span = np.abs(late).max(axis=1)
    powers = np.linalg.inv((late / span[:, None])[..., None] ** np.arange(k))  # coefficients by values, (n, k, k)
    values = [track.pose[windows][..., :3, 3]]
    if not mechanism.end_effector_is_joint:
        turns = track.pose[windows][..., :3, :3] @ np.swapaxes(track.pose[:, None, :3, :3], -1, -2)
        values.append(to_rotvec(turns))  # from the step itself: so their second derivative is its acceleration
    along = np.concatenate([*values, track.actuators[windows]], axis=-1)
    first, second = (np.einsum("nk,nkv->nv", powers[:, p], along) for p in (1, 2))
    return first / span[:, None], 2.0 * second / span[:, None] ** 2


def in_lengths(mechanism: Mechanism, at: str | tuple[str, ...]) -> Floats:
    """Units in L of the numbers that `motion_of` and arguments have: of twists, of actuators, of both, or of joints."""
    length, actuators = mechanism.characteristic_length, actuator_units(mechanism)
    twist = np.repeat([length, 1.0], 3)[: 3 if mechanism.end_effector_is_joint else 6]
    if at in ("task", "path"):
        return twist if at == "task" else np.append(twist, actuators)
    return actuators if at == "actuators" else np.where(are_lengths(mechanism, at), length, 1.0)
