"""The fields of an answer: its status, its configuration, and the measured errors."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any, Literal, NamedTuple, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import Floats, Ints, Mask, shaped
from ..common.batch import aligned
from ..common.frozen import FrozenMapping
from ..common.rotations import to_rotvec
from ..engines.engine import engine_of
from ..engines.joints.configurations import Configurations
from ..engines.joints.projection import modes_of
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
from ..machine.description.mechanism import Mechanism
from ..machine.model import model_of
from ..machine.motion.displacements import columns, home_coordinates
from ..options import Options
from .active_limits import (
    ActiveLimit,
    active_limits,
    binding_limits,
    dead_point,
    has_passive_limits,
    holding_limits,
)
from .jumps import are_jumps
from .status import Status

Held: TypeAlias = Literal["orientation", "position"] | None
"""The part of its target that a projected answer holds."""


class PoseRequest(NamedTuple):
    """Target poses (n, 4, 4) with the options of the question."""

    targets: Floats
    options: Options


class Before(NamedTuple):
    """Starts of answers, one or one for each, the targets (n, 4, 4) that these answer, and what was asked then."""

    starts: Configurations
    targets: Floats
    request: PoseRequest

    def at(self, rows: NDArray[np.intp]) -> Before:
        """Those of some answers."""
        request = self.request._replace(targets=self.request.targets[rows])
        if len(self.starts) == 1:
            return self._replace(request=request)
        return Before(self.starts.at(rows), self.targets[rows], request)


_State: TypeAlias = tuple[Mechanism, Configurations, tuple[int, ...], PoseRequest | None, Floats | None, Before | None]


class Answer:
    """The fields of a `Solution`, whose docstring describes them; text and pictures are made from these."""

    def __init__(
        self,
        mechanism: Mechanism,
        found: Configurations,
        shape: tuple[int, ...],
        request: PoseRequest | None = None,
        values: Floats | None = None,
        before: Before | None = None,
    ) -> None:
        """Wrap configurations, as many as the batch shape has; if any are missed, with what was asked for.

        Parameters
        ----------
        request : the poses asked for.
        values : the actuator values asked for, (n, n_a) [length or rad].
        before : what poses were asked from; None for home.
        """
        self.mechanism = mechanism
        self.shape = shape
        self._configurations = found
        self._request = request
        self._values = values
        self._before = before

    def __getstate__(self) -> _State:
        """The arguments of the constructor; cached properties are not pickled."""
        return self.mechanism, self._configurations, self.shape, self._request, self._values, self._before

    def __setstate__(self, state: _State) -> None:
        mechanism, found, shape, *asked = state
        Answer.__init__(self, mechanism, found, shape, *map(aligned, asked))

    @property
    def _rows(self) -> Rows:
        return self._configurations.rows

    @property
    def _coordinates(self) -> Floats:
        """All joint coordinates as deviations from home, (n, columns) [length or rad]."""
        return self._configurations.coordinates

    def _coordinates_at(self, place: int) -> Floats:
        """Those of one row, (1, columns)."""
        return self._configurations.coordinates_at(np.array([place]))

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

    @cached_property
    def jumped(self) -> bool | Mask:
        jumps, before, answers = np.zeros(len(self._configurations), bool), self._before, self._configurations
        if before is not None:
            rows = np.zeros(len(jumps), int) if len(before.starts) == 1 else np.arange(len(jumps))
            starts, (targets, options) = before.starts.at(rows), before.request
            engine = engine_of(self.mechanism)
            jumps = are_jumps(engine, self.mechanism, starts, before.targets[rows], answers, targets, options)
        return cast("bool | Mask", self._shaped(jumps))

    @property
    def certified(self) -> bool | NDArray[np.bool_]:
        status = self._rows.status
        is_nearest = (status == Status.PROJECTED) & self._rows.certain
        return cast("bool | NDArray[np.bool_]", self._shaped((status == Status.REACHED) | is_nearest))

    @property
    def is_complete(self) -> bool | NDArray[np.bool_]:
        most_steps = None if self._request is None else self._request.options.most_steps
        is_cut = np.zeros(len(self._rows.status), bool)
        if most_steps is not None:
            is_cut = (self._rows.status == Status.PROJECTED) & ~self._rows.certain
        return cast("bool | NDArray[np.bool_]", self._shaped(~is_cut))

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
        points = engine_of(self.mechanism).points(self._configurations)
        order = [joint.name for joint in self.mechanism.joints if joint.name in points]
        is_invalid = (self._rows.status == Status.INVALID)[:, None]
        return FrozenMapping({name: self._shaped(np.where(is_invalid, np.nan, points[name])) for name in order})

    @cached_property
    def active_limits(self) -> tuple[ActiveLimit, ...] | list[tuple[ActiveLimit, ...]]:
        limits = self._limits
        return limits[0] if self.shape == () else limits

    @cached_property
    def _limits(self) -> list[tuple[ActiveLimit, ...]]:
        """`active_limits` as a list of rows, also of a single answer."""
        status = self._rows.status
        limits: list[tuple[ActiveLimit, ...]] = [()] * len(status)
        is_projected = (status == Status.PROJECTED) & (self._request is not None)
        without_target = np.flatnonzero((status != Status.REACHED) & (status != Status.INVALID) & ~is_projected)
        if len(without_target):
            active = active_limits(self.mechanism, self._coordinates[without_target])
            for row, row_limits in zip(without_target, active, strict=True):
                limits[row] = row_limits
        projected = np.flatnonzero(is_projected)
        if self._request is not None and len(projected):
            for row, row_limits in zip(projected, self._holding(self._request, projected), strict=True):
                limits[row] = row_limits
        model = model_of(self.mechanism)
        for place in np.flatnonzero(status == Status.PROJECTED).tolist():
            limits[place] = limits[place] or dead_point(
                model, self._configurations.at(np.array([place])), self._missed(place)
            )
        return limits

    def _missed(self, place: int) -> list[tuple[Floats, Floats]]:
        """The motions to a row's target: velocity of the reference point [L] and angular one, then each alone."""
        if self._request is None:
            return []
        pose, target = self._rows.poses[place], self._request.targets[place]
        offset = (target - pose)[:3, 3] / self.mechanism.characteristic_length
        turn = to_rotvec(target[:3, :3] @ pose[:3, :3].T)
        return [(offset, turn), (offset, 0.0 * turn), (0.0 * offset, turn)]

    @cached_property
    def binding(self) -> NDArray[np.void]:
        """The first of `active_limits` of every row as one array, (...,): empty names if there is none.

        Fields: joint, bound (text), coordinate (int), value, limit [length or rad], multiplier (NaN if unknown).
        """
        return binding_limits(self._limits).reshape(self.shape)

    def _holding(self, request: PoseRequest, projected: NDArray[np.intp]) -> list[tuple[ActiveLimit, ...]]:
        """The limits that block projected rows from their targets."""
        limits: dict[int, tuple[ActiveLimit, ...]] = {}
        engine, holds, options = engine_of(self.mechanism), self._rows.holds[projected], request.options
        for projection in modes_of(model_of(self.mechanism).path_closure, options):
            rows = projected[holds == (HOLD_NOTHING if projection.price else projection.hold)]
            if len(rows):
                configurations = self._configurations.at(rows)
                multipliers = engine.limit_multipliers(configurations, request.targets[rows], projection)
                coordinates = self._coordinates_for_limits(rows, multipliers)
                row_limits = holding_limits(self.mechanism, coordinates, multipliers)
                limits.update(zip(rows.tolist(), row_limits, strict=True))
        return [limits[row] for row in projected.tolist()]

    def _coordinates_for_limits(self, rows: NDArray[np.intp], multipliers: Floats) -> Floats:
        """Joint coordinates of some rows, (n, columns), computed only if the active limits need them.

        If only limits of actuators are active, the coordinates of other joints are NaN.
        """
        if has_passive_limits(self.mechanism, multipliers):
            return self._coordinates[rows]
        coordinates = np.full((len(rows), len(home_coordinates(self.mechanism))), np.nan)
        for place, drive in enumerate(self.mechanism.drives):
            coordinates[:, drive.column] = self._rows.actuators[rows, place] - drive.home
        return coordinates
