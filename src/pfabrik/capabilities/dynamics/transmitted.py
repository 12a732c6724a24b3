"""What joints transmit in motion."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Floats, Mask
from ...kinematics import JointRates, end_effector_pose, joint_centres, model_of, tree_of
from ...machine.files.units import metres_of
from ..statics.joint_balance import ROWS_A_BLOCK, about_centres, balance_at, open_components
from .drives import drives_of
from .moving_rows import MovingRows


def transmitted(rows: MovingRows, exerted: Floats) -> tuple[Floats, Mask]:
    """Force [N] and moment about their centres [N m] of all joints, (n, joints, 6), and where that is not determined.

    Parameters
    ----------
    exerted : forces of the actuators, (n, n_a) [N, N m]; NaN where there are none.
    """
    mechanism, weights, found = rows.solution.mechanism, rows.weights, rows.efforts(["wrenches"])
    drives, paths = drives_of(mechanism), tree_of(mechanism).paths
    by_body = np.reshape([paths[body] for body in (*weights.bodies, *weights.loaded)], (-1, len(mechanism.joints)))
    given = exerted - drives.taken(found.rates, found.gains, found.signs)
    reactions = np.full((len(given), len(mechanism.joints), 6), np.nan)
    is_open = np.zeros(reactions.shape, bool)
    has_answer = np.flatnonzero(~np.isnan(given).any(axis=1))
    for start in range(0, len(has_answer), ROWS_A_BLOCK):
        block = has_answer[start : start + ROWS_A_BLOCK]
        q = rows.solution._coordinates[block]
        carried, on_drives = by_body.T @ found.wrenches[block], given[block] * drives.units
        held = balance_at(mechanism, JointRates(model_of(mechanism), q), carried[..., None], on_drives[..., None])
        points = joint_centres(mechanism, q), end_effector_pose(mechanism, q)[:, :3, 3]
        reactions[block] = about_centres(mechanism, held.wrenches, *points)[..., 0]
        is_open[block] = open_components(mechanism, held.open, *points)
    reactions[is_open] = np.nan
    return reactions * np.repeat([1.0, metres_of(mechanism.length_unit)], 3), is_open
