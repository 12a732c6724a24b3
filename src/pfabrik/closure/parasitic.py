"""Ways of assembly: what a task leaves out of a pose, and whether it follows from the mechanism."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..arrays import Floats, Mask
from ..description.mechanism import Mechanism
from ..description.task import task_of
from ..motion.mobility import generic_of
from ..motion.walks import around_home
from ..tolerances import TOLERANCES
from .close import Closure, closure_of, platform_poses


@lru_cache(maxsize=64)
def follows_task(mechanism: Mechanism) -> bool:
    """Whether all that a task leaves out of a pose follows from the mechanism, which has no freedom beside the task.

    Then a target has one pose for each way of assembly. Told by the freedoms in general, not by those of home, which
    may be singular; of a joint end effector nothing turns.
    """
    if mechanism.end_effector_is_joint or task_of(mechanism).is_whole_pose:
        return False
    return generic_of(mechanism).mobility.platform <= _asked(mechanism)


def asks_too_much(mechanism: Mechanism) -> bool:
    """Whether a task sets more of a pose than the end effector has freedoms: hardly any target is within reach."""
    return generic_of(mechanism).mobility.platform < _asked(mechanism)


def has_other_assemblies(mechanism: Mechanism) -> bool:
    """Whether a target that one way of assembly misses is to be looked for in all others: they reach different ones.

    Not where nothing is left out but what never changes: positions, as the height of a planar machine, or what is left
    of the rotation of a platform that does not turn at all.
    """
    if not (follows_task(mechanism) and asks_too_much(mechanism)):
        return False
    turns = bool((np.abs(generic_of(mechanism).directions[3:]) > TOLERANCES.alignment).any())
    return (turns and task_of(mechanism).rotations in (1, 2)) or has_parasitic_motion(mechanism)


def _asked(mechanism: Mechanism) -> int:
    """How many coordinates of a pose the task sets."""
    task = task_of(mechanism)
    return sum(task.axes) + task.rotations


@lru_cache(maxsize=64)
def has_parasitic_motion(mechanism: Mechanism) -> bool:
    """Whether what a task leaves out of a pose changes as the mechanism moves about home.

    Not so where parallelograms keep an orientation. There a platform that has turned over on its rods is of no use,
    though its loops close, and no answer.
    """
    poses = platform_poses(mechanism, around_home(mechanism))
    home = np.repeat(mechanism.home_pose[None], len(poses), axis=0)
    kept = task_of(mechanism).completed(poses, home)
    return bool((differences(closure_of(mechanism), poses, kept) > TOLERANCES.same_mode).any())


def is_flipped(mechanism: Mechanism, poses: Floats) -> Mask:
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
