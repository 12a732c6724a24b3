"""The answers along a path, with its jumps and the speeds of actuators."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import array, is_not_infinite
from ..arrays import Floats, Ints, Mask
from ..checks import put_limits, require_positive
from ..closure.configurations import Configurations
from ..closure.on_the_way import least_on_the_way
from ..description.mechanism import Mechanism
from ..description.task import task_of
from ..engine import engine_of
from ..errors import InvalidArgument
from ..motion.displacements import actuator_units
from ..poses import between
from ..tolerances import TOLERANCES
from .active_limits import ActiveLimit
from .answer_fields import PoseRequest
from .solution import Solution, as_plain
from .status import Status

SUSPICIOUS, LEAST = 4.0, 1e-6
"""Ratio of the motion of an answer to that of its target, and least motion [L or rad], above which it may be a jump."""

SUBSTEPS = 8
"""Parts into which a checked step is divided: a jump stays within one of them, a fast motion spreads over several."""

JUMP = 0.5
"""Share of the whole motion that one part makes if it is a jump."""

EVEN = 1e-6
"""Relative difference up to which time steps count as equal: times in files have so many digits."""


class Pace(NamedTuple):
    """Times of the targets, and speed limits of the actuators.

    Attributes
    ----------
    times : (n,) [s]; NaN where unknown.
    sample_time : from each target to the next [s]; None if it varies.
    speed_limits : (n_a,) [length/s or rad/s].
    """

    times: Floats
    sample_time: float | None
    speed_limits: Floats


class Track(Solution):
    """The answers along a path, (n,), with jumps, speeds and accelerations.

    Attributes
    ----------
    targets : target poses (n, 4, 4) [length].
    times : of the targets, (n,) [s]; None if not given.
    sample_time : from one target to the next [s]; None if not given, or if it varies.
    jumps : mask of answers to which no continuous motion leads from the answer before, as the target moves, (n,). The
        nearest feasible pose itself can jump if a workspace is not convex.
    passing : of a machine with a clearance, the least distance between links on the way from the answer before, along
        the straight line between the two poses, (n,) [length]; in the first row that of the answer. Where it is less
        than the clearance, it is exact to 1e-3 L. None for other machines.
    speeds : mean speed of every actuator since the answer before, (n, n_a) [length/s or rad/s]; 0 in the first row.
        NaN where no time passes or times are unknown; None without times.
    accelerations : change of the mean velocity from the step before to this one, per time, (n, n_a) [length/s^2 or
        rad/s^2]; 0 in the first two rows. NaN and None as for speeds.
    too_fast : names of actuators that exceed their speed limits, one tuple per row; None without times.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        found: Configurations,
        wanted: PoseRequest,
        follow: Callable[..., Solution],
        pace: Pace | None,
    ) -> None:
        """Wrap answers; `follow` solves another path, (k, 4, 4), from a start, with the same options."""
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
        """The state of a `Solution`, the pace, and the jumps, which are computed before pickling."""
        return *super().__getstate__(), self._pace, self.jumps

    def __setstate__(self, state: Any) -> None:
        *solution_state, self._pace, self.jumps = state
        super().__setstate__(tuple(solution_state))

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
        jumps = np.zeros(self.shape, bool)
        actuators = _scaled(self.mechanism, self.actuators).max(axis=1, initial=0.0)
        moves = np.maximum(_moves(self.mechanism, self.pose), actuators)
        asked = np.where((self.status == Status.INVALID)[:, None, None], np.nan, self.targets)
        expected = np.maximum(SUSPICIOUS * _moves(self.mechanism, asked), LEAST)
        for row in np.flatnonzero(moves > expected).tolist():
            # with stretched links, substeps may bend them to the right side in one of the two directions only
            steps = [ends for ends in ((row - 1, row), (row, row - 1)) if self.status[ends[0]] < Status.FAILED]
            jumps[row] = all(self._is_jump(*ends, moves[row]) for ends in steps)
        return jumps

    @cached_property
    def passing(self) -> Floats | None:
        if self.mechanism.clearance is None:
            return None
        rows = np.arange(len(self))
        before, after = (self._configurations.at(each) for each in (np.maximum(rows - 1, 0), rows))
        free = engine_of(self.mechanism.with_clearance(None))
        return least_on_the_way(free, self.mechanism, before, after)

    def _is_jump(self, start: int, end: int, whole: float) -> bool:
        """True if a step from one row to the next, or back, is a jump also when divided into substeps."""
        shares = np.arange(1, SUBSTEPS + 1)[:, None, None] / SUBSTEPS
        first, last = (np.repeat(self.targets[row : row + 1], SUBSTEPS, axis=0) for row in (start, end))
        parts = [self[start], self._follow(between(first, last, shares), start=self[start]), self[end]]
        poses = np.concatenate([part.pose.reshape(-1, 4, 4) for part in parts])
        actuators = np.concatenate([part.actuators.reshape(-1, self.actuators.shape[1]) for part in parts])
        steps = np.maximum(_moves(self.mechanism, poses), _scaled(self.mechanism, actuators).max(axis=1, initial=0.0))
        return bool(steps.max() > JUMP * whole)

    def to_dict(self) -> dict[str, Any]:
        """The dict of a `Solution`, with the fields of a track."""
        plain = super().to_dict()
        plain["jumps"] = self.jumps.tolist()
        for name in ("times", "speeds", "accelerations", *(["passing"] if self.passing is not None else [])):
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
        accelerations = np.zeros_like(rates)
        accelerations[2:] = np.diff(rates[1:], axis=0) / _durations(0.5 * (times[2:] - times[:-2]))
        return accelerations

    def _rates(self) -> Floats | None:
        """Mean velocities of the actuators since the answer before, (n, n_a)."""
        if self.times is None:
            return None
        rates = np.zeros_like(self.actuators)
        rates[1:] = np.diff(self.actuators, axis=0) / _durations(np.diff(self.times))
        return rates

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
    """The checked times and speed limits of a path of `count` targets; None without times."""
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
        checked = sample_time * np.arange(count, dtype=np.float64)
    else:
        checked = _checked_times(times, count)
        sample_time = _even_step(checked)
    limits = np.full(len(names), np.inf)
    put_limits(limits, "speed_limits", speed_limits, names)
    return Pace(checked, sample_time, limits)


def _checked_times(times: ArrayLike | None, count: int) -> Floats:
    note = ", when each target is to be there [s], NaN where not known"
    checked = array("times", times, f"{count}", "times", note, is_not_infinite).copy()
    if (np.diff(checked[~np.isnan(checked)]) < 0.0).any():
        raise InvalidArgument("times", "times that go back", "times of which none is before one before it")
    return checked


def _even_step(times: Floats) -> float | None:
    """The step of times that are equally far apart; None for others."""
    steps = np.diff(times)
    if not len(steps) or not steps.min() > 0.0 or np.ptp(steps) > EVEN * steps[0]:
        return None
    return float(steps.mean())


def _durations(steps: Floats) -> Floats:
    """Positive time steps as a column (n, 1), to divide by; NaN where a step is not positive."""
    return np.where(steps > 0.0, steps, np.nan)[:, None]


def _moves(mechanism: Mechanism, poses: Floats) -> Floats:
    """Distance of each pose of a path from the one before it, in the components of the task, (n,) [L]; first 0."""
    position, rotation = task_of(mechanism).errors(poses[1:], poses[:-1])
    moves = np.hypot(position, mechanism.rotation_length * rotation) / mechanism.characteristic_length
    return np.concatenate([np.zeros(min(len(poses), 1)), moves])


def _scaled(mechanism: Mechanism, actuators: Floats) -> Floats:
    """Distance that each actuator moves in every step, (n, n_a) [L or rad]."""
    return np.asarray(np.abs(np.diff(actuators, axis=0, prepend=actuators[:1])) / actuator_units(mechanism))
