"""How redundant actuators share a load within their limits: cables that only pull, motors that only exert so much."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Mask
from ..tolerances import TOLERANCES

ROUNDS = 5000
"""Projections by which forces come within limits: far from corners tens do."""


def within_limits(forces: Floats, rates: Floats, limits: Floats) -> tuple[Floats, Floats, Mask]:
    """The forces (n, n_a) within limits that do the same work on all motions, nearest to the middle of the limits.

    Projected in turn on the forces that do the work and on those within limits (Dykstra's algorithm), the middle comes
    to the point of both that is nearest to it. Where a limit is infinite, it is the allowed force nearest to 0.

    Parameters
    ----------
    forces : that do the work, (n, n_a).
    rates : of the actuators, by motions, (n, n_a, d).
    limits : lowest and highest forces, (n_a, 2).

    Returns
    -------
    The forces; how far the nearest that do the work are beyond limits, signed, (n, n_a); and a mask of rows with forces
    that are not, (n,): others keep those given.
    """
    low, high = limits.T
    is_bounded = np.isfinite(limits).all(axis=1)
    with np.errstate(invalid="ignore"):
        middle = np.where(is_bounded, 0.5 * (low + high), np.clip(0.0, low, high))
    working = rates @ np.linalg.pinv(rates, rcond=TOLERANCES.singular)
    found, owed = np.tile(middle, (len(forces), 1)), np.zeros(forces.shape)
    size = np.maximum(np.abs(forces).max(axis=1, initial=0.0), np.abs(middle).max(initial=0.0))
    on, is_within = forces, np.zeros(len(forces), bool)
    for _ in range(ROUNDS):
        on = found + (working @ (forces - found)[..., None])[..., 0]
        found = np.clip(on + owed, low, high)
        owed = owed + on - found
        is_within = np.abs(on - found).max(axis=1, initial=0.0) <= TOLERANCES.rank * size
        if is_within.all():
            break
    return np.where(is_within[:, None], on, forces), on - found, is_within
