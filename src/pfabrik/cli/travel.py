"""``pfabrik travel``: how far the end effector can go from a pose, and what stops it."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import click

import pfabrik as pf

from .finite import FINITE
from .mech import MECH, load
from .table import aligned
from .target import Triple, target_of, targeted

if TYPE_CHECKING:
    from ..travel import Reach, Travel


@click.command()
@click.argument("mech", type=MECH)
@targeted
@click.option("--along", type=FINITE, nargs=3, multiple=True, metavar="X Y Z", help="A direction. May be repeated.")
@click.option("--about", type=FINITE, nargs=3, multiple=True, metavar="X Y Z", help="An axis to turn about. Likewise.")
@click.option("--pivot", type=FINITE, nargs=3, metavar="X Y Z", help="What stays where it is. Default: --position.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout; angles in radians.")
def travel(
    mech: str,
    position: Triple | None,
    rpy: Triple | None,
    joint: str | None,
    along: tuple[Triple, ...],
    about: tuple[Triple, ...],
    pivot: Triple | None,
    as_json: bool,
) -> int:
    """Tell how far the end effector can go along and about axes.

    It starts at a pose within reach (default: home) and stays in its working mode; a limit, or the length of the links,
    stops it. By default it goes both ways along and about each axis of the task.
    """
    mechanism = load(mech)
    start = pf.solve_ik(mechanism, target_of(mechanism, position, rpy, joint))
    if not start:
        raise click.ClickException(f"cannot start there: {str(start.status).lower()}; see `pfabrik ik`")
    found = pf.travel(start, along=along or None, about=about or None, pivot=pivot)
    click.echo(json.dumps(found.to_dict(), allow_nan=False) if as_json else describe(found))
    return 0


def describe(found: Travel) -> str:
    """One line a direction."""
    from ..answers.words import short_names
    from .answer import plain

    rows = [
        (
            each.kind,
            *(plain(part, 1e-9) for part in each.direction),
            *distance(each, found),
            short_names(each.stopped_by),
        )
        for each in found
    ]
    return aligned(["", "x", "y", "z", "travel", "unit", "stopped by"], rows)


def distance(reach: Reach, found: Travel) -> tuple[str, str]:
    """How far it is, and the unit: degrees about an axis."""
    from .answer import plain

    mechanism = found.origin.mechanism
    unit = "deg" if reach.kind == "about" else mechanism.length_unit
    if not math.isfinite(reach.distance):
        return "unlimited", unit
    if reach.kind == "about":
        return plain(math.degrees(reach.distance), 1e-6), unit
    return plain(reach.distance, 2e-9 * mechanism.characteristic_length), unit
