"""Paths in CSV files: targets in, answers out."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import click
import numpy as np
from numpy.typing import NDArray

import pfabrik as pf

from ..answers.words import short_names
from ..description.readouts import readouts
from ..errors import near_miss
from ..rotations import to_rpy

if TYPE_CHECKING:
    from _csv import Reader

    from ..answers.tracked import Track

Floats = NDArray[np.float64]
POSITION = ("x", "y", "z")
ANGLES = ("roll", "pitch", "yaw")
EXPECTED = "expected x, y, z and optionally roll, pitch, yaw [deg]"
FAULTS_SHOWN = 10


class WrongPath(click.ClickException):
    """A path file that cannot be read; every line of the message is one fault."""

    def __init__(self, path: Path, faults: Sequence[str]) -> None:
        more = [f"and {len(faults) - FAULTS_SHOWN} more faults"] if len(faults) > FAULTS_SHOWN else []
        super().__init__("\n".join(f"{path}: {fault}" for fault in [*faults[:FAULTS_SHOWN], *more]))


def read_targets(path: Path) -> Floats:
    """Targets (n, 4, 4) from a CSV file with the columns x, y, z and, optionally, roll, pitch, yaw [deg]."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as handle:
            lines = [(number, cells) for number, cells in numbered(csv.reader(handle)) if any(cells)]
    except (UnicodeDecodeError, csv.Error) as error:
        raise WrongPath(path, [f"not a CSV text file: {error}"]) from error
    if not lines:
        raise WrongPath(path, [f"empty; {EXPECTED} in the first line"])
    (header_line, header), *rows = lines
    refuse(path, header_faults(header_line, header))
    refuse(path, [fault for number, cells in rows for fault in row_faults(number, header, cells)])
    if not rows:
        raise WrongPath(path, ["no targets below the header"])
    columns = dict(zip(header, np.array([[float(cell) for cell in cells] for _, cells in rows]).T, strict=True))
    rpy = np.stack([columns.get(name, np.zeros(len(rows))) for name in ANGLES], axis=-1)
    positions = np.stack([columns[name] for name in POSITION], axis=-1)
    return pf.pose(positions, rpy=rpy, degrees=True)


def numbered(reader: Reader) -> Iterator[tuple[int, list[str]]]:
    """Rows with the line they end on, cells without surrounding blanks."""
    for cells in reader:
        yield reader.line_num, [cell.strip() for cell in cells]


def refuse(path: Path, faults: Sequence[str]) -> None:
    """Stop if there are faults."""
    if faults:
        raise WrongPath(path, faults)


def header_faults(line: int, header: Sequence[str]) -> list[str]:
    """Unknown, repeated and missing columns."""
    known = POSITION + ANGLES
    faults = [
        f"line {line}: unknown column '{name}'{near_miss(name, known)}; {EXPECTED}"
        for name in header
        if name not in known
    ]
    faults += [f"line {line}: column '{name}' appears twice" for name in known if header.count(name) > 1]
    needed = POSITION + (ANGLES if set(header) & set(ANGLES) else ())
    missing = ", ".join(name for name in needed if name not in header)
    return faults + ([f"line {line}: no column {missing}; {EXPECTED}"] if missing else [])


def row_faults(line: int, header: Sequence[str], cells: Sequence[str]) -> list[str]:
    """Rows of the wrong length and cells that are not finite numbers."""
    if len(cells) != len(header):
        return [f"line {line}: found {len(cells)} cells; expected {len(header)}"]
    return [
        f"line {line}: column '{name}': found '{cell}'; expected a finite number"
        for name, cell in zip(header, cells, strict=True)
        if not is_finite(cell)
    ]


def is_finite(cell: str) -> bool:
    """Whether a cell is a finite number."""
    try:
        return math.isfinite(float(cell))
    except ValueError:
        return False


def write_track(handle: TextIO, targets: Floats, followed: Track) -> None:
    """One row for each target: target, achieved pose, status, actuators, errors, active limits, and what is swift.

    Angles are in radians. `jump` is 1 where the answer leaps away from the one before it; `too_fast` names actuators.
    """
    writer = csv.writer(handle, lineterminator="\n")
    names = [f"actuator_{readout.name}{'_rad' if readout.is_angle else ''}" for readout in readouts(followed.mechanism)]
    pose_names = [*POSITION, *(f"{name}_rad" for name in ANGLES)]
    ends = ["position_error", "rotation_error_rad", "active_limits", "jump", "too_fast"]
    writer.writerow([*(f"target_{name}" for name in pose_names), *pose_names, "status", *names, *ends])
    too_fast = followed.too_fast or [()] * len(followed)
    words = zip(
        map(short_names, followed.active_limits), map(int, followed.jumps), map("; ".join, too_fast), strict=True
    )
    errors = np.stack([followed.position_error, followed.rotation_error], axis=-1)
    numbers = (coordinates(targets), coordinates(followed.pose), followed.actuators, errors)
    for status, (target, pose, actuators, error), ending in zip(
        followed.status, zip(*map(np.ndarray.tolist, numbers), strict=True), words, strict=True
    ):
        writer.writerow([*target, *pose, pf.Status(int(status)).name, *actuators, *error, *ending])


def coordinates(poses: Floats) -> Floats:
    """Position and roll, pitch, yaw [rad] of poses: (n, 4, 4) to (n, 6)."""
    return np.concatenate([poses[:, :3, 3], to_rpy(poses[:, :3, :3])], axis=-1) + 0.0  # so that no -0.0 is written
