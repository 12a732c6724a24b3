"""Rows in and out: targets and seeds taken up, configurations written down, memory to work in."""

from __future__ import annotations

import math

import numpy as np

from .._jit import allocator, inlined, routine
from ..vectors import copy_row, copy_table, put, vec
from .exact import branch_mode
from .frames import move_carriers, orthonormalise, place_ends
from .measure import read_coordinate
from .plan import (
    LENGTH,
    POINT_END,
    Configuration,
    Floats,
    Plan,
    Rows,
    Seeds,
    Work,
)

# Largest deviation of R^T R from I in a target, and below which it is machine noise.
NOT_A_ROTATION, ROUNDED = 1e-6, 1e-15
# Targets farther than this many L are solved for as if they lay there, in the same direction: the square of their
# distance would not feel where the platform goes.
HORIZON = 1e6


@allocator
def new_configuration(plan: Plan) -> Configuration:
    return Configuration(
        np.zeros((4, 4)),
        np.zeros((plan.nodes.shape[0], 3)),
        np.zeros(plan.trunk_joints.shape[0]),
        np.zeros((plan.trunks.shape[0] + 1, 3, 4)),
        np.zeros((plan.trunk_joints.shape[0], 2, 3)),
    )


@allocator
def new_work(plan: Plan) -> Work:
    n_nodes, n_branches, n_trunks = plan.nodes.shape[0], plan.branches.shape[0], plan.trunk_joints.shape[0]
    n = 6 + 3 * n_nodes + n_branches + n_trunks
    return Work(
        np.zeros((4, 4)),
        np.zeros((n_nodes, 3)),
        np.zeros(n_trunks),
        np.zeros((n_nodes, 3)),
        np.zeros(n_trunks),
        np.zeros(n_branches),
        np.zeros((n_branches, 3)),
        np.zeros((n + 1, n + 1)),
        np.zeros((n + 1, n + 1)),
        np.zeros(n),
        np.zeros(n),
        np.zeros(3),
        np.zeros((4 * n_nodes + plan.cones.shape[0] + 12 * n_branches, 16)),
        np.zeros(n_nodes + n_branches + n_trunks, np.int64),
    )


@inlined
def load_target(plan: Plan, target: Floats, pose: Floats) -> bool:
    """Copy a target into `pose`, made orthonormal; False when it is not a pose."""
    worst = 0.0
    for i in range(3):
        for j in range(4):
            if not math.isfinite(target[i, j]):
                return False
            pose[i, j] = target[i, j]
        for j in range(i, 3):
            product = target[0, i] * target[0, j] + target[1, i] * target[1, j] + target[2, i] * target[2, j]
            worst = max(worst, abs(product - (1.0 if i == j else 0.0)))
    determinant = (
        target[0, 0] * (target[1, 1] * target[2, 2] - target[1, 2] * target[2, 1])
        - target[0, 1] * (target[1, 0] * target[2, 2] - target[1, 2] * target[2, 0])
        + target[0, 2] * (target[1, 0] * target[2, 1] - target[1, 1] * target[2, 0])
    )
    last_row = abs(target[3, 0]) + abs(target[3, 1]) + abs(target[3, 2]) + abs(target[3, 3] - 1.0)
    if not (worst <= NOT_A_ROTATION and determinant > 0.0 and last_row <= NOT_A_ROTATION):
        return False
    pose[3, 0] = pose[3, 1] = pose[3, 2] = 0.0
    pose[3, 3] = 1.0
    farthest = max(abs(target[0, 3]), abs(target[1, 3]), abs(target[2, 3]))
    horizon = HORIZON * plan.scalars[LENGTH]
    if farthest > horizon:
        for i in range(3):
            pose[i, 3] = target[i, 3] / farthest * horizon
    if plan.scalars[POINT_END] == 1.0:  # a point has no orientation: home's
        for i in range(3):
            for j in range(3):
                pose[i, j] = 1.0 if i == j else 0.0
    elif worst > ROUNDED:
        orthonormalise(pose)
    return True


@routine
def load_configuration(plan: Plan, pose: Floats, nodes: Floats, trunks: Floats, now: Configuration) -> None:
    """Take up a stored configuration; the nodes that are not stored follow from the pose and the trunks."""
    copy_table(pose, now.pose)
    copy_row(trunks, now.trunks)
    move_carriers(plan, now)
    for k in range(plan.nodes.shape[0]):
        if plan.nodes[k]["stored"] >= 0:
            put(now.nodes[k], vec(nodes[plan.nodes[k]["stored"]]))
    for c in range(plan.chains.shape[0]):
        place_ends(plan, c, now)


@routine
def load_seed(plan: Plan, seeds: Seeds, i: int, now: Configuration, modes: Floats) -> None:
    """Take up seed `i` (or the only one), and the working mode of each branch; home's where the seed has none."""
    row = i if seeds.poses.shape[0] > 1 else 0
    load_configuration(plan, seeds.poses[row], seeds.nodes[row], seeds.trunks[row], now)
    read_modes(plan, now, modes)


@inlined
def read_modes(plan: Plan, now: Configuration, modes: Floats) -> None:
    """Update the working mode of each branch; a branch that is stretched keeps the one it had."""
    for b in range(plan.branches.shape[0]):
        mode = branch_mode(plan, b, now)
        if mode != 0.0:
            modes[b] = mode


@routine
def home_modes(plan: Plan, now: Configuration, modes: Floats) -> None:
    """The working modes of home; +1 for a branch that is stretched even there. `now` becomes home."""
    for k in range(plan.nodes.shape[0]):
        for j in range(3):
            now.nodes[k, j] = plan.nodes[k]["home"][j]
    for j in range(plan.trunk_joints.shape[0]):
        now.trunks[j] = 0.0
    move_carriers(plan, now)
    for b in range(plan.branches.shape[0]):
        modes[b] = 1.0
    read_modes(plan, now, modes)


@inlined
def write_row(plan: Plan, i: int, now: Configuration, rows: Rows) -> None:
    """The configuration that answers row `i`, and its actuators."""
    for k in range(4):
        for j in range(4):
            rows.poses[i, k, j] = now.pose[k, j]
    for k in range(plan.nodes.shape[0]):
        if plan.nodes[k]["stored"] >= 0:
            put(rows.nodes[i, plan.nodes[k]["stored"]], vec(now.nodes[k]))
    for j in range(plan.trunk_joints.shape[0]):
        rows.trunks[i, j] = now.trunks[j]
    for j in range(rows.actuators.shape[1]):
        rows.actuators[i, j] = read_coordinate(plan, j, now)
