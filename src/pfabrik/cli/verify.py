"""``pfabrik verify``: what an independent program says of the answers."""

from __future__ import annotations

import dataclasses
import json
from typing import TYPE_CHECKING

import click

import pfabrik as pf

from ..errors import counted
from .mech import MECH, load

if TYPE_CHECKING:
    from ..description.mechanism import Mechanism
    from ..interop import Verification


@click.command()
@click.argument("mech", type=MECH)
@click.option(
    "--with", "referee", type=click.Choice(["mujoco"]), default="mujoco", show_default=True, help="The referee."
)
@click.option("--poses", type=click.IntRange(min=1), default=100, show_default=True, help="How many to compare.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the random poses.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout; angles in radians.")
def verify(mech: str, referee: str, poses: int, seed: int, as_json: bool) -> int:
    """Compare answers with those of MuJoCo.

    At random poses that are reached, MuJoCo says how far our loops are open, by its own constraint rows; then it closes
    the loops by itself, from elsewhere, and the poses are compared.

    Exit code 0 if all agree, 1 if some do not or none was found.
    """
    mechanism = load(mech)
    found = pf.interop.verify(mechanism, poses=poses, seed=seed)
    if as_json:
        plain = {key: value if value == value else None for key, value in dataclasses.asdict(found).items()}
        click.echo(json.dumps({"agree": bool(found)} | plain))
    else:
        click.echo(describe(mechanism, found))
    return 0 if found else 1


def describe(mechanism: Mechanism, found: Verification) -> str:
    """What was found, for people."""
    unit = mechanism.length_unit
    if not found.poses:
        return f"{mechanism.name}: no pose was reached"
    agrees = "agrees" if found else "does not agree"
    return "\n".join(
        [
            f"{mechanism.name}: {agrees} with MuJoCo on {counted(found.poses, 'pose')}",
            f"largest loop gap             {found.loop_gap:.1e} {unit}",
            f"largest position difference  {found.position_difference:.1e} {unit}",
            f"largest rotation difference  {found.rotation_difference:.1e} rad",
        ]
    )
