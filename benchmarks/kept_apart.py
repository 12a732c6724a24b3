"""What it costs to keep links apart, over the same machine without a clearance."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

import pfabrik as pf
from table import Row
from timing import best_times

POSES, UNREACHED = 100_000, 400


def kept_apart(runs: int) -> Iterator[Row]:
    """On one core: six struts with 15 pairs that are clear; rods on rails, half of whose targets would touch."""
    legs = {"base": [[100, 20, 0], [100, -20, 0]], "platform": [[40, 40, 195], [40, -40, 195]], "stroke": (155, 280)}
    around = {"copies": {"count": 3, "axis": [0, 0, 1]}, "reference_point": [0, 0, 195]}
    struts = pf.Mechanism.from_legs("U-P*-S", thickness=12, clearance=2, **legs, **around)  # type: ignore[arg-type]
    yield _row("6-UPS, 15 pairs of links, in reach", struts, _poses(struts, POSES, 0.05, 0.05), runs)
    machine = pf.load("hexaglide")
    rods = [pf.Shape(body, thickness=20) for body in machine.bodies if body.startswith("rod")]
    rails = machine.with_shapes(rods).with_clearance(2)
    yield _row("hexaglide, 15 pairs of links, out of reach", rails, _poses(rails, UNREACHED, 0.3, 0.8), runs)


def _row(what: str, machine: pf.Mechanism, poses: np.ndarray, runs: int) -> Row:
    free = machine.with_clearance(None)
    kept, loose = best_times(runs, lambda: pf.solve_ik(machine, poses), lambda: pf.solve_ik(free, poses))
    return Row(what, len(poses), kept / len(poses), "without a clearance", loose / len(poses))


def _poses(machine: pf.Mechanism, count: int, length: float, angle: float) -> np.ndarray:
    rng = np.random.default_rng(0)
    poses = np.tile(machine.home_pose, (count, 1, 1))
    poses[:, :3, 3] += length * machine.characteristic_length * rng.uniform(-1, 1, (count, 3))
    poses[:, :3, :3] = Rotation.from_rotvec(angle * rng.uniform(-1, 1, (count, 3))).as_matrix()
    return poses
