"""A configuration of the caller's own: is it closed, and within its limits?"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .answers.solution import Solution
from .answers.starts import joint_vectors
from .answers.status import Status
from .closure.close import CLOSED, measure_configurations
from .description.mechanism import Mechanism
from .engine import engine_of


def configuration(mechanism: Mechanism, q: ArrayLike) -> Solution:
    """The configuration at given joint coordinates, measured and not changed.

    Parameters
    ----------
    q : all joint coordinates (..., nq), in the order of `mechanism.coordinate_names` [rad or length], counted as the
        description counts them.

    Returns
    -------
    Solution : REACHED where all loops are closed and every limit is kept; EXCEEDED where a limit is not, which
        `active_limits` names; FAILED where loops are open, by `residual`. Errors are 0: nothing else was asked for.

    Raises
    ------
    InvalidArgument : coordinates of the wrong shape, or not finite.
    """
    deviations, shape = joint_vectors(mechanism, q, "q")
    closing = measure_configurations(mechanism, deviations)
    found = engine_of(mechanism).as_configurations(closing)
    within = np.where(closing.feasible, Status.REACHED, Status.EXCEEDED)
    found.rows.status[:] = np.where(closing.gap <= CLOSED, within, Status.FAILED)
    return Solution(mechanism, found, shape)
