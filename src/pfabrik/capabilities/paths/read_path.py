"""Paths from files."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import BufferedReader
from itertools import chain, islice, repeat
from os import PathLike
from pathlib import Path as FilePath
from typing import TextIO

import numpy as np

from ...common.arrays import Floats
from ...common.checks import require_path, require_positive
from ...common.csv_columns import SAID
from ...common.rotations import to_rpy
from ...common.text_lines import WrongText, as_text, lines_of, refusing
from ...machine.description.mechanism import Mechanism, checked_mechanism
from ...machine.poses import pose
from .csv_table import CsvTable, named_columns
from .gcode import COMMENT, Move, steps_of
from .path import BLOCK, MOST_STEPS, Path, joined
from .sampling import at_rate, divided, timed

GCODE = (".gcode", ".nc", ".ngc", ".g", ".gco", ".tap")
PRINTERS = (".gcode", ".g", ".gco")
"""Endings of programs, and those of printers' among them."""

CHORD, LONGEST = 1e-5, 1e-2
"""Largest distance of a chord from its arc, and longest straight part of a move, as shares of L."""

FIRST_WORD = re.compile(r"\s*([%/]|[A-Z]\s*[-+.\d])", re.IGNORECASE)
"""The beginning of a line of G-code."""


def read_path(
    path: str | PathLike[str],
    mechanism: Mechanism,
    *,
    tolerance: float | None = None,
    longest: float | None = None,
    rate: float | None = None,
    rapid: float | None = None,
    columns: Mapping[str, str] | None = None,
    scale: float | Mapping[str, float] | None = None,
) -> Path:
    """A path for a mechanism from a CSV file, or from G-code.

    A CSV file, separated by commas, semicolons or tabs (with the last two also decimal commas), in UTF-8, UTF-16 or
    Latin-1, has a header with columns in any order: x, y, z, and roll, pitch, yaw (in degrees, or in the unit that
    their names end in; or a_deg, b_rad and the like) or the quaternion qx, qy, qz, qw, then t [s] and feed [length/s];
    others are handed on, and coordinates that the machine cannot change may be missing. In place of a pose there may be
    the coordinates of joints in series from base to end effector (pitch_joint, roll_joint; pivot[0], pivot[1]), angles
    in degrees or with _deg or _rad behind their names. G-code, by its file's ending or
    if the first line is no header, begins at home and has G0 to G4, planes, G20, G21, G90, G91 and F per minute; A, B,
    C are roll, pitch, yaw [deg]. Its moves come in steps. A dwell (G4) holds the pose for its time: S in s, P in ms in
    printers' programs (.gcode, .g, .gco, or with E) and in s in others, as LinuxCNC and Grbl have it.

    Parameters
    ----------
    path : str or PathLike
        A file, or ``-`` for standard input.
    mechanism : Mechanism
        The machine that is to follow it.
    tolerance : float, optional
        How far steps may be off an arc [length]; default 1e-5 L.
    longest : float, optional
        Greatest length of a step [length]; default 1e-2 L for G-code; targets of a table are as they are.
    rate : float, optional
        Steps per second instead, between the targets straight on [1/s].
    rapid : float, optional
        Feed of rapid moves [length/s], which say none.
    columns : mapping of str to str, optional
        What a table calls its columns: ``{"t": "time", "x": "surge [m]", "roll_rad": "roll"}``, of a recording say.
    scale : float or mapping of str to float, optional
        Factor on a table's lengths: x, y, z, feed and joints' (1000 from m to mm); or on columns by name, `lengths` for
        all of those: ``{"lengths": 1000.0, "t": 1e-3}``.

    Raises
    ------
    InvalidArgument
        A file that is no path, with its line; one of more than a million targets; a rate for a path that says nothing
        of time.
    """
    blocks = path_blocks(
        path, mechanism, tolerance=tolerance, longest=longest, rate=rate, rapid=rapid, columns=columns, scale=scale
    )
    path_read = joined(blocks)
    if path_read.times is not None and not np.isfinite(path_read.times).all():
        return path_read._replace(times=None)
    return path_read


def path_blocks(
    path: str | PathLike[str],
    mechanism: Mechanism,
    *,
    tolerance: float | None = None,
    longest: float | None = None,
    rate: float | None = None,
    rapid: float | None = None,
    columns: Mapping[str, str] | None = None,
    scale: float | Mapping[str, float] | None = None,
    sample_time: float | None = None,
    most: int | None = None,
) -> Iterator[Path]:
    """The path of `read_path` in parts; times are NaN from the first step on whose time is not known.

    Parameters
    ----------
    sample_time : from one target to the next [s], in place of the times of the path.
    most : targets at most; default a million.
    """
    most = MOST_STEPS if most is None else most
    length = checked_mechanism(mechanism).characteristic_length
    chord = CHORD * length if tolerance is None else require_positive("tolerance", tolerance)
    lengths_and_times = {"longest": longest, "rate": rate, "rapid": rapid, "sample_time": sample_time}
    for option, value in lengths_and_times.items():
        if value is not None:
            require_positive(option, value)
    as_named = named_columns(mechanism, {} if columns is None else columns, scale)
    file = require_path("path", path)
    name = "standard input" if str(file) == "-" else str(file)
    with refusing(name, "CSV or G-code that can be followed"), _opened(file) as handle:
        is_table, lines = _begun(lines_of(handle, 10 * most, "a path"), file.suffix.lower())
        if not is_table and as_named:
            raise WrongText("G-code; expected a table, of which columns and scale are")
        if is_table:
            table = CsvTable(lines, mechanism, as_named)
            blocks, has_times = _counted(table.blocks(), most), table.has_times
            if longest is not None:
                blocks = divided(blocks, longest)
        else:
            step = LONGEST * length if longest is None else longest
            passed: dict[str, int] = {}
            is_printers = file.suffix.lower() in PRINTERS
            program = steps_of(lines, _home(mechanism), mechanism.length_unit, chord, step, passed, is_printers)
            blocks, has_times = _program(program, passed, most), True
        if has_times or sample_time is not None or rate is not None:
            blocks = timed(blocks, sample_time, rapid)
        yield from _counted(blocks if rate is None else at_rate(blocks, rate), most)


@contextmanager
def _opened(path: FilePath) -> Iterator[TextIO]:
    if str(path) != "-":
        with path.open("rb") as raw:
            yield as_text(raw)
        return
    standard = getattr(sys.stdin, "buffer", None)
    if standard is None:
        yield sys.stdin
        return
    raw = standard if isinstance(standard, BufferedReader) else BufferedReader(standard)
    text = as_text(raw)
    try:
        yield text
    finally:
        text.detach()  # else standard input would be closed with it
        if raw is not standard:
            raw.detach()


def _begun(lines: Iterator[str], ending: str) -> tuple[bool, Iterator[str]]:
    """True if lines are a table, by the file's ending or by the first line that is not blank; and all lines."""
    n_blank, first = 0, ""
    for line in lines:
        first = line.removeprefix("\ufeff")
        if first.strip():
            break
        n_blank += 1
    all_lines = chain(repeat("\n", n_blank), [first] if first.strip() else [], lines)
    return ending == ".csv" or (ending not in GCODE and _is_header(first)), all_lines


def _is_header(line: str) -> bool:
    """True if a line names columns: G-code has numbers after its letters."""
    plain = COMMENT.sub(" ", line)
    if "," in plain or SAID.fullmatch(line.strip()):
        return True
    return FIRST_WORD.match(plain) is None and ("\t" in plain.strip() or plain.strip().isidentifier())


def _home(mechanism: Mechanism) -> Floats:
    pose_at_home = mechanism.home_pose
    return np.concatenate([pose_at_home[:3, 3], np.degrees(to_rpy(pose_at_home[:3, :3]))])


def _program(steps: Iterator[Move], passed: dict[str, int], most: int) -> Iterator[Path]:
    """The steps of a program, in parts, each with what was passed over so far."""
    count = 0
    while part := list(islice(steps, BLOCK)):
        count += len(part)
        _require_few(count, [step.line for step in part], most)
        if count < 2:
            break
        places = np.array([step.place for step in part])
        targets = pose(places[:, :3], rpy=places[:, 3:], degrees=True)
        feeds, lines = np.array([step.feed for step in part]), [step.line for step in part]
        dwells = np.array([step.dwell for step in part])
        yield Path(targets, None, feeds, lines, {}, ("deg", "deg", "deg"), dict(passed), dwells)
    if count < 2:
        raise WrongText("no moves; expected CSV or G-code")


def _counted(blocks: Iterable[Path], most: int) -> Iterator[Path]:
    """Blocks, up to as many steps as a path may have."""
    count = 0
    for block in blocks:
        count += len(block.lines)
        _require_few(count, block.lines, most)
        yield block


def _require_few(count: int, lines: Sequence[int], most: int) -> None:
    if count > most:
        found = f"line {lines[most - count]}: more than {most} targets"
        raise WrongText(f"{found}; expected a shorter path, parts of it, or longer steps")
