"""Random starts of searches."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..arrays import Floats
from ..kernels.closure.joint_constants import SPREAD
from ..motion.closure import Closure
from ..motion.displacements import columns
from ..rotations import from_quaternion, random_quaternions, rotvec_from_quaternion


def random_starts(closure: Closure, n: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Coordinates (n, columns) by `random_coordinates`, and poses (n, 4, 4) around home with any rotation."""
    mechanism = closure.mechanism
    poses = np.repeat(mechanism.home_pose[None], n, axis=0)
    poses[:, :3, :3] = from_quaternion(random_quaternions(n, rng))
    poses[:, :3, 3] += rng.normal(0.0, SPREAD * mechanism.characteristic_length, (n, 3))
    return random_coordinates(closure, n, rng), poses


def same_random_starts(closure: Closure, starts: int, n: int) -> Iterator[tuple[Floats, Floats]]:
    """Yield random starts, each repeated for n rows, and equal in every call: rows do not depend on each other."""
    rng = np.random.default_rng(0)
    for _ in range(starts):
        coordinates, poses = random_starts(closure, 1, rng)
        yield np.repeat(coordinates, n, axis=0), np.repeat(poses, n, axis=0)


def random_coordinates(closure: Closure, n: int, rng: np.random.Generator) -> Floats:
    """Coordinates (n, columns) with random angles; lengths, which follow the platform, and idle coordinates are 0."""
    coordinates = rng.uniform(-np.pi, np.pi, (n, len(closure.scale))) * closure.turning
    for name, span in columns(closure.mechanism).items():
        if closure.mechanism.joint(name).type == "spherical":
            coordinates[:, span] = rotvec_from_quaternion(random_quaternions(n, rng))
    coordinates[:, closure.idle] = 0.0
    return np.asarray(coordinates)
