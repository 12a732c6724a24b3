"""``pfabrik track`` and ``time``: a path of targets followed, and how fast it may be."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO, TypeAlias

import click

import pfabrik as pf

from ..common.telling import telling
from ..errors import counted, near_miss
from ..view.save_picture import FILMS
from .arguments import FINITE, MECH, Triple, by_name, load, note_left_out, positive, projecting
from .options import actuators, named_values, together
from .outputs import (
    OUTPUT,
    STANDARD,
    PictureOptions,
    check_outputs,
    note_no_picture,
    pictured,
    refuse_both_on_stdout,
    require_picture,
    say_wrote,
    whole_file,
    write_picture,
)
from .printing import json_option, note, print_json, print_result, print_text
from .questions import own_limits, speed_limits, speed_option
from .statics import Loads, carrying, weighed

if TYPE_CHECKING:
    from ..answers.tracked import TrackSummary
    from ..capabilities.paths import path as paths
    from ..capabilities.paths.track_rows import TrackRows
    from ..common.arrays import Mask
    from ..exchange.interop.qpos_rows import QposRows

    Rows: TypeAlias = TrackRows | QposRows
    LimitsOf: TypeAlias = Callable[[pf.Mechanism], dict[str, Any]]


MOST_TARGETS = 1_000_000_000
"""Targets of a path that is followed part by part, at most: what is longer has no end."""


Reading: TypeAlias = "dict[str, Any]"


def _reading(columns: tuple[str, ...], scales: tuple[str, ...]) -> Reading:
    named: dict[str, str] = {}
    for part in (each for text in columns for each in text.split(",")):
        name, is_given, column = part.partition("=")
        if not (is_given and name.strip() and column.strip()):
            raise click.UsageError(f"--columns: found '{part}'; expected NAME=COLUMN, as in t=time,x=surge")
        if name.strip() in named:
            raise click.UsageError(f"--columns: found {name.strip()} twice; expected one column for each name")
        named[name.strip()] = column.strip()
    from ..capabilities.paths.csv_table import ALL_LENGTHS, NUMERIC

    factors = by_name("--scale", scales, "column", NUMERIC, positive, (ALL_LENGTHS,))
    return {"columns": named, "scale": factors}


recorded = together(
    "reading",
    _reading,
    click.option(
        "--columns", multiple=True, metavar="NAME=COLUMN,...", help="What the file calls its columns: t=time,x=surge."
    ),
    click.option(
        "--scale",
        "scales",
        multiple=True,
        metavar="[NAME=]FACTOR",
        help="Factor on its lengths, 1000 from m to mm, or on a column: t=0.001.",
    ),
)
"""Adds what recordings call their columns; a command gets `reading`, for `read_path`."""


@click.command()
@click.argument("mech", type=MECH)
@click.argument("path", type=click.Path(path_type=Path, allow_dash=True))
@click.option("-o", "--output", help="CSV file to write; - prints it.", **OUTPUT)
@click.option(
    "--qpos", "model", type=click.Path(path_type=Path), metavar="MJCF", help="Write MuJoCo's qpos of this robot."
)
@projecting
@click.option("--sample-time", type=FINITE, metavar="S", help="Time from one target to the next [s].")
@click.option("--rapid", type=FINITE, metavar="V", help="Feed of rapid moves (G0), which say none [length/s].")
@click.option("--rate", type=FINITE, metavar="HZ", help="Resample the path: targets per second.")
@click.option("--longest", type=FINITE, metavar="D", help="Resample the path: longest step [length].")
@click.option("--tolerance", type=FINITE, metavar="D", help="How far steps may be off an arc [length].")
@recorded
@speed_option
@click.option("--live", "is_live", is_flag=True, help="Follow it as a stream: drives keep --speed, nothing leaps.")
@click.option(
    "--plot", "picture_path", type=click.Path(path_type=Path), metavar="FILE", help="Picture: PNG, SVG or PDF."
)
@click.option("--animate", "film_path", type=click.Path(path_type=Path), metavar="FILE", help="Film: GIF or MP4.")
@pictured()
@json_option()
def track(
    mech: str,
    path: Path,
    output: Path | None,
    model: Path | None,
    options: pf.Options,
    speeds: tuple[str, ...],
    is_live: bool,
    reading: Reading,
    picture_path: Path | None,
    film_path: Path | None,
    drawn: PictureOptions,
    as_json: bool,
    **sampling: float | None,
) -> int:
    """Follow a path of targets.

    Reads the targets from a CSV file or G-code and writes the answers to a CSV file, a part at a time; without -o it
    sums them up. Each answer starts from the one before.

    PATH is G-code, by its ending (.nc, .ngc, .gcode), or a CSV file: a header line and, in any order, the columns x, y,
    z, roll, pitch, yaw [deg] or roll_rad, pitch_rad, yaw_rad, and t [s] or feed [length/s]; - is standard input.
    Coordinates that the machine cannot change may be missing, as z in a plane. Further columns go out as they came in,
    and angles in the unit they came in.

    --plot draws the path, every actuator between its limits, and all margins; --animate the machine on its way.

    --live follows the path as a stream, a tick a target: no drive is faster than it may, every limit is kept, nothing
    leaps; out of reach, and where the path is too fast, answers lag behind. The path needs times, and drives speeds.

    With --qpos the file has the joint positions of the robot that MECH was made of, a row a target.

    The exit code is 1 also where an actuator would have to be faster than it may.
    """
    if model is not None and output is None:
        raise click.UsageError("--qpos: found no file to write; expected -o beside it")
    is_drawn = picture_path is not None or film_path is not None
    refuse_both_on_stdout(output, as_json)
    if mech == str(path) == str(STANDARD):
        raise click.UsageError("MECH and PATH are both standard input: give a file for one of them")
    outputs = [("-o", output), ("--plot", picture_path), ("--animate", film_path)]
    check_outputs(outputs, [path, Path(mech)], as_json=as_json)
    require_picture(picture_path)
    require_picture(film_path, FILMS)
    if not is_drawn:
        note_no_picture("--plot", "--animate")
    mechanism = load(mech)
    limits = speed_limits(mechanism, speeds)
    from ..answers.tracked import TrackSummary
    from ..capabilities.paths.read_path import path_blocks

    is_whole = as_json or is_drawn
    most = None if is_whole else MOST_TARGETS
    read: Any = partial(path_blocks, path, mechanism, most=most, **{**sampling, **reading})
    check = partial(checked, mechanism=mechanism, is_timed=bool(limits))
    blocks, n_targets = blocks_of(path if output is not None else STANDARD, read, check, whole=is_whole)
    summary = TrackSummary(mechanism)
    with nullcontext() if output is None else whole_file(output) as handle:
        every = own_limits(mechanism) | limits
        policy = {name: getattr(options, name) for name in ("hold", "hold_price", "rotation_length")}
        live = pf.Live(mechanism, speed=every, **policy) if is_live else None
        rows = None if handle is None else rows_of(handle, mechanism, model)
        solution = follow(mechanism, blocks, options, every, rows, summary, n_targets, live)
    draw(solution, picture_path, film_path, drawn)
    if as_json:
        print_json(solution.to_dict())
    print_text(summary.line(), to_stderr=as_json or output == STANDARD)
    if summary.worst():
        print_text(summary.worst(), to_stderr=True)
    return 0 if summary.is_well else 1


def blocks_of(
    path: Path,
    read: Callable[[], Iterator[paths.Path]],
    check: Callable[[Iterator[paths.Path]], Iterator[paths.Path]],
    *,
    whole: bool,
) -> tuple[Iterable[paths.Path], int | None]:
    """The parts of a path, all in one if it is wanted whole, and how many targets there are, where that is known.

    A path that can be read twice is checked to its end before the first answer is written; others part by part.
    """
    from ..capabilities.paths.path import joined

    if whole:
        block = joined(check(read()))
        return [block], len(block.lines)
    if path != STANDARD and path.is_file():
        return read(), sum(len(block.lines) for block in check(read()))
    return check(read()), None


def checked(blocks: Iterable[paths.Path], mechanism: pf.Mechanism, is_timed: bool) -> Iterator[paths.Path]:
    """Blocks of a path, with notes of what it sets to no effect, and an error if it sets nothing of the task."""
    import numpy as np

    from ..capabilities.paths.csv_table import NUMERIC

    is_set, passed = np.zeros((4, 4), bool), ""
    for number, block in enumerate(blocks):
        if number == 0:
            if is_timed and block.times is None:
                raise click.UsageError("--speed says nothing without --sample-time, or a path with times")
            for name in block.others:
                hint = "" if name in NUMERIC else near_miss(name, NUMERIC)
                if hint:
                    note(f"column '{name}' goes out as it came in{hint}")
        is_set |= (block.targets != mechanism.home_pose).any(axis=0) & (not block.by_joints)
        passed = ", ".join(f"{name} (line {line})" for name, line in block.passed.items())
        yield block
    if passed:
        note(f"passed over: {passed}: levelling and macros are not modelled")
    check_columns(is_set, mechanism)


def check_columns(is_set: Mask, mechanism: pf.Mechanism) -> None:
    """Note columns that the task leaves out; refuse a path that sets nothing else.

    Parameters
    ----------
    is_set : mask (4, 4) of the elements of a pose that are not as at home in some target.
    """
    task, axes = set(mechanism.task), dict(zip("xyz", is_set[:3, 3], strict=True))
    is_turned, is_tilted = is_set[:3, :3].any(), is_set[:3, 2].any()
    columns = [axis for axis in axes if axes[axis] and axis not in task]
    if is_turned and not task - set("xyz"):
        columns += ["roll", "pitch", "yaw"]
    elif "yaw" in task and is_tilted:
        columns += ["roll", "pitch"]
    sets_some = any(axes[axis] for axis in task & set("xyz")) or (is_turned and task - set("xyz"))
    if columns and not sets_some:
        raise click.ClickException(
            f"the path sets {', '.join(columns)} only, none of which the task has: {' '.join(mechanism.task)}"
        )
    note_left_out((f"column {name}" for name in columns), mechanism)


def follow(
    mechanism: pf.Mechanism,
    blocks: Iterable[paths.Path],
    options: pf.Options,
    limits: dict[str, float],
    rows: Rows | None,
    summary: TrackSummary,
    n_targets: int | None,
    live: pf.Live | None,
) -> pf.Track:
    """Follow a path part by part, write its rows and sum it up; the answers to the last part."""
    from ..capabilities.paths.follow import drive_parts, follow_parts

    with telling(f"tracking {counted(n_targets, 'target') if n_targets else 'targets'}") as tell:
        on_progress = None if tell is None else lambda done: tell(done, n_targets or 0)
        if live is None:
            parts = follow_parts(
                mechanism, blocks, options=options, speed_limits=limits or None, on_progress=on_progress
            )
        else:
            parts = drive_parts(live, blocks, on_progress=on_progress)
        for part in parts:
            summary.add(part.track, part.first, part.path.lines)
            if rows is not None:
                rows.write(part)
    return part.track


def rows_of(handle: TextIO, mechanism: pf.Mechanism, model: Path | None) -> Rows:
    """What writes the rows of a path: answers, or the states of a robot."""
    if model is not None:
        from ..exchange.interop.qpos_rows import QposRows

        return QposRows(handle, mechanism, model)
    from ..capabilities.paths.track_rows import TrackRows

    return TrackRows(handle)


def draw(solution: pf.Track, picture_path: Path | None, film_path: Path | None, drawn: PictureOptions) -> None:
    """Write the picture and the film that are wanted."""
    if picture_path is not None:
        write_picture(picture_path, partial(pf.plot_track, solution, **drawn.in_space), drawn)
    if film_path is not None:
        pf.animate(solution, film_path, dpi=drawn.dpi, **drawn.in_space)
        say_wrote(film_path)


def _limits_of(
    speeds: tuple[str, ...],
    accelerations: tuple[str, ...],
    torques: tuple[str, ...],
    platform_speed: float | None,
    platform_acceleration: float | None,
    platform_angular_acceleration: float | None,
) -> LimitsOf:
    def limits_of(mechanism: pf.Mechanism) -> dict[str, Any]:
        limits = {
            "speed": speed_limits(mechanism, speeds),
            "acceleration": speed_limits(mechanism, accelerations, "--acceleration"),
            "torque": by_name("--torque", torques, "actuator", actuators(mechanism), positive),
        }
        given: dict[str, Any] = {name: values for name, values in limits.items() if values}
        turning = platform_angular_acceleration
        of_platform = {
            "platform_speed": platform_speed,
            "platform_acceleration": platform_acceleration,
            "platform_angular_acceleration": None if turning is None else math.radians(turning),
        }
        return given | {name: value for name, value in of_platform.items() if value is not None}

    return limits_of


limiting = together(
    "limits_of",
    _limits_of,
    speed_option,
    named_values(
        "--acceleration",
        "accelerations",
        actuators,
        "Highest acceleration, likewise [deg/s² or length/s²]. Default: the file's max_acceleration.",
    ),
    named_values(
        "--torque",
        "torques",
        actuators,
        "The most that an actuator exerts, likewise [N m, of slides N]. Default: the file's max_torque.",
    ),
    click.option("--platform-speed", type=FINITE, metavar="V", help="Highest speed of the reference point [length/s]."),
    click.option("--platform-acceleration", type=FINITE, metavar="A", help="Its highest acceleration [length/s²]."),
    click.option(
        "--platform-angular-acceleration",
        type=FINITE,
        metavar="A",
        help="Highest angular acceleration of the platform [deg/s²].",
    ),
)
"""Adds the limits that a path is timed within; a command gets `limits_of`, from a machine to those given."""


@contextmanager
def at_lines_of(path: paths.Path) -> Iterator[None]:
    """Name the first target that an error is about as `track` does: counted from 1, and by the line it comes from."""
    from ..answers.tracked import place_of

    try:
        yield
    except pf.errors.InvalidArgument as error:
        if not error.rows:
            raise
        place = place_of(1, error.rows[0], path.lines)
        name = "--torque" if error.argument == "torque" else "PATH"
        raise click.ClickException(
            f"{name}: found {error.found}, first at {place}; expected {error.expected}"
        ) from error


@click.command()
@click.argument("mech", type=MECH)
@click.argument("path", type=click.Path(path_type=Path, allow_dash=True))
@click.option("-o", "--output", help="CSV file to write; - prints it.", **OUTPUT)
@recorded
@limiting
@carrying
@click.option("--rate", type=FINITE, default=1000.0, show_default=True, metavar="HZ", help="Samples per second.")
@json_option("One JSON object on stdout: the time, and what limits it.")
def time(
    mech: str,
    path: Path,
    output: Path | None,
    limits_of: LimitsOf,
    loads: Loads,
    gravity: Triple,
    rate: float,
    reading: Reading,
    as_json: bool,
) -> int:
    """Find the fastest way along a path.

    PATH is a CSV file or G-code; - is standard input. Every actuator stays within its speed, acceleration and torque;
    where a torque does not, on a long or rough path, the answer says by how much. At both ends the machine is at rest.
    A path with steps that are not reached, that leaps or crosses a parallel singularity is refused.

    Torques move the masses of the file [kg], and those of --load; gravity is in m/s².
    """
    refuse_both_on_stdout(output, as_json)
    check_outputs([("-o", output)], [path, Path(mech)], as_json=as_json)
    from ..capabilities.dynamics.weights import lacking_masses

    mechanism = load(mech)
    limits = limits_of(mechanism)
    if "torque" in limits:
        mechanism = weighed(mechanism, loads)
    elif any(joint.max_torque for joint in mechanism.joints) and (left := lacking_masses(mechanism)):
        note(f"max_torque of the file has no effect: no `mass` of {', '.join(left)} in tables [[body]]")
    read = pf.read_path(path, mechanism, **reading)
    with nullcontext() if output is None else whole_file(output) as handle, at_lines_of(read):
        followed = pf.track(mechanism, read.targets)
        timed = pf.time_path(followed, **limits, loads=loads, gravity=gravity, rate=rate, dwells=read.dwells)
        if handle is not None:
            timed.write(handle)
    print_result(as_json, timed, to_stderr=output == STANDARD)
    return 0
