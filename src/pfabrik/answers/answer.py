"""The fields of an answer: a status, a configuration that is feasible, and what was measured of it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any, Literal, NamedTuple, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Ints, shaped
from ..closure.configurations import Configurations
from ..closure.projection import projection_modes
from ..description.mechanism import Mechanism
from ..engine import engine_of
from ..frozen import FrozenMapping
from ..kernels.rows import (
    ACTUATOR_ERROR,
    HOLD_NOTHING,
    ITERATIONS,
    LIMIT_EXCESS,
    POSITION_ERROR,
    RESIDUAL,
    ROTATION_ERROR,
    ROUNDS,
    Rows,
)
from ..motion.displacements import columns, home_coordinates
from .limits import ActiveLimit, active_limits, binding_limits, holding_limits, is_held_by_others
from .status import Status

Held: TypeAlias = Literal["orientation", "position"] | None
"""What of its target a projected answer has."""


class PoseRequest(NamedTuple):
    """Poses that were asked for, (n, 4, 4), and how the distance from them counts; see `Options`."""

    targets: Floats
    hold: str | None
    rotation_length: float | None


class Answer:
    """The fields of a `Solution`, which says what they are; what puts them into words or pictures reads these."""

    def __init__(
        self, mechanism: Mechanism, found: Configurations, shape: tuple[int, ...], wanted: PoseRequest | None = None
    ) -> None:
        """Wrap configurations, as many as the batch shape has; `wanted` are the poses asked for, if any are missed."""
        self.mechanism = mechanism
        self.shape = shape
        self._configurations = found
        self._request = wanted

    def __getstate__(self) -> tuple[Mechanism, Configurations, tuple[int, ...], PoseRequest | None]:
        """What an answer is made of; all else follows again where it is unpickled."""
        return self.mechanism, self._configurations, self.shape, self._request

    def __setstate__(self, state: tuple[Mechanism, Configurations, tuple[int, ...], PoseRequest | None]) -> None:
        Answer.__init__(self, *state)

    @property
    def _rows(self) -> Rows:
        return self._configurations.rows

    @property
    def _coordinates(self) -> Floats:
        """All joint coordinates as deviations from home, row by row, (n, columns) [length or rad]."""
        return self._configurations.coordinates

    def _shaped(self, array: NDArray[Any]) -> Any:
        return shaped(array, self.shape)

    @property
    def status(self) -> Status | Ints:
        return Status(int(self._rows.status[0])) if self.shape == () else self._rows.status.reshape(self.shape)

    @property
    def pose(self) -> Floats:
        return cast(Floats, self._shaped(self._rows.poses))

    @property
    def actuators(self) -> Floats:
        return cast(Floats, self._shaped(self._rows.actuators))

    @property
    def position_error(self) -> float | Floats:
        return cast(float | Floats, self._shaped(self._rows.measures[:, POSITION_ERROR]))

    @property
    def rotation_error(self) -> float | Floats:
        return cast(float | Floats, self._shaped(self._rows.measures[:, ROTATION_ERROR]))

    @property
    def residual(self) -> float | Floats:
        return cast(float | Floats, self._shaped(self._rows.measures[:, RESIDUAL]))

    @property
    def limit_excess(self) -> float | Floats:
        return cast(float | Floats, self._shaped(self._rows.measures[:, LIMIT_EXCESS]))

    @property
    def iterations(self) -> int | Ints:
        return cast(int | Ints, self._shaped(self._rows.counters[:, ITERATIONS]))

    @property
    def rounds(self) -> int | Ints:
        return cast(int | Ints, self._shaped(self._rows.counters[:, ROUNDS]))

    @property
    def held(self) -> Held | NDArray[np.object_]:
        names = np.array([None, "orientation", "position"], dtype=object)
        held = names[np.where(self._rows.status == Status.PROJECTED, self._rows.holds, HOLD_NOTHING)]
        return held[0] if self.shape == () else held.reshape(self.shape)

    @property
    def certified(self) -> bool | NDArray[np.bool_]:
        status = self._rows.status
        is_nearest = (status == Status.PROJECTED) & self._rows.certain
        return cast("bool | NDArray[np.bool_]", self._shaped((status == Status.REACHED) | is_nearest))

    @property
    def actuator_error(self) -> float | Floats:
        return cast(float | Floats, self._shaped(self._rows.measures[:, ACTUATOR_ERROR]))

    @cached_property
    def q(self) -> Floats:
        return cast(Floats, self._shaped(self._coordinates + home_coordinates(self.mechanism)))

    @cached_property
    def joints(self) -> Mapping[str, Floats]:
        spans = ((name, span) for name, span in columns(self.mechanism).items() if span.stop > span.start)
        single = {name: span.start if span.stop - span.start == 1 else span for name, span in spans}
        return FrozenMapping({name: self.q[..., place][()] for name, place in single.items()})

    @cached_property
    def points(self) -> Mapping[str, Floats]:
        found = engine_of(self.mechanism).points(self._configurations)
        order = [joint.name for joint in self.mechanism.joints if joint.name in found]
        unknown = (self._rows.status == Status.INVALID)[:, None]
        return FrozenMapping({name: self._shaped(np.where(unknown, np.nan, found[name])) for name in order})

    @cached_property
    def active_limits(self) -> tuple[ActiveLimit, ...] | list[tuple[ActiveLimit, ...]]:
        listed = self._limits
        return listed[0] if self.shape == () else listed

    @cached_property
    def _limits(self) -> list[tuple[ActiveLimit, ...]]:
        """The same as a list of rows, also of a single answer."""
        status = self._rows.status
        held: list[tuple[ActiveLimit, ...]] = [()] * len(status)
        is_asked = (status == Status.PROJECTED) & (self._request is not None)
        others = np.flatnonzero((status != Status.REACHED) & (status != Status.INVALID) & ~is_asked)
        if len(others):
            for row, found in zip(others, active_limits(self.mechanism, self._coordinates[others]), strict=True):
                held[row] = found
        projected = np.flatnonzero(is_asked)
        if self._request is not None and len(projected):
            for row, found in zip(projected, self._holding(self._request, projected), strict=True):
                held[row] = found
        return held

    @cached_property
    def binding(self) -> NDArray[np.void]:
        """The first of `active_limits` of every row as one array, (...,): empty names where there is none.

        Fields: joint, bound (text), coordinate (int), value, limit [length or rad], multiplier (NaN where none is
        known).
        """
        return binding_limits(self._limits).reshape(self.shape)

    def _holding(self, wanted: PoseRequest, projected: NDArray[np.intp]) -> list[tuple[ActiveLimit, ...]]:
        """The limits that hold projected rows back from the poses that were asked for."""
        found: dict[int, tuple[ActiveLimit, ...]] = {}
        engine = engine_of(self.mechanism)
        holds, ways = (
            self._rows.holds[projected],
            projection_modes(self.mechanism, wanted.hold, wanted.rotation_length),
        )
        for way in ways:
            rows = projected[holds == way.hold]
            if len(rows):
                weights = engine.limit_multipliers(self._configurations.at(rows), wanted.targets[rows], way)
                limits = holding_limits(self.mechanism, self._told_of(rows, weights), weights)
                found.update(zip(rows.tolist(), limits, strict=True))
        return [found[row] for row in projected.tolist()]

    def _told_of(self, rows: NDArray[np.intp], weights: Floats) -> Floats:
        """Joint coordinates of some rows, (n, columns), as far as the limits that hold these back need them.

        Where only those of actuators hold, the others are not worked out: they are NaN.
        """
        if is_held_by_others(self.mechanism, weights):
            return self._coordinates[rows]
        told = np.full((len(rows), len(home_coordinates(self.mechanism))), np.nan)
        for place, drive in enumerate(self.mechanism.drives):
            told[:, drive.column] = self._rows.actuators[rows, place] - drive.home
        return told
