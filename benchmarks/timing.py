"""How times are taken, and where targets are drawn."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

import pfabrik as pf

Array = NDArray[np.float64]
Solve = Callable[[], object]


def best_times(runs: int, *solves: Solve) -> list[float]:
    """Shortest time of each [s], run by turns after one run to warm up."""
    best = [float("inf")] * len(solves)
    for solve in solves:
        solve()
    for _ in range(runs):
        for i, solve in enumerate(solves):
            start = time.perf_counter()
            solve()
            best[i] = min(best[i], time.perf_counter() - start)
    return best


def draw(mechanism: pf.Mechanism, rng: np.random.Generator, n: int, size: float, tilt: float) -> Array:
    """Poses (n, 4, 4) about home's: in a box of half width `size` L, turned by up to `tilt` [rad] about each axis."""
    targets = np.tile(mechanism.home_pose, (n, 1, 1))
    targets[:, :3, 3] += rng.uniform(-size, size, (n, 3)) * mechanism.characteristic_length
    if mechanism.end_effector_is_joint:
        axis = np.array(mechanism.joint(mechanism.end_effector).axis)
        targets[:, :3, 3] -= ((targets[:, :3, 3] - mechanism.reference_point) @ axis)[:, None] * axis
        return targets
    for target in targets:
        target[:3, :3] = pf.pose((0, 0, 0), rotvec=rng.uniform(-tilt, tilt, 3))[:3, :3]
    return targets


def in_blocks(solve: Callable[[Array], object], targets: Array, size: int = 4096) -> list[object]:
    """A vectorised closed form at its best: in blocks whose intermediate arrays stay in the cache."""
    return [solve(targets[start : start + size]) for start in range(0, len(targets), size)]
