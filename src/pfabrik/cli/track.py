"""``pfabrik track``: a path of targets, each answer starting from the one before."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import click

import pfabrik as pf

from ..checks import require_ending
from ..errors import counted
from ..extras import require
from ..telling import telling
from .finite import FINITE
from .mech import MECH, load
from .outputs import OUTPUT, STANDARD, check_outputs
from .pictures import picture
from .projecting import options_projecting, projecting
from .speeds import own_limits, speed_limits, speed_option
from .track_checks import checked
from .whole import whole_file

if TYPE_CHECKING:
    from ..answers.tracked import Track
    from ..description.mechanism import Mechanism
    from ..options import Options
    from ..paths import path as paths
    from ..paths.along import Extremes
    from .track_summary import Summary


@click.command()
@click.argument("mech", type=MECH)
@click.argument("path", type=click.Path(path_type=Path, allow_dash=True))
@click.option("-o", "--output", help="CSV file to write; - prints it.", **OUTPUT)
@projecting
@click.option("--sample-time", type=FINITE, metavar="S", help="Time from one target to the next [s].")
@click.option("--rapid", type=FINITE, metavar="V", help="Feed of rapid moves (G0), which say none [length/s].")
@click.option("--rate", type=FINITE, metavar="HZ", help="Resample the path: targets per second.")
@click.option("--longest", type=FINITE, metavar="D", help="Resample the path: longest step [length].")
@click.option("--tolerance", type=FINITE, metavar="D", help="How far steps may be off an arc [length].")
@speed_option
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
    drawn = picture_path is not None or film_path is not None
    if output is None and not as_json and not drawn:
        raise click.UsageError("no place for the answers: give -o FILE, -o -, --json, --plot or --animate")
    if as_json and output == STANDARD:
        raise click.UsageError("-o - and --json both print on stdout: give one of them")
    if mech == str(path) == str(STANDARD):
        raise click.UsageError("MECH and PATH are both standard input: give a file for one of them")
    inputs = (path, Path(mech))
    printed = STANDARD if as_json else None
    outputs = [("-o", output), ("--plot", picture_path), ("--animate", film_path), ("--json", printed)]
    check_outputs(outputs, inputs)
    refuse_early(picture_path, film_path)
    mechanism = load(mech)
    limits = speed_limits(mechanism, speeds)
    from ..paths.read_path import path_blocks
    from .track_summary import Summary

    timing = {"rate": rate, "rapid": rapid, "sample_time": sample_time}
    read = partial(path_blocks, path, mechanism, tolerance=tolerance, longest=longest, **timing)
    check = partial(checked, mechanism=mechanism, is_timed=bool(limits))
    blocks, total = blocks_of(path, read, check, whole=as_json or drawn)
    told = Summary(mechanism)
    options = options_projecting(hold, projection)
    with nullcontext() if output is None else whole_file(output, inputs) as handle:
        followed = answered(mechanism, blocks, options, own_limits(mechanism) | limits, handle, told, total)
    draw(followed, picture_path, film_path)
    if as_json:
        click.echo(json.dumps(as_object(followed), allow_nan=False))
    click.echo(told.line(), err=as_json or output == STANDARD)
    if told.worst():
        click.echo(told.worst(), err=True)
    return 0 if told.is_well else 1


def refuse_early(picture_path: Path | None, film_path: Path | None) -> None:
    """Stop before the work begins where a picture or film cannot be written."""
    from ..view.save_picture import FILMS, PICTURES

    for path, endings in ((picture_path, PICTURES), (film_path, FILMS)):
        if path is not None:
            require_ending(path, endings)
            require("pictures", "matplotlib", "plot")


def blocks_of(
    path: Path,
    read: Callable[[], Iterator[paths.Path]],
    check: Callable[[Iterator[paths.Path]], Iterator[paths.Path]],
    *,
    whole: bool,
) -> tuple[Iterable[paths.Path], int | None]:
    """The parts of a path, all in one if it is wanted whole, and how many targets there are, where that is known.

    What can be read twice is checked to its end before anything is answered; the rest part by part.
    """
    from ..paths.path import joined

    if whole:
        block = joined(check(read()))
        return [block], len(block.lines)
    if path != STANDARD and path.is_file():
        return read(), sum(len(block.lines) for block in check(read()))
    return check(read()), None


def draw(followed: Track, picture_path: Path | None, film_path: Path | None) -> None:
    """Write the picture and the film that were asked for."""
    if picture_path is not None:
        with picture(picture_path):
            pf.plot_track(followed)
    if film_path is not None:
        pf.animate(followed, film_path)
        click.echo(f"wrote {film_path}", err=True)


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
    from .track_rows import TrackRows

    rows: TrackRows | None = None
    with telling(f"tracking {counted(total, 'target') if total else 'targets'}") as tell:
        on_progress = None if tell is None else lambda done: tell(done, total or 0)
        parts = follow_parts(mechanism, blocks, options=options, speed_limits=limits or None, on_progress=on_progress)
        for path, followed, first in parts:
            room, tilts = least_margins(followed), largest_tilts(followed)
            told.add(path, followed, room, tilts, first)
            if handle is not None:
                rows = rows or TrackRows(handle, mechanism, path, tilts is not None)
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
