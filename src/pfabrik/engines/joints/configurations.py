"""Solutions of a batch: their rows of results, and the coordinates of all joints."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ...common.arrays import Floats, Mask
from ...common.batch import aligned, joined, put, take
from ...kernels.rows import INVALID, ITERATIONS, LIMIT_EXCESS, N_COUNTERS, PENDING, RESIDUAL, Rows
from ...machine.model import Model
from ...machine.motion.loops import Closure
from ...tolerances import TOLERANCES
from .close import Closing

Places: TypeAlias = NDArray[np.intp] | slice
"""Indices of rows of a batch."""

ROWS_A_CALL = 32
"""Overhead of computing the coordinates of a part of a batch, as a number of rows."""

STEPS_A_REPORT = 16
"""Steps along a path between two reports of progress."""


def new_rows(model: Model, n: int) -> Rows:
    """Allocate n results.

    All but the actuators, which callers keep, share one block of memory: allocators retain about as much as was freed
    at once, and requesting more, page by page, takes longer than solving.
    """
    block, actuators = np.empty((25, n)), np.empty((n, len(model.mechanism.actuator_names)))
    block[16:] = 0.0
    counters, status = block[21:24].view(np.int64).reshape(n, N_COUNTERS), block[24].view(np.int64)
    status[:] = PENDING
    return Rows(status, counters, block[:16].reshape(n, 4, 4), actuators, block[16:21].reshape(n, 5))


def steps_of(is_valid: Mask, on_progress: Callable[[int, int], None] | None) -> Iterator[int]:
    """Yield the indices of a path's valid targets, and report progress every few steps."""
    for i, is_pose in enumerate(is_valid.tolist()):
        if is_pose:
            yield i
        if on_progress is not None and ((i + 1) % STEPS_A_REPORT == 0 or i + 1 == len(is_valid)):
            on_progress(i + 1, len(is_valid))


def write_closing(closure: Closure, closing: Closing, rows: Rows) -> None:
    """Write pose, actuators, loop gap, limit excess and iterations of closed configurations into as many rows.

    A joint end effector has no orientation; that of home is written.
    """
    mechanism = closure.mechanism
    rows.poses[:] = closing.poses
    if mechanism.end_effector_is_joint:
        rows.poses[:, :3, :3] = np.eye(3)
    rows.actuators[:] = closure.actuators(closing.coordinates)
    rows.counters[:] = 0
    rows.counters[:, ITERATIONS] = closing.iterations
    rows.measures[:] = 0.0
    rows.measures[:, RESIDUAL] = closing.gap * mechanism.characteristic_length
    rows.measures[:, LIMIT_EXCESS] = np.maximum(closing.excess, 0.0)


class Configurations:
    """The solutions of a batch.

    Attributes
    ----------
    rows : status, pose, actuators and measures, row by row.
    coordinates : of all joints, deviations from home, (n, columns) [length or rad].
    were_given : True if the coordinates were computed by the solver; else they are computed from the rows on access.
    """

    def __init__(self, rows: Rows, coordinates: Floats | Callable[[Places], Floats]) -> None:
        """Wrap rows with their coordinates, or with a function that computes those of some places."""
        self.rows = rows
        self.were_given = not callable(coordinates)
        self._coordinates = coordinates
        self._taken = 0

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle with coordinates, not with the function that computes them."""
        return restored, (type(self), self.rows, self.coordinates)

    def __len__(self) -> int:
        return len(self.rows.status)

    @property
    def coordinates(self) -> Floats:
        if callable(self._coordinates):
            self._coordinates = self._coordinates(slice(None))
        return self._coordinates

    def coordinates_at(self, places: NDArray[np.intp]) -> Floats:
        """The coordinates at some places; all are computed once parts have cost as much as the whole batch would."""
        if not callable(self._coordinates):
            return self._coordinates[places]
        self._taken += len(places) + ROWS_A_CALL
        return self._coordinates(places) if self._taken < len(self) else self.coordinates[places]

    @property
    def is_within_limits(self) -> Mask:
        """True for configurations that keep every limit, by their measures, (n,)."""
        return np.asarray(self.rows.measures[:, LIMIT_EXCESS] <= TOLERANCES.limit)

    def at(self, places: NDArray[np.intp]) -> Configurations:
        """The configurations at some places, copied."""
        rows = take(self.rows, places)
        if self.were_given:
            return Configurations(rows, self.coordinates[places])
        return Configurations(rows, lambda selected: self.coordinates_at(places[selected]))

    def with_rows(self, places: NDArray[np.intp], source: Configurations) -> Configurations:
        """A copy with other configurations at some places."""
        if len(places) == len(self):
            return source
        rows, coordinates = take(self.rows, np.arange(len(self))), self.coordinates.copy()
        put(rows, places, source.rows)
        coordinates[places] = source.coordinates
        return Configurations(rows, coordinates)

    def followed_by(self, others: Sequence[Configurations]) -> Configurations:
        """These configurations, and after them those of other batches."""
        every = [self, *others]
        return Configurations(
            joined([each.rows for each in every]), np.concatenate([each.coordinates for each in every])
        )

    def put(self, places: NDArray[np.intp], source: Configurations, rows: Mask) -> None:
        """Write some rows of other configurations at some places."""
        put(self.rows, places, take(source.rows, rows))
        if self.were_given:
            self.coordinates[places] = source.coordinates[rows]

    def scatter(self, mask: Mask) -> Configurations:
        """A batch of the size of the mask: these configurations where it is true, INVALID and NaN elsewhere."""
        if mask.all():
            return self
        n = len(mask)
        rows = Rows._make(_blank(array, n) for array in self.rows)
        rows.status[:] = INVALID
        put(rows, mask, self.rows)
        coordinates = _blank(self.coordinates, n)
        coordinates[mask] = self.coordinates
        return Configurations(rows, coordinates)


def restored(kind: type[Configurations], *state: Any) -> Configurations:
    """Configurations that were pickled."""
    return kind(*map(aligned, state))


def _blank(array: NDArray[Any], n: int) -> NDArray[Any]:
    """Allocate n rows like those of an array, filled with NaN, or with 0 for integers."""
    return np.full((n, *array.shape[1:]), np.nan if array.dtype.kind == "f" else 0, array.dtype)


def joint_coordinates(model: Model, start: Configurations | None) -> Floats:
    """Joint coordinates of the start, (n, columns) or (1, columns), as deviations from home; zero without a start."""
    return np.zeros((1, len(model.mechanism.coordinates))) if start is None else start.coordinates


def coordinates_for(model: Model, start: Configurations | None, n: int) -> Floats:
    """A copy of the joint coordinates of the start, one row for each of n targets, (n, columns)."""
    coordinates = joint_coordinates(model, start)
    return np.repeat(coordinates, 1 if start is not None and len(start) > 1 else n, axis=0)
