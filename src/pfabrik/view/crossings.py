"""The order in which lines and plates are drawn, so that what is nearer crosses over what is farther."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..common.arrays import Floats

ENDS = 0.01
"""Share of a line at both ends in which it crosses no other: there they are joined."""

DOTS = np.linspace(0.04, 0.96, 25)[:, None]
"""Places of a line that are compared with a plate, as shares of its length."""

LEVEL = 1e-6
"""Difference in depth up to which neither of two is nearer, as a share of the extent."""


def far_to_near(outlines: Sequence[Floats], is_plate: Sequence[bool]) -> list[int]:
    """The places of outlines in the order in which they are drawn.

    Their depths are compared where they cross on the screen; a plate is compared by its plane. What crosses nothing
    goes by its middle, plates first. Where each of several is nearer than the next, all the way round, the farthest is
    first.

    Parameters
    ----------
    outlines : points (n, 3) as an eye sees them: to the right, up, and towards it; a plate's back to its first corner.
    """
    nearer = _lines_nearer(outlines, is_plate)
    for plate in np.flatnonzero(is_plate).tolist():
        for other, outline in enumerate(outlines):
            if other != plate:
                above = _above(outline, outlines[plate])
                nearer[other, plate] += above
                nearer[plate, other] -= above
    level = LEVEL * (float(np.ptp(np.vstack(outlines), axis=0).max()) if len(outlines) else 1.0)
    waits_for = [set(np.flatnonzero(row > level).tolist()) for row in nearer]
    rank = [(not plate, float(outline[:, 2].mean())) for outline, plate in zip(outlines, is_plate, strict=True)]
    left, order = set(range(len(outlines))), list[int]()
    while left:
        ready = [place for place in left if not waits_for[place] & left] or list(left)
        order.append(min(ready, key=rank.__getitem__))
        left.remove(order[-1])
    return order


def _lines_nearer(outlines: Sequence[Floats], is_plate: Sequence[bool]) -> Floats:
    """How much nearer one line is than another where they cross, summed over their crossings, (n, n) [length]."""
    lines = [place for place, plate in enumerate(is_plate) if not plate]
    nearer = np.zeros((len(outlines), len(outlines)))
    if not lines:
        return nearer
    start = np.concatenate([outlines[place][:-1] for place in lines])
    along = np.concatenate([np.diff(outlines[place], axis=0) for place in lines])
    owner = np.repeat(lines, [len(outlines[place]) - 1 for place in lines])
    to = start[None, :, :2] - start[:, None, :2]
    across = cross(along[:, None], along[None])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = cross(to, along[None]) / across  # of the first line up to where they cross
    is_within = np.isfinite(share) & (share > ENDS) & (share < 1.0 - ENDS)
    first, second = np.nonzero(is_within & is_within.T)
    depth = start[first, 2] + share[first, second] * along[first, 2]
    np.add.at(nearer, (owner[first], owner[second]), depth)
    np.add.at(nearer, (owner[second], owner[first]), -depth)
    np.fill_diagonal(nearer, 0.0)
    return nearer


def cross(a: Floats, b: Floats) -> Floats:
    """The upright component of the cross product of vectors (..., 2 or more): twice the area that they span."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _above(outline: Floats, plate: Floats) -> float:
    """The height of a line above the plane of a plate where it is largest within it; 0 where the line is beside."""
    from matplotlib.path import Path

    dots = np.concatenate([outline[:-1] + share * np.diff(outline, axis=0) for share in DOTS])
    within = dots[Path(plate[:, :2]).contains_points(dots[:, :2])]
    if not len(within):
        return 0.0
    middle = plate[:-1].mean(axis=0)
    normal = np.linalg.svd(plate[:-1] - middle)[2][2]
    if abs(normal[2]) < LEVEL:  # seen on its edge
        return 0.0
    heights = (within - middle) @ normal / normal[2]
    return float(heights[np.abs(heights).argmax()])
