"""``pfabrik time``: how fast a path may be followed."""

from __future__ import annotations

import json
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import click

import pfabrik as pf

from ..answers.aligned_text import aligned
from ..errors import counted
from ..telling import telling
from .finite import FINITE
from .mech import MECH, load
from .outputs import OUTPUT, STANDARD, check_outputs
from .speeds import speed_limits, speed_option
from .whole import whole_file

if TYPE_CHECKING:
    from ..timing.timed import Timed


@click.command()
@click.argument("mech", type=MECH)
@click.argument("path", type=click.Path(path_type=Path, allow_dash=True))
@click.option("-o", "--output", help="CSV file to write; - prints it.", **OUTPUT)
@speed_option
@click.option(
    "--acceleration",
    "accelerations",
    multiple=True,
    metavar="[NAME=]VALUE",
    help="Highest acceleration, likewise [deg/s² or length/s²]. Default: the file's max_acceleration.",
)
@click.option("--platform-speed", type=FINITE, metavar="V", help="Highest speed of the reference point [length/s].")
@click.option("--rate", type=FINITE, default=1000.0, show_default=True, metavar="HZ", help="Samples per second.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout: the time, and what limits it.")
def time(
    mech: str,
    path: Path,
    output: Path | None,
    speeds: tuple[str, ...],
    accelerations: tuple[str, ...],
    platform_speed: float | None,
    rate: float,
    as_json: bool,
) -> int:
    """Find the fastest way along a path.

    PATH is a CSV file or G-code; - is standard input. Every actuator stays within its speed and acceleration; at both
    ends the machine is at rest. A path with steps that are not reached, that leaps or crosses a parallel singularity
    is refused.
    """
    if as_json and output == STANDARD:
        raise click.UsageError("-o - and --json both print on stdout: give one of them")
    inputs = (path, Path(mech))
    check_outputs([("-o", output), ("--json", STANDARD if as_json else None)], inputs)
    mechanism = load(mech)
    limits = speed_limits(mechanism, speeds)
    pushes = speed_limits(mechanism, accelerations, "--acceleration")
    targets = pf.read_path(path, mechanism).targets
    with nullcontext() if output is None else whole_file(output, inputs) as handle:
        with telling(f"tracking {counted(len(targets), 'target')}") as on_progress:
            followed = pf.track(mechanism, targets, on_progress=on_progress)
        timed = pf.time_path(
            followed,
            speed=limits or None,
            acceleration=pushes or None,
            platform_speed=platform_speed,
            rate=rate,
        )
        if handle is not None:
            timed.write(handle)
    if as_json:
        click.echo(json.dumps(as_object(timed), allow_nan=False))
    else:
        click.echo(describe(timed), err=output == STANDARD)
    return 0


def as_object(timed: Timed) -> dict[str, object]:
    """The time, how many samples, and the limits that hold the path back."""
    held = [{"actuator": name, "what": what, "share": share} for (name, what), share in timed.held_back.items()]
    return {"duration": timed.duration, "samples": len(timed.times), "held_back": held}


def describe(timed: Timed) -> str:
    """The same for people."""
    rows = [(name, what, f"{100.0 * share:.1f} %") for (name, what), share in timed.held_back.items()]
    told = f"{timed.duration:.6g} s, {counted(len(timed.times), 'sample')}"
    return "\n\n".join([told, aligned(["held back by", "its", "of the time"], rows)]) if rows else told
