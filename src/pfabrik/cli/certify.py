"""``pfabrik certify``: is every pose of a region within all limits?"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import click

import pfabrik as pf

from .arguments import FINITE, MECH, load, numbers_of
from .options import completing, joints
from .printing import printing_result


@click.command()
@click.argument("mech", type=MECH)
@click.option("--box", metavar="X1:X2,Y1:Y2,Z1:Z2", help="Positions between these ends [length]; one value fixes.")
@click.option("--cylinder", metavar="X,Y,Z,R,H", help="Positions in a cylinder along z: centre, radius, height.")
@click.option("--ball", metavar="X,Y,Z,R", help="Positions in a ball: centre, radius.")
@click.option("--track", "path", type=click.Path(path_type=Path), metavar="FILE", help="Every pose of a path instead.")
@click.option("--rotation", metavar="DEG[,DEG,DEG]", help="Rotation vectors up to this to either side, by component.")
@click.option("--tilt", type=FINITE, metavar="DEG", help="Lean so far to every side, instead.")
@click.option("--yaw", metavar="MIN:MAX", help="With it, turns about z before the tilt [deg]. Default: 0.")
@click.option(
    "--limits",
    metavar="NAME[,NAME]",
    shell_complete=completing(joints),
    help="Joints whose limits count. Default: all.",
)
@click.option(
    "--tolerance", type=FINITE, metavar="M", help="Prove the least margin up to this. Default: its sign only."
)
@click.option("--budget", type=click.IntRange(min=1), metavar="N", help="Cells to look at, at most.")
@click.option("--uncertain", type=FINITE, metavar="R", help="For joints that may be so far off their points [length].")
@printing_result
def certify(
    mech: str,
    box: str | None,
    cylinder: str | None,
    ball: str | None,
    path: Path | None,
    rotation: str | None,
    tilt: float | None,
    yaw: str | None,
    limits: str | None,
    tolerance: float | None,
    budget: int | None,
    uncertain: float | None,
) -> pf.Certificate:
    """Prove that every pose of a region is reached, or find one that is not.

    Exit code 0: proved. 1: refuted, by a pose that is printed; or left open.
    """
    given = [
        name for name, value in (("--box", box), ("--cylinder", cylinder), ("--ball", ball), ("--track", path)) if value
    ]
    if len(given) != 1:
        raise click.UsageError(f"{' and '.join(given) or 'no region'}: give one of --box, --cylinder, --ball, --track")
    if path is not None and (rotation is not None or tilt is not None or yaw is not None):
        raise click.UsageError("--track has its orientations; leave out --rotation, --tilt and --yaw")
    mechanism = load(mech)
    region = (
        pf.read_path(path, mechanism).targets if path is not None else _region(box, cylinder, ball, rotation, tilt, yaw)
    )
    asked: dict[str, Any] = {"tolerance": tolerance, "uncertain": uncertain or 0.0}
    if budget is not None:
        asked["budget"] = budget
    return pf.certify(mechanism, region, limits=None if limits is None else limits.split(","), **asked)


def _region(
    box: str | None, cylinder: str | None, ball: str | None, rotation: str | None, tilt: float | None, yaw: str | None
) -> pf.PoseRegion:
    """The region that options describe, its angles in degrees."""
    turns: dict[str, Any] = {}
    if rotation is not None:
        sizes = [math.radians(size) for size in numbers_of("--rotation", rotation, (1, 3))]
        turns["rotation"] = sizes if len(sizes) == 3 else sizes[0]
    if tilt is not None:
        turns["tilt"] = math.radians(tilt)
    if yaw is not None:
        ends = [math.radians(end) for end in numbers_of("--yaw", yaw, (1, 2), ":")]
        turns["yaw"] = [ends[0], ends[-1]]
    if box is not None:
        sides = [numbers_of("--box", side, (1, 2), ":") for side in box.split(",")]
        if len(sides) != 3:
            raise click.UsageError(f"--box: found '{box}'; expected three ranges or values with commas between")
        return pf.PoseRegion.box([side[0] for side in sides], [side[-1] for side in sides], **turns)
    if cylinder is not None:
        *centre, radius, height = numbers_of("--cylinder", cylinder, (5,))
        return pf.PoseRegion.cylinder(centre, radius, height, **turns)
    *centre, radius = numbers_of("--ball", ball or "", (4,))
    return pf.PoseRegion.ball(centre, radius, **turns)
