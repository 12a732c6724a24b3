"""CSV: a header that names columns in any order, then one target a line; commas and points as countries have them."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain, islice

import numpy as np

from ..arrays import Floats
from ..cells import is_finite, unmarked
from ..description.mechanism import Mechanism
from ..errors import counted, near_miss
from ..kinematics import generic_of, passive_series, task_of
from ..poses import pose
from ..tolerances import TOLERANCES
from .joint_columns import JointColumns, joint_columns
from .path import BLOCK, AngleUnit, Path, WrongPath

POSITION = ("x", "y", "z")
ANGLES = {"roll": "a", "pitch": "b", "yaw": "c"}
"""Turns about x, y and z, and what machine tools call them; the latter only with a unit behind it."""

UNITS: tuple[AngleUnit, ...] = ("deg", "rad")
OF_ANGLES = {
    name: (name, *(f"{each}_{unit}" for each in (name, letter) for unit in UNITS)) for name, letter in ANGLES.items()
}
QUATERNION = ("qx", "qy", "qz", "qw")
AMBIGUOUS = ("rx", "ry", "rz")
"""Angles to some, parts of a rotation vector to others."""

OF_POSES = (*POSITION, *(column for columns in OF_ANGLES.values() for column in columns), *QUATERNION)
NUMERIC = (*OF_POSES, "t", "feed")
SEPARATORS = (",", ";", "\t")
SAID = re.compile(r'"?sep=(.)"?', re.IGNORECASE)
"""A first line that gives spreadsheets the separator."""

EXPECTED = "expected x, y, z and roll, pitch, yaw or qx, qy, qz, qw"


class CsvTable:
    """The lines of a table, of which only the header is read at first.

    Attributes
    ----------
    has_times : True if a column gives times or feeds.

    Raises
    ------
    WrongPath
    """

    def __init__(self, lines: Iterable[str], mechanism: Mechanism) -> None:
        self._mechanism = mechanism
        self._separator, lines = _separated(iter(lines))
        self._decimal = "." if self._separator == "," else None
        self._rows = ((number, cells) for number, cells in _numbered(lines, self._separator) if any(cells))
        number, header = next(self._rows, (1, []))
        if not header:
            raise WrongPath("empty; expected a header with x, y, z")
        self._header = [name.lower() if name.lower() in OF_POSES else unmarked(name) for name in header]
        by_joints = not any(name in OF_POSES for name in self._header)
        self._joints = joint_columns(mechanism, self._header) if by_joints else None
        _require_once(number, self._header)
        if self._joints is None:
            _check_header(number, self._header, mechanism)
        self._numeric = {*NUMERIC, *(self._joints.columns if self._joints is not None else ())}
        self.has_times = "t" in self._header or "feed" in self._header

    def blocks(self) -> Iterator[Path]:
        """The targets, in parts."""
        last = -math.inf
        rows = list(islice(self._rows, BLOCK))
        if not rows:
            raise WrongPath("no targets below the header")
        while rows:
            block = self._block(rows)
            if block.times is not None:
                _check_times(np.concatenate([[last], block.times]), block.lines)
                last = float(block.times[-1])
            yield block
            rows = list(islice(self._rows, BLOCK))

    def _block(self, rows: Sequence[tuple[int, list[str]]]) -> Path:
        columns: dict[str, Floats] = {}
        lines = [number for number, _ in rows]
        for number, cells in rows:
            if len(cells) != len(self._header):
                raise WrongPath(f"line {number}: found {counted(len(cells), 'cell')}; expected {len(self._header)}")
        texts_by_name = dict(zip(self._header, zip(*(cells for _, cells in rows), strict=True), strict=True))
        others: dict[str, Sequence[str]] = {}
        for name, texts in texts_by_name.items():
            if name not in self._numeric:
                others[name] = [unmarked(cell) for cell in texts]
                continue
            numbers = self._with_points(name, texts, lines)
            columns[name] = _numbers(name, numbers, lines)
            if name in ("t", "feed"):
                others[name] = numbers
        return _path(columns, others, lines, self._mechanism, self._joints)

    def _with_points(self, name: str, cells: Sequence[str], lines: Sequence[int]) -> Sequence[str]:
        """Numbers with decimal points; WrongPath where some have commas, and others points."""
        if self._separator == ",":
            return cells
        for line, cell in zip(lines, cells, strict=True):
            if "," in cell and not is_finite(cell.replace(",", ".")):
                raise WrongPath(f"line {line}: column '{name}': found '{cell[:20]}'; expected a finite number")
            mark = "," if "," in cell else "." if "." in cell else self._decimal
            if self._decimal not in (None, mark):
                fault = f"found '{cell[:20]}'; expected decimals with '{self._decimal}', as before"
                raise WrongPath(f"line {line}: column '{name}': {fault}")
            self._decimal = mark
        return [cell.replace(",", ".") for cell in cells] if self._decimal == "," else cells


def _separated(lines: Iterator[str]) -> tuple[str, Iterator[str]]:
    """The separator of cells, from a first line that gives it or from the column names in the header; and all lines."""
    read: list[str] = []
    for line in lines:
        read.append(line)
        if line.strip():
            break
    stated = SAID.fullmatch(read[-1].strip()) if read else None
    if stated is not None:
        read[-1] = "\n"
        return stated[1], chain(read, lines)
    return max(SEPARATORS, key=lambda separator: _names(read[-1:], separator)), chain(read, lines)


def _names(header: Sequence[str], separator: str) -> tuple[int, int]:
    """Numbers of known names and of cells that a header has with a separator."""
    cells = [cell.strip() for row in csv.reader(header, delimiter=separator) for cell in row]
    return sum(name in NUMERIC or name.lower() in OF_POSES for name in cells), len(cells)


def _numbered(lines: Iterable[str], separator: str) -> Iterator[tuple[int, list[str]]]:
    reader = csv.reader(lines, delimiter=separator)
    try:
        for cells in reader:
            yield reader.line_num, [cell.strip() for cell in cells]
    except csv.Error as error:
        raise WrongPath(f"line {reader.line_num}: not a CSV text file: {error}") from error


def _require_once(line: int, header: Sequence[str]) -> None:
    """Refuse a header that has a column twice."""
    twice = [name for name in dict.fromkeys(header) if header.count(name) > 1]
    if twice:
        raise WrongPath(f"line {line}: column '{twice[0]}' appears twice")


def _check_header(line: int, header: Sequence[str], mechanism: Mechanism) -> None:
    """Refuse a header without the columns of a target, or with an angle in two units."""
    moves = np.abs(generic_of(mechanism).directions[:3]).max(axis=1, initial=0.0) > TOLERANCES.alignment
    missing = [
        name
        for name, is_asked, is_free in zip(POSITION, task_of(mechanism).axes, moves, strict=True)
        if is_asked and is_free and name not in header
    ]
    if missing:
        hint = near_miss(missing[0], [name for name in header if name not in NUMERIC])
        between = ", with commas between" if len(header) == 1 else ""
        raise WrongPath(f"line {line}: no column {', '.join(missing)}{hint}; {EXPECTED}{between}")
    for columns in OF_ANGLES.values():
        same = [name for name in columns if name in header]
        if len(same) > 1:
            raise WrongPath(f"line {line}: found columns {' and '.join(same)}; expected one of them")
    turning = [name for name in OF_POSES if name in header and name not in POSITION]
    parts = [name for name in turning if name in QUATERNION]
    if parts and turning != [*QUATERNION]:
        raise WrongPath(f"line {line}: found columns {', '.join(turning)}; expected {', '.join(QUATERNION)} alone")
    unread = [name for name in header if name.lower() in AMBIGUOUS]
    if unread and not turning and task_of(mechanism).rotations:
        raise WrongPath(f"line {line}: found columns {', '.join(unread)} for turns; {EXPECTED}")
    if not any(name in OF_POSES for name in header):
        series = ", ".join(passive_series(mechanism))
        raise WrongPath(f"line {line}: no column of a pose; {EXPECTED}{', or ' if series else ''}{series}")


def _numbers(name: str, cells: Sequence[str], lines: Sequence[int]) -> Floats:
    for line, cell in zip(lines, cells, strict=True):
        if not is_finite(cell):
            raise WrongPath(f"line {line}: column '{name}': found '{cell[:20]}'; expected a finite number")
    return np.array(cells, dtype=float)


def _path(
    columns: Mapping[str, Floats],
    others: Mapping[str, Sequence[str]],
    lines: list[int],
    mechanism: Mechanism,
    joints: JointColumns | None,
) -> Path:
    count, home = len(lines), mechanism.reference_point
    positions = [columns.get(name, np.full(count, at)) for name, at in zip(POSITION, home, strict=True)]
    given = [next((name for name in names if name in columns), "") for names in OF_ANGLES.values()]
    units: list[AngleUnit] = ["rad" if name.endswith("_rad") else "deg" for name in given]
    units_given = {unit for unit, name in zip(units, given, strict=True) if name} or {"deg"}
    if len(units_given) == 1:  # angles that are not given come in the unit of the others
        units = [*units_given] * 3
    angles = [columns.get(name, np.zeros(count)) for name in given]
    turned = [np.radians(values) if unit == "deg" else values for values, unit in zip(angles, units, strict=True)]
    feeds = columns.get("feed", np.full(count, math.nan))
    if (feeds <= 0.0).any():
        place = int(np.flatnonzero(feeds <= 0.0)[0])
        raise WrongPath(f"line {lines[place]}: column 'feed': found {feeds[place]:g}; expected a feed above zero")
    if joints is not None:
        targets = joints.poses(columns)
    elif QUATERNION[0] in columns:
        targets = pose(np.array(positions).T, quat_xyzw=_quaternions(columns, lines))
    else:
        targets = pose(np.array(positions).T, rpy=np.array(turned).T)
    return Path(targets, columns.get("t"), feeds, lines, others, (units[0], units[1], units[2]))


def _quaternions(columns: Mapping[str, Floats], lines: Sequence[int]) -> Floats:
    """Quaternions (n, 4), of any length but zero."""
    quaternions = np.stack([columns[name] for name in QUATERNION], axis=-1)
    zero = np.flatnonzero(~quaternions.any(axis=-1))
    if len(zero):
        raise WrongPath(f"line {lines[int(zero[0])]}: found a zero quaternion; expected one that is a rotation")
    return quaternions


def _check_times(times: Floats, lines: Sequence[int]) -> None:
    """Refuse times that do not grow."""
    back = np.flatnonzero(np.diff(times) <= 0.0)
    if len(back):
        place = int(back[0])
        raise WrongPath(f"line {lines[place]}: column 't': found {times[place + 1]:g}; expected times that grow")
