"""The smallest sphere around a set of points."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ...kernels import enclosing as K


def enclosing_radius(points: ArrayLike) -> float:
    """Radius of the smallest sphere that contains all points.

    Parameters
    ----------
    points : finite positions, shape (n, 3), any length unit; n may be 0.

    Returns
    -------
    The radius, in the unit of the points; 0 for no points or coincident ones.
    """
    numbers: list[float] = np.asarray(points, dtype=float).ravel().tolist()
    places: list[int] = [0] * K.N_PLACES
    return K.enclosing_radius(numbers, len(numbers) // 3, numbers.copy(), places, [0.0] * 4, [0.0] * 4)
