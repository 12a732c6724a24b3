"""What every answer of the study must keep: limits and closed loops, measured in three ways."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pfabrik import Solution, Status, closure_residual

from .feasible import worst_excess
from .tolerances import LIMIT, POSITION


class Feasibility(NamedTuple):
    """The worst of many answers.

    Attributes
    ----------
    failed : how many have no feasible configuration.
    limit_excess : what the answers say of themselves [L or rad].
    closure : `closure_residual`, by the closure engine [L].
    independent : excess over limits and gaps of loops by closed forms in NumPy [L or rad].
    """

    failed: int
    limit_excess: float
    closure: float
    independent: float

    @property
    def holds(self) -> bool:
        """Whether every limit is kept and every loop is closed."""
        kept = max(self.limit_excess, self.independent) <= LIMIT
        return not self.failed and kept and self.closure <= POSITION


def feasibility(solution: Solution) -> Feasibility:
    """The worst of a batch of answers."""
    mechanism = solution.mechanism
    return Feasibility(
        failed=int((np.asarray(solution.status) >= Status.FAILED).sum()),
        limit_excess=float(np.max(solution.limit_excess)),
        closure=float(np.max(closure_residual(solution)) / mechanism.characteristic_length),
        independent=float(worst_excess(solution).max()),
    )
