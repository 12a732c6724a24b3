"""Answers along a path as a CSV file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TextIO

import numpy as np

import pfabrik as pf

from ..answers.words import short_names
from ..cells import CsvWriter
from ..description.readouts import readouts
from ..paths.along import Extremes, largest_tilts, least_margins
from ..rotations import to_rpy

if TYPE_CHECKING:
    from ..answers.tracked import Track
    from ..arrays import Floats
    from ..description.mechanism import Mechanism
    from ..paths.path import AngleUnit, Path

POSITION = ("x", "y", "z")
ANGLES = ("roll", "pitch", "yaw")


class TrackRows:
    """Writes answers to an open file: a header, then one row for each target.

    A row has the target, its time if the path says, further columns, pose, status, actuators with their speeds and
    accelerations, the least margin and the largest tilt of a rod, errors, active limits, and what is swift. Angles are
    in the units of the path, which their columns name. `jump` is 1 where the answer leaps away from the one before it;
    `too_fast` names actuators. Cells are empty where there is nothing to tell.
    """

    def __init__(self, handle: TextIO, mechanism: Mechanism, path: Path, has_rods: bool) -> None:
        """Write the header for a path that begins with `path`."""
        self._writer = CsvWriter(handle)
        self._units = path.angle_units
        self._unit: AngleUnit = "deg" if "deg" in path.angle_units else "rad"
        self._is_angle = np.array([each.is_angle for each in readouts(mechanism)])
        self._others = [name for name in path.others if not (name == "t" and path.times is not None)]
        names = [f"{printable(each.name)}{f'_{self._unit}' if each.is_angle else ''}" for each in readouts(mechanism)]
        pose = [*POSITION, *(f"{name}_{unit}" for name, unit in zip(ANGLES, self._units, strict=True))]
        target = [f"target_{name}" for name in pose]
        rates = [] if path.times is None else [f"{kind}_{name}" for kind in ("speed", "acceleration") for name in names]
        own = [*pose, "status", *(f"actuator_{name}" for name in names), *rates]
        own += ["margin", "margin_of", *([f"tilt_{self._unit}", "tilt_of"] if has_rods else [])]
        own += ["position_error", f"rotation_error_{self._unit}", "active_limits", "jump", "too_fast"]
        timed = [] if path.times is None else ["t"]
        taken = {*target, *timed, *own}
        others = [f"path_{name}" if name in taken else name for name in self._others]
        self._writer.writerow([*target, *timed, *others, *own])

    def write(self, path: Path, followed: Track, room: Extremes, tilts: Extremes | None, first: int = 0) -> None:
        """The rows of a part of the path, from the row `first` on."""
        new = slice(first, None)
        words = zip(
            map(short_names, followed.active_limits[new]),
            map(int, followed.jumps[new]),
            map("; ".join, (followed.too_fast or [()] * len(followed))[new]),
            strict=True,
        )
        errors = np.stack([followed.position_error, self._shown(followed.rotation_error)], axis=-1)
        times = np.zeros((len(followed), 0)) if path.times is None else path.times[:, None]
        actuators = self._in_units(followed.actuators)
        rates = [self._in_units(each) for each in (followed.speeds, followed.accelerations) if each is not None]
        numbers = (
            np.concatenate([self._coordinates(path.targets), times], axis=1),
            self._coordinates(followed.pose),
            np.concatenate([actuators, *rates], axis=1),
        )
        margin = zip(_cells(room.values[new]), room.names[new], strict=True)
        tilted: Any = [()] * (len(followed) - first)
        if tilts is not None:
            tilted = zip(_cells(self._shown(tilts.values[new])), tilts.names[new], strict=True)
        carried = list(zip(*(path.others[name][new] for name in self._others), strict=True))
        for target, pose, values, status, off, extra, least, most, ending in zip(
            *(_rows(each[new]) for each in numbers),
            followed.status[new].tolist(),
            errors[new].tolist(),
            carried or [()] * (len(followed) - first),
            margin,
            tilted,
            words,
            strict=True,
        ):
            name = pf.Status(status).name
            self._writer.writerow([*target, *extra, *pose, name, *values, *least, *most, *off, *ending])

    def _shown(self, angles: Floats) -> Floats:
        return np.degrees(angles) if self._unit == "deg" else angles

    def _in_units(self, values: Floats) -> Floats:
        """Numbers of actuators (n, n_a) in the units that are shown."""
        return np.where(self._is_angle, self._shown(values), values)

    def _coordinates(self, poses: Floats) -> Floats:
        """Position and roll, pitch, yaw of poses: (n, 4, 4) to (n, 6)."""
        angles = to_rpy(poses[:, :3, :3])
        shown = [np.degrees(each) if unit == "deg" else each for each, unit in zip(angles.T, self._units, strict=True)]
        return np.column_stack([poses[:, :3, 3], *shown]) + 0.0  # so that no -0.0 is written


def write_track(handle: TextIO, path: Path, followed: Track) -> None:
    """A whole path and its answers."""
    room, tilts = least_margins(followed), largest_tilts(followed)
    TrackRows(handle, followed.mechanism, path, tilts is not None).write(path, followed, room, tilts)


def _rows(values: Floats) -> list[Any]:
    """Numbers as cells, empty where there is none."""
    if np.isfinite(values).all():
        found: list[Any] = values.tolist()
        return found
    return [_cells(row) for row in values]


def _cells(values: Floats) -> Sequence[float | str]:
    return [value if value == value else "" for value in values.tolist()]


def printable(name: str) -> str:
    """A name without line breaks and other control characters."""
    return "".join(each if each.isprintable() else each.encode("unicode_escape").decode() for each in name)
