"""Results of a map: values, and whether they are the requested ones."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from ..answers.active_limits import ActiveLimit
from ..answers.solution import Solution
from ..answers.status import Status
from ..arrays import Floats, Ints


class Mapped:
    """Coordinates of actuators or joints that a map gives; `numpy.asarray` of it is `values`.

    Attributes
    ----------
    values : the coordinates, (..., n) [rad or length]. Of rows that are not REACHED, of the nearest feasible pose.
    status : a `Status`; for a batch an integer array of them, (...,).
    """

    def __init__(self, values: Floats, status: Any, solve: Callable[[], Solution]) -> None:
        self.values, self._solve = values, solve
        self.status: Status | Ints = Status(status) if np.ndim(status) == 0 else status

    @cached_property
    def solution(self) -> Solution:
        """The configurations, as answers of `solve_ik` or `solve_fk`."""
        return self._solve()

    @property
    def active_limits(self) -> tuple[ActiveLimit, ...] | list[tuple[ActiveLimit, ...]]:
        """The limits that block rows; see `Solution.active_limits`."""
        return self.solution.active_limits

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Floats:
        return np.array(self.values, dtype=dtype) if copy or dtype is not None else self.values

    def __bool__(self) -> bool:
        return bool(np.all(np.asarray(self.status) == Status.REACHED))

    def __repr__(self) -> str:
        if isinstance(self.status, Status):
            return f"<Mapped {self.status.name}: {self.values.tolist()}>"
        missed = int(np.count_nonzero(np.asarray(self.status) != Status.REACHED))
        return f"<Mapped, shape {self.values.shape}: {missed} not reached>"
