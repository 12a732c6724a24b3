"""Targets that legs reach once their arms have moved: as little as limits ask for."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..decomposition.leg_table import LegTable
from ..description.mechanism import Mechanism
from .approach import starts_at
from .nearest import nearest_arms


def move_arms(
    mechanism: Mechanism,
    table: LegTable,
    targets: Floats,
    begins: Floats,
    sides: Floats,
    places: NDArray[np.intp],
) -> tuple[NDArray[np.intp], Floats]:
    """Move the arms of some rows to where legs reach their targets within all limits, as little as can be.

    Parameters
    ----------
    targets, begins : (n, 4, 4) and (n or 1, 4, 4) [length].
    sides : where arms are, (n, legs), and where they go.
    places : the rows that are asked for.

    Returns
    -------
    The rows for which there is such a place, and the poses that the searches ended at, (rows, 4, 4) [length].
    """
    own = starts_at(mechanism, table, begins if len(begins) == 1 else begins[places], sides[places])
    found = nearest_arms(mechanism, table, targets[places], own)
    placed = np.isfinite(found.distances)
    sides[places[placed]] = found.sides[placed]
    return places[placed], found.poses[placed]
