"""``pfabrik verify``: what an independent program says of the answers."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

import pfabrik as pf

from ..errors import counted
from ..printed import error_text
from .arguments import MECH, load
from .printing import json_option, print_answer

if TYPE_CHECKING:
    from ..description.joint_coordinates import JointCoordinate
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
@json_option()
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
    from closes its own loops there too, from its joints put by their names.

    Exit code 0 if all agree, 1 if some do not, none was found, or all are too near to home to say anything.
    """
    mechanism = load(mech)
    verification = pf.interop.verify(
        mechanism, poses=poses, seed=seed, original=original, loops=loops, configuration=configuration
    )
    print_answer(as_json, lambda: as_object(verification), lambda: describe(mechanism, verification))
    return 0 if verification else 1


def as_object(verification: Verification) -> dict[str, object]:
    """A verification as plain numbers and dicts, None where a number is not known."""
    fields = dataclasses.asdict(verification) | {"travelled": verification.travelled._asdict()}
    plain = {name: value if value == value else None for name, value in fields.items()}
    return {"agree": verification.agrees, "far": verification.goes_far} | plain


def describe(mechanism: pf.Mechanism, verification: Verification) -> str:
    """A verification for people."""
    from ..interop.verifying import FAR

    name, unit, size = mechanism.name, mechanism.length_unit, mechanism.characteristic_length
    original, went = verification.original, verification.travelled
    if not verification.poses:
        return f"{name}: no pose was reached"
    rows = [
        ("largest loop gap", f"{error_text(verification.loop_gap, '.1e', size)} {unit}"),
        ("largest position difference", f"{error_text(verification.position_difference, '.1e', size)} {unit}"),
        ("largest rotation difference", f"{error_text(verification.rotation_difference, '.1e')} rad"),
    ]
    if original is not None:
        nearest, least = f"{original.position_tolerance:.1e}", f"{original.rotation_tolerance:.1e}"
        rows += [
            ("original file", "agrees" if original else "does not agree"),
            ("its own loops, open by", f"{error_text(original.loop_gap, '.1e', size)} {unit}, of {nearest}"),
            (
                "position difference from it",
                f"{error_text(original.position_difference, '.1e', size)} {unit}, of {nearest}",
            ),
            ("rotation difference from it", f"{error_text(original.rotation_difference, '.1e')} rad, of {least}"),
        ]
    shift = f"{went.position / size:.2g} L ({went.position:.3g} {unit})"
    rows += [
        ("actuators went through", ", ".join(span(drive, went.drives[drive.name], unit) for drive in mechanism.drives)),
        ("end effector went up to", f"{shift}, {math.degrees(went.rotation):.2g} deg"),
    ]
    agrees = "agrees" if verification.agrees else "does not agree"
    lines = [f"{name}: {agrees} with MuJoCo on {counted(verification.poses, 'pose')}"]
    lines += [f"{label:<29}{text}" for label, text in rows]
    if not verification.goes_far:
        lines.append(
            "too near to home to say anything: farther targets were not reached, and no actuator went through "
            f"{100.0 * FAR:.0f} % of its range; see `pfabrik check` for what may hold the machine"
        )
    return "\n".join(lines)


def span(drive: JointCoordinate, value: float, unit: str) -> str:
    """The travel of an actuator, with its share of the range if there is one."""
    shown = f"{math.degrees(value):.3g} deg" if drive.kind == "angle" else f"{value:.3g} {unit}"
    width = drive.limits[1] - drive.limits[0]
    return f"{drive.name} {shown}" + (f" ({100.0 * value / width:.0f} %)" if math.isfinite(width) else "")
