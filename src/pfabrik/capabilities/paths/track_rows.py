"""Answers along a path as rows of a CSV file, while they come in parts."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import chain
from typing import TextIO, TypeAlias

import numpy as np

from ...answers.status import Status
from ...answers.tracked import Track
from ...answers.words import short_names
from ...common.arrays import Floats
from ...common.cells import CsvWriter
from ...common.rotations import to_rpy
from ...kinematics import readouts
from .follow import TrackPart
from .path import AngleUnit, Path

POSITION, ANGLES = ("x", "y", "z"), ("roll", "pitch", "yaw")

Columns: TypeAlias = tuple[Sequence[str], Sequence[Sequence[float | str]]]
"""Names of some columns, and their cells: a sequence for each row."""


class TrackRows:
    """Writes answers to an open file: a header, then one row for each target.

    A row has the target, its time if the path gives it, further columns, pose, status, actuators with their speeds and
    accelerations, the least margin and the largest tilt of a rod, errors, active limits, jumps, and actuators that are
    too fast. Angles are in the units of the path, which their columns name. `jump` is 1 where the answer jumps away
    from the one before it. Cells are empty where there is no value.
    """

    def __init__(self, handle: TextIO) -> None:
        self._writer, self._is_begun = CsvWriter(handle), False

    def write(self, part: TrackPart) -> None:
        """Write the rows of a part that are new."""
        path, track, units = part.path.after(part.first), part.track, part.path.angle_units
        names, poses = _pose_names(units), (path.targets, track.pose[part.first :])
        targets, answers = (_numbers(_coordinates(each, units)) for each in poses)
        asked: list[Columns] = [([f"target_{name}" for name in names], targets)]
        if path.times is not None:
            asked.append((["t"], _numbers(path.times[:, None])))
        answered = [(names, answers), *_answer_columns(track, part.first, "deg" if "deg" in units else "rad")]
        taken = {name for names, _ in (*asked, *answered) for name in names}
        columns = [*asked, _further(path, taken), *answered]
        if not self._is_begun:
            self._writer.writerow(list(chain.from_iterable(names for names, _ in columns)))
            self._is_begun = True
        self._writer.writerows(map(chain.from_iterable, zip(*(cells for _, cells in columns), strict=True)))


def _further(path: Path, taken: set[str]) -> Columns:
    """Further columns of a path as they came in, under other names where these are taken."""
    names = [name for name in path.others if not (name == "t" and path.times is not None)]
    cells = list(zip(*(path.others[name] for name in names), strict=True)) or [()] * len(path.lines)
    return [f"path_{name}" if name in taken else name for name in names], cells


def _answer_columns(track: Track, first: int, unit: AngleUnit) -> Iterator[Columns]:
    """Columns of the answers from row `first` on, but for their poses."""
    new, drives = slice(first, None), readouts(track.mechanism)
    is_angle = np.array([drive.is_angle for drive in drives])
    names = [f"{printable(drive.name)}{f'_{unit}' if drive.is_angle else ''}" for drive in drives]
    yield ["status"], [[Status(status).name] for status in track.status[new].tolist()]
    rates = (("actuator", track.actuators), ("speed", track.speeds), ("acceleration", track.accelerations))
    for kind, values in rates:
        if values is not None:
            shown = np.where(is_angle, _shown(values[new], unit), values[new])
            yield [f"{kind}_{name}" for name in names], _numbers(shown)
    margins, tilts = track.least_margins, track.largest_tilts
    yield ["margin", "margin_of"], list(zip(_cells(margins.values[new]), margins.names[new], strict=True))
    if tilts is not None:
        cells = _cells(_shown(tilts.values[new], unit))
        yield [f"tilt_{unit}", "tilt_of"], list(zip(cells, tilts.names[new], strict=True))
    errors = np.stack([track.position_error, _shown(track.rotation_error, unit)], axis=-1)
    yield ["position_error", f"rotation_error_{unit}"], errors[new].tolist()
    too_fast = track.too_fast or [()] * len(track)
    yield (
        ["active_limits", "jump", "too_fast"],
        [
            (short_names(limits), int(jump), "; ".join(names))
            for limits, jump, names in zip(track.active_limits[new], track.jumps[new], too_fast[new], strict=True)
        ],
    )


def _pose_names(units: Sequence[AngleUnit]) -> list[str]:
    return [*POSITION, *(f"{name}_{unit}" for name, unit in zip(ANGLES, units, strict=True))]


def _coordinates(poses: Floats, units: Sequence[AngleUnit]) -> Floats:
    """Position and roll, pitch, yaw of poses: (n, 4, 4) to (n, 6)."""
    angles = zip(to_rpy(poses[:, :3, :3]).T, units, strict=True)
    shown = [_shown(values, unit) for values, unit in angles]
    return np.column_stack([poses[:, :3, 3], *shown]) + 0.0  # so that no -0.0 is written


def _shown(angles: Floats, unit: AngleUnit) -> Floats:
    return np.degrees(angles) if unit == "deg" else angles


def _numbers(values: Floats) -> list[Sequence[float | str]]:
    """Numbers (n, k) as cells, empty where there is none."""
    return values.tolist() if np.isfinite(values).all() else [_cells(row) for row in values]


def _cells(values: Floats) -> Sequence[float | str]:
    return ["" if math.isnan(value) else value for value in values.tolist()]


def printable(name: str) -> str:
    """A name without line breaks and other control characters."""
    return "".join(letter if letter.isprintable() else letter.encode("unicode_escape").decode() for letter in name)
