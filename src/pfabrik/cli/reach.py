"""``pfabrik reach``: how far the end effector can go from a pose."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import click

import pfabrik as pf

from .finite import FINITE
from .table import aligned

if TYPE_CHECKING:
    from ..answers.words import Floats
    from ..description.mechanism import Mechanism

Triple = tuple[float, float, float]

AXES: dict[str, tuple[Triple, Triple]] = {
    "x": ((1, 0, 0), (-1, 0, 0)),
    "y": ((0, 1, 0), (0, -1, 0)),
    "z": ((0, 0, 1), (0, 0, -1)),
}


@click.command()
@click.argument("mech")
@click.option("--from", "position", type=FINITE, nargs=3, metavar="X Y Z", help="Where to start. Default: at home.")
@click.option("--rpy", type=FINITE, nargs=3, metavar="R P Y", help="Roll, pitch, yaw [deg] from home. Default: 0 0 0.")
@click.option(
    "--direction",
    "directions",
    type=FINITE,
    nargs=3,
    multiple=True,
    metavar="X Y Z",
    help="Where to, of any length. May be repeated. Default: along each axis of the task, both ways.",
)
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout.")
def reach(mech: str, position: Triple | None, rpy: Triple | None, directions: tuple[Triple, ...], as_json: bool) -> int:
    """Tell how far the end effector can go in given directions.

    It starts at a pose within reach, keeps its orientation, and stays in its working mode; a limit, or the length of
    the links, stops it.
    """
    mechanism = pf.load(mech)
    origin = pf.pose(position or mechanism.reference_point, rpy=[math.radians(angle) for angle in rpy or (0, 0, 0)])
    rays = directions or tuple(way for axis in AXES if axis in mechanism.task for way in AXES[axis])
    distances = pf.reach(mechanism, origin, rays)
    click.echo(as_object(origin, rays, distances) if as_json else describe(mechanism, rays, distances))
    return 0


def describe(mechanism: Mechanism, rays: tuple[Triple, ...], distances: Floats) -> str:
    """One line a direction."""
    from .answer import plain

    smallest = 2e-9 * mechanism.characteristic_length  # nothing nearer can be told apart from no way at all
    rows = [
        (*(f"{part:.6g}" for part in ray), plain(far, smallest) if math.isfinite(far) else "unlimited")
        for ray, far in zip(rays, distances.tolist(), strict=True)
    ]
    return aligned(["x", "y", "z", f"reach [{mechanism.length_unit}]"], rows)


def as_object(origin: Floats, rays: tuple[Triple, ...], distances: Floats) -> str:
    """One JSON object; null for a distance without end."""
    ends = [far if math.isfinite(far) else None for far in distances.tolist()]
    return json.dumps({"from": origin.tolist(), "directions": [list(ray) for ray in rays], "reach": ends})
