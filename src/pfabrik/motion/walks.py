"""Walks from a configuration along motions that the loops allow or hardly resist."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..derived import derived
from ..description.home_mobility import column_joints
from ..description.mechanism import Mechanism
from ..tolerances import TOLERANCES
from .displacements import gaps
from .joint_rates import actuated_columns, first_order, loop_errors_here, loop_slopes, moved, right_singular

SAMPLES, STEPS, STEP = 8, 3, 0.1
"""Number of walks from home to generic configurations, steps of a walk, largest joint motion of a step [rad or L]."""
NEWTON_STEPS = 20
"""Most steps to close the loops after a step of a walk; a walk that needs more is left out."""


@derived
def around_home(mechanism: Mechanism) -> Floats:
    """Home and closed configurations some steps away from it, (n, c), the same in every call."""
    random = np.random.default_rng(0)
    q = np.zeros((SAMPLES, len(column_joints(mechanism))))
    for _ in range(STEPS):
        conditions, _ = first_order(mechanism, q)
        step = random.standard_normal(q.shape)
        step -= np.einsum("nij,nj->ni", np.linalg.pinv(conditions, TOLERANCES.alignment) @ conditions, step)
        largest = np.abs(step).max(axis=1, keepdims=True)
        q = _closed(mechanism, moved(mechanism, q, STEP * step / np.maximum(largest, TOLERANCES.alignment)))
    closed = gaps(mechanism, q) <= TOLERANCES.position * mechanism.characteristic_length
    return np.concatenate([np.zeros((1, q.shape[1])), q[closed]])


def _closed(mechanism: Mechanism, q: Floats) -> Floats:
    """Close the loops by Gauss-Newton steps of the smallest joint motions, and take one more step when they are closed.

    Directions in which the loops hardly resist are not corrected, so that a walk may start in a singularity.
    """
    for _ in range(NEWTON_STEPS):
        open_gaps = gaps(mechanism, q) / mechanism.characteristic_length
        inverses = np.linalg.pinv(loop_slopes(mechanism, q), TOLERANCES.alignment)
        step = np.einsum("nij,nj->ni", inverses, -loop_errors_here(mechanism, q))
        q = moved(mechanism, q, step)
        if (open_gaps <= TOLERANCES.position).all():
            break
    return q


def stepped_freely(mechanism: Mechanism, q: Floats, step: float) -> Floats:
    """Coordinates (k, c) after a step from q (c,) along each free motion.

    A free motion moves the end effector with locked actuators; the loops resist it, to first order, by less than
    `TOLERANCES.singular`. The caller tests whether it is a finite motion.

    Parameters
    ----------
    step : of the end effector [L or rad].
    """
    closure, twist = first_order(mechanism, q[None])
    free = np.setdiff1d(np.arange(q.size), actuated_columns(mechanism))
    values, right = right_singular(closure[..., free])
    motions = right[0, np.count_nonzero(values > TOLERANCES.singular) :].T
    _, sizes, axes = np.linalg.svd(twist[0][:, free] @ motions, full_matrices=False)
    shown = sizes > TOLERANCES.singular
    rates = np.zeros((int(shown.sum()), q.size))
    rates[:, free] = axes[shown] @ motions.T / sizes[shown, None]
    return moved(mechanism, np.repeat(q[None], len(rates), axis=0), step * rates)
