"""Targets on both sides of the border of a workspace, and how far from it they are by closed forms."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

from checks import actuator_units, home_values
from pfabrik import Mechanism
from pfabrik.machine.description.task import task_of

from .arms import redundant_actuators, redundant_margin
from .ik import solve_ik
from .turns import Array, unit


def is_redundant(mechanism: Mechanism) -> bool:
    """True of machines with arms and crossbars; of the others each leg has a closed form."""
    return len(mechanism.actuator_names) > 6


def margin(mechanism: Mechanism, targets: Array) -> Array:
    """Distance of targets (n, 4, 4) from the tightest limit in the configuration answered, (n,): see `judge`."""
    return redundant_margin(mechanism, targets) if is_redundant(mechanism) else solve_ik(mechanism, targets).margin


def actuators(mechanism: Mechanism, targets: Array) -> Array:
    """Actuated coordinates (n, n_a) at targets (n, 4, 4): of the redundant mechanism in its best configuration."""
    if is_redundant(mechanism):
        return redundant_actuators(mechanism, targets)
    return solve_ik(mechanism, targets).actuators


def random_targets(mechanism: Mechanism, rng: np.random.Generator, n: int) -> Array:
    """Targets from well inside to far outside, (n, 4, 4); those of a 5-bar are level and in its plane.

    Positions are drawn from balls about the home position and tilts up to an angle: a quarter of the machine's size
    and 10 degrees (35 % of the targets), half and 45 degrees (40 %), all of it and 180 degrees (20 %), 20 times (5 %).
    """
    home = np.array(mechanism.reference_point)
    size = max(float(np.linalg.norm(np.subtract(j.at, home))) for j in mechanism.joints if j.at is not None)
    kind = rng.choice(4, size=n, p=[0.35, 0.40, 0.20, 0.05])
    radius, tilt = np.array([0.25, 0.5, 1.0, 20.0])[kind] * size, np.radians([10.0, 45.0, 180.0, 180.0])[kind]
    planar = mechanism.end_effector_is_joint
    normal = unit(mechanism.joint(mechanism.end_effector).axis) if planar else np.zeros(3)
    steps = _directions(rng, n, normal) * (radius * rng.random(n) ** (1 / 3))[:, None]
    turns = _directions(rng, n, np.zeros(3)) * (tilt * (not planar) * rng.random(n))[:, None]
    return poses(home + steps, Rotation.from_rotvec(turns).as_matrix())


def _directions(rng: np.random.Generator, n: int, normal: Array) -> Array:
    """Random unit vectors (n, 3), normal to `normal` unless it is zero."""
    drawn = rng.normal(size=(n, 3))
    drawn -= (drawn @ normal)[:, None] * normal
    return np.asarray(drawn / np.linalg.norm(drawn, axis=1, keepdims=True))


def inside_targets(mechanism: Mechanism, rng: np.random.Generator, n: int, least: float = 0.01) -> Array:
    """Random targets, (n, 4, 4), with a margin of at least `least`."""
    found = np.empty((0, 4, 4))
    while len(found) < n:
        drawn = random_targets(mechanism, rng, 4 * n)
        found = np.concatenate([found, drawn[margin(mechanism, drawn) >= least]])
    return found[:n]


PARTS = 24
"""Parts that `edge` cuts a bracket into."""


def edge(margin: Callable[[Array], Array], farthest: Array, width: float) -> Array:
    """Where margins (k, n) of distances (k, n) first change sign between 0 and `farthest`, (n,), to within `width`.

    Brackets are cut into many parts, all of them measured in one call.
    """
    low, high, rows = np.zeros_like(farthest), farthest, np.arange(len(farthest))
    shares = np.linspace(0.0, 1.0, PARTS + 1)[:, None]
    while (high - low).max() > width:
        places = low + shares * (high - low)
        is_outside = margin(places[1:-1]) < 0.0
        part = np.where(is_outside.any(axis=0), is_outside.argmax(axis=0), PARTS - 1)
        low, high = places[part, rows], places[part + 1, rows]
    return 0.5 * (low + high)


def poses(positions: Array, rotations: Array | None = None) -> Array:
    """T_base_platform of positions (n, 3) and rotations (n, 3, 3), level when left out."""
    result = np.tile(np.eye(4), (len(positions), 1, 1))
    result[:, :3, 3] = positions
    if rotations is not None:
        result[:, :3, :3] = rotations
    return result


def leg_lengths(base: Array, platform: Array, targets: Array) -> Array:
    """Distances (n, k) from base points (k, 3) to platform points (k, 3) given in platform coordinates."""
    moved = np.einsum("nij,kj->nki", targets[:, :3, :3], platform) + targets[:, None, :3, 3]
    return np.linalg.norm(moved - base, axis=2)


def any_values(mechanism: Mechanism, n: int, share: float = 1.0, seed: int = 0) -> np.ndarray:
    """Actuator values within a share of their ranges, from home, (n, n_a)."""
    rng, home = np.random.default_rng(seed), home_values(mechanism)
    reach = np.where([drive.kind == "angle" for drive in mechanism.drives], 1.5, 0.4) * actuator_units(mechanism)
    ranges = [None if "[" in name else mechanism.joint(name).range for name in mechanism.actuator_names]
    low, high = np.transpose([own or (h - r, h + r) for own, h, r in zip(ranges, home, reach, strict=True)])
    return home + share * (rng.uniform(low, high, (n, len(home))) - home)


def any_targets(mechanism: Mechanism, n: int, seed: int = 0) -> np.ndarray:
    """Poses (n, 4, 4) near and far, up to 1e150 L, turned by any angle, some on joint centres, the last one home."""
    rng, length = np.random.default_rng(seed), mechanism.characteristic_length
    targets = np.tile(np.eye(4), (n, 1, 1))
    away = length * rng.choice([0, 1e-6, 0.05, 0.3, 1, 10, 1e3, 1e6, 1e150], (n, 1))
    turn = rng.choice([0, 1e-6, 0.05, 0.4, 3], (n, 1))
    targets[:, :3, 3] = mechanism.reference_point + away * rng.normal(size=(n, 3))
    targets[:, :3, :3] = Rotation.from_rotvec(turn * rng.uniform(-1, 1, (n, 3))).as_matrix()
    for row, centre in enumerate([each.at for each in mechanism.joints if each.at is not None][: n // 4]):
        targets[row, :3, 3] = centre
    targets[-1] = mechanism.home_pose
    return targets


def targets_about(mechanism: Mechanism, rng: np.random.Generator, n: int, shift: float, turn: float) -> Array:
    """Poses (n, 4, 4) up to so far from home on each axis that counts [L and rad]."""
    poses, counting = np.tile(mechanism.home_pose, (n, 1, 1)), np.array(task_of(mechanism).axes)
    poses[:, :3, 3] += rng.uniform(-shift, shift, (n, 3)) * mechanism.characteristic_length * counting
    if not mechanism.end_effector_is_joint:
        poses[:, :3, :3] = Rotation.from_rotvec(rng.uniform(-turn, turn, (n, 3))).as_matrix() @ poses[:, :3, :3]
    return poses
