"""``pfabrik effort`` and ``identify``: what motors exert along a path, and what their efforts tell of masses."""

from __future__ import annotations

from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

import pfabrik as pf

from ..common.cells import is_finite
from .arguments import FINITE, MECH, Triple, load
from .outputs import (
    OUTPUT,
    STANDARD,
    PictureOptions,
    check_outputs,
    force_option,
    note_no_picture,
    pictured,
    refuse_both_on_stdout,
    refuse_existing,
    require_picture,
    whole_file,
    write_picture,
)
from .printing import json_option, print_result
from .statics import Loads, carrying, weighed
from .track import at_lines_of, limiting, recorded

if TYPE_CHECKING:
    from ..capabilities.paths import path as paths
    from ..common.arrays import Floats
    from .track import LimitsOf, Reading


@click.command()
@click.argument("mech", type=MECH)
@click.argument("path", type=click.Path(path_type=Path, allow_dash=True))
@click.option("-o", "--output", help="CSV file to write; - prints it.", **OUTPUT)
@click.option("--sample-time", type=FINITE, metavar="S", help="Time from one target to the next [s].")
@click.option("--rapid", type=FINITE, metavar="V", help="Feed of rapid moves (G0), which say none [length/s].")
@click.option("--rate", type=FINITE, metavar="HZ", help="Resample the path: targets per second.")
@recorded
@limiting
@carrying
@click.option("--plot", type=click.Path(path_type=Path), metavar="FILE", help="Picture too: PNG, SVG or PDF.")
@pictured(with_view=False)
@json_option()
def effort(
    mech: str,
    path: Path,
    output: Path | None,
    limits_of: LimitsOf,
    loads: Loads,
    gravity: Triple,
    plot: Path | None,
    drawn: PictureOptions,
    as_json: bool,
    reading: Reading,
    sample_time: float | None,
    rapid: float | None,
    rate: float | None,
) -> int:
    """Tell what motors exert along a path.

    PATH is a CSV file or G-code, as of track, with times, feeds or --sample-time; - is standard input. With a limit,
    such as --speed or --torque, it is followed as fast as `pfabrik time` would, whatever its times. Without one, the
    nearest poses are followed where it is out of reach: the answer says where, and the exit code is 1.

    Masses [kg] are those of the file and of --load; bodies without one weigh nothing. Gravity is in m/s². Forces are in
    N, torques in N m, power in W.
    """
    refuse_both_on_stdout(output, as_json)
    check_outputs([("-o", output), ("--plot", plot)], [path, Path(mech)], as_json=as_json)
    require_picture(plot)
    if plot is None:
        note_no_picture("--plot")
    mechanism = load(mech)
    limits = limits_of(mechanism)
    mechanism = weighed(mechanism, loads)
    if limits and sample_time is not None:
        raise click.UsageError("--sample-time does not go with limits, which time the path")
    read = pf.read_path(path, mechanism, rapid=rapid, rate=None if limits else rate, **reading)
    with nullcontext() if output is None else whole_file(output) as handle, at_lines_of(read):
        if limits:
            track = pf.track(mechanism, read.targets)
            motion: pf.Timed | pf.Track = pf.time_path(
                track, **limits, loads=loads, gravity=gravity, rate=rate or 1000.0, dwells=read.dwells
            )
        else:
            motion = at_its_times(mechanism, read, sample_time)
        found = pf.inverse_dynamics(motion, loads=loads, gravity=gravity)
        if handle is not None:
            found.write(handle)
    if plot is not None:
        write_picture(plot, partial(found.plot, **drawn.looks), drawn)
    print_result(as_json, found, to_stderr=output == STANDARD)
    return int(any(found.reason) or bool(found.projected.any()))


def at_its_times(mechanism: pf.Mechanism, path: paths.Path, sample_time: float | None) -> pf.Track:
    """A path at the times that it has, or one target after the other."""
    if path.times is None and sample_time is None:
        raise click.UsageError("the path has no times: give --sample-time, or a limit to time it by, such as --speed")
    times = path.times if sample_time is None else None
    return pf.track(mechanism, path.targets, times=times, sample_time=sample_time)


EFFORT = "effort_"
"""Before the name of an actuator, in columns of what it exerts."""


@click.command()
@click.argument("mech", type=MECH)
@click.argument("data", type=click.Path(path_type=Path, allow_dash=True))
@click.option("--body", "bodies", multiple=True, metavar="NAME", help="A body to identify. Default: all that move.")
@click.option("--rotors", is_flag=True, help="Identify the rotors of actuators too.")
@click.option("--no-friction", is_flag=True, help="Leave friction as in the file.")
@click.option("--sigma", type=FINITE, help="Standard deviation of the efforts [N, N m]. Default: that of what is left.")
@click.option("-o", "--output", help="Mechanism file to write, with the identified values.", **OUTPUT)
@click.option("--sample-time", type=FINITE, metavar="S", help="Time from one row to the next [s].")
@recorded
@carrying
@force_option
@json_option()
def identify(
    mech: str,
    data: Path,
    bodies: tuple[str, ...],
    rotors: bool,
    no_friction: bool,
    sigma: float | None,
    output: Path | None,
    sample_time: float | None,
    reading: Reading,
    loads: Loads,
    gravity: Triple,
    force: bool,
    as_json: bool,
) -> int:
    """Find masses and friction from efforts measured in motion.

    DATA is a CSV file as of effort, with times or --sample-time, and a column effort_NAME [N, N m] for each actuator,
    or what --columns calls so; - is standard input. Rows with an empty effort are left out.

    What the efforts do not determine stays as in the file. The exit code is 1 where the whole is in doubt.
    """
    refuse_both_on_stdout(output, as_json)
    check_outputs([("-o", output)], [data, Path(mech)], as_json=as_json)
    if output is not None:
        refuse_existing(output, force)
    mechanism = load(mech)
    columns: dict[str, str] = {f"{EFFORT}{name}": f"{EFFORT}{name}" for name in mechanism.actuator_names}
    named = reading["columns"]
    columns |= {name: named[name] for name in columns if name in named}
    reading = {**reading, "columns": {name: column for name, column in named.items() if name not in columns}}
    read = pf.read_path(data, mechanism, **reading)
    with at_lines_of(read):
        motion = at_its_times(mechanism, read, sample_time)
    result = pf.identify(
        motion,
        _efforts(read, list(columns.values())),
        gravity=gravity,
        loads=loads,
        bodies=bodies or None,
        friction=not no_friction,
        rotors=rotors,
        sigma=sigma,
    )
    if output is not None:
        from ..machine.files import dumps

        with whole_file(output) as file:
            file.write(dumps(result.mechanism))
    print_result(as_json, result, to_stderr=output == STANDARD)
    return int(bool(result.doubt))


def _efforts(read: paths.Path, columns: list[str]) -> Floats:
    """Efforts of the columns of a file, (n, n_a); NaN where a cell is empty."""
    import numpy as np

    if missing := [column for column in columns if column not in read.others]:
        raise click.UsageError(f"no column {', '.join(missing)}; --columns effort_NAME=COLUMN names those of the file")
    efforts = np.full((len(read.lines), len(columns)), np.nan)
    for place, column in enumerate(columns):
        for row, cell in enumerate(read.others[column]):
            text = cell.replace(",", ".")
            if text.strip() and not is_finite(text):
                raise click.UsageError(f"line {read.lines[row]}: column '{column}': found '{cell}'; expected a number")
            efforts[row, place] = float(text) if text.strip() else np.nan
    return efforts
