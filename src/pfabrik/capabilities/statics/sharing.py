"""How redundant actuators share a load within their limits: cables that only pull, motors that only exert so much."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Floats, Mask
from ...tolerances import TOLERANCES

MOST_STEPS, MOST_HALVINGS = 60, 40
"""Newton's steps, of which some ten suffice, and the halvings of each."""

GIVE = 1e-10
"""How far work may give way per force: with it there is an answer where no forces within limits do the work."""


def within_limits(forces: Floats, rates: Floats, limits: Floats) -> tuple[Floats, Floats, Mask]:
    """The forces (n, n_a) within limits that do the same work on all motions, nearest to the middle of the limits.

    Where a limit is infinite, the middle is the allowed force nearest to 0. Forces t = clip(middle + U y) do the work
    U't = U'forces, with U an orthonormal basis of what motions ask of actuators, where the convex function

        sum h(middle + U y) - y . U'forces,    h' = clip,

    is least: by Newton's steps, for it is a parabola wherever the same forces are at a limit.

    Parameters
    ----------
    forces : that do the work, (n, n_a).
    rates : of the actuators, by motions, (n, n_a, d).
    limits : lowest and highest forces, (n_a, 2).

    Returns
    -------
    The forces, those that are nearest to the limits where none are within; how far they are beyond, signed, (n, n_a);
    and a mask of rows with forces within, (n,).
    """
    low, high = limits.T
    with np.errstate(invalid="ignore"):
        middle = np.where(np.isfinite(limits).all(axis=1), 0.5 * (low + high), np.clip(0.0, low, high))
    left, sizes, _ = np.linalg.svd(rates, full_matrices=False)
    basis = left * (sizes > TOLERANCES.singular * sizes[:, :1])[:, None]
    asked = np.einsum("nad,na->nd", basis, forces)
    y = np.zeros(asked.shape)

    def at(y: Floats) -> tuple[Floats, Floats, Floats]:
        """The forces before limits and within them, (n, n_a), and the function, (n,)."""
        free = middle + np.einsum("nad,nd->na", basis, y)
        kept = np.clip(free, low, high)
        return free, kept, (kept * (free - 0.5 * kept)).sum(axis=1) - (y * (asked - 0.5 * GIVE * y)).sum(axis=1)

    free, kept, value = at(y)
    for _ in range(MOST_STEPS):
        slope = np.einsum("nad,na->nd", basis, kept) - asked + GIVE * y
        inner = basis * ((free > low) & (free < high))[..., None]
        bend = np.swapaxes(inner, -1, -2) @ inner + GIVE * np.eye(y.shape[1])
        step = -np.linalg.solve(bend, slope[..., None])[..., 0]
        falls, share = (slope * step).sum(axis=1), np.ones(len(y))
        for _ in range(MOST_HALVINGS):
            free, kept, lower = at(y + share[:, None] * step)
            is_steep = lower > value + 1e-4 * share * falls + 1e-15 * np.abs(value)
            if not is_steep.any():
                break
            share[is_steep] *= 0.5
        y, value = y + share[:, None] * step, lower
        if (np.abs(step).max(axis=1, initial=0.0) * share <= 1e-14 * (1.0 + np.abs(y).max(axis=1, initial=0.0))).all():
            break
    on = kept + np.einsum("nad,nd->na", basis, asked - np.einsum("nad,na->nd", basis, kept))
    beyond = on - np.clip(on, low, high)
    size = np.maximum(np.abs(forces).max(axis=1, initial=0.0), np.abs(middle).max(initial=0.0))
    is_within = np.abs(beyond).max(axis=1, initial=0.0) <= TOLERANCES.speed * size
    return on, beyond, is_within
