"""``pfabrik effort``: what motors exert along a path."""

from __future__ import annotations

from pathlib import Path

import click

import pfabrik as pf

from .arguments import FINITE, MECH, Triple, completing, load
from .printing import json_option, note, print_result
from .statics import bodies, load_of


@click.command()
@click.argument("mech", type=MECH)
@click.argument("path", type=click.Path(path_type=Path, allow_dash=True))
@click.option("--sample-time", type=FINITE, metavar="S", help="Time from one target to the next [s].")
@click.option("--rapid", type=FINITE, metavar="V", help="Feed of rapid moves (G0), which say none [length/s].")
@click.option("--rate", type=FINITE, metavar="HZ", help="Resample the path: targets per second.")
@click.option(
    "--load",
    "loads",
    multiple=True,
    metavar="BODY=MASS,X,Y,Z",
    shell_complete=completing(bodies, "="),
    help="A mass [kg] that a body carries, and its centre, at home.",
)
@click.option(
    "--gravity", type=FINITE, nargs=3, default=(0, 0, -9.81), metavar="X Y Z", help="[m/s²]  [default: 0 0 -9.81]"
)
@json_option()
def effort(
    mech: str,
    path: Path,
    sample_time: float | None,
    rapid: float | None,
    rate: float | None,
    loads: tuple[str, ...],
    gravity: Triple,
    as_json: bool,
) -> int:
    """Tell what motors exert along a path.

    PATH is a CSV file or G-code, as of track, with times, feeds or --sample-time; - is standard input. Masses are those
    of the file and of --load; bodies without one weigh nothing. Forces are in N, torques in N m, power in W.
    """
    mechanism = load(mech)
    carried = dict(map(load_of, loads))
    known = {each.body for each in mechanism.masses} | {each.body for each in mechanism.shapes if each.density}
    others = [body for body in bodies(mechanism) if body not in known]
    if not known | set(carried):
        raise click.UsageError("nothing has a mass: give --load, or masses in the file")
    read = pf.read_path(path, mechanism, rapid=rapid, rate=rate)
    if read.times is None and sample_time is None:
        raise click.UsageError("the path has no times: give --sample-time")
    times = read.times if sample_time is None else None
    mechanism = mechanism.with_masses([*mechanism.masses, *(pf.Mass(body, 0.0) for body in others)])
    if left := [body for body in others if body not in carried]:
        note(f"without a mass, and counted as none: {', '.join(left)}")
    track = pf.track(mechanism, read.targets, times=times, sample_time=sample_time)
    found = pf.inverse_dynamics(track, loads=carried, gravity=gravity)
    print_result(as_json, found)
    return int(any(found.reason))
