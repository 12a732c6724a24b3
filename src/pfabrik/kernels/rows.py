"""The answers of a batch, row by row: what kernels fill and Python reads."""

from __future__ import annotations

from typing import NamedTuple

from ..arrays import Floats, Ints

# Status of a row; the same numbers as the public Status.
REACHED, PROJECTED, EXCEEDED, FAILED, INVALID, PENDING = 0, 1, 2, 3, 4, 9
# Of rows on their way: within reach, but legs close only once what the target leaves open is completed, if they do; and
# reached by some leg at a dead point, as far as can be told.
OPEN, UNSURE = 8, 10
# What a projection holds.
HOLD_NOTHING, HOLD_ORIENTATION, HOLD_POSITION = 0, 1, 2
# Columns of Rows.counters, and of Rows.measures.
ITERATIONS, ROUNDS, HOLD, CERTIFIED, N_COUNTERS = 0, 1, 2, 3, 4
POSITION_ERROR, ROTATION_ERROR, RESIDUAL, LIMIT_EXCESS, ACTUATOR_ERROR = 0, 1, 2, 3, 4


class Rows(NamedTuple):
    """The answers of a batch."""

    status: Ints  # (n,)
    counters: Ints  # (n, N_COUNTERS): iterations, rounds, what is held (HOLD_...), 1 where none is nearer for certain
    poses: Floats  # (n, 4, 4)
    actuators: Floats  # (n, n_actuators)
    measures: Floats  # (n, 5): position error, rotation error, residual, limit excess, actuator error
