"""Struts that are thick, and how far apart their axes are by their ends alone."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import pfabrik as pf

Array = NDArray[np.float64]

FEET = np.array([[100.0, 20, 0], [100, -20, 0]])
HEADS = np.array([[40.0, 40, 195], [40, -40, 195]])
CENTRE = np.array([0.0, 0, 195])
STROKE = (155.0, 280.0)


def struts(
    thickness: float = 12.0,
    clearance: float | None = None,
    *,
    size: float = 1.0,
    stroke: tuple[float, float] = STROKE,
    **more: object,
) -> pf.Mechanism:
    """Six struts in pairs, thick, and so large."""
    return pf.Mechanism.from_legs(
        "U-P*-S",
        base=size * FEET,
        platform=size * HEADS,
        stroke=(size * stroke[0], size * stroke[1]),
        copies={"count": 3, "axis": [0, 0, 1]},
        reference_point=size * CENTRE,
        thickness=thickness * size,
        clearance=None if clearance is None else clearance * size,
        **more,  # type: ignore[arg-type]
    )


TURNS = Rotation.from_rotvec(np.outer(np.arange(3) * 2.0 * np.pi / 3.0, [0, 0, 1])).as_matrix()
BASE, PLATFORM = (np.concatenate([points @ turn.T for turn in TURNS]) for points in (FEET, HEADS))
PAIRS = list(itertools.combinations(range(6), 2))


def axes_of_struts(poses: Array) -> Array:
    """Both ends of the axes of all `struts` at poses, (n, 6, 2, 3)."""
    heads = (PLATFORM - CENTRE) @ poses[:, :3, :3].swapaxes(1, 2) + poses[:, None, :3, 3]
    return np.stack([np.broadcast_to(BASE, heads.shape), heads], axis=2)


def distances_of_pairs(poses: Array, thickness: float = 12.0) -> Array:
    """The distances of all pairs of struts at poses, (n, 15)."""
    axes, (i, j) = axes_of_struts(poses), np.transpose(PAIRS)
    ends = np.concatenate([axes[:, i], axes[:, j]], axis=2)
    return by_cases(ends.reshape(-1, 4, 3)).reshape(len(poses), -1) - thickness


def distances_of_struts(poses: Array, thickness: float = 12.0) -> dict[str, Array]:
    """The same by the names of their bodies, (n,)."""
    names = [f"BC{i + 1}–BC{j + 1}" for i, j in PAIRS]
    return dict(zip(names, distances_of_pairs(poses, thickness).T, strict=True))


def by_cases(ends: Array) -> Array:
    """Distances of segments (n, 4, 3) by all cases of the quadratic programme in two parameters: four ends, and inside
    in 80 bits."""
    p, q, x, y = np.moveaxis(ends.astype(np.longdouble), 1, 0)

    def to_line(point: Array, start: Array, end: Array) -> Array:
        d = end - start
        square = (d * d).sum(-1)
        t = np.clip(((point - start) * d).sum(-1) / np.where(square > 0, square, 1), 0, 1)
        return np.linalg.norm((start + t[:, None] * d - point).astype(float), axis=1)

    least = np.min([to_line(p, x, y), to_line(q, x, y), to_line(x, p, q), to_line(y, p, q)], axis=0)
    d, e, w = q - p, y - x, x - p
    n = np.cross(d, e)
    square = (n * n).sum(-1)
    some = np.where(square > 0, square, 1)
    s, t = (np.cross(w, e) * n).sum(-1) / some, (np.cross(w, d) * n).sum(-1) / some
    inside = (square > 0) & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    distance = np.abs((w * n).sum(-1)) / np.sqrt(some)
    return np.where(inside, np.minimum(distance, least), least).astype(float)


def thick_hexaglide(thickness: float = 20.0) -> pf.Mechanism:
    machine = pf.load("hexaglide")
    rods = [body for body in machine.bodies if body.startswith("rod")]
    return machine.with_shapes([pf.Shape(rod, thickness=thickness) for rod in rods]).with_clearance(2)
