"""What became of a path, in a few lines, while its answers come in parts."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

import pfabrik as pf

from ..description.readouts import readouts
from ..errors import counted

if TYPE_CHECKING:
    from ..answers.tracked import Track
    from ..arrays import Floats
    from ..description.mechanism import Mechanism
    from ..paths.along import Extremes
    from ..paths.path import Path

NAMED = 5


@dataclass
class Targets:
    """Some targets of a path: how many, and the numbers of the first, counted from 1."""

    count: int = 0
    first: list[int] = field(default_factory=list)

    def add(self, numbers: Iterable[int]) -> None:
        """These as well."""
        numbers = list(numbers)
        self.count += len(numbers)
        self.first += numbers[: NAMED - len(self.first)]

    def __str__(self) -> str:
        more = f", and {self.count - NAMED} more" if self.count > NAMED else ""
        return f"target{'s' * (self.count != 1)} {', '.join(map(str, self.first))}{more}"


@dataclass
class Worst:
    """The largest value so far, what it is of, and at which target and line."""

    value: float = -math.inf
    name: str = ""
    place: str = ""

    def add(self, values: Floats, names: list[str], first: int, begin: int, path: Path) -> None:
        """The rows from `first` on, the targets from number `begin` on."""
        known = np.where(np.isnan(values), -np.inf, values)[first:]
        row = int(known.argmax())
        if known[row] > self.value:
            self.value, self.name = float(known[row]), names[first + row]
            line = path.lines[first + row]
            self.place = f"target {begin + row} ({f'line {line}' if line else 'home'})"


class Summary:
    """Counts, failures and the worst step of a path."""

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism = mechanism
        self._counts: Counter[str] = Counter()
        self._farthest = 0.0
        self._failed, self._jumps = Targets(), Targets()
        self._hasty = {each.name: (Targets(), each) for each in readouts(mechanism)}
        self._speeds: dict[str, float] = {}
        self._room, self._tilt = Worst(), Worst()
        self.count = 0

    def add(self, path: Path, followed: Track, room: Extremes, tilts: Extremes | None, first: int = 0) -> None:
        """A part of the path, of which rows before `first` are known already."""
        begin = self.count + 1
        status = followed.status[first:]
        self._counts += Counter(pf.Status(each).name.lower() for each in status.tolist())
        self._farthest = max(self._farthest, float(followed.position_error[first:].max()))
        self._failed.add((begin + np.flatnonzero(status >= pf.Status.FAILED)).tolist())
        self._jumps.add((begin + np.flatnonzero(followed.jumps[first:])).tolist())
        self._add_speeds(followed, first, begin)
        self._room.add(-room.values, room.names, first, begin, path)
        if tilts is not None:
            self._tilt.add(tilts.values, tilts.names, first, begin, path)
        self.count += len(status)

    def _add_speeds(self, followed: Track, first: int, begin: int) -> None:
        too_fast, speeds = followed.too_fast, followed.speeds
        if too_fast is None or speeds is None:
            return
        for column, (name, (targets, _)) in enumerate(self._hasty.items()):
            rows = [row for row, names in enumerate(too_fast[first:]) if name in names]
            if rows:
                targets.add(begin + row for row in rows)
                fastest = float(np.nanmax(speeds[first:, column]))
                self._speeds[name] = max(self._speeds.get(name, 0.0), fastest)

    @property
    def is_well(self) -> bool:
        """Whether all targets were reached, and no actuator has to be too fast."""
        return self._counts["reached"] == self.count and not self._speeds

    def line(self) -> str:
        """How many targets came to what, how far off, and where answers leap or are too fast."""
        counts = ((status.name.lower(), self._counts[status.name.lower()]) for status in pf.Status)
        told = [", ".join(f"{count} {name}" for name, count in counts if count or name == "reached")]
        if self._failed.count:
            told.append(f"failed at {self._failed}")
        if self._counts["projected"]:
            told.append(f"farthest from its target {self._farthest:.3g} {self._mechanism.length_unit}")
        if self._jumps.count:
            told.append(f"{counted(self._jumps.count, 'jump')} ({self._jumps})")
        for name, (targets, shown) in self._hasty.items():
            if name in self._speeds:
                fastest = float(shown.display(np.array(self._speeds[name])))
                told.append(f"{name} too fast: {fastest:.3g} {shown.unit}/s ({targets})")
        return "; ".join(told)

    def worst(self) -> str:
        """The step with the least margin, and the one where a rod is tilted most; empty where there is neither."""
        told = []
        if self._room.name:
            told.append(f"worst step: {self._room.place}, margin {-self._room.value:.3g} of {self._room.name}")
        if self._tilt.name:
            degrees = math.degrees(self._tilt.value)
            told.append(f"largest tilt: {degrees:.3g} deg of {self._tilt.name} at {self._tilt.place}")
        return "; ".join(told)
