"""Ways of assembly: what a task leaves out of a pose, and whether it follows from the mechanism."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..description.home_mobility import end_effector_freedom
from ..description.mechanism import Mechanism
from ..description.task import task_of
from ..poses import pose
from ..tolerances import TOLERANCES
from .close import Closure, close, closure_of

Floats = NDArray[np.float64]

NEARBY, PROBES = 0.05, 8
"""How far about home it is looked whether a task's other coordinates change [L or rad], and in how many directions."""


@lru_cache(maxsize=64)
def follows_task(mechanism: Mechanism) -> bool:
    """Whether all that a task leaves out of a pose follows from the mechanism, which has no freedom beside the task.

    Then a target has one pose for each way of assembly. Told at home; of a joint end effector nothing turns.
    """
    task = task_of(mechanism)
    asked = sum(task.axes) + task.rotations
    freedom = end_effector_freedom(mechanism, frozenset())
    return not (mechanism.end_effector_is_joint or task.is_whole_pose) and freedom <= asked


@lru_cache(maxsize=64)
def has_parasitic_motion(mechanism: Mechanism) -> bool:
    """Whether what a task leaves out of a pose changes as the end effector moves about home.

    Not so where parallelograms keep an orientation. There a platform that has turned over on its rods is of no use,
    though its loops close, and no answer.
    """
    closure, task = closure_of(mechanism), task_of(mechanism)
    rng = np.random.default_rng(0)
    targets = [
        pose(mechanism.home_pose[:3, 3] + NEARBY * mechanism.characteristic_length * step[:3], rotvec=NEARBY * step[3:])
        for step in rng.uniform(-1.0, 1.0, (PROBES, 6))
    ]
    home = np.repeat(mechanism.home_pose[None], PROBES, axis=0)
    wanted = task.completed(np.array(targets), home)
    start = np.zeros((PROBES, len(closure.scale)))
    found = close(closure, start, wanted, platform=task.held, framed=task.is_framed)
    closed = found.gap <= TOLERANCES.position
    return bool((differences(closure, found.poses, wanted)[closed] > TOLERANCES.same_mode).any())


def strays(mechanism: Mechanism, poses: Floats) -> NDArray[np.bool_]:
    """Whether poses (n, 4, 4) are those of a platform that has turned over though its legs keep it as it is, (n,)."""
    if not follows_task(mechanism) or has_parasitic_motion(mechanism):
        return np.zeros(len(poses), bool)
    home = np.repeat(mechanism.home_pose[None], len(poses), axis=0)
    kept = task_of(mechanism).completed(poses, home)
    return np.asarray(differences(closure_of(mechanism), poses, kept) > TOLERANCES.same_mode)


def differences(closure: Closure, poses: Floats, others: Floats) -> Floats:
    """Largest difference of positions [L] and of entries of rotations, (n,)."""
    scale = np.ones((3, 4))
    scale[:, 3] = 1.0 / closure.mechanism.characteristic_length
    return np.asarray(np.abs((poses - others)[:, :3] * scale).max(axis=(1, 2), initial=0.0))
