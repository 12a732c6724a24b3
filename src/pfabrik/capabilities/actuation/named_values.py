"""Arguments and results of maps: coordinates, vectors and values of actuators, checked."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from ...answers.active_limits import ActiveLimit
from ...answers.solution import Solution
from ...answers.status import Status
from ...common.arguments import array, is_not_negative
from ...common.arrays import Floats, Ints
from ...errors import InvalidArgument
from ...machine.description.mechanism import Mechanism
from ...tolerances import TOLERANCES
from .task_path import Coordinates


def inverses(matrices: Floats) -> Floats:
    """Moore-Penrose inverses (..., k, n) of matrices (..., n, k), n >= k; what is singular is left out.

    By (A'A)^-1 A' for tall matrices would square the condition: square ones are inverted, all others decomposed.
    """
    n, k = matrices.shape[-2:]
    if n != k:
        return np.asarray(np.linalg.pinv(matrices, rcond=TOLERANCES.rank), float)
    rows = matrices.reshape(-1, n, n)
    sizes = np.linalg.norm(rows, axis=2).prod(axis=1)
    is_regular = np.abs(np.linalg.det(rows)) > REGULAR * sizes
    found = np.empty_like(rows)
    found[is_regular] = np.linalg.inv(rows[is_regular])
    found[~is_regular] = np.linalg.pinv(rows[~is_regular], rcond=TOLERANCES.rank)
    return found.reshape(matrices.shape)


REGULAR = 1e-6
"""Determinant by the product of its rows' lengths above which a matrix is inverted at once, with ten digits or so."""


class Mapped:
    """Coordinates of actuators or joints that a map gives; `numpy.asarray` of it is `values`.

    Attributes
    ----------
    values : array (..., n)
        The coordinates [rad or length]. Of rows that are not REACHED, those of the nearest feasible pose.
    status : Status or array of int (...)
        The `Status`; for a batch an integer array of them.
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


def rows_of(names: Sequence[str], q: Any) -> tuple[Floats, tuple[int, ...]]:
    """Coordinates as rows (n, k), and the batch shape they came in."""
    values = vectors_of("q", q, names)
    return np.ascontiguousarray(values.reshape(-1, len(names))), values.shape[:-1]


def vectors_of(name: str, given: Any, names: Sequence[str]) -> Floats:
    """Finite vectors (..., n), one number for each name."""
    return array(name, given, f"... {len(names)}", "finite values", f": {', '.join(names)}")


def per_actuator(names: Sequence[str], name: str, given: Any) -> Floats:
    """Values that are not negative, one for each actuator, (n_a,)."""
    shape, note = f"() | {len(names)}", f": {', '.join(names)}"
    values = array(name, given, shape, "numbers that are not negative", note, is_not_negative)
    return np.array(np.broadcast_to(values, (len(names),)))


def speeds_of(mechanism: Mechanism, given: Any) -> Floats:
    """Highest speeds of actuators, (n_a,): given, or those of the mechanism's joints."""
    if given is not None:
        return per_actuator(mechanism.actuator_names, "speed_max", given)
    speeds = []
    for drive in mechanism.drives:
        rate = drive.said("max_speed")
        if rate is None:
            raise InvalidArgument("speed_max", f"None, and no max_speed of '{drive.name}'", "speeds of actuators")
        speeds.append(rate)
    return np.array(speeds)


def box_of(coordinates: Coordinates, box: Any) -> tuple[Floats, Floats]:
    """Lowest and highest coordinates, (k,) each: of a box (2, k), or the joints' ranges."""
    expected = f": lowest and highest {', '.join(coordinates.names)}"
    if box is None:
        low, high = coordinates.low, coordinates.high
        endless = [name for name, size in zip(coordinates.names, high - low, strict=True) if not np.isfinite(size)]
        if endless:
            raise InvalidArgument("box", f"None, and no range of {', '.join(endless)}", f"finite numbers{expected}")
        return low, high
    values = array("box", box, f"2 {len(coordinates.names)}", note=expected)
    if (values[0] > values[1]).any():
        raise InvalidArgument("box", str(values.tolist())[:80], f"finite numbers{expected}")
    return values[0], values[1]
