"""A path that was followed: where it leaps, and where it is too fast."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Floats, Ints, Mask
from ..checks import put_limits, require_positive
from ..closure.configurations import Configurations
from ..description.mechanism import Mechanism
from ..description.task import task_of
from ..errors import InvalidArgument
from ..motion.displacements import actuator_units
from ..poses import as_floats, between
from ..tolerances import TOLERANCES
from .answer import PoseRequest
from .limits import ActiveLimit
from .solution import Solution, as_plain
from .status import Status

SUSPICIOUS, LEAST = 4.0, 1e-6
"""An answer that moves so many times as far as its target, and farther than the least [L or rad], may have leapt."""

SUBSTEPS = 8
"""Steps that a suspicious one is divided into: a leap stays within one of them, a swift motion spreads over several."""

LEAP = 0.5
"""Share of the whole motion that one of them makes if it is a leap."""


EVEN = 1e-6
"""How far steps of time may differ to count as the same, as a share: times are written with so many digits."""


class Pace(NamedTuple):
    """When each target is to be there, and how fast actuators may be.

    Attributes
    ----------
    times : (n,) [s]; NaN where nothing is known.
    sample_time : from each to the next [s]; None where it differs.
    speed_limits : (n_a,) [length/s or rad/s].
    """

    times: Floats
    sample_time: float | None
    speed_limits: Floats


class Track(Solution):
    """The answers along a path, (n,), with what a machine that follows it must know.

    Attributes
    ----------
    targets : what was asked for, poses (n, 4, 4) [length].
    times : when each target is to be there, (n,) [s]; None where nothing was said of it.
    sample_time : from one target to the next [s]; None where nothing was said of it, or it differs.
    jumps : whether an answer leaps away from the one before it, (n,): no motion leads from one to the other while
        the target moves between theirs. So it is where the nearest feasible pose itself jumps, as it can where a
        workspace is not convex.
    speeds : mean speed of every actuator since the answer before, (n, n_a) [length/s or rad/s]; 0 in the first row.
        NaN where no time passes or none is known; None without times.
    accelerations : how fast the mean velocity changes from the step before to this one, (n, n_a) [per s^2]; 0 in the
        first two rows. NaN and None as of speeds.
    too_fast : actuators that cannot move as fast as they would have to, one tuple of names a row; None without times.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        found: Configurations,
        wanted: PoseRequest,
        follow: Callable[..., Solution],
        pace: Pace | None,
    ) -> None:
        """Wrap answers; `follow` answers another path, (k, 4, 4), from a start, in the same way."""
        super().__init__(mechanism, found, (len(found),), wanted)
        self._follow = follow
        self._pace = pace

    if TYPE_CHECKING:  # a path is a batch: all of these are arrays

        @property
        def status(self) -> Ints: ...
        @property
        def position_error(self) -> Floats: ...
        @property
        def rotation_error(self) -> Floats: ...
        @property
        def actuator_error(self) -> Floats: ...
        @property
        def residual(self) -> Floats: ...
        @property
        def limit_excess(self) -> Floats: ...
        @property
        def iterations(self) -> Ints: ...
        @property
        def rounds(self) -> Ints: ...
        @property
        def held(self) -> NDArray[np.object_]: ...
        @property
        def certified(self) -> NDArray[np.bool_]: ...
        @cached_property
        def active_limits(self) -> list[tuple[ActiveLimit, ...]]: ...

    def __getstate__(self) -> Any:
        """As that of a `Solution`; whether there are jumps is found out before."""
        return *super().__getstate__(), self._pace, self.jumps

    def __setstate__(self, state: Any) -> None:
        *own, self._pace, self.jumps = state
        super().__setstate__(tuple(own))

    @property
    def targets(self) -> Floats:
        assert self._request is not None
        return self._request.targets

    @property
    def times(self) -> Floats | None:
        return None if self._pace is None else self._pace.times

    @property
    def sample_time(self) -> float | None:
        return None if self._pace is None else self._pace.sample_time

    @cached_property
    def jumps(self) -> Mask:
        found = np.zeros(self.shape, bool)
        actuators = _scaled(self.mechanism, self.actuators).max(axis=1, initial=0.0)
        moved = np.maximum(_moves(self.mechanism, self.pose), actuators)
        asked = np.maximum(SUSPICIOUS * _moves(self.mechanism, self.targets), LEAST)
        for row in np.flatnonzero(moved > asked).tolist():
            # where links are stretched out, only one direction may tell which way they bend
            ways = [ends for ends in ((row - 1, row), (row, row - 1)) if self.status[ends[0]] < Status.FAILED]
            found[row] = all(self._leaps(*ends, moved[row]) for ends in ways)
        return found

    def _leaps(self, start: int, end: int, moved: float) -> bool:
        """Whether a step from one row to the next, or back, stays a leap where it is divided, or leads elsewhere."""
        shares = np.arange(1, SUBSTEPS + 1)[:, None, None] / SUBSTEPS
        here, there = (np.repeat(self.targets[row : row + 1], SUBSTEPS, axis=0) for row in (start, end))
        way = [self[start], self._follow(between(here, there, shares), start=self[start]), self[end]]
        poses = np.concatenate([each.pose.reshape(-1, 4, 4) for each in way])
        actuators = np.concatenate([each.actuators.reshape(-1, self.actuators.shape[1]) for each in way])
        steps = np.maximum(_moves(self.mechanism, poses), _scaled(self.mechanism, actuators).max(axis=1, initial=0.0))
        return bool(steps.max() > LEAP * moved)

    def to_dict(self) -> dict[str, Any]:
        """As that of a `Solution`, with the fields of a track."""
        plain = super().to_dict()
        plain["jumps"] = self.jumps.tolist()
        for name in ("times", "speeds", "accelerations"):
            value = getattr(self, name)
            plain[name] = None if value is None else as_plain(value)
        plain["too_fast"] = None if self.too_fast is None else [list(names) for names in self.too_fast]
        return plain

    @property
    def speeds(self) -> Floats | None:
        rates = self._rates()
        return None if rates is None else np.abs(rates)

    @property
    def accelerations(self) -> Floats | None:
        rates, times = self._rates(), self.times
        if rates is None or times is None:
            return None
        found = np.zeros_like(rates)
        found[2:] = np.diff(rates[1:], axis=0) / _passed(0.5 * (times[2:] - times[:-2]))
        return found

    def _rates(self) -> Floats | None:
        """Mean velocities of the actuators since the answer before, (n, n_a)."""
        if self.times is None:
            return None
        found = np.zeros_like(self.actuators)
        found[1:] = np.diff(self.actuators, axis=0) / _passed(np.diff(self.times))
        return found

    @property
    def too_fast(self) -> list[tuple[str, ...]] | None:
        speeds = self.speeds
        if self._pace is None or speeds is None:
            return None
        beyond = speeds > self._pace.speed_limits * (1.0 + TOLERANCES.speed)
        names = self.mechanism.actuator_names
        return [tuple(name for name, over in zip(names, row, strict=True) if over) for row in beyond]


def pace_of(
    mechanism: Mechanism,
    count: int,
    sample_time: float | None,
    times: ArrayLike | None,
    speed_limits: float | Mapping[str, float] | None,
) -> Pace | None:
    """What was said of time and speeds along a path of so many targets, checked."""
    names = mechanism.actuator_names
    if sample_time is None and times is None:
        if speed_limits is not None:
            expected = "the time between two targets [s], or times"
            raise InvalidArgument("sample_time", "None beside speed limits", expected)
        return None
    if sample_time is not None:
        sample_time = require_positive("sample_time", sample_time)
        if times is not None:
            raise InvalidArgument("times", "times beside a sample time", "one of them")
        when = sample_time * np.arange(count, dtype=np.float64)
    else:
        when = _checked_times(times, count)
        sample_time = _even_step(when)
    limits = np.full(len(names), np.inf)
    put_limits(limits, "speed_limits", speed_limits, names)
    return Pace(when, sample_time, limits)


def _checked_times(times: ArrayLike | None, count: int) -> Floats:
    expected = f"shape ({count},): when each target is to be there [s], NaN where not known, none before one before it"
    found = as_floats("times", times, expected).copy()
    if found.shape != (count,):
        raise InvalidArgument("times", f"shape {found.shape}", expected)
    if np.isinf(found).any() or (np.diff(found[~np.isnan(found)]) < 0.0).any():
        raise InvalidArgument("times", "times that go back, or are infinite", expected)
    return found


def _even_step(times: Floats) -> float | None:
    """The step between times that are as far apart as each other; None for others."""
    steps = np.diff(times)
    if not len(steps) or not steps.min() > 0.0 or np.ptp(steps) > EVEN * steps[0]:
        return None
    return float(steps.mean())


def _passed(steps: Floats) -> Floats:
    """Durations as a column to divide by, NaN where there are none."""
    return np.where(steps > 0.0, steps, np.nan)[:, None]


def _moves(mechanism: Mechanism, poses: Floats) -> Floats:
    """How far each pose of a path is from the one before it in what the task counts, (n,) [L]; 0 for the first."""
    position, rotation = task_of(mechanism).errors(poses[1:], poses[:-1])
    moves = np.hypot(position, mechanism.rotation_length * rotation) / mechanism.characteristic_length
    return np.concatenate([np.zeros(min(len(poses), 1)), moves])


def _scaled(mechanism: Mechanism, actuators: Floats) -> Floats:
    """How far each actuator moves in every step, (n, n_a) [L or rad]."""
    return np.asarray(np.abs(np.diff(actuators, axis=0, prepend=actuators[:1])) / actuator_units(mechanism))
