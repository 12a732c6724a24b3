"""The configuration at given joint coordinates, with its loop gaps and limits measured."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .answers.solution import Solution
from .answers.start_configuration import joint_vectors
from .answers.status import Status
from .engines.engine import engine_of
from .engines.joints.close import CLOSED, measure_configurations
from .machine.description.mechanism import Mechanism
from .machine.model import model_of


def configuration(mechanism: Mechanism, q: ArrayLike) -> Solution:
    """The configuration at given joint coordinates: measured, not changed.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    q : array (..., nq)
        All joint coordinates, in the order of `mechanism.coordinate_names` [rad or length], with the zeros of the
        description.

    Returns
    -------
    Solution
        REACHED if all loops are closed and every limit is kept; EXCEEDED if a limit is exceeded, which `active_limits`
        names; FAILED if loops are open, by `residual`. Errors are 0, as there is no target.

    Raises
    ------
    InvalidArgument
        Coordinates of the wrong shape, or not finite.
    """
    deviations, shape = joint_vectors(mechanism, q, "q")
    closing = measure_configurations(model_of(mechanism), deviations)
    configurations = engine_of(mechanism).as_configurations(closing)
    within = np.where(configurations.is_within_limits, Status.REACHED, Status.EXCEEDED)
    configurations.rows.status[:] = np.where(closing.gap <= CLOSED, within, Status.FAILED)
    return Solution(mechanism, configurations, shape)
