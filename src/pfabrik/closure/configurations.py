"""Configurations found for a batch: what is told of them row by row, and the coordinates of all their joints."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Mask
from ..description.mechanism import Mechanism
from ..kernels.rows import INVALID, ITERATIONS, LIMIT_EXCESS, N_COUNTERS, PENDING, RESIDUAL, Rows
from .close import Closing, Closure, closure_of

Places: TypeAlias = NDArray[np.intp] | slice
"""Which rows of a batch."""

ROWS_A_CALL = 32
"""What it takes to find the coordinates of a part of a batch, besides those of its rows [rows]."""

STEPS_A_REPORT = 16
"""Steps along a path between two reports of progress."""


def new_rows(mechanism: Mechanism, n: int) -> Rows:
    """Room for n answers.

    All but the actuators, which callers keep, is one piece of memory: allocators hold on to about as much as was given
    back at once, and to get what is more anew, page by page, takes longer than to answer.
    """
    room, actuators = np.empty((25, n)), np.empty((n, len(mechanism.actuator_names)))
    room[16:] = 0.0
    counters, status = room[21:24].view(np.int64).reshape(n, N_COUNTERS), room[24].view(np.int64)
    status[:] = PENDING
    return Rows(status, counters, room[:16].reshape(n, 4, 4), actuators, room[16:21].reshape(n, 5))


def rows_at(rows: Rows, places: Any) -> Rows:
    """The rows at some places: an integer array (copied), a mask (copied) or a slice (shared)."""
    return Rows._make(array[places] for array in rows)


def put_rows(rows: Rows, places: Any, others: Rows) -> None:
    """Write other rows at some places."""
    for array, own in zip(rows, others, strict=True):
        array[places] = own


def steps_of(known: Mask, on_progress: Callable[[int, int], None] | None) -> Iterator[int]:
    """The steps of a path that are poses, one after the other; every few steps it is told how far it is."""
    for i, is_pose in enumerate(known.tolist()):
        if is_pose:
            yield i
        if on_progress is not None and ((i + 1) % STEPS_A_REPORT == 0 or i + 1 == len(known)):
            on_progress(i + 1, len(known))


def write_closing(closure: Closure, closing: Closing, rows: Rows) -> None:
    """Pose, actuators, loop gaps, limit excesses and iterations of closed configurations, into as many rows.

    A joint end effector has no orientation: home's is written.
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
    """What was found for a batch.

    Attributes
    ----------
    rows : status, pose, actuators and measures, row by row.
    coordinates : of all joints, deviations from home, (n, columns) [length or rad].
    were_given : whether the coordinates were what was searched for; else they follow from the rows when asked for.
    """

    def __init__(self, rows: Rows, coordinates: Floats | Callable[[Places], Floats]) -> None:
        """Coordinates that follow from the rows are those that a call gives for some places."""
        self.rows = rows
        self.were_given = not callable(coordinates)
        self._coordinates = coordinates
        self._taken = 0

    def __reduce__(self) -> tuple[Any, ...]:
        """As configurations whose coordinates were given: how they would be found is not pickled."""
        return type(self), (self.rows, self.coordinates)

    def __len__(self) -> int:
        return len(self.rows.status)

    @cached_property
    def coordinates(self) -> Floats:
        return self._coordinates(slice(None)) if callable(self._coordinates) else self._coordinates

    def coordinates_at(self, places: NDArray[np.intp]) -> Floats:
        """The coordinates at some places: of these alone, until parts have taken as long as the whole would."""
        if not callable(self._coordinates) or "coordinates" in vars(self):
            return self.coordinates[places]
        self._taken += len(places) + ROWS_A_CALL
        return self._coordinates(places) if self._taken < len(self) else self.coordinates[places]

    def at(self, places: NDArray[np.intp]) -> Configurations:
        """The configurations at some places, copied."""
        rows = Rows._make(np.ascontiguousarray(array[places]) for array in self.rows)
        if self.were_given:
            return Configurations(rows, self.coordinates[places])
        return Configurations(rows, lambda own: self.coordinates_at(places[own]))

    def with_rows(self, places: NDArray[np.intp], others: Configurations) -> Configurations:
        """These configurations with as many others at some places."""
        rows, coordinates = rows_at(self.rows, np.arange(len(self))), self.coordinates.copy()
        put_rows(rows, places, others.rows)
        coordinates[places] = others.coordinates
        return Configurations(rows, coordinates)

    def put(self, places: NDArray[np.intp], others: Configurations, rows: Mask) -> None:
        """Put some rows of other configurations in some places, in place."""
        put_rows(self.rows, places, rows_at(others.rows, rows))
        if self.were_given:
            self.coordinates[places] = others.coordinates[rows]

    def scatter(self, known: Mask) -> Configurations:
        """As many rows as `known` has, with these configurations where it is true, INVALID and NaN elsewhere."""
        if known.all():
            return self
        n = len(known)
        rows = Rows._make(_blank(array, n) for array in self.rows)
        rows.status[:] = INVALID
        put_rows(rows, known, self.rows)
        coordinates = _blank(self.coordinates, n)
        coordinates[known] = self.coordinates
        return Configurations(rows, coordinates)


def _blank(array: NDArray[Any], n: int) -> NDArray[Any]:
    """Room for n rows like those of an array: NaN, or 0 for integers."""
    return np.full((n, *array.shape[1:]), np.nan if array.dtype.kind == "f" else 0, array.dtype)


def joint_coordinates(mechanism: Mechanism, start: Configurations | None) -> Floats:
    """Joint coordinates to start from, (n, columns) or (1, columns), as deviations from home; home's are zero."""
    return np.zeros((1, len(closure_of(mechanism).scale))) if start is None else start.coordinates


def coordinates_for(mechanism: Mechanism, start: Configurations | None, n: int) -> Floats:
    """The same for each of n rows, (n, columns), copied."""
    coordinates = joint_coordinates(mechanism, start)
    return np.repeat(coordinates, 1 if start is not None and len(start) > 1 else n, axis=0)
