"""Targets from a table: which columns make them, one target a row."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ...common.arrays import Floats
from ...common.cells import unmarked
from ...common.checks import require_known, require_mapping, require_positive
from ...common.csv_columns import CsvColumns, CsvRows
from ...common.text_lines import WrongText
from ...errors import InvalidArgument, near_miss
from ...kinematics import JointPath, generic_of, joint_path, passive_series, task_of
from ...machine.description.mechanism import Mechanism
from ...machine.poses import pose
from ...tolerances import TOLERANCES
from .path import BLOCK, AngleUnit, Path

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

LENGTHS = (*POSITION, "feed")
"""Columns of lengths besides coordinates of joints."""

ALL_LENGTHS = "lengths"
"""The name under which one factor is for all lengths."""

EXPECTED = "expected x, y, z and roll, pitch, yaw or qx, qy, qz, qw"


class CsvTable:
    """The targets of a table, of which only the header is read at first.

    Attributes
    ----------
    has_times : True if a column gives times or feeds.

    Raises
    ------
    WrongText
    """

    def __init__(self, lines: Iterable[str], mechanism: Mechanism, as_named: NamedColumns) -> None:
        self._mechanism, self._factors = mechanism, as_named.of_lengths | as_named.scales
        self._table = CsvColumns(lines, as_named.spelled, NUMERIC, "x, y, z")
        header = self._table.header
        missing = [column for name, column in as_named.columns.items() if name not in header]
        if missing:
            known = ", ".join(as_named.columns.get(name, name.removeprefix(OF_FILE)) for name in header)
            raise WrongText(f"line {self._table.line}: no column '{missing[0]}'; expected one of those there: {known}")
        unscaled = [name for name in as_named.scales if name not in header]
        if unscaled:
            raise WrongText(
                f"line {self._table.line}: no column '{unscaled[0]}' to scale; expected one of {', '.join(header)}"
            )
        by_joints = not any(name in OF_POSES for name in header)
        self._joints = joint_columns(mechanism, header) if by_joints else None
        if self._joints is None:
            _check_header(self._table.line, header, mechanism)
        self._numeric = {*NUMERIC, *(self._joints.columns if self._joints is not None else ())}
        self.has_times = "t" in header or "feed" in header

    def blocks(self) -> Iterator[Path]:
        """The targets, in parts."""
        last, is_empty = -math.inf, True
        for rows in self._table.rows(BLOCK):
            is_empty = False
            block = self._block(rows)
            if block.times is not None:
                _check_times(np.concatenate([[last], block.times]), block.lines)
                last = float(block.times[-1])
            yield block
        if is_empty:
            raise WrongText("no targets below the header")

    def _block(self, rows: CsvRows) -> Path:
        columns: dict[str, Floats] = {}
        others: dict[str, Sequence[str]] = {}
        for name, texts in rows.texts.items():
            if name not in self._numeric:
                others[name] = [unmarked(cell) for cell in texts]
                continue
            numbers = self._table.numbers(rows, name)
            columns[name] = np.array(numbers, dtype=float) * self._factors.get(name, 1.0)
            if name in self._factors:
                numbers = [f"{value!r}" for value in columns[name].tolist()]
            if name in ("t", "feed"):
                others[name] = numbers
        return _path(columns, others, rows.lines, self._mechanism, self._joints)


@dataclass(frozen=True)
class NamedColumns:
    """What a file calls its columns, and factors on their numbers.

    Attributes
    ----------
    columns : name of a column of targets -> what the file calls it.
    scales : the same -> a factor on its numbers.
    of_lengths : every column of a length, there or not -> the factor on lengths, if there is one.
    """

    columns: Mapping[str, str]
    scales: dict[str, float]
    of_lengths: dict[str, float]

    def __bool__(self) -> bool:
        """False where a table is as it is."""
        return bool(self.columns or self.scales or self.of_lengths)

    def spelled(self, cell: str) -> str:
        """The name of a column: those of poses also in capitals; another that takes a given name is of the file."""
        name = cell.lower() if cell.lower() in OF_POSES else unmarked(cell)
        given = next((each for each, column in self.columns.items() if column == unmarked(cell)), "")
        return given or (f"{OF_FILE}{name}" if name in self.columns else name)


OF_FILE = "file_"
"""Before the name of a column that the file calls so, where another was named so."""


def named_columns(mechanism: Mechanism, columns: Any, scale: Any) -> NamedColumns:
    """Names and factors of the columns of targets for a mechanism, checked."""
    names = require_mapping("columns", columns, "name -> what the file calls the column")
    for name, column in names.items():
        if not isinstance(column, str):
            raise InvalidArgument(f"columns['{name}']", repr(column), "what the file calls the column")
    twice = next((column for column in names.values() if [*names.values()].count(column) > 1), None)
    if twice is not None:
        raise InvalidArgument("columns", f"'{twice}' twice", "a column of the file for each name")
    given = dict(scale) if isinstance(scale, Mapping) else {ALL_LENGTHS: scale} if scale is not None else {}
    known = (*NUMERIC, *joint_names(mechanism))
    require_known("column", names, known)
    require_known("column", given, (*known, ALL_LENGTHS))
    factors = {name: require_positive(f"scale of '{name}'", factor) for name, factor in given.items()}
    of_lengths = factors.pop(ALL_LENGTHS, None)
    lengths = (*LENGTHS, *(each.name for each in mechanism.coordinates if each.kind == "length"))
    return NamedColumns(dict(names), factors, {} if of_lengths is None else dict.fromkeys(lengths, of_lengths))


def joint_names(mechanism: Mechanism) -> dict[str, str]:
    """Name of a column, with its unit or without -> the coordinate of a joint that it has."""
    angles = [each.name for each in mechanism.coordinates if each.kind == "angle"]
    known = {each.name: each.name for each in mechanism.coordinates}
    return known | {name + unit: name for name in angles for unit in ("_deg", "_rad")}


class JointColumns(NamedTuple):
    """The columns of a header that are coordinates of joints in series, and what they give."""

    path: JointPath
    columns: tuple[str, ...]

    def poses(self, values: Mapping[str, Floats]) -> Floats:
        """Targets (n, 4, 4) of the cells of the columns, (n,) each."""
        q = [
            np.radians(values[name]) if is_angle and not name.endswith("_rad") else values[name]
            for name, is_angle in zip(self.columns, self.path.is_angle, strict=True)
        ]
        return self.path.poses(np.stack(q, axis=1))


def joint_columns(mechanism: Mechanism, header: Sequence[str]) -> JointColumns | None:
    """The columns that are named after coordinates of a mechanism; None if they are not joints in series to its end.

    Angles are in degrees, as roll, pitch and yaw are, or in the unit behind their names.
    """
    known = joint_names(mechanism)
    columns = tuple(name for name in header if name in known)
    try:
        path = joint_path(mechanism, tuple(known[name] for name in columns))
    except InvalidArgument:
        return None
    return JointColumns(path, columns)


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
        raise WrongText(f"line {line}: no column {', '.join(missing)}{hint}; {EXPECTED}{between}")
    for columns in OF_ANGLES.values():
        same = [name for name in columns if name in header]
        if len(same) > 1:
            raise WrongText(f"line {line}: found columns {' and '.join(same)}; expected one of them")
    turning = [name for name in OF_POSES if name in header and name not in POSITION]
    parts = [name for name in turning if name in QUATERNION]
    if parts and turning != [*QUATERNION]:
        raise WrongText(f"line {line}: found columns {', '.join(turning)}; expected {', '.join(QUATERNION)} alone")
    unread = [name for name in header if name.lower() in AMBIGUOUS]
    if unread and not turning and task_of(mechanism).rotations:
        raise WrongText(f"line {line}: found columns {', '.join(unread)} for turns; {EXPECTED}")
    if not any(name in OF_POSES for name in header):
        series = ", ".join(passive_series(mechanism))
        raise WrongText(f"line {line}: no column of a pose; {EXPECTED}{', or ' if series else ''}{series}")


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
        raise WrongText(f"line {lines[place]}: column 'feed': found {feeds[place]:g}; expected a feed above zero")
    if joints is not None:
        targets = joints.poses(columns)
    elif QUATERNION[0] in columns:
        targets = pose(np.array(positions).T, quat_xyzw=_quaternions(columns, lines))
    else:
        targets = pose(np.array(positions).T, rpy=np.array(turned).T)
    angle_units = units[0], units[1], units[2]
    return Path(targets, columns.get("t"), feeds, lines, others, angle_units, by_joints=joints is not None)


def _quaternions(columns: Mapping[str, Floats], lines: Sequence[int]) -> Floats:
    """Quaternions (n, 4), of any length but zero."""
    quaternions = np.stack([columns[name] for name in QUATERNION], axis=-1)
    zero = np.flatnonzero(~quaternions.any(axis=-1))
    if len(zero):
        raise WrongText(f"line {lines[int(zero[0])]}: found a zero quaternion; expected one that is a rotation")
    return quaternions


def _check_times(times: Floats, lines: Sequence[int]) -> None:
    """Refuse times that do not grow."""
    back = np.flatnonzero(np.diff(times) <= 0.0)
    if len(back):
        place = int(back[0])
        raise WrongText(f"line {lines[place]}: column 't': found {times[place + 1]:g}; expected times that grow")
