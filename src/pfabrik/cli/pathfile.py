"""Paths in CSV files: targets in, answers out."""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import click
import numpy as np

import pfabrik as pf

from ..answers.words import short_names
from ..arrays import Floats
from ..description.readouts import readouts
from ..description.task import task_of
from ..errors import near_miss
from ..motion.first_order import generic_of
from ..paths.path import MOST_STEPS
from ..paths.read_path import GCODE
from ..rotations import to_rpy
from ..tolerances import TOLERANCES
from .finite import is_finite

if TYPE_CHECKING:
    from _csv import Reader

    from ..answers.tracked import Track
    from ..description.mechanism import Mechanism

POSITION = ("x", "y", "z")
ANGLES = ("roll", "pitch", "yaw")
UNITS = ("deg", "rad")
KNOWN = (*POSITION, *ANGLES, *(f"{name}_{unit}" for name in ANGLES for unit in UNITS))
EXPECTED = "expected x, y, z and optionally roll, pitch, yaw [deg], or roll_rad, pitch_rad, yaw_rad"
FAULTS_SHOWN = 10
STANDARD = Path("-")


@dataclass(frozen=True)
class PathFile:
    """What a path file holds.

    Attributes
    ----------
    targets : (n, 4, 4) [length].
    unit : of its angles, "deg" or "rad"; answers are written in the same.
    others : further columns by name, the cells as they were, n each; they go out as they came in.
    """

    targets: Floats
    unit: str = "deg"
    others: Mapping[str, Sequence[str]] = field(default_factory=dict)


class WrongPath(click.ClickException):
    """A path file that cannot be read; every line of the message is one fault."""

    def __init__(self, path: Path, faults: Sequence[str]) -> None:
        more = [f"and {len(faults) - FAULTS_SHOWN} more faults"] if len(faults) > FAULTS_SHOWN else []
        name = "standard input" if path == STANDARD else path
        super().__init__("\n".join(f"{name}: {fault}" for fault in [*faults[:FAULTS_SHOWN], *more]))


def read_path(path: Path, mechanism: Mechanism) -> PathFile:
    """Targets from a CSV file, or from standard input for ``-``.

    A header line names the columns: x, y, z and, optionally, roll, pitch, yaw, in degrees, or in the unit that their
    names end in. Coordinates that the end effector cannot change, and those that its task leaves out, may be missing.
    """
    if path.suffix.lower() in GCODE:
        return PathFile(pf.read_path(path, mechanism).targets)
    try:
        source = nullcontext(sys.stdin) if path == STANDARD else path.open(newline="", encoding="utf-8-sig")
        with source as handle:
            told = ((number, cells) for number, cells in numbered(csv.reader(handle)) if any(cells))
            lines = list(islice(told, MOST_STEPS + 2))
    except (UnicodeDecodeError, csv.Error) as error:
        raise WrongPath(path, [f"not a CSV text file: {error}"]) from error
    if len(lines) > MOST_STEPS + 1:
        raise WrongPath(path, [f"more than {MOST_STEPS} targets; expected a shorter path, or parts of it"])
    if not lines:
        raise WrongPath(path, [f"empty; {EXPECTED} in the first line"])
    (header_line, header), *rows = lines
    refuse(path, header_faults(header_line, header, mechanism))
    note_misspelt(header)
    refuse(path, [fault for number, cells in rows for fault in row_faults(number, header, cells)])
    if not rows:
        raise WrongPath(path, ["no targets below the header"])
    cells = dict(zip(header, zip(*(cells for _, cells in rows), strict=True), strict=True))
    unit = "rad" if any(f"{name}_rad" in header for name in ANGLES) else "deg"
    home = [[each] * len(rows) for each in mechanism.reference_point]
    positions = np.array([cells.get(name, at_home) for name, at_home in zip(POSITION, home, strict=True)], float).T
    columns = (cells.get(name, cells.get(f"{name}_{unit}", [0.0] * len(rows))) for name in ANGLES)
    targets = pf.pose(positions, rpy=np.array(list(columns), float).T, degrees=unit == "deg")
    return PathFile(targets, unit, {name: column for name, column in cells.items() if name not in KNOWN})


def numbered(reader: Reader) -> Iterator[tuple[int, list[str]]]:
    """Rows with the line they end on, cells without surrounding blanks."""
    for cells in reader:
        yield reader.line_num, [cell.strip() for cell in cells]


def refuse(path: Path, faults: Sequence[str]) -> None:
    """Stop if there are faults."""
    if faults:
        raise WrongPath(path, faults)


def header_faults(line: int, header: Sequence[str], mechanism: Mechanism) -> list[str]:
    """Repeated columns, missing ones, angles in two units, and a path that says nothing of the task."""
    faults = [f"line {line}: column '{name}' appears twice" for name in dict.fromkeys(header) if header.count(name) > 1]
    angles = [name for name in header if name in KNOWN and name not in POSITION]
    if any(name.endswith("_rad") for name in angles) and not all(name.endswith("_rad") for name in angles):
        faults.append(f"line {line}: angles in degrees and in radians: {', '.join(angles)}; expected one unit")
    missing = [name for name in needed(mechanism) if name not in header]
    if missing:
        hints = "".join(near_miss(name, [each for each in header if each not in KNOWN]) for name in missing)
        faults.append(f"line {line}: no column {', '.join(missing)}{hints}; {EXPECTED}")
    elif not any(name in KNOWN for name in header):
        faults.append(f"line {line}: no column of a pose; {EXPECTED}")
    return faults


def note_misspelt(header: Sequence[str]) -> None:
    """Say so where a further column is named nearly like one of a pose."""
    for name in header:
        hint = "" if name in KNOWN else near_miss(name, KNOWN)
        if hint:
            click.echo(f"pfabrik: note: column '{name}' goes out as it came in{hint}", err=True)


def needed(mechanism: Mechanism) -> list[str]:
    """The coordinates of a position that a target must give: those that the task has, and the end effector changes."""
    moves = np.abs(generic_of(mechanism).directions[:3]).max(axis=1, initial=0.0) > TOLERANCES.alignment
    return [name for name, asked, free in zip(POSITION, task_of(mechanism).axes, moves, strict=True) if asked and free]


def row_faults(line: int, header: Sequence[str], cells: Sequence[str]) -> list[str]:
    """Rows of the wrong length and cells that are not finite numbers."""
    if len(cells) != len(header):
        return [f"line {line}: found {len(cells)} cells; expected {len(header)}"]
    return [
        f"line {line}: column '{name}': found '{cell}'; expected a finite number"
        for name, cell in zip(header, cells, strict=True)
        if name in KNOWN and not is_finite(cell)
    ]


def write_track(handle: TextIO, path: PathFile, followed: Track) -> None:
    """One row for each target: it, further columns, pose, status, actuators, errors, limits, and what is swift.

    Angles are in the unit of the path file, which their columns name. `jump` is 1 where the answer leaps away from the
    one before it; `too_fast` names actuators.
    """
    writer, shown, unit = csv.writer(handle, lineterminator="\n"), readouts(followed.mechanism), path.unit
    factors = np.array([in_unit(1.0, unit) if each.is_angle else 1.0 for each in shown])
    names = [f"actuator_{printable(each.name)}{f'_{unit}' if each.is_angle else ''}" for each in shown]
    pose_names = [*POSITION, *(f"{name}_{unit}" for name in ANGLES)]
    ends = ["position_error", f"rotation_error_{unit}", "active_limits", "jump", "too_fast"]
    own = [*(f"target_{name}" for name in pose_names), *pose_names, "status", *names, *ends]
    others = [f"path_{name}" if name in own else name for name in path.others]
    writer.writerow([*own[:6], *others, *own[6:]])
    too_fast = followed.too_fast or [()] * len(followed)
    words = zip(
        map(short_names, followed.active_limits), map(int, followed.jumps), map("; ".join, too_fast), strict=True
    )
    errors = np.stack([followed.position_error, in_unit(followed.rotation_error, unit)], axis=-1)
    actuators = followed.actuators * factors
    numbers = (coordinates(path.targets, unit), coordinates(followed.pose, unit), actuators, errors)
    carried = list(zip(*path.others.values(), strict=True)) or [()] * len(followed)
    for status, (target, pose, values, error), extra, ending in zip(
        followed.status, zip(*map(np.ndarray.tolist, numbers), strict=True), carried, words, strict=True
    ):
        writer.writerow([*target, *extra, *pose, pf.Status(int(status)).name, *values, *error, *ending])


def in_unit(angles: float | Floats, unit: str) -> float | Floats:
    """Angles [rad] in a unit."""
    return np.degrees(angles) if unit == "deg" else angles


def printable(name: str) -> str:
    """A name without line breaks and other control characters."""
    return "".join(each if each.isprintable() else each.encode("unicode_escape").decode() for each in name)


def coordinates(poses: Floats, unit: str) -> Floats:
    """Position and roll, pitch, yaw of poses: (n, 4, 4) to (n, 6)."""
    angles = in_unit(to_rpy(poses[:, :3, :3]), unit)
    return np.concatenate([poses[:, :3, 3], np.asarray(angles)], axis=-1) + 0.0  # so that no -0.0 is written
