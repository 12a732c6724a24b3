"""``pfabrik track``: a path of targets, each answer starting from the one before."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import click

import pfabrik as pf

from ..errors import near_miss
from ..extras import require
from .finite import FINITE, is_finite
from .mech import MECH, load
from .picture import ending_checked, picture
from .progress import progress
from .projecting import note_left_out, options_projecting, projecting
from .whole import whole_file

if TYPE_CHECKING:
    from ..answers.tracked import Track
    from ..arrays import Floats
    from ..description.mechanism import Mechanism

ROWS_NAMED = 5


@click.command()
@click.argument("mech", type=MECH)
@click.argument("path", type=click.Path(path_type=Path, allow_dash=True))
@click.option(
    "-o", "--output", type=click.Path(path_type=Path, allow_dash=True), help="CSV file to write; - prints it."
)
@projecting
@click.option("--sample-time", type=FINITE, metavar="S", help="Time from one target to the next [s].")
@click.option(
    "--speed",
    "speeds",
    multiple=True,
    metavar="[NAME=]VALUE",
    help="Highest speed of an actuator, or of all [deg/s or length/s]. May be repeated.",
)
@click.option(
    "--plot", "picture_path", type=click.Path(path_type=Path), metavar="FILE", help="Picture: PNG, SVG or PDF."
)
@click.option("--animate", "film_path", type=click.Path(path_type=Path), metavar="FILE", help="Film: GIF or MP4.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout; angles in radians.")
def track(
    mech: str,
    path: Path,
    output: Path | None,
    hold: str,
    projection: str,
    sample_time: float | None,
    speeds: tuple[str, ...],
    picture_path: Path | None,
    film_path: Path | None,
    as_json: bool,
) -> int:
    """Follow a path of targets.

    Reads the targets from a CSV file and writes the answers to another. Each answer starts from the one before.

    PATH is G-code, by its ending (.nc, .ngc, .gcode), or a CSV file: a header line and the columns x, y, z and,
    optionally, roll, pitch, yaw [deg] or roll_rad, pitch_rad, yaw_rad; - is standard input. Coordinates that the
    machine cannot change may be missing, as z in a plane. Further columns go out as they came in, and angles in the
    unit they came in.

    --plot draws the path, every actuator between its limits, and all margins; --animate the machine on its way.

    The exit code is 1 also where an actuator would have to be faster than --speed allows.
    """
    from .pathfile import STANDARD, read_path, write_track

    if output is None and not as_json and picture_path is None and film_path is None:
        raise click.UsageError("no place for the answers: give -o FILE, -o -, --json, --plot or --animate")
    if as_json and output == STANDARD:
        raise click.UsageError("-o - and --json both print on stdout: give one of them")
    if mech == str(path) == str(STANDARD):
        raise click.UsageError("MECH and PATH are both standard input: give a file for one of them")
    inputs = (path, Path(mech))
    refuse_early(picture_path, film_path, inputs)
    mechanism = load(mech)
    limits = speed_limits(mechanism, speeds)
    if limits and sample_time is None:
        raise click.UsageError("--speed says nothing without --sample-time")
    read = read_path(path, mechanism)
    note_ignored(mechanism, read.targets)
    options = options_projecting(hold, projection)
    with nullcontext() if output is None else whole_file(output, inputs) as handle:
        with progress(f"tracking {len(read.targets)} targets") as on_progress:
            followed = pf.track(
                mechanism,
                read.targets,
                options=options,
                on_progress=on_progress,
                sample_time=sample_time,
                speed_limits=limits or None,
            )
        if handle is not None:
            write_track(handle, read, followed)
    if picture_path is not None:
        with picture(picture_path):
            pf.plot_track(followed)
    if film_path is not None:
        with progress(f"drawing {film_path}") as on_progress:
            pf.animate(followed, film_path, on_progress=on_progress)
        click.echo(f"wrote {film_path}", err=True)
    if as_json:
        click.echo(json.dumps(followed.to_dict(), allow_nan=False))
    click.echo(summary(followed), err=as_json or output == STANDARD)
    return 0 if followed and not any(followed.too_fast or ()) else 1


def refuse_early(picture_path: Path | None, film_path: Path | None, inputs: tuple[Path, ...]) -> None:
    """Stop before the work begins where a picture or film cannot be written, or would replace what was read."""
    from ..view.saving import FILMS, PICTURES

    for path, endings in ((picture_path, PICTURES), (film_path, FILMS)):
        if path is not None:
            ending_checked(path, endings, inputs)
            require("pictures", "matplotlib", "plot")


def note_ignored(mechanism: Mechanism, targets: Floats) -> None:
    """Say so when the task leaves out columns that are not as at home; refuse a path that sets nothing else."""
    task, home = set(mechanism.task), mechanism.home_pose
    moved = (targets[:, :3, 3] != home[:3, 3]).any(axis=0)
    turned = (targets[:, :3, :3] != home[:3, :3]).any()
    columns = [axis for axis, moves in zip("xyz", moved, strict=True) if moves and axis not in task]
    if turned and not task - set("xyz"):
        columns += ["roll", "pitch", "yaw"]
    elif "yaw" in task and (targets[:, :3, 2] != home[:3, 2]).any():
        columns += ["roll", "pitch"]
    sets_some = any(moves and axis in task for axis, moves in zip("xyz", moved, strict=True))
    if columns and not sets_some and not (turned and task - set("xyz")):
        raise click.ClickException(
            f"the path sets {', '.join(columns)} only, none of which the task has: {' '.join(mechanism.task)}"
        )
    note_left_out((f"column {name}" for name in columns), mechanism)


def speed_limits(mechanism: Mechanism, given: Sequence[str], option: str = "--speed") -> dict[str, float]:
    """Speeds by name [rad/s or length/s], from words as of ``--speed``; what is said of one counts before all."""
    from ..description.readouts import readouts

    shown = {readout.name: readout for readout in readouts(mechanism)}
    said: dict[str, float] = {}
    for word in sorted(given, key=lambda word: "=" in word):
        name, _, value = word.rpartition("=")
        if "=" in word and name not in shown:
            hint = near_miss(name, tuple(shown)) or f" (known: {', '.join(shown)})"
            raise click.UsageError(f"{option} {word}: no actuator '{name}'{hint}")
        said |= dict.fromkeys([name] if "=" in word else shown, positive(option, word, value))
    return {name: shown[name].coordinate(value) for name, value in said.items()}


def positive(option: str, word: str, value: str) -> float:
    """A speed as a positive number."""
    if not is_finite(value) or float(value) <= 0.0:
        raise click.UsageError(f"{option} {word}: found '{value}'; expected a positive number")
    return float(value)


def summary(followed: Track) -> str:
    """What became of the targets, in one line."""
    counts = count_statuses(followed)
    told = [", ".join(f"{count} {name}" for name, count in counts.items() if count or name == "reached")]
    if counts["projected"]:
        unit = followed.mechanism.length_unit
        told.append(f"farthest from its target {float(followed.position_error.max()):.3g} {unit}")
    jumps = [row for row, leaps in enumerate(followed.jumps.tolist(), 1) if leaps]
    if jumps:
        told.append(f"{len(jumps)} jump{'s' * (len(jumps) > 1)} ({targets_named(jumps)})")
    return "; ".join([*told, *hasty(followed)])


def hasty(followed: Track) -> list[str]:
    """The actuators that would have to be too fast, how fast, and where: one phrase each."""
    from ..description.readouts import readouts

    too_fast, speeds, phrases = followed.too_fast, followed.speeds, []
    if too_fast is None or speeds is None:
        return []
    for column, readout in enumerate(readouts(followed.mechanism)):
        rows = [row for row, names in enumerate(too_fast, 1) if readout.name in names]
        if rows:
            fastest = float(readout.display(speeds[:, column]).max())
            phrases.append(f"{readout.name} too fast: {fastest:.3g} {readout.unit}/s ({targets_named(rows)})")
    return phrases


def targets_named(rows: Sequence[int]) -> str:
    """Numbers of targets, counted from 1: the first of them."""
    more = f", and {len(rows) - ROWS_NAMED} more" if len(rows) > ROWS_NAMED else ""
    return f"target{'s' * (len(rows) > 1)} {', '.join(map(str, rows[:ROWS_NAMED]))}{more}"


def count_statuses(solution: Track) -> dict[str, int]:
    """How many targets ended in each status, by its name in lower case."""
    return {status.name.lower(): int((solution.status == status).sum()) for status in pf.Status}
