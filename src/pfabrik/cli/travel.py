"""``pfabrik travel``: how far the end effector can go from a pose, and what stops it."""

from __future__ import annotations

import json
from pathlib import Path

import click

import pfabrik as pf

from .finite import FINITE
from .mech import MECH, load
from .outputs import STANDARD, check_outputs
from .pictures import picture
from .target import Triple, target_of, targeted


@click.command()
@click.argument("mech", type=MECH)
@targeted
@click.option("--along", type=FINITE, nargs=3, multiple=True, metavar="X Y Z", help="A direction. May be repeated.")
@click.option("--about", type=FINITE, nargs=3, multiple=True, metavar="X Y Z", help="An axis to turn about. Likewise.")
@click.option("--pivot", type=FINITE, nargs=3, metavar="X Y Z", help="What stays where it is. Default: --position.")
@click.option("--plot", "path", type=click.Path(path_type=Path), metavar="FILE", help="Picture too: PNG, SVG or PDF.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout; angles in radians.")
def travel(
    mech: str,
    position: Triple | None,
    rpy: Triple | None,
    joint: str | None,
    along: tuple[Triple, ...],
    about: tuple[Triple, ...],
    pivot: Triple | None,
    path: Path | None,
    as_json: bool,
) -> int:
    """Tell how far the end effector can go along and about axes.

    It starts at a pose within reach (default: home) and stays in its working mode; a limit, or the length of the links,
    stops it. By default it goes both ways along and about each axis of the task.
    """
    check_outputs([("--plot", path), ("--json", STANDARD if as_json else None)], [Path(mech)])
    mechanism = load(mech)
    start = pf.solve_ik(mechanism, target_of(mechanism, position, rpy, joint))
    if not start:
        raise click.ClickException(f"cannot start there: {str(start.status).lower()}; see `pfabrik ik`")
    found = pf.travel(start, along=along or None, about=about or None, pivot=pivot)
    if path is not None:
        with picture(path):
            pf.plot_travel(found)
    click.echo(json.dumps(found.to_dict(), allow_nan=False) if as_json else str(found))
    return 0
