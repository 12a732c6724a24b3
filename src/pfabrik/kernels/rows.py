"""Results of a batch, row by row: filled by kernels, read by Python."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..common.arrays import Floats, Ints, Mask

# Status of a row, numbered as the public Status.
REACHED, PROJECTED, EXCEEDED, FAILED, INVALID, PENDING = 0, 1, 2, 3, 4, 9
# Intermediate: within reach, but legs close only once the unset coordinates are completed, if at all; and solved to
# half the digits, for a leg is at a dead point; and within reach, but with links that are too near.
OPEN, UNSURE, TOO_NEAR = 8, 10, 11
# Held part of the target in a projection.
HOLD_NOTHING, HOLD_ORIENTATION, HOLD_POSITION = 0, 1, 2
# Added to it if a certificate proves that no feasible pose is nearer.
CERTAIN = 4
# Columns of Rows.counters, and of Rows.measures.
ITERATIONS, ROUNDS, HOLD, N_COUNTERS = 0, 1, 2, 3
POSITION_ERROR, ROTATION_ERROR, RESIDUAL, LIMIT_EXCESS, ACTUATOR_ERROR = 0, 1, 2, 3, 4
# Upper bound of position errors: finite, however far the target.
LARGEST_NUMBER = 1.7976931348623157e308


class Rows(NamedTuple):
    """Results of a batch."""

    status: Ints  # (n,)
    counters: Ints  # (n, N_COUNTERS): iterations, rounds, held part of a projection (HOLD_...)
    poses: Floats  # (n, 4, 4)
    actuators: Floats  # (n, n_actuators)
    measures: Floats  # (n, 5): position error, rotation error, residual, limit excess, actuator error

    @property
    def holds(self) -> Ints:
        """Held parts of projections, (n,): HOLD_..."""
        return self.counters[:, HOLD] % CERTAIN

    @property
    def certain(self) -> Mask:
        """True where a certificate proves that no feasible pose is nearer than the projection, (n,)."""
        return np.asarray(self.counters[:, HOLD] >= CERTAIN)
