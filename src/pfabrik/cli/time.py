"""``pfabrik time``: how fast a path may be followed."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import click

import pfabrik as pf

from .arguments import FINITE, MECH, load
from .outputs import OUTPUT, STANDARD, check_outputs, refuse_both_on_stdout, whole_file
from .printing import json_option, print_result
from .speed import speed_limits, speed_option


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
@json_option("One JSON object on stdout: the time, and what limits it.")
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
    refuse_both_on_stdout(output, as_json)
    check_outputs([("-o", output)], [path, Path(mech)], as_json=as_json)
    mechanism = load(mech)
    highest_speeds = speed_limits(mechanism, speeds) or None
    highest_accelerations = speed_limits(mechanism, accelerations, "--acceleration") or None
    targets = pf.read_path(path, mechanism).targets
    with nullcontext() if output is None else whole_file(output) as handle:
        solution = pf.track(mechanism, targets)
        timed = pf.time_path(
            solution,
            speed=highest_speeds,
            acceleration=highest_accelerations,
            platform_speed=platform_speed,
            rate=rate,
        )
        if handle is not None:
            timed.write(handle)
    print_result(as_json, timed, to_stderr=output == STANDARD)
    return 0
