"""Motions that are asked for: of the end effector, of actuators, or of other joints; and those of paths with times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..answers.tracked import Track, refuse_leaps
from ..arrays import Floats, Mask
from ..checks import names_of
from ..description.mechanism import Mechanism
from ..errors import InvalidArgument
from ..kinematics import actuator_units, cycle_basis, joint_path, task_of
from ..rotations import to_rotvec
from ..tolerances import TOLERANCES
from .moving_machine import MovingMachine

NEIGHBOURS = 5
"""Steps of a path through which a polynomial gives the rates and accelerations of one: of the fourth degree."""


class Shown(NamedTuple):
    """What joint rates show of a motion, at n configurations, lengths in L.

    Attributes
    ----------
    by_rates : k components by joint rates, (n, k, c).
    by_twist : the same by the end effector's twist, (n, k, 6); 0 for coordinates of joints.
    is_length : True for lengths, False for angles, (k,).
    """

    by_rates: Floats
    by_twist: Floats
    is_length: Mask

    def following(self, moving: MovingMachine) -> Floats:
        """The least joint rates that make each component, (n, c, k)."""
        pairs = moving.first.pairs
        return np.asarray(pairs @ np.linalg.pinv(self.by_rates @ pairs, rcond=TOLERANCES.singular))


def shown_of(moving: MovingMachine, at: str | Sequence[str], poses: Floats) -> Shown:
    """The components that `at` names: those of the task, of the actuators, of some joints; or "path", of all."""
    n, mechanism = len(poses), moving.mechanism
    if at == "task":
        return _of_twist(moving, task_axes(mechanism, poses))
    if at == "path":
        whole = np.tile(np.eye(3 if mechanism.end_effector_is_joint else 6, 6), (n, 1, 1))
        of_pose, of_actuators = _of_twist(moving, whole), shown_of(moving, "actuators", poses)
        by_rates, by_twist = (np.concatenate(both, axis=1) for both in zip(of_pose[:2], of_actuators[:2], strict=True))
        return Shown(by_rates, by_twist, np.append(of_pose.is_length, of_actuators.is_length))
    columns = np.array(moving.first.actuated) if at == "actuators" else joint_path(mechanism, at).columns
    by_rates = cycle_basis(mechanism).rates.T[columns]
    is_length = np.array([mechanism.coordinates[column].kind == "length" for column in columns], bool)
    return Shown(np.tile(by_rates, (n, 1, 1)), np.zeros((n, len(columns), 6)), is_length)


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


def _of_twist(moving: MovingMachine, axes: Floats) -> Shown:
    return Shown(axes @ moving.first.twists, axes, np.asarray(axes[:, :, :3].any(axis=(0, 2))))


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


def in_lengths(mechanism: Mechanism, at: str) -> Floats:
    """Units of the numbers that `motion_of` and arguments have, in L: of twists, of actuators, or of both."""
    twist = np.repeat([mechanism.characteristic_length, 1.0], 3)[: 3 if mechanism.end_effector_is_joint else 6]
    return {"task": twist, "actuators": actuator_units(mechanism), "path": np.append(twist, actuator_units(mechanism))}[
        at
    ]


def is_missed(shown: Shown, rates: Floats, wanted: Floats) -> Mask:
    """True where joint rates (n, c) do not make a motion (n, k), as at a serial singularity, (n,)."""
    missed = (shown.by_rates @ rates[..., None])[..., 0] - wanted
    return np.asarray(
        np.abs(missed).max(axis=1, initial=0.0) > TOLERANCES.alignment * np.abs(wanted).max(axis=1, initial=0.0)
    )
