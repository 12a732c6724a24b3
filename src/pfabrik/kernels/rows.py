"""The answers of a batch, row by row: what kernels fill and Python reads."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Floats, Ints, Mask

# Status of a row; the same numbers as the public Status.
REACHED, PROJECTED, EXCEEDED, FAILED, INVALID, PENDING = 0, 1, 2, 3, 4, 9
# Of rows on their way: within reach, but legs close only once what the target leaves open is completed, if they do; and
# reached by some leg at a dead point, as far as can be told.
OPEN, UNSURE = 8, 10
# What a projection holds.
HOLD_NOTHING, HOLD_ORIENTATION, HOLD_POSITION = 0, 1, 2
# Added to that where it is certain that no feasible pose is nearer.
CERTAIN = 4
# Columns of Rows.counters, and of Rows.measures.
ITERATIONS, ROUNDS, HOLD, N_COUNTERS = 0, 1, 2, 3
POSITION_ERROR, ROTATION_ERROR, RESIDUAL, LIMIT_EXCESS, ACTUATOR_ERROR = 0, 1, 2, 3, 4


class Rows(NamedTuple):
    """The answers of a batch."""

    status: Ints  # (n,)
    counters: Ints  # (n, N_COUNTERS): iterations, rounds, what a projection held (HOLD_...)
    poses: Floats  # (n, 4, 4)
    actuators: Floats  # (n, n_actuators)
    measures: Floats  # (n, 5): position error, rotation error, residual, limit excess, actuator error

    @property
    def holds(self) -> Ints:
        """What projections hold, (n,): HOLD_..."""
        return self.counters[:, HOLD] % CERTAIN

    @property
    def certain(self) -> Mask:
        """Whether it is certain that no feasible pose is nearer than a projection, (n,)."""
        return np.asarray(self.counters[:, HOLD] >= CERTAIN)
