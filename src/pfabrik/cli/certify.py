"""``pfabrik certify``: is every pose of a region within all limits?"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

import pfabrik as pf

from .arguments import FINITE, MECH, load, numbers_of
from .options import completing, joints, together
from .printing import printing_result


@dataclass(frozen=True)
class RegionOptions:
    """What is typed for a region of poses, or a path: positions [length], angles [deg]; None where nothing is."""

    box: str | None
    cylinder: str | None
    ball: str | None
    path: Path | None
    rotation: str | None
    tilt: float | None
    yaw: str | None
    joints: str | None

    def of(self, mechanism: pf.Mechanism) -> pf.PoseRegion | Any:
        """The region, or the targets of the path."""
        shapes = {
            "--box": self.box,
            "--cylinder": self.cylinder,
            "--ball": self.ball,
            "--joints": self.joints,
            "--track": self.path,
        }
        given = [name for name, value in shapes.items() if value]
        if len(given) != 1:
            raise click.UsageError(
                f"{' and '.join(given) or 'no region'}: give one of --box, --cylinder, --ball, --joints, --track"
            )
        if self.joints is not None:
            return self._of_joints(mechanism, self.joints)
        if self.path is None:
            return self._region()
        if self.rotation is not None or self.tilt is not None or self.yaw is not None:
            raise click.UsageError("--track has its orientations; leave out --rotation, --tilt and --yaw")
        return pf.read_path(self.path, mechanism).targets

    def _of_joints(self, mechanism: pf.Mechanism, text: str) -> pf.PoseRegion:
        """The region of coordinates NAME=MIN:MAX with commas between."""
        if self.rotation is not None or self.tilt is not None or self.yaw is not None:
            raise click.UsageError("--joints give the orientations; leave out --rotation, --tilt and --yaw")
        ranges: dict[str, list[float]] = {}
        for each in text.split(","):
            name, _, ends = each.partition("=")
            coordinate = mechanism.coordinates_by_name.get(name.strip())
            unit = math.radians(1.0) if coordinate is None or coordinate.kind == "angle" else 1.0
            ranges[name.strip()] = [unit * end for end in numbers_of("--joints", ends, (2,), ":")]
        return pf.PoseRegion.joints(ranges)

    def _region(self) -> pf.PoseRegion:
        turns: dict[str, Any] = {}
        if self.rotation is not None:
            sizes = [math.radians(size) for size in numbers_of("--rotation", self.rotation, (1, 3))]
            turns["rotation"] = sizes if len(sizes) == 3 else sizes[0]
        if self.tilt is not None:
            turns["tilt"] = math.radians(self.tilt)
        if self.yaw is not None:
            ends = [math.radians(end) for end in numbers_of("--yaw", self.yaw, (1, 2), ":")]
            turns["yaw"] = [ends[0], ends[-1]]
        if self.box is not None:
            sides = [numbers_of("--box", side, (1, 2), ":") for side in self.box.split(",")]
            if len(sides) != 3:
                raise click.UsageError(
                    f"--box: found '{self.box}'; expected three ranges or values with commas between"
                )
            return pf.PoseRegion.box([side[0] for side in sides], [side[-1] for side in sides], **turns)
        if self.cylinder is not None:
            *centre, radius, height = numbers_of("--cylinder", self.cylinder, (5,))
            return pf.PoseRegion.cylinder(centre, radius, height, **turns)
        *centre, radius = numbers_of("--ball", self.ball or "", (4,))
        return pf.PoseRegion.ball(centre, radius, **turns)


regioned = together(
    "region",
    RegionOptions,
    click.option("--box", metavar="X1:X2,Y1:Y2,Z1:Z2", help="Positions between these ends [length]; one value fixes."),
    click.option("--cylinder", metavar="X,Y,Z,R,H", help="Positions in a cylinder along z: centre, radius, height."),
    click.option("--ball", metavar="X,Y,Z,R", help="Positions in a ball: centre, radius."),
    click.option("--joints", metavar="NAME=A:B,...", help="Coordinates of joints in series to the platform [deg]."),
    click.option(
        "--track", "path", type=click.Path(path_type=Path), metavar="FILE", help="Every pose of a path instead."
    ),
    click.option(
        "--rotation", metavar="DEG[,DEG,DEG]", help="Rotation vectors up to this to either side, by component."
    ),
    click.option("--tilt", type=FINITE, metavar="DEG", help="Lean so far to every side, instead."),
    click.option("--yaw", metavar="MIN:MAX", help="With it, turns about z before the tilt [deg]. Default: 0."),
)
"""Adds the options of a region, which a command gets as one `region`."""


@click.command()
@click.argument("mech", type=MECH)
@regioned
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
@click.option("--singular", is_flag=True, help="Prove, too, that no pose is a parallel singularity.")
@printing_result
def certify(
    mech: str,
    region: RegionOptions,
    limits: str | None,
    tolerance: float | None,
    budget: int | None,
    uncertain: float | None,
    singular: bool,
) -> pf.Certificate:
    """Prove that every pose of a region is reached, or find one that is not.

    Exit code 0: proved. 1: refuted, by a pose that is printed; or left open.
    """
    mechanism = load(mech)
    asked: dict[str, Any] = {"tolerance": tolerance, "uncertain": uncertain or 0.0, "singular": singular}
    if budget is not None:
        asked["budget"] = budget
    chosen = None if limits is None else limits.split(",")
    return pf.certify(mechanism, region.of(mechanism), limits=chosen, **asked)
