"""CSV: a header that names columns in any order, then one target a line."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Sequence

import numpy as np

from ..arrays import Floats
from ..description.mechanism import Mechanism
from ..errors import near_miss
from ..motion.first_order import generic_of
from ..poses import pose
from ..tolerances import TOLERANCES
from .path import MOST_STEPS, Path

POSITION = ("x", "y", "z")
ANGLES = ("roll", "pitch", "yaw")
NAMES = (*POSITION, *(f"{name}{unit}" for name in ANGLES for unit in ("", "_deg", "_rad")), "t", "feed")


class WrongTable(ValueError):
    """A table that is no path; its text names the line and what was found."""


def read_table(lines: Iterable[str], mechanism: Mechanism) -> Path:
    """A path from the lines of a table; columns of other names are left out.

    Raises
    ------
    WrongTable
    """
    rows = ((number, cells) for number, cells in _numbered(lines) if any(cells))
    try:
        first, header = next(rows)
    except StopIteration:
        raise WrongTable("empty; expected a header with x, y, z") from None
    _check_header(first, header, mechanism)
    found: list[list[float]] = []
    numbers: list[int] = []
    wanted = [(place, name) for place, name in enumerate(header) if name in NAMES]
    for number, cells in rows:
        if len(found) == MOST_STEPS:
            raise WrongTable(f"line {number}: more than {MOST_STEPS} targets; expected a shorter path, or parts of it")
        if len(cells) != len(header):
            raise WrongTable(f"line {number}: found {len(cells)} cells; expected {len(header)}")
        found.append([_number(number, name, cells[place]) for place, name in wanted])
        numbers.append(number)
    if not found:
        raise WrongTable("no targets below the header")
    columns = dict(zip((name for _, name in wanted), np.array(found).T, strict=True))
    return _path(columns, numbers, mechanism)


def _numbered(lines: Iterable[str]) -> Iterable[tuple[int, list[str]]]:
    reader = csv.reader(lines)
    try:
        for cells in reader:
            yield reader.line_num, [cell.strip() for cell in cells]
    except csv.Error as error:
        raise WrongTable(f"line {reader.line_num}: not a CSV text file: {error}") from error


def _check_header(line: int, header: Sequence[str], mechanism: Mechanism) -> None:
    """Columns that a target needs, each once, angles in one unit."""
    twice = [name for name in dict.fromkeys(header) if header.count(name) > 1]
    if twice:
        raise WrongTable(f"line {line}: column '{twice[0]}' appears twice")
    moves = np.abs(generic_of(mechanism).directions[:3]).max(axis=1, initial=0.0) > TOLERANCES.alignment
    missing = [
        name
        for name, free in zip(POSITION, moves, strict=True)
        if free and name in mechanism.task and name not in header
    ]
    if missing:
        hint = near_miss(missing[0], header)
        raise WrongTable(f"line {line}: no column {', '.join(missing)}{hint}; expected x, y, z and roll, pitch, yaw")
    for name in ANGLES:
        ways = [each for each in (name, f"{name}_deg", f"{name}_rad") if each in header]
        if len(ways) > 1:
            raise WrongTable(f"line {line}: found columns {' and '.join(ways)}; expected one of them")
    if not any(name in NAMES[:-2] for name in header):
        raise WrongTable(f"line {line}: no column of a pose; expected x, y, z and roll, pitch, yaw")


def _number(line: int, name: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise WrongTable(f"line {line}: column '{name}': found '{cell[:20]}'; expected a finite number")
    return value


def _path(columns: dict[str, Floats], lines: list[int], mechanism: Mechanism) -> Path:
    count = len(lines)
    home = mechanism.reference_point
    positions = [columns.get(name, np.full(count, at)) for name, at in zip(POSITION, home, strict=True)]
    angles = []
    for name in ANGLES:
        degrees = columns.get(name, columns.get(f"{name}_deg", np.zeros(count)))
        angles.append(columns.get(f"{name}_rad", np.radians(degrees)))
    times, feeds = columns.get("t"), columns.get("feed", np.full(count, math.nan))
    if times is not None and not (np.diff(times) > 0.0).all():
        place = int(np.flatnonzero(np.diff(times) <= 0.0)[0]) + 1
        raise WrongTable(f"line {lines[place]}: column 't': found {times[place]:g}; expected times that grow")
    if (feeds <= 0.0).any():
        place = int(np.flatnonzero(feeds <= 0.0)[0])
        raise WrongTable(f"line {lines[place]}: column 'feed': found {feeds[place]:g}; expected a feed above zero")
    return Path(pose(np.array(positions).T, rpy=np.array(angles).T), times, feeds, lines)
