"""``pfabrik travel``: how far the end effector can go from a pose, and what stops it."""

from __future__ import annotations

from pathlib import Path

import click

import pfabrik as pf

from .arguments import FINITE, MECH, TargetOptions, Triple, load, targeted
from .outputs import check_outputs, picture
from .printing import json_option, print_result


@click.command()
@click.argument("mech", type=MECH)
@targeted
@click.option("--along", type=FINITE, nargs=3, multiple=True, metavar="X Y Z", help="A direction. May be repeated.")
@click.option("--about", type=FINITE, nargs=3, multiple=True, metavar="X Y Z", help="An axis to turn about. Likewise.")
@click.option("--pivot", type=FINITE, nargs=3, metavar="X Y Z", help="What stays where it is. Default: --position.")
@click.option("--plot", "path", type=click.Path(path_type=Path), metavar="FILE", help="Picture too: PNG, SVG or PDF.")
@json_option()
def travel(
    mech: str,
    target: TargetOptions,
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
    check_outputs([("--plot", path)], [Path(mech)], as_json=as_json)
    mechanism = load(mech)
    start = pf.solve_ik(mechanism, target.of(mechanism))
    if not start:
        raise click.ClickException(f"cannot start there: {str(start.status).lower()}; see `pfabrik ik`")
    distances = pf.travel(start, along=along or None, about=about or None, pivot=pivot)
    if path is not None:
        with picture(path):
            pf.plot_travel(distances)
        click.echo(f"wrote {path}", err=True)
    print_result(as_json, distances)
    return 0
