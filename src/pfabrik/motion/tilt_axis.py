"""The one axis about which an end effector tilts, and targets measured along that freedom alone."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..derived import derived
from ..description.mechanism import MOST_JOINTS_FOR_FREEDOM, Mechanism
from ..description.task import task_of
from ..rotations import shortest_turns
from ..tolerances import TOLERANCES
from .displacements import home_coordinates
from .fitting_task import motions_at
from .mobility import generic_of


@derived
def tilt_axis(mechanism: Mechanism) -> Floats | None:
    """The axis of the end effector's only rotation, a unit vector (3,) whose largest component is positive.

    None if the task sets no tilt, if the end effector has other rotations too, or if this one leaves the tilt as it is.
    """
    if task_of(mechanism).rotations != 2 or len(mechanism.joints) > MOST_JOINTS_FOR_FREEDOM:
        return None
    turns = motions_at(mechanism, home_coordinates(mechanism)[None])[3:]
    if np.linalg.matrix_rank(turns, TOLERANCES.alignment) > 1:  # quickly seen, of most
        return None
    left, sizes, _ = np.linalg.svd(generic_of(mechanism).directions[3:], full_matrices=False)
    axis = left[:, 0] * np.sign(left[np.abs(left[:, 0]).argmax(), 0]) + 0.0
    is_only = np.count_nonzero(sizes > TOLERANCES.alignment) == 1
    across = np.linalg.norm(np.cross(axis, mechanism.home_pose[:3, 2]))
    return axis if is_only and across > TOLERANCES.independent else None


def along_tilt(mechanism: Mechanism, targets: Floats) -> Floats:
    """Targets (n, 4, 4) turned so that their z axis is one that the mechanism's only rotation leads to.

    With the axis n of this rotation it is the one whose part across n has the same direction: the angle about n is all
    that counts. Targets whose z axis is along n, and rows that are no poses, stay as they are.
    """
    axis = tilt_axis(mechanism)
    if axis is None:
        return targets
    home = mechanism.home_pose[:3, 2]
    along = (home @ axis) * axis
    with np.errstate(invalid="ignore", over="ignore"):
        across = targets[:, :3, 2] - (targets[:, :3, 2] @ axis)[:, None] * axis
        lengths = np.linalg.norm(across, axis=1)
        rows = np.flatnonzero((lengths > TOLERANCES.alignment) & (lengths < 2.0))
    wanted = along + np.linalg.norm(home - along) * across[rows] / lengths[rows, None]
    turned = targets.copy()
    turned[rows, :3, :3] = shortest_turns(targets[rows, :3, 2], wanted) @ targets[rows, :3, :3]
    return turned
