"""What answers beside an answer say of its derivatives: central differences by the actuators."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import Array, actuator_units
from oracles import targets_about

STEP = 1e-5
"""Of an actuator, either way [L or rad]."""


def somewhere(machine: pf.Mechanism, n: int | None = None, shift: float = 0.05, turn: float = 0.05) -> pf.Solution:
    """Configurations near home, one or a batch, of a machine whose limits are not in the way."""
    targets = targets_about(machine, np.random.default_rng(5), n or 1, shift, turn)
    values = pf.solve_ik(machine, targets).actuators
    return pf.solve_fk(machine.without_limits(), values[0] if n is None else values)


def beside(solution: pf.Solution) -> pf.Solution:
    """What forward kinematics gives with each actuator a little ahead, and behind, (2, n_a)."""
    steps = STEP * np.diag(actuator_units(solution.mechanism))
    return pf.solve_fk(solution.mechanism, solution.actuators + np.stack([steps, -steps]), start=solution)


def slopes(machine: pf.Mechanism, ends: Array) -> Array:
    """Derivatives (..., n_a) per actuator of values (2, n_a, ...) of the answers `beside` one."""
    units = actuator_units(machine).reshape(-1, *[1] * (np.ndim(ends) - 2))
    return np.moveaxis((ends[0] - ends[1]) / (2.0 * STEP * units), 0, -1)


def slope_of_pose(near: pf.Solution) -> Array:
    """Twists per actuator rate, (6, n_a), or (3, n_a) of a joint, of the answers `beside` one."""
    ahead, behind = near.pose
    turned = Rotation.from_matrix(ahead[:, :3, :3] @ behind[:, :3, :3].swapaxes(1, 2)).as_rotvec()
    moved = slopes(near.mechanism, near.pose[..., :3, 3])
    if near.mechanism.end_effector_is_joint:
        return moved
    return np.concatenate([moved, slopes(near.mechanism, np.stack([turned, 0.0 * turned]))])
