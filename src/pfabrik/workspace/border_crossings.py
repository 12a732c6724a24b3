"""Where lines from points within reach to points beyond cross the border."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints, Mask
from .measuring import Measure

MOST_LOOKS = 40
"""Largest number of points measured on an edge; bisection alone takes ten."""


def crossings(
    measure: Measure, inner: Floats, outer: Floats, inside: Floats, outside: Floats, close: float
) -> tuple[Floats, Ints]:
    """The last points within on lines from points within to points beyond, (n, d), and the limits exceeded next, (n,).

    Parameters
    ----------
    inside, outside : the margins at both ends, (n,).
    close : their accuracy [share of the way].
    """
    near, far = np.zeros(len(inner)), np.ones(len(inner))
    inside, outside = inside.copy(), outside.copy()
    limits, halve = np.full(len(inner), -1), np.zeros(len(inner), bool)
    rows = np.arange(len(inner))
    for _ in range(MOST_LOOKS):
        rows = rows[far[rows] - near[rows] > close]
        if not len(rows):
            break
        width = far[rows] - near[rows]
        at = near[rows] + width * _share(inside[rows], outside[rows], halve[rows], close / width)
        margins, binding = measure(inner[rows] + at[:, None] * (outer - inner)[rows])
        kept = margins >= 0.0
        near[rows[kept]], inside[rows[kept]] = at[kept], margins[kept]
        far[rows[~kept]], outside[rows[~kept]] = at[~kept], margins[~kept]
        limits[rows[~kept]] = binding[~kept]
        halve[rows] = far[rows] - near[rows] > 0.5 * width
    unknown = np.flatnonzero(limits < 0) if measure.question.has_margins else np.arange(len(inner))
    if len(unknown):
        limits[unknown] = measure.name_limits((inner + far[:, None] * (outer - inner))[unknown])
    return inner + near[:, None] * (outer - inner), limits


def _share(inside: Floats, outside: Floats, halve: Mask, close: Floats) -> Floats:
    """The share of the way to measure next: half, or just beyond the zero of linearly interpolated margins."""
    with np.errstate(invalid="ignore"):
        even = inside / (inside - outside)
    usable = np.isfinite(even) & ~halve
    beyond = np.where(even < 0.5, 0.45, -0.45) * close
    return np.asarray(np.where(usable, np.clip(even + beyond, 0.4 * close, 1.0 - 0.4 * close), 0.5))
