"""``pfabrik ik``: one target, one answer."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import click

import pfabrik as pf

from .answer import describe
from .hold import hold_option, options_holding

if TYPE_CHECKING:
    from ..mechanism import Mechanism

Triple = tuple[float, float, float]


@click.command()
@click.argument("mech")
@click.option("--position", type=float, nargs=3, metavar="X Y Z", help="Of the reference point. Default: at home.")
@click.option("--rpy", type=float, nargs=3, metavar="R P Y", help="Roll, pitch, yaw [deg] from home. Default: 0 0 0.")
@hold_option
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout; angles in radians.")
def ik(mech: str, position: Triple | None, rpy: Triple | None, hold: str, as_json: bool) -> int:
    """Solve for one target.

    A target out of reach gets a feasible answer near it, with the limits that hold it back.
    """
    if position is None and rpy is None:
        raise click.UsageError("no target: give --position, --rpy or both")
    mechanism = pf.load(mech)
    note_ignored(mechanism, position, rpy)
    target = pf.pose(position or mechanism.reference_point, rpy=[math.radians(angle) for angle in rpy or (0, 0, 0)])
    solution = pf.solve_ik(mechanism, target, options=options_holding(hold))
    click.echo(json.dumps(solution.to_dict(), allow_nan=False) if as_json else describe(solution))
    return 0 if solution else 1


def note_ignored(mechanism: Mechanism, position: Triple | None, rpy: Triple | None) -> None:
    """Say so when the task leaves out what the user gave."""
    task = set(mechanism.task)
    left_out = {"--position": position and not task & set("xyz"), "--rpy": rpy and not task & {"rotation", "tilt"}}
    for option in (name for name, ignored in left_out.items() if ignored):
        click.echo(f"pfabrik: note: {option} has no effect: the task is {' '.join(mechanism.task)}", err=True)
