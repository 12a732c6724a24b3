"""The smallest sphere around a set of points."""

from __future__ import annotations

import sys
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats

ROUNDING = 64 * sys.float_info.epsilon
"""How far outside a sphere a point may lie and count as on it [radius]: what a handful of operations round off."""


def enclosing_radius(points: ArrayLike) -> float:
    """Radius of the smallest sphere that contains all points.

    At most four of the points carry the sphere. Starting from one point, the farthest point outside joins the carriers
    and the smallest sphere around them is found among all their subsets, until no point is outside. The radius grows
    in every round, so no set of carriers returns.

    Parameters
    ----------
    points : finite positions, shape (n, 3), any length unit; n may be 0.

    Returns
    -------
    The radius, in the unit of the points; 0 for no points or coincident ones.
    """
    cloud = np.asarray(points, dtype=float).reshape(-1, 3)
    if len(cloud) == 0:
        return 0.0
    cloud = cloud - cloud[0]
    size = float(np.abs(cloud).max())
    return size * _radius_at_unit_size(cloud / size) if size > 0.0 else 0.0


def _radius_at_unit_size(cloud: Floats) -> float:
    carriers, centre, radius = cloud[:1], cloud[0], 0.0
    while True:
        distances = np.linalg.norm(cloud - centre, axis=1)
        farthest = int(distances.argmax())
        if distances[farthest] <= radius * (1.0 + ROUNDING):
            return radius
        grown = _smallest_among_subsets(np.vstack([carriers, cloud[farthest]]))
        if not radius < grown[2] < np.inf:  # rounding is all that is left to gain
            return float(distances[farthest])
        carriers, centre, radius = grown


def _smallest_among_subsets(points: Floats) -> tuple[Floats, Floats, float]:
    """The carriers, centre and radius of the smallest sphere around at most five points."""
    best = (points, points[0], np.inf)
    for count in range(2, min(len(points), 4) + 1):
        for chosen in combinations(range(len(points)), count):
            carriers = points[list(chosen)]
            centre = _circumcentre(carriers)
            radius = float(np.linalg.norm(carriers[0] - centre))
            reach = float(np.linalg.norm(points - centre, axis=1).max())
            if reach <= radius * (1.0 + ROUNDING) and radius < best[2]:
                best = (carriers, centre, radius)
    return best


def _circumcentre(carriers: Floats) -> Floats:
    """The point of their affine hull that is equally far from all carriers."""
    edges = carriers[1:] - carriers[0]
    halves = 0.5 * np.einsum("ij,ij->i", edges, edges)
    offset: Floats = np.linalg.lstsq(edges, halves, rcond=None)[0]
    centre: Floats = carriers[0] + offset
    return centre
