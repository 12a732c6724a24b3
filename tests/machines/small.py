"""Small machines of one idea each: slides in a row, four-bars, a gripper."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pfabrik import Joint, Mechanism

Z = (0, 0, 1)
Pin = Sequence[float] | np.ndarray


def slides(*ranges: tuple[float, float] | None, axes: Any = np.eye(3), point: Any = (1, 2, 3)) -> Mechanism:  # noqa: B008
    """Driven slides P0, P1, ... in a row, within ranges, along x, y and z or other axes: no joint has a centre."""
    bodies = ["base", *(f"slide{k}" for k in range(len(ranges)))]
    joints = [
        Joint(f"P{k}", "prismatic", bodies[k : k + 2], axis=axes[k], actuated=True, range=limits)
        for k, limits in enumerate(ranges)
    ]
    task = [name for name, column in zip("xyz", np.abs(axes[: len(ranges)]).sum(axis=0), strict=True) if column]
    return Mechanism("slides", joints, bodies[-1], point, task=task)


LINKS = (("base", "crank"), ("crank", "coupler"), ("coupler", "rocker"), ("base", "rocker"))


def four_bar(
    *pins: Pin, end: str = "rocker", at: Pin | None = None, balls: str = "", driven: str = "A", **more: Any
) -> Mechanism:
    """Crank AB, coupler BC and rocker CD in the plane z = 0, some pins balls; a point is commanded, C by default."""
    joints = []
    for name, place, bodies in zip("ABCD", pins, LINKS, strict=True):
        kind = {"type": "spherical"} if name in balls else {"type": "revolute", "axis": Z, "actuated": name == driven}
        joints.append(Joint(name, connects=bodies, at=(*place, 0), **kind))
    return Mechanism("four-bar", joints, end, (*(pins[2] if at is None else at), 0), **more)


PINS = {
    "rod0": (6, -10, "carriage", "rod"),
    "rod1": (26, 11, "rod", "driver"),
    "drv0": (16, 16, "body", "driver"),
    "drv1": (36, 62, "driver", "pad"),
    "fol0": (6, 21, "body", "follow"),
    "fol1": (26, 67, "follow", "pad"),
}
"""Of one finger of a gripper: where its pins are, and what they join."""


def gripper(fingers: int, balls: Sequence[str] = ()) -> Mechanism:
    """A slide that drives fingers by rods, each with its pad on a parallelogram, mirrored; some pins are balls."""
    joints = [Joint("slide", "prismatic", ("body", "carriage"), axis=(0, 1, 0), range=(-12, 12), actuated=True)]
    for sign, k in ((-1, "L"), (1, "R"))[:fingers]:
        for name, (x, y, *bodies) in PINS.items():
            one, other = (body if body in ("body", "carriage") else body + k for body in bodies)
            kind = {"type": "spherical"} if name in balls else {"type": "revolute", "axis": Z}
            joints.append(Joint(name + k, connects=(one, other), at=(sign * x, y, 0), **kind))
    return Mechanism("gripper", joints, "padL", (-30, 92, 0), base="body", task=("x",))
