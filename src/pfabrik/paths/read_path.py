"""Paths from files."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, nullcontext
from itertools import chain
from os import PathLike
from pathlib import Path as FilePath
from typing import TextIO

import numpy as np

from ..arrays import Floats
from ..description.mechanism import Mechanism, checked_mechanism
from ..errors import InvalidArgument
from ..poses import pose
from ..rotations import to_rpy
from .gcode import Step, WrongGCode, steps_of
from .path import MOST_STEPS, Path
from .table import WrongTable, read_table

GCODE = (".gcode", ".nc", ".ngc", ".g", ".gco", ".tap")
CHORD, LONGEST = 1e-5, 1e-2
"""How far chords are off their arcs, and the longest straight part of a move, as shares of L."""

LONGEST_LINE = 100_000
"""Characters of a line: what is longer is no text of a path."""


def read_path(
    path: str | PathLike[str],
    mechanism: Mechanism,
    *,
    tolerance: float | None = None,
    longest: float | None = None,
) -> Path:
    """A path for a mechanism from a CSV file, or from G-code.

    A CSV file has a header with columns in any order: x, y, z, and roll, pitch, yaw (in degrees, or in the unit that
    their names end in), t [s] and feed [length/s]; others are left out, and coordinates that the machine cannot change
    may be missing. G-code, by its file's ending or if the first line is no header, begins at home and has G0 to G3,
    planes, G20, G21, G90, G91 and F per minute; A, B, C are roll, pitch, yaw [deg]. Its moves come in steps.

    Parameters
    ----------
    path : a file, or ``-`` for standard input.
    tolerance : how far steps may be off an arc [length]; default 1e-5 L.
    longest : of a step [length]; default 1e-2 L.

    Raises
    ------
    InvalidArgument : a file that is no path, with its line; one of more than a million targets.
    """
    checked_mechanism(mechanism)
    length = mechanism.characteristic_length
    off = CHORD * length if tolerance is None else _positive("tolerance", tolerance)
    step = LONGEST * length if longest is None else _positive("longest", longest)
    name = "standard input" if str(path) == "-" else str(path)
    try:
        with _opened(path) as handle:
            lines = _text(handle)
            first = next(lines, "")
            every = chain([first], lines)
            if FilePath(path).suffix.lower() in GCODE or not _is_header(first):
                return _program(steps_of(every, _home(mechanism), mechanism.length_unit, off, step))
            return read_table(every, mechanism)
    except (WrongTable, WrongGCode) as error:
        raise InvalidArgument(name, *_both(str(error))) from None
    except UnicodeDecodeError:
        raise InvalidArgument(name, "a file that is no text", "CSV or G-code") from None


def _opened(path: str | PathLike[str]) -> AbstractContextManager[TextIO]:
    if str(path) == "-":
        return nullcontext(sys.stdin)
    return FilePath(path).open(newline="", encoding="utf-8-sig")


def _both(told: str) -> tuple[str, str]:
    """What was found, and what was expected."""
    found, _, expected = told.partition("; expected ")
    return found, expected or "CSV or G-code that can be followed"


def _positive(name: str, value: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not 0.0 < value < np.inf:
        raise InvalidArgument(name, repr(value), "a positive number")
    return float(value)


def _text(handle: TextIO) -> Iterator[str]:
    """Lines, none of them endless."""
    number = 0
    while line := handle.readline(LONGEST_LINE):
        number += 1
        if len(line) == LONGEST_LINE or "\0" in line:
            raise WrongTable(f"line {number}: no text of a path; expected CSV or G-code")
        yield line


def _is_header(line: str) -> bool:
    """Whether a line names columns: G-code has numbers after its letters."""
    cells = [cell.strip() for cell in line.split(",")]
    return len(cells) > 1 or cells[0].isidentifier()


def _home(mechanism: Mechanism) -> Floats:
    pose_at_home = mechanism.home_pose
    return np.concatenate([pose_at_home[:3, 3], np.degrees(to_rpy(pose_at_home[:3, :3]))])


def _program(steps: Iterable[Step]) -> Path:
    places: list[Floats] = []
    feeds: list[float] = []
    lines: list[int] = []
    for step in steps:
        if len(places) > MOST_STEPS:
            found = f"line {step.line}: more than {MOST_STEPS} steps"
            raise WrongGCode(f"{found}; expected a shorter path, parts of it, or longer steps")
        places.append(step.place)
        feeds.append(step.feed)
        lines.append(step.line)
    if len(places) < 2:
        raise WrongGCode("no moves; expected CSV or G-code")
    found_places = np.array(places)
    targets = pose(found_places[:, :3], rpy=found_places[:, 3:], degrees=True)
    return Path(targets, None, np.array(feeds), lines)
