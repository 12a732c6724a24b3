"""``pfabrik speed``: how fast the platform may move at a pose, and which actuator limits it."""

from __future__ import annotations

import json
import math

import click

import pfabrik as pf

from ..answers.aligned_text import aligned, plain
from .mech import MECH, load
from .speeds import speed_limits, speed_option
from .target import Triple, target_of, targeted


@click.command()
@click.argument("mech", type=MECH)
@targeted
@speed_option
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout; angles in radians.")
def speed(
    mech: str,
    position: Triple | None,
    rpy: Triple | None,
    joint: str | None,
    speeds: tuple[str, ...],
    as_json: bool,
) -> int:
    """Tell how fast the platform may move.

    Along and about each axis at a pose (default: home), and along the slowest direction of all.
    """
    mechanism = load(mech)
    at = pf.solve_ik(mechanism, target_of(mechanism, position, rpy, joint))
    if not at:
        raise click.ClickException(f"not reached: {str(at.status).lower()}; see `pfabrik ik`")
    found = pf.platform_speed(at, speed=speed_limits(mechanism, speeds) or None)
    if as_json:
        told = [each._asdict() | {"speed": each.speed if math.isfinite(each.speed) else None} for each in found]
        click.echo(json.dumps({"speeds": told}, allow_nan=False))
        return 0
    rows = []
    for each in found:
        value = math.degrees(each.speed) if each.kind == "about" else each.speed
        unit = "deg/s" if each.kind == "about" else f"{mechanism.length_unit}/s"
        shown = plain(value, 1e-9) if math.isfinite(value) else "unlimited"
        rows.append((each.kind, *(plain(part, 1e-9) for part in each.direction), shown, unit, each.limited_by))
    click.echo(aligned(["", "x", "y", "z", "speed", "unit", "limited by"], rows))
    return 0
