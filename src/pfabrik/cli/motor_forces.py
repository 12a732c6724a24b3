"""``pfabrik effort``: what motors exert along a path."""

from __future__ import annotations

from pathlib import Path

import click

import pfabrik as pf

from .arguments import FINITE, MECH, Triple, load
from .printing import json_option, print_result
from .statics import Loads, carrying, weighed


@click.command()
@click.argument("mech", type=MECH)
@click.argument("path", type=click.Path(path_type=Path, allow_dash=True))
@click.option("--sample-time", type=FINITE, metavar="S", help="Time from one target to the next [s].")
@click.option("--rapid", type=FINITE, metavar="V", help="Feed of rapid moves (G0), which say none [length/s].")
@click.option("--rate", type=FINITE, metavar="HZ", help="Resample the path: targets per second.")
@carrying
@json_option()
def effort(
    mech: str,
    path: Path,
    sample_time: float | None,
    rapid: float | None,
    rate: float | None,
    loads: Loads,
    gravity: Triple,
    as_json: bool,
) -> int:
    """Tell what motors exert along a path.

    PATH is a CSV file or G-code, as of track, with times, feeds or --sample-time; - is standard input. Masses are those
    of the file and of --load; bodies without one weigh nothing. Forces are in N, torques in N m, power in W.
    """
    mechanism = weighed(load(mech), loads)
    read = pf.read_path(path, mechanism, rapid=rapid, rate=rate)
    if read.times is None and sample_time is None:
        raise click.UsageError("the path has no times: give --sample-time")
    times = read.times if sample_time is None else None
    track = pf.track(mechanism, read.targets, times=times, sample_time=sample_time)
    found = pf.inverse_dynamics(track, loads=loads, gravity=gravity)
    print_result(as_json, found)
    return int(any(found.reason))
