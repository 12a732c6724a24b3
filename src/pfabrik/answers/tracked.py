"""The answers along a path, with its jumps and the speeds of actuators."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import Floats, Ints, Mask, as_plain
from ..common.printed import ResultTable, plain
from ..engines.engine import engine_of
from ..engines.joints.configurations import Configurations
from ..engines.joints.engine_contract import InverseEngine
from ..engines.joints.link_distances import least_on_the_way
from ..errors import InvalidArgument, counted
from ..machine.description.mechanism import Mechanism
from ..machine.description.readouts import readouts
from ..tolerances import TOLERANCES
from .active_limits import ActiveLimit
from .along import Extremes, largest_tilts, least_margins
from .answer_fields import PoseRequest
from .jumps import are_jumps
from .pace import Pace
from .solution import Solution
from .status import Status
from .words import error_words

MOST_NAMED = 5
"""Targets that a summary names by number, at most."""

NEARLY_KEPT = 0.99
"""Share of the clearance from which on it counts as kept between targets: straight ways cut the corners of a limit."""


class Track(Solution):
    """The answers along a path, (n,), with jumps, speeds and accelerations.

    Attributes
    ----------
    targets : array (n, 4, 4)
        Target poses [length].
    times : array (n,) or None
        Times of the targets [s]; None if not given.
    sample_time : float or None
        Time from one target to the next [s]; None if not given, or if it varies.
    jumps : array of bool (n,)
        Mask of answers to which no motion leads from the answer before, as the target moves: drives would jump. The
        nearest feasible pose itself can jump if a workspace is not convex.
    passing : array (n,) or None
        For a machine with a clearance, the least distance between links on the way from the answer before, along the
        straight line between the two poses [length]; in the first row that of the answer. Where it is less than the
        clearance, it is exact to 1e-3 L. None for other machines.
    speeds : array (n, n_a) or None
        Mean speed of every actuator since the answer before [length/s or rad/s]; 0 in the first row. NaN where no time
        passes or times are unknown; None without times.
    accelerations : array (n, n_a) or None
        Change of the mean velocity from the step before to this one, per time [length/s^2 or rad/s^2]; 0 in the first
        two rows. NaN and None as for speeds.
    too_fast : list of tuple of str or None
        Names of actuators that exceed their speed limits, one tuple per row; None without times.
    least_margins : Extremes
        The least margin of every row, `values` (n,), and the limit that has it, `names`.
    largest_tilts : Extremes or None
        The largest tilt of any rod in every row, `values` (n,) [rad], and the body of that rod, `names`; None for
        machines without rods.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        found: Configurations,
        wanted: PoseRequest,
        pace: Pace | None,
        engine: InverseEngine,
    ) -> None:
        """Wrap the answers of an engine."""
        super().__init__(mechanism, found, (len(found),), wanted)
        self._pace, self._engine = pace, engine

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
        assert self._request is not None
        rows, targets = np.arange(len(self)), self._request.targets
        before = np.maximum(rows - 1, 0)
        starts, options = self._configurations.at(before), self._request.options
        return are_jumps(self._engine, self.mechanism, starts, targets[before], self._configurations, targets, options)

    @cached_property
    def passing(self) -> Floats | None:
        if self.mechanism.clearance is None:
            return None
        rows = np.arange(len(self))
        before, after = (self._configurations.at(each) for each in (np.maximum(rows - 1, 0), rows))
        free = engine_of(self.mechanism.with_clearance(None))
        return least_on_the_way(free, self.mechanism, before, after)

    def to_dict(self) -> dict[str, Any]:
        """The dict of a `Solution`, with the fields of a track."""
        fields = super().to_dict()
        fields["jumps"] = self.jumps.tolist()
        for name in ("times", "speeds", "accelerations", *(["passing"] if self.passing is not None else [])):
            value = getattr(self, name)
            fields[name] = None if value is None else as_plain(value)
        fields["too_fast"] = None if self.too_fast is None else [list(names) for names in self.too_fast]
        for name, extremes in (("margin", self.least_margins), ("tilt", self.largest_tilts)):
            fields[name] = None if extremes is None else as_plain(extremes.values)
            fields[f"{name}_of"] = None if extremes is None else extremes.names
        return fields

    def table(self) -> ResultTable:
        """Counts of targets reached, the largest errors of the others, jumps, and the worst step."""
        summary = TrackSummary(self.mechanism)
        summary.add(self)
        return ResultTable(self.mechanism.name, list(filter(None, (summary.line(), summary.worst()))))

    @cached_property
    def least_margins(self) -> Extremes:
        return least_margins(self)

    @cached_property
    def largest_tilts(self) -> Extremes | None:
        return largest_tilts(self)

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


def refuse_leaps(track: Track, worst: Status = Status.REACHED) -> None:
    """Refuse a track with steps that are not reached, or of a status worse than another one, or that jump."""
    _refuse(track.status > worst, "not reached")
    _refuse(track.jumps, "leaping from the one before")


def _refuse(bad: Mask, what: str) -> None:
    steps = np.flatnonzero(bad)
    if len(steps):
        found = f"{len(steps)} step{'s' * (len(steps) > 1)} {what}"
        raise InvalidArgument("track", found, "a path that is reached throughout", rows=steps[:5].tolist())


def _durations(steps: Floats) -> Floats:
    """Positive time steps as a column (n, 1), to divide by; NaN where a step is not positive."""
    return np.where(steps > 0.0, steps, np.nan)[:, None]


@dataclass
class TargetNumbers:
    """Some targets of a path: how many, and the numbers of the first, counted from 1."""

    count: int = 0
    named: list[int] = field(default_factory=list)

    def add(self, numbers: Iterable[int]) -> None:
        """Add targets that follow."""
        numbers = list(numbers)
        self.count += len(numbers)
        self.named += numbers[: MOST_NAMED - len(self.named)]

    def __str__(self) -> str:
        more = f", and {self.count - MOST_NAMED} more" if self.count > MOST_NAMED else ""
        return f"target{'s' * (self.count != 1)} {', '.join(map(str, self.named))}{more}"


@dataclass
class Worst:
    """The largest value so far, what it is of, and at which target and line."""

    value: float = -math.inf
    name: str = ""
    place: str = ""

    def add(self, values: Floats, names: list[str], begin: int, lines: Sequence[int]) -> None:
        """Add the values of the targets from number `begin` on, and the lines of the path that these come from."""
        known = np.where(np.isnan(values), -np.inf, values)
        row = int(known.argmax())
        if known[row] > self.value:
            self.value, self.name = float(known[row]), names[row]
            self.place = place_of(begin, row, lines)


def place_of(begin: int, row: int, lines: Sequence[int]) -> str:
    """The number of a target and, of those that were read, its line; a path may begin at home."""
    line = f" ({f'line {lines[row]}' if lines[row] else 'home'})" if lines else ""
    return f"target {begin + row}{line}"


class TrackSummary:
    """Counts, failures and the worst step of a path."""

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism = mechanism
        self._counts: Counter[Status] = Counter()
        self._n_targets = 0
        self._farthest = [0.0, 0.0]
        self._failed, self._jumps, self._near = TargetNumbers(), TargetNumbers(), TargetNumbers()
        self._first_off = ""
        self._nearest = math.inf
        self._too_fast = {name: TargetNumbers() for name in mechanism.actuator_names}
        self._fastest = dict.fromkeys(mechanism.actuator_names, 0.0)
        self._margin, self._tilt = Worst(), Worst()

    def add(self, track: Track, first: int = 0, lines: Sequence[int] = ()) -> None:
        """Add the rows of a track from `first` on, and the lines of the file that each of all its rows comes from."""
        if first >= len(track):
            return
        new, begin = slice(first, None), self._n_targets + 1
        lines, margins, tilts = lines[first:], track.least_margins, track.largest_tilts
        status = track.status[new]
        self._counts += Counter(map(Status, status.tolist()))
        off = np.flatnonzero(status != Status.REACHED)
        if len(off) and not self._first_off:
            self._first_off = place_of(begin, int(off[0]), lines)
        errors = (track.position_error[new], track.rotation_error[new])
        self._farthest = [max(before, float(each.max())) for before, each in zip(self._farthest, errors, strict=True)]
        self._failed.add((begin + np.flatnonzero(status >= Status.FAILED)).tolist())
        self._jumps.add((begin + np.flatnonzero(track.jumps[new])).tolist())
        if track.passing is not None:
            is_near = track.passing[new] < NEARLY_KEPT * (self._mechanism.clearance or 0.0)
            self._near.add((begin + np.flatnonzero(is_near)).tolist())
            self._nearest = min(self._nearest, float(np.nanmin(track.passing[new], initial=math.inf)))
        if track.too_fast is not None and track.speeds is not None:
            self._add_speeds(track.too_fast[new], track.speeds[new], begin)
        self._margin.add(-margins.values[new], margins.names[new], begin, lines)
        if tilts is not None:
            self._tilt.add(tilts.values[new], tilts.names[new], begin, lines)
        self._n_targets += len(status)

    def _add_speeds(self, too_fast: list[tuple[str, ...]], speeds: Floats, begin: int) -> None:
        for column, (name, targets) in enumerate(self._too_fast.items()):
            rows = [row for row, names in enumerate(too_fast) if name in names]
            if rows:
                targets.add(begin + row for row in rows)
                self._fastest[name] = max(self._fastest[name], float(np.nanmax(speeds[:, column])))

    @property
    def is_well(self) -> bool:
        """True if all targets were reached, links stay apart on the way, and no actuator has to be too fast."""
        is_reached = self._counts[Status.REACHED] == self._n_targets
        return is_reached and not self._near.count and not any(self._fastest.values())

    def line(self) -> str:
        """The number of targets of each status, how far off they are, and where answers jump or are too fast."""
        counts = {status: self._counts[status] for status in Status}
        named = (f"{n} {status.name.lower()}" for status, n in counts.items() if n or status == Status.REACHED)
        parts = [", ".join(named)]
        if self._failed.count:
            parts.append(f"failed at {self._failed}")
        if counts[Status.PROJECTED]:
            farthest = error_words(self._mechanism, *self._farthest)
            parts.append(f"first at {self._first_off}; farthest from its target {farthest}")
        if self._jumps.count:
            parts.append(f"{counted(self._jumps.count, 'jump')} ({self._jumps})")
        if self._near.count:
            nearest = f"{self._nearest:.3g} {self._mechanism.length_unit}"
            parts.append(f"links come as near as {nearest} on the way to {self._near}")
        for drive in readouts(self._mechanism):
            if self._fastest[drive.name]:
                fastest = float(drive.display(np.array(self._fastest[drive.name])))
                parts.append(f"{drive.name} too fast: {fastest:.3g} {drive.unit}/s ({self._too_fast[drive.name]})")
        return "; ".join(parts)

    def worst(self) -> str:
        """The step with the least margin, and the one where a rod is tilted most; empty where there is neither."""
        parts = []
        if self._margin.name:
            margin = plain(-self._margin.value, TOLERANCES.active, ".3g")
            parts.append(f"worst step: {self._margin.place}, margin {margin} of {self._margin.name}")
        if self._tilt.name:
            degrees = math.degrees(self._tilt.value)
            parts.append(f"largest tilt: {degrees:.3g} deg of {self._tilt.name} at {self._tilt.place}")
        return "; ".join(parts)
