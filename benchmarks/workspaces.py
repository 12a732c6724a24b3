"""What workspaces cost: points, a hexapod at a millimetre, the angles of an ankle."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import pfabrik as pf
from table import Row
from timing import best_times


def workspaces(rng: np.random.Generator, runs: int, n: int) -> Iterator[Row]:
    """On all cores; times of whole workspaces are for all of it."""
    hexapod = pf.load("stewart")
    coarse = pf.workspace(hexapod, resolution=6.0)
    points = rng.uniform(*coarse.bounds, (n, 3))
    (seconds,) = best_times(runs, lambda: coarse.contains(points))
    yield Row("6-UPS, points asked whether a workspace contains them", n, seconds / n)
    (seconds,) = best_times(min(runs, 3), lambda: pf.workspace(hexapod, resolution=1.0))
    yield Row("6-UPS, workspace at 1 mm (L/129), closed mesh", 1, seconds)
    ankle = pf.workspace(pf.load("ankle_ups"))
    first, second = ankle.bounds.T
    angles = np.stack(np.meshgrid(np.linspace(*first, 101), np.linspace(*second, 101)), axis=-1)
    (seconds,) = best_times(runs, lambda: ankle.contains(angles))
    yield Row("2-UPS/U, map of 101 x 101 angles", 1, seconds)
    (seconds,) = best_times(runs, lambda: pf.workspace(ankle.mechanism))
    yield Row("2-UPS/U, workspace over both angles at 0.01 rad", 1, seconds)
