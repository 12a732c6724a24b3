"""``pfabrik track``: a path of targets, each answer starting from the one before."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

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
    from ..options import Options
    from ..paths import path as paths
    from ..paths.along import Extremes
    from .track_summary import Summary

STANDARD = Path("-")


@click.command()
@click.argument("mech", type=MECH)
@click.argument("path", type=click.Path(path_type=Path, allow_dash=True))
@click.option(
    "-o", "--output", type=click.Path(path_type=Path, allow_dash=True), help="CSV file to write; - prints it."
)
@projecting
@click.option("--sample-time", type=FINITE, metavar="S", help="Time from one target to the next [s].")
@click.option("--rapid", type=FINITE, metavar="V", help="Feed of rapid moves (G0), which say none [length/s].")
@click.option("--rate", type=FINITE, metavar="HZ", help="Resample the path: targets per second.")
@click.option("--longest", type=FINITE, metavar="D", help="Resample the path: longest step [length].")
@click.option("--tolerance", type=FINITE, metavar="D", help="How far steps may be off an arc [length].")
@click.option(
    "--speed",
    "speeds",
    multiple=True,
    metavar="[NAME=]VALUE",
    help="Highest speed of an actuator, or of all [deg/s or length/s]. May be repeated. Default: the file's max_speed.",
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
    rapid: float | None,
    rate: float | None,
    longest: float | None,
    tolerance: float | None,
    speeds: tuple[str, ...],
    picture_path: Path | None,
    film_path: Path | None,
    as_json: bool,
) -> int:
    """Follow a path of targets.

    Reads the targets from a CSV file or G-code and writes the answers to a CSV file, a part at a time. Each answer
    starts from the one before.

    PATH is G-code, by its ending (.nc, .ngc, .gcode), or a CSV file: a header line and, in any order, the columns x, y,
    z, roll, pitch, yaw [deg] or roll_rad, pitch_rad, yaw_rad, and t [s] or feed [length/s]; - is standard input.
    Coordinates that the machine cannot change may be missing, as z in a plane. Further columns go out as they came in,
    and angles in the unit they came in.

    --plot draws the path, every actuator between its limits, and all margins; --animate the machine on its way.

    The exit code is 1 also where an actuator would have to be faster than it may.
    """
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
    from ..paths.path import joined
    from ..paths.read_path import path_blocks
    from .track_summary import Summary

    def read() -> Iterator[paths.Path]:
        options = {"longest": longest, "rate": rate, "rapid": rapid, "sample_time": sample_time}
        return path_blocks(path, mechanism, tolerance=tolerance, **options)

    blocks: Iterable[paths.Path]
    total = None
    if as_json or picture_path is not None or film_path is not None:
        blocks = checked(read(), mechanism, is_timed=bool(limits))
        blocks = [joined(blocks)]
        total = len(blocks[0].lines)
    elif path.is_file():
        total = sum(len(block.lines) for block in checked(read(), mechanism, is_timed=bool(limits)))
        blocks = read()
    else:
        blocks = checked(read(), mechanism, is_timed=bool(limits))
    told = Summary(mechanism)
    options = options_projecting(hold, projection)
    with nullcontext() if output is None else whole_file(output, inputs) as handle:
        followed = answered(mechanism, blocks, options, own_limits(mechanism) | limits, handle, told, total)
    if picture_path is not None:
        with picture(picture_path):
            pf.plot_track(followed)
    if film_path is not None:
        with progress(f"drawing {film_path}") as on_progress:
            pf.animate(followed, film_path, on_progress=on_progress)
        click.echo(f"wrote {film_path}", err=True)
    if as_json:
        click.echo(json.dumps(as_object(followed), allow_nan=False))
    click.echo(told.line(), err=as_json or output == STANDARD)
    if told.worst():
        click.echo(told.worst(), err=True)
    return 0 if told.is_well else 1


def refuse_early(picture_path: Path | None, film_path: Path | None, inputs: tuple[Path, ...]) -> None:
    """Stop before the work begins where a picture or film cannot be written, or would replace what was read."""
    from ..view.saving import FILMS, PICTURES

    for path, endings in ((picture_path, PICTURES), (film_path, FILMS)):
        if path is not None:
            ending_checked(path, endings, inputs)
            require("pictures", "matplotlib", "plot")


def checked(blocks: Iterable[paths.Path], mechanism: Mechanism, is_timed: bool) -> Iterator[paths.Path]:
    """Blocks of a path that sets something of the task, with notes of what it sets for nothing; see `Moves`."""
    moves = Moves(mechanism)
    for number, block in enumerate(blocks):
        if number == 0:
            if is_timed and block.times is None:
                raise click.UsageError("--speed says nothing without --sample-time, or a path with times")
            note_misspelt(block.others)
        moves.add(block.targets)
        yield block
    moves.tell()


class Moves:
    """What a path changes of a pose, against home."""

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism = mechanism
        self._found = {"x": False, "y": False, "z": False, "turned": False, "tilted": False}

    def add(self, targets: Floats) -> None:
        """Targets (n, 4, 4) as well."""
        off = (targets != self._mechanism.home_pose).any(axis=0)
        found = (*off[:3, 3], off[:3, :3].any(), off[:3, 2].any())
        self._found = {name: was or bool(now) for (name, was), now in zip(self._found.items(), found, strict=True)}

    def tell(self) -> None:
        """Say so when the task leaves out columns that are not as at home; refuse a path that sets nothing else."""
        found, task = self._found, set(self._mechanism.task)
        columns = [axis for axis in "xyz" if found[axis] and axis not in task]
        if found["turned"] and not task - set("xyz"):
            columns += ["roll", "pitch", "yaw"]
        elif "yaw" in task and found["tilted"]:
            columns += ["roll", "pitch"]
        sets_some = any(found[axis] for axis in task & set("xyz"))
        if columns and not sets_some and not (found["turned"] and task - set("xyz")):
            raise click.ClickException(
                f"the path sets {', '.join(columns)} only, none of which the task has: {' '.join(self._mechanism.task)}"
            )
        note_left_out((f"column {name}" for name in columns), self._mechanism)


def note_misspelt(others: Iterable[str]) -> None:
    """Say so where a further column is named nearly like one of a pose."""
    from ..paths.table import NUMERIC

    for name in others:
        hint = "" if name in NUMERIC else near_miss(name, NUMERIC)
        if hint:
            click.echo(f"pfabrik: note: column '{name}' goes out as it came in{hint}", err=True)


def answered(
    mechanism: Mechanism,
    blocks: Iterable[paths.Path],
    options: Options,
    limits: dict[str, float],
    handle: TextIO | None,
    told: Summary,
    total: int | None,
) -> Track:
    """Follow a path part by part, write its rows and sum it up; the answers to the last part."""
    from ..paths.along import largest_tilts, least_margins
    from ..paths.follow import follow_parts
    from .track_rows import Rows

    rows: Rows | None = None
    with progress(f"tracking {total or ''} targets") as show:
        on_progress = None if show is None else lambda done: show(done, total)
        parts = follow_parts(mechanism, blocks, options=options, speed_limits=limits or None, on_progress=on_progress)
        for path, followed, first in parts:
            room, tilts = least_margins(followed), largest_tilts(followed)
            told.add(path, followed, room, tilts, first)
            if handle is not None:
                rows = rows or Rows(handle, mechanism, path, tilts is not None)
                rows.write(path, followed, room, tilts, first)
    return followed


def as_object(followed: Track) -> dict[str, object]:
    """The fields of a track, and in every row the least margin and the largest tilt of a rod [rad]."""
    from ..answers.solution import as_plain
    from ..paths.along import largest_tilts, least_margins

    plain = followed.to_dict()
    found: dict[str, Extremes | None] = {"margin": least_margins(followed), "tilt": largest_tilts(followed)}
    for name, each in found.items():
        plain[name] = None if each is None else as_plain(each.values)
        plain[f"{name}_of"] = None if each is None else each.names
    return plain


def own_limits(mechanism: Mechanism) -> dict[str, float]:
    """The speeds that the mechanism says, by name."""
    from ..timing.time_path import limits_of

    speeds = zip(mechanism.actuator_names, limits_of(mechanism, "speed", None).tolist(), strict=True)
    return {name: speed for name, speed in speeds if math.isfinite(speed)}


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


def count_statuses(solution: Track) -> dict[str, int]:
    """How many targets ended in each status, by its name in lower case."""
    return {status.name.lower(): int((solution.status == status).sum()) for status in pf.Status}
