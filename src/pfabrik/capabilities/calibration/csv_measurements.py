"""Measurements from CSV: a header of actuators and quantities, then a configuration a line."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np

from ...common.arrays import Floats
from ...common.checks import require_path
from ...common.csv_columns import CsvColumns
from ...common.text_lines import WrongText, as_text, lines_of, refusing
from ...errors import InvalidArgument, near_miss
from ...machine.description.mechanism import Mechanism, checked_mechanism
from ...machine.poses import pose
from .measurements import Measurements, Sigma

POSITION, QUATERNION = ("x", "y", "z"), ("qx", "qy", "qz", "qw")
ANGLES = ("roll", "pitch", "yaw")
HEIGHT, DISTANCE, DISTANCE_TO = "height", "distance", "distance_to"

MOST_ROWS = 100_000
"""Lines of a file at most."""


def read_measurements(path: str | PathLike[str], mechanism: Mechanism, *, sigma: Sigma = None) -> Measurements:
    """Measurements of a machine from a CSV file.

    Columns, in any order: every actuator; and of `x`, `y`, `z` with `roll`, `pitch`, `yaw` [deg] (or `qx`, `qy`, `qz`,
    `qw`), `height`, names of other coordinates that a sensor reads, and `distance` with `distance_to`, the line of
    another row (the first one below the header is 1). An angle's column is in radians, or degrees if `_deg` is behind
    its name; roll, pitch and yaw the other way round, with `_rad`. Empty cells were not measured. Lines that begin
    with # are passed over.

    Parameters
    ----------
    path : str or PathLike
        The CSV file.
    mechanism : Mechanism
        The machine that was measured.
    sigma : float or mapping of str to float, optional
        Standard deviations, as in `Measurements`.

    Raises
    ------
    InvalidArgument
        A file that is no such table, with its line and column.
    """
    checked_mechanism(mechanism)
    columns: dict[str, Floats] = {}
    lengths = {*POSITION, HEIGHT, DISTANCE, *(each.name for each in mechanism.coordinates if each.kind == "length")}
    for column, values in _columns(Path(require_path("path", path))).items():
        bare = column.removesuffix("_rad")
        name = bare if bare in ANGLES else column.removesuffix("_deg")
        if name in columns:
            raise InvalidArgument("path", f"column '{name}' in two units", "one of them")
        if column != name and name in lengths:
            raise InvalidArgument("path", f"column '{column}', an angle", f"{name}, a length")
        columns[name] = np.radians(values) if column.endswith("_deg") or column in ANGLES else values
    _check_names(columns, mechanism)
    sensors = [n for n in mechanism.coordinates_by_name if n in columns and n not in mechanism.actuator_names]
    return Measurements(
        np.stack([columns[name] for name in mechanism.actuator_names], axis=1),
        position=_position(columns),
        orientation=_orientation(columns),
        height=columns.get(HEIGHT),
        distances=_distances(columns),
        joints={name: columns[name] for name in sensors},
        sigma=sigma,
    )


def _columns(path: Path) -> dict[str, Floats]:
    """The numbers of a table by column; NaN for empty cells."""
    try:
        with refusing(str(path), "a CSV file of measurements"), path.open("rb") as raw, as_text(raw) as text:
            lines = lines_of(text, MOST_ROWS, "a table")
            table = CsvColumns("\n" if line.lstrip().startswith("#") else line for line in lines)
            for rows in table.rows(MOST_ROWS):
                return {name: np.array(table.numbers(rows, name, gaps=True), float) for name in table.header}
            raise WrongText("no line of numbers; expected a header, then a configuration a line")
    except OSError as error:
        raise InvalidArgument("path", f"{path}: {error.strerror}", "a CSV file that can be read") from None


def _check_names(columns: dict[str, Floats], mechanism: Mechanism) -> None:
    """Refuse a table without all actuators, or with a column that is nothing."""
    missing = [name for name in mechanism.actuator_names if name not in columns]
    if missing:
        raise InvalidArgument("path", f"no column {', '.join(missing)}", "one for each actuator of the machine")
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
