"""Answers along a path, as rows of a CSV file and as a summary, while they come in parts."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import TYPE_CHECKING, TextIO, TypeAlias

import numpy as np

import pfabrik as pf

from ..answers.words import short_names
from ..arrays import Floats
from ..cells import CsvWriter
from ..description.readouts import readouts
from ..errors import counted
from ..paths.along import Extremes
from ..printed import plain
from ..rotations import to_rpy
from ..tolerances import TOLERANCES

if TYPE_CHECKING:
    from ..paths.follow import TrackPart
    from ..paths.path import AngleUnit, Path

POSITION = ("x", "y", "z")
ANGLES = ("roll", "pitch", "yaw")

MOST_NAMED = 5
"""Targets that a summary names by number, at most."""

Cells: TypeAlias = list[Sequence[float | str]]
"""Cells of some columns, a sequence for each row."""


class TrackRows:
    """Writes answers to an open file: a header, then one row for each target.

    A row has the target, its time if the path gives it, further columns, pose, status, actuators with their speeds and
    accelerations, the least margin and the largest tilt of a rod, errors, active limits, jumps, and actuators that are
    too fast. Angles are in the units of the path, which their columns name. `jump` is 1 where the answer jumps away
    from the one before it. Cells are empty where there is no value.
    """

    def __init__(self, handle: TextIO, mechanism: pf.Mechanism, path: Path, *, has_tilts: bool) -> None:
        """Write the header for a path that begins with `path`."""
        drives = readouts(mechanism)
        self._writer = CsvWriter(handle)
        self._units = path.angle_units
        self._unit: AngleUnit = "deg" if "deg" in path.angle_units else "rad"
        self._is_angle = np.array([drive.is_angle for drive in drives])
        self._others = [name for name in path.others if not (name == "t" and path.times is not None)]
        names = [f"{printable(drive.name)}{f'_{self._unit}' if drive.is_angle else ''}" for drive in drives]
        pose = [*POSITION, *(f"{name}_{unit}" for name, unit in zip(ANGLES, self._units, strict=True))]
        target = [f"target_{name}" for name in pose]
        timed = [] if path.times is None else ["t"]
        rates = [] if path.times is None else [f"{kind}_{name}" for kind in ("speed", "acceleration") for name in names]
        answer = [*pose, "status", *(f"actuator_{name}" for name in names), *rates, "margin", "margin_of"]
        answer += [f"tilt_{self._unit}", "tilt_of"] if has_tilts else []
        answer += ["position_error", f"rotation_error_{self._unit}", "active_limits", "jump", "too_fast"]
        taken = {*target, *timed, *answer}
        others = [f"path_{name}" if name in taken else name for name in self._others]
        self._writer.writerow([*target, *timed, *others, *answer])

    def write(self, part: TrackPart, margins: Extremes, tilts: Extremes | None) -> None:
        """Write the rows of a part that are new; `margins` and `tilts` are those of all its rows."""
        path, track, new = part.path.after(part.first), part.track, slice(part.first, None)
        none: Cells = [()] * len(path.lines)
        actuators = (track.actuators, track.speeds, track.accelerations)
        errors = np.stack([track.position_error, self._shown(track.rotation_error)], axis=-1)
        too_fast = track.too_fast or [()] * len(track)
        columns: list[Cells] = [
            _rows(self._coordinates(path.targets)),
            none if path.times is None else _rows(path.times[:, None]),
            list(zip(*(path.others[name] for name in self._others), strict=True)) or none,
            _rows(self._coordinates(track.pose[new])),
            [[pf.Status(status).name] for status in track.status[new].tolist()],
            *(_rows(self._in_units(values[new])) for values in actuators if values is not None),
            list(zip(_cells(margins.values[new]), margins.names[new], strict=True)),
            none if tilts is None else list(zip(_cells(self._shown(tilts.values[new])), tilts.names[new], strict=True)),
            errors[new].tolist(),
            [
                (short_names(limits), int(jump), "; ".join(names))
                for limits, jump, names in zip(track.active_limits[new], track.jumps[new], too_fast[new], strict=True)
            ],
        ]
        self._writer.writerows(map(chain.from_iterable, zip(*columns, strict=True)))

    def _shown(self, angles: Floats) -> Floats:
        return np.degrees(angles) if self._unit == "deg" else angles

    def _in_units(self, values: Floats) -> Floats:
        """Numbers of actuators (n, n_a) in the units that are shown."""
        return np.where(self._is_angle, self._shown(values), values)

    def _coordinates(self, poses: Floats) -> Floats:
        """Position and roll, pitch, yaw of poses: (n, 4, 4) to (n, 6)."""
        angles = zip(to_rpy(poses[:, :3, :3]).T, self._units, strict=True)
        shown = [np.degrees(values) if unit == "deg" else values for values, unit in angles]
        return np.column_stack([poses[:, :3, 3], *shown]) + 0.0  # so that no -0.0 is written


def _rows(values: Floats) -> Cells:
    """Numbers (n, k) as cells, empty where there is none."""
    if np.isfinite(values).all():
        rows: Cells = values.tolist()
        return rows
    return [_cells(row) for row in values]


def _cells(values: Floats) -> Sequence[float | str]:
    return ["" if math.isnan(value) else value for value in values.tolist()]


def printable(name: str) -> str:
    """A name without line breaks and other control characters."""
    return "".join(letter if letter.isprintable() else letter.encode("unicode_escape").decode() for letter in name)


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

    def add(self, values: Floats, names: list[str], begin: int, lines: list[int]) -> None:
        """Add the values of the targets from number `begin` on, and the lines of the path that these come from."""
        known = np.where(np.isnan(values), -np.inf, values)
        row = int(known.argmax())
        if known[row] > self.value:
            self.value, self.name = float(known[row]), names[row]
            self.place = _place(begin + row, lines[row])


def _place(number: int, line: int) -> str:
    return f"target {number} ({f'line {line}' if line else 'home'})"


NEARLY_KEPT = 0.99
"""Share of the clearance from which on it counts as kept between targets: straight ways cut the corners of a limit."""


class Summary:
    """Counts, failures and the worst step of a path."""

    def __init__(self, mechanism: pf.Mechanism) -> None:
        self._mechanism = mechanism
        self._counts: Counter[pf.Status] = Counter()
        self._n_targets = 0
        self._farthest = 0.0
        self._failed, self._jumps, self._near = TargetNumbers(), TargetNumbers(), TargetNumbers()
        self._first_off = ""
        self._nearest = math.inf
        self._too_fast = {name: TargetNumbers() for name in mechanism.actuator_names}
        self._fastest = dict.fromkeys(mechanism.actuator_names, 0.0)
        self._margin, self._tilt = Worst(), Worst()

    def add(self, part: TrackPart, margins: Extremes, tilts: Extremes | None) -> None:
        """Add the rows of a part that are new; `margins` and `tilts` are those of all its rows."""
        track, new, begin = part.track, slice(part.first, None), self._n_targets + 1
        status = track.status[new]
        self._counts += Counter(map(pf.Status, status.tolist()))
        off = np.flatnonzero(status != pf.Status.REACHED)
        if len(off) and not self._first_off:
            self._first_off = _place(begin + int(off[0]), part.path.lines[part.first + int(off[0])])
        self._farthest = max(self._farthest, float(track.position_error[new].max()))
        self._failed.add((begin + np.flatnonzero(status >= pf.Status.FAILED)).tolist())
        self._jumps.add((begin + np.flatnonzero(track.jumps[new])).tolist())
        if track.passing is not None:
            is_near = track.passing[new] < NEARLY_KEPT * (self._mechanism.clearance or 0.0)
            self._near.add((begin + np.flatnonzero(is_near)).tolist())
            self._nearest = min(self._nearest, float(np.nanmin(track.passing[new], initial=math.inf)))
        if track.too_fast is not None and track.speeds is not None:
            self._add_speeds(track.too_fast[new], track.speeds[new], begin)
        self._margin.add(-margins.values[new], margins.names[new], begin, part.path.lines[new])
        if tilts is not None:
            self._tilt.add(tilts.values[new], tilts.names[new], begin, part.path.lines[new])
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
        is_reached = self._counts[pf.Status.REACHED] == self._n_targets
        return is_reached and not self._near.count and not any(self._fastest.values())

    def line(self) -> str:
        """The number of targets of each status, how far off they are, and where answers jump or are too fast."""
        counts = {status: self._counts[status] for status in pf.Status}
        named = (f"{n} {status.name.lower()}" for status, n in counts.items() if n or status == pf.Status.REACHED)
        parts = [", ".join(named)]
        if self._failed.count:
            parts.append(f"failed at {self._failed}")
        if counts[pf.Status.PROJECTED]:
            farthest = f"farthest from its target {self._farthest:.3g} {self._mechanism.length_unit}"
            parts.append(f"first at {self._first_off}; {farthest}")
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
