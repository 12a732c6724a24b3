"""What joints transmit in motion."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Floats, Ints, Mask
from ..files.units import metres_of
from ..kinematics import JointRates, end_effector_pose, joint_centres, model_of, tree_of
from ..statics.joint_balance import about_centres, balance_at, open_components
from .drives import drives_of
from .moving_rows import MovingRows

ROWS_A_BLOCK = 256
"""Rows whose matrices are in memory at once."""


@dataclass(frozen=True, eq=False)
class TransmittedForces:
    """What joints transmit in motion, computed when it is asked for.

    Attributes
    ----------
    rows : the rows that have a configuration; places : of these among all.
    exerted : forces of the actuators in all rows, (n, n_a) [N, N m]; NaN where there are none.
    shape : of the batch.
    """

    rows: MovingRows
    places: Ints
    exerted: Floats
    shape: tuple[int, ...]

    @cached_property
    def found(self) -> tuple[Floats, Mask]:
        """Force [N] and moment about their centres [N m], (..., joints, 6), and where that is not determined."""
        mechanism, weights = self.rows.mechanism, self.rows.weights
        found = self.rows.efforts(["wrenches"])
        metres = metres_of(mechanism.length_unit)
        drives, paths = drives_of(mechanism), tree_of(mechanism).paths
        by_body = np.array([paths[body] for body in (*weights.bodies, *weights.loaded)]).reshape(
            -1, len(mechanism.joints)
        )
        given = self.exerted[self.places] - drives.taken(found.rates, found.gains)
        reactions = np.full((len(self.exerted), len(mechanism.joints), 6), np.nan)
        is_open = np.zeros(reactions.shape, bool)
        has_answer = np.flatnonzero(~np.isnan(given).any(axis=1) & (found.marks == 0))
        for start in range(0, len(has_answer), ROWS_A_BLOCK):
            rows = has_answer[start : start + ROWS_A_BLOCK]
            q = self.rows.q[rows]
            carried, on_drives = by_body.T @ found.wrenches[rows], given[rows] * drives.units
            held = balance_at(mechanism, JointRates(model_of(mechanism), q), carried[..., None], on_drives[..., None])
            points = joint_centres(mechanism, q), end_effector_pose(mechanism, q)[:, :3, 3]
            places = self.places[rows]
            reactions[places] = about_centres(mechanism, held.wrenches, *points)[..., 0]
            is_open[places] = open_components(mechanism, held.open, *points)
        reactions[is_open] = np.nan
        return (reactions * np.repeat([1.0, metres], 3)).reshape(*self.shape, -1, 6), is_open
