"""``pfabrik verify``: what an independent program says of the answers."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

import pfabrik as pf

from ..errors import counted
from ..interop.verifying import FAR
from .mech import MECH, load

if TYPE_CHECKING:
    from ..description.joint_coordinates import JointCoordinate
    from ..description.mechanism import Mechanism
    from ..interop import Verification


@click.command()
@click.argument("mech", type=MECH)
@click.option(
    "--with", "referee", type=click.Choice(["mujoco"]), default="mujoco", show_default=True, help="The referee."
)
@click.option("--poses", type=click.IntRange(min=1), default=100, show_default=True, help="How many to compare.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the random poses.")
@click.option(
    "--original", type=click.Path(path_type=Path), metavar="FILE", help="The MuJoCo model or URDF it was imported from."
)
@click.option("--loops", type=click.Path(path_type=Path), metavar="YAML", help="The loops of the original, if a URDF.")
@click.option("--configuration", metavar="KEY", default="qpos0", show_default=True, help="A keyframe of it: home.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout; angles in radians.")
def verify(
    mech: str,
    referee: str,
    poses: int,
    seed: int,
    original: Path | None,
    loops: Path | None,
    configuration: str,
    as_json: bool,
) -> int:
    """Compare answers with those of MuJoCo.

    At random poses that are reached, MuJoCo says how far our loops are open, by its own constraint rows; then it closes
    the loops by itself, from elsewhere, and the poses are compared. With --original, the file that MECH was imported
    from is led to the same poses too, by the names of its joints.

    Exit code 0 if all agree, 1 if some do not, none was found, or all are too near to home to say anything.
    """
    mechanism = load(mech)
    found = pf.interop.verify(
        mechanism, poses=poses, seed=seed, original=original, loops=loops, configuration=configuration
    )
    if as_json:
        plain = {key: value if value == value else None for key, value in dataclasses.asdict(found).items()}
        plain["travelled"] = found.travelled._asdict()
        click.echo(json.dumps({"agree": found.agrees, "far": found.goes_far} | plain))
    else:
        click.echo(describe(mechanism, found))
    return 0 if found else 1


def describe(mechanism: Mechanism, found: Verification) -> str:
    """What was found, for people."""
    unit = mechanism.length_unit
    if not found.poses:
        return f"{mechanism.name}: no pose was reached"
    went, own = found.travelled, found.original
    spans = ", ".join(span(drive, went.drives[drive.name], unit) for drive in mechanism.drives)
    shift = f"{went.position / mechanism.characteristic_length:.2g} L ({went.position:.3g} {unit})"
    agrees = "agrees" if found.agrees else "does not agree"
    lines = [
        f"{mechanism.name}: {agrees} with MuJoCo on {counted(found.poses, 'pose')}",
        f"largest loop gap             {found.loop_gap:.1e} {unit}",
        f"largest position difference  {found.position_difference:.1e} {unit}",
        f"largest rotation difference  {found.rotation_difference:.1e} rad",
    ]
    if own is not None:
        lines += [
            f"original file                {'agrees' if own else 'does not agree'}",
            f"its own loops, left open by   {own.loop_gap:.1e} {unit}, of {own.position_tolerance:.1e}",
            f"position difference from it  {own.position_difference:.1e} {unit}, of {own.position_tolerance:.1e}",
            f"rotation difference from it  {own.rotation_difference:.1e} rad, of {own.rotation_tolerance:.1e}",
        ]
    lines += [
        f"actuators went through       {spans}",
        f"end effector went up to      {shift}, {math.degrees(went.rotation):.2g} deg",
    ]
    if not found.goes_far:
        lines.append(
            "too near to home to say anything: farther targets were not reached, and no actuator went through "
            f"{100.0 * FAR:.0f} % of its range; see `pfabrik check` for what may hold the machine"
        )
    return "\n".join(lines)


def span(drive: JointCoordinate, value: float, unit: str) -> str:
    """How far an actuator went, and which share of its range that is, if it has one."""
    shown = f"{math.degrees(value):.3g} deg" if drive.kind == "angle" else f"{value:.3g} {unit}"
    width = drive.limits[1] - drive.limits[0]
    return f"{drive.name} {shown}" + (f" ({100.0 * value / width:.0f} %)" if math.isfinite(width) else "")
