"""Measurements from files: tables of actuators or of what was commanded, and what printers' probes wrote."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import TextIO

import numpy as np

from ...answers.status import Status
from ...common.arguments import array
from ...common.arrays import Floats
from ...common.checks import require_path
from ...common.csv_columns import SEPARATORS, CsvColumns
from ...common.text_lines import WrongText, as_text, lines_of, refusing
from ...errors import InvalidArgument, near_miss
from ...ik import solve_ik
from ...kinematics import task_of
from ...machine.description.mechanism import Mechanism, checked_mechanism
from ...machine.poses import pose
from .measurements import Measurements, Sigma
from .probe_files import touches_of

POSITION, QUATERNION = ("x", "y", "z"), ("qx", "qy", "qz", "qw")
ANGLES = ("roll", "pitch", "yaw")
HEIGHT, DISTANCE, DISTANCE_TO = "height", "distance", "distance_to"
TARGET = "target_"
"""Before the names of what was commanded, as in the tables of `pfabrik track`."""

MOST_ROWS, MOST_LINES = 100_000, 10_000_000
"""Lines of a table at most, and of a log."""


def read_measurements(
    path: str | PathLike[str],
    mechanism: Mechanism,
    *,
    sigma: Sigma = None,
    probe_offset: Sequence[float] = (0.0, 0.0, 0.0),
) -> Measurements:
    """Measurements of a machine from a file.

    A CSV file has columns, in any order: every actuator; and of `x`, `y`, `z` with `roll`, `pitch`, `yaw` [deg] (or
    `qx`, `qy`, `qz`, `qw`), `height`, names of other coordinates that a sensor reads, and `distance` with
    `distance_to`, the line of another row (the first one below the header is 1). An angle's column is in radians, or
    degrees if `_deg` is behind its name; roll, pitch and yaw the other way round, with `_rad`. Empty cells were not
    measured. Lines that begin with # are passed over.

    In place of the actuators there may be the pose that was commanded, in columns `target_x`, `target_y` and so on: the
    actuators are then those at which the machine as described has it. Without them, a table without actuators has the
    commanded pose in `x`, `y`, `z`, `roll`, `pitch`, `yaw`. A z that is missing is 0, on the bed.

    Other files are what printers' probes wrote: lines of a log, as Klipper's "probe at 30,40 is z=0.12" (those of its
    last session) or Marlin's "Bed X: 30 Y: 40 Z: 0.12", or RepRapFirmware's heightmap.csv. A probe triggers where the
    nozzle is above the bed, at z = 0, by the z of its offset.

    Parameters
    ----------
    path : str or PathLike
        The file.
    mechanism : Mechanism
        The machine that was measured.
    sigma : float or mapping of str to float, optional
        Standard deviations, as in `Measurements`.
    probe_offset : array (3,), optional
        Place of the probe from the nozzle, z at its trigger [length].

    Raises
    ------
    InvalidArgument
        A file that is no such table, with its line and column; a commanded pose that the machine cannot have.
    """
    checked_mechanism(mechanism)
    offset = array("probe_offset", probe_offset, "3")
    file = Path(require_path("path", path))
    with _reading(file, "what probes wrote") as text:
        touches = touches_of(lines_of(text, MOST_LINES, "a log"), offset.tolist())
    if touches is not None:
        readings = _at_poses(mechanism, pose(touches.places), touches.names)
        return Measurements(readings, height=np.full(len(readings), offset[2]), sigma=sigma, names=touches.names)
    try:
        table = _columns(file)
    except InvalidArgument as error:
        _refuse_log(file, mechanism, error)
        raise
    columns = _in_units(table, mechanism)
    commanded = _commanded(columns, mechanism)
    _check_names(columns, mechanism, is_commanded=bool(commanded))
    sensors = [n for n in mechanism.coordinates_by_name if n in columns and n not in mechanism.actuator_names]
    if commanded:
        poses = _poses(commanded, mechanism)
        readings = _at_poses(mechanism, poses, [f"row {k}" for k in range(1, len(poses) + 1)])
    else:
        readings = np.stack([columns[name] for name in mechanism.actuator_names], axis=1)
    return Measurements(
        readings,
        position=_position(columns),
        orientation=_orientation(columns),
        height=columns.get(HEIGHT),
        distances=_distances(columns),
        joints={name: columns[name] for name in sensors},
        sigma=sigma,
    )


def _in_units(table: dict[str, Floats], mechanism: Mechanism) -> dict[str, Floats]:
    """Columns by their names without units, angles in radians."""
    columns: dict[str, Floats] = {}
    lengths = {*POSITION, HEIGHT, DISTANCE, *(each.name for each in mechanism.coordinates if each.kind == "length")}
    for column, values in table.items():
        bare = column.removesuffix("_rad")
        is_turn = bare.removeprefix(TARGET) in ANGLES
        name = bare if is_turn else column.removesuffix("_deg")
        if name in columns:
            raise InvalidArgument("path", f"column '{name}' in two units", "one of them")
        if column != name and name.removeprefix(TARGET) in lengths:
            raise InvalidArgument("path", f"column '{column}', an angle", f"{name}, a length")
        is_degrees = column.endswith("_deg") or (is_turn and column == name)
        columns[name] = np.radians(values) if is_degrees else values
    return columns


def _commanded(columns: dict[str, Floats], mechanism: Mechanism) -> dict[str, Floats]:
    """The columns of a commanded pose by their names, taken out of all columns; none where actuators were read."""
    if any(name in columns for name in mechanism.actuator_names):
        return {}
    stem = TARGET if any(name.startswith(TARGET) for name in columns) else ""
    names = [name for name in (*POSITION, *ANGLES, *QUATERNION) if stem + name in columns]
    return {name: columns.pop(stem + name) for name in names}


def _poses(columns: dict[str, Floats], mechanism: Mechanism) -> Floats:
    """Commanded poses (n, 4, 4): as at home where the machine cannot be elsewhere, z on the bed, without a turn."""
    task, home, n = task_of(mechanism), mechanism.reference_point, len(next(iter(columns.values())))
    here = [0.0 if axis == "z" and free else at for axis, free, at in zip(POSITION, task.axes, home, strict=True)]
    missing = [axis for axis, free in zip("xy", task.axes, strict=False) if free and axis not in columns]
    if missing:
        raise InvalidArgument("path", f"no column {', '.join(missing)}", "all of what was commanded")
    position = np.stack([columns.get(axis, np.full(n, at)) for axis, at in zip(POSITION, here, strict=True)], axis=1)
    turned = _orientation(columns)
    poses = np.tile(np.eye(4), (n, 1, 1))
    poses[:, :3, 3], poses[:, :3, :3] = position, np.eye(3) if turned is None else turned
    bad = np.flatnonzero(~np.isfinite(poses).all(axis=(1, 2)))
    if len(bad):
        raise InvalidArgument("path", "a row without all of what was commanded", "numbers", rows=bad[:5].tolist())
    return poses


def _at_poses(mechanism: Mechanism, poses: Floats, names: Sequence[str]) -> Floats:
    """Actuator values (n, n_a) at which the machine as described has commanded poses."""
    answers = solve_ik(mechanism.without_limits(), poses)
    bad = np.flatnonzero(answers.status != Status.REACHED)
    if len(bad):
        x, y, z = poses[bad[0], :3, 3]
        found = f"{names[bad[0]]}: x {x:g}, y {y:g}, z {z:g}, where '{mechanism.name}' as described cannot be"
        raise InvalidArgument("path", found, "what was commanded, in its units", rows=bad[:5].tolist())
    return np.asarray(answers.actuators)


@contextmanager
def _reading(path: Path, expected: str) -> Iterator[TextIO]:
    """The text of a file; InvalidArgument for what is no text, or no file."""
    try:
        with refusing(str(path), expected), path.open("rb") as raw, as_text(raw) as text:
            yield text
    except OSError as error:
        raise InvalidArgument("path", f"{path}: {error.strerror}", "a file that can be read") from None


def _columns(path: Path) -> dict[str, Floats]:
    """The numbers of a table by column; NaN for empty cells."""
    with _reading(path, "a CSV file of measurements") as text:
        lines = lines_of(text, MOST_ROWS, "a table")
        table = CsvColumns("\n" if line.lstrip().startswith("#") else line for line in lines)
        for rows in table.rows(MOST_ROWS):
            return {name: np.array(table.numbers(rows, name, gaps=True), float) for name in table.header}
        raise WrongText("no line of numbers; expected a header, then a configuration a line")


def _refuse_log(path: Path, mechanism: Mechanism, error: InvalidArgument) -> None:
    """Refuse a file whose first line is no header of measurements: a log, in which no probe wrote a line."""
    with _reading(path, "a CSV file of measurements") as text:
        rows = (line.strip() for line in lines_of(text, MOST_ROWS, "a table"))
        first = next((row for row in rows if row and not row.startswith("#")), "")
    cells = (cell.strip() for cell in re.split("|".join(SEPARATORS), first))
    names = {cell.removeprefix(TARGET).removesuffix("_deg").removesuffix("_rad") for cell in cells}
    if not names & {*mechanism.coordinates_by_name, *POSITION, *ANGLES, *QUATERNION, HEIGHT, DISTANCE}:
        found = "no line that a probe wrote, and no column of measurements in the first line"
        expected = (
            "lines of a log such as 'probe at 30,40 is z=0.12' or 'Bed X: 30 Y: 40 Z: 0.12', a heightmap.csv, or a CSV "
            "file with a column for each actuator, or x, y and height"
        )
        raise InvalidArgument(str(path), found, expected) from error


def _check_names(columns: dict[str, Floats], mechanism: Mechanism, *, is_commanded: bool) -> None:
    """Refuse a table without all actuators or what was commanded, or with a column that is nothing."""
    missing = [name for name in mechanism.actuator_names if name not in columns]
    if missing and not is_commanded:
        expected = "one for each actuator of the machine, or x, y, z as commanded"
        raise InvalidArgument("path", f"no column {', '.join(missing)}", expected)
    known = [*mechanism.coordinates_by_name, *POSITION, *ANGLES, *QUATERNION, HEIGHT, DISTANCE, DISTANCE_TO]
    unknown = [name for name in columns if name not in known]
    if unknown:
        expected = "actuators, other coordinates, x, y, z, roll, pitch, yaw, height, distance and distance_to"
        raise InvalidArgument("path", f"column '{unknown[0]}'{near_miss(unknown[0], known)}", expected)


def _position(columns: dict[str, Floats]) -> Floats | None:
    if not any(name in columns for name in POSITION):
        return None
    nothing = np.full(len(next(iter(columns.values()))), np.nan)
    return np.stack([columns.get(name, nothing) for name in POSITION], axis=1)


def _orientation(columns: dict[str, Floats]) -> Floats | None:
    """Measured orientations (n, 3, 3); NaN in rows without."""
    for names in (ANGLES, QUATERNION):
        given = [name for name in names if name in columns]
        if given and len(given) < len(names):
            raise InvalidArgument("path", f"columns {', '.join(given)}", f"{', '.join(names)} together")
        if given:
            numbers = np.stack([columns[name] for name in names], axis=1)
            is_whole = np.isfinite(numbers).all(axis=1)
            made = np.full((len(numbers), 3, 3), np.nan)
            whole = numbers[is_whole]
            turned = pose(np.zeros(3), rpy=whole) if names == ANGLES else pose(np.zeros(3), quat_xyzw=whole)
            made[is_whole] = turned[..., :3, :3]
            return made
    return None


def _distances(columns: dict[str, Floats]) -> Floats | None:
    """Rows of (row, row, distance), counted from 0."""
    lengths, ends = columns.get(DISTANCE), columns.get(DISTANCE_TO)
    if lengths is None and ends is None:
        return None
    if lengths is None or ends is None:
        raise InvalidArgument("path", "one of the columns distance and distance_to", "both")
    rows = np.flatnonzero(np.isfinite(lengths))
    if not np.isfinite(ends[rows]).all():
        raise InvalidArgument(
            "path", "a distance without distance_to", "the line that it leads to", rows=rows[:5].tolist()
        )
    return np.column_stack([rows, ends[rows] - 1.0, lengths[rows]]) if len(rows) else None
