"""Components of a pose that a task leaves out: whether the mechanism determines them, and whether they vary."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Floats, Mask
from ...common.derived import derived
from ...machine.motion.loops import Closure
from ...machine.motion.mobility import STEP, around_home, generic_of
from ...tolerances import TOLERANCES
from .close import platform_poses


@derived
def follows_task(closure: Closure) -> bool:
    """True if the mechanism determines every component of a pose that the task leaves out.

    It then has no freedom beside the task, and a target has one pose per assembly mode. Freedoms are counted at generic
    configurations, as home may be singular. False for a whole-pose task or a joint end effector, which has no rotation.
    """
    if closure.mechanism.end_effector_is_joint or closure.task.is_whole_pose:
        return False
    return generic_of(closure.mechanism).mobility.platform <= _n_set(closure)


def asks_too_much(closure: Closure) -> bool:
    """True if the task sets more components than the end effector has freedoms: hardly any target is reachable."""
    return generic_of(closure.mechanism).mobility.platform < _n_set(closure)


def has_other_assemblies(closure: Closure) -> bool:
    """True if assembly modes reach different targets, so that a target missed in one must be tried in the others.

    False if the components left out never change: a position, such as the height of a planar machine, or the rest of
    the rotation of a platform that does not rotate.
    """
    if not (follows_task(closure) and asks_too_much(closure)):
        return False
    turns = bool((np.abs(generic_of(closure.mechanism).directions[3:]) > TOLERANCES.alignment).any())
    return (turns and closure.task.rotations in (1, 2)) or has_parasitic_motion(closure)


def _n_set(closure: Closure) -> int:
    """Number of components of a pose that the task sets."""
    return sum(closure.task.axes) + closure.task.rotations


@derived
def has_parasitic_motion(closure: Closure) -> bool:
    """True if the components of a pose that the task leaves out vary as the mechanism moves about home.

    False if, for instance, parallelograms keep the orientation. A platform that has flipped over on its rods is then no
    answer, although its loops close.
    """
    mechanism = closure.mechanism
    poses = platform_poses(mechanism, around_home(mechanism))
    home = np.repeat(mechanism.home_pose[None], len(poses), axis=0)
    kept, shares = closure.task.completed(poses, home), differences(closure, poses, home) / STEP
    least = TOLERANCES.same_mode * np.minimum(shares**2, 1.0)  # such motion grows as the square of the way
    return bool((differences(closure, poses, kept) > np.maximum(least, TOLERANCES.position)).any())


def is_flipped(closure: Closure, poses: Floats) -> Mask:
    """Mask of poses (n, 4, 4) with a flipped platform, for legs that keep its orientation about home, (n,)."""
    if not follows_task(closure) or has_parasitic_motion(closure):
        return np.zeros(len(poses), bool)
    home = np.repeat(closure.mechanism.home_pose[None], len(poses), axis=0)
    kept = closure.task.completed(poses, home)
    return np.asarray(differences(closure, poses, kept) > TOLERANCES.same_mode)


def differences(closure: Closure, poses: Floats, other_poses: Floats) -> Floats:
    """Largest difference of positions [L] and of entries of rotation matrices between poses, (n,)."""
    scale = np.ones((3, 4))
    scale[:, 3] = 1.0 / closure.mechanism.characteristic_length
    return np.asarray(np.abs((poses - other_poses)[:, :3] * scale).max(axis=(1, 2), initial=0.0))
