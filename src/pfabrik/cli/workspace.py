"""``pfabrik workspace`` and ``singularities``: how far the end effector can move, and where it is not controlled."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import pfabrik as pf

from ..common.cells import is_finite
from ..view.save_picture import PICTURES
from .arguments import FINITE, MECH, TargetOptions, Triple, answered, load, numbers_of, rpy_option, targeted
from .options import completing, named_values, together
from .outputs import (
    PictureOptions,
    check_outputs,
    note_no_picture,
    pictured,
    require_format,
    require_picture,
    say_wrote,
    write_picture,
)
from .printing import json_option, note, print_result

if TYPE_CHECKING:
    from ..capabilities.workspace.inscribed import Kind


@dataclass(frozen=True)
class SpaceOptions:
    """What is typed for ``--over``, ``--fix``, ``--within`` and ``--resolution``; None or empty where nothing is."""

    over: str | None
    fixed: tuple[str, ...]
    within: tuple[str, ...]
    resolution: float | None

    @property
    def is_given(self) -> bool:
        """True if any of the options is given."""
        return self != SpaceOptions(None, (), (), None)

    def workspace(self, mech: str, mechanism: pf.Mechanism, rpy: Triple | None, **others: Any) -> pf.Workspace:
        """The workspace that the options ask of the machine MECH, about an orientation [deg] if one is given."""
        names = None if self.over is None else self.over.split(",")
        held = {name: value for name, (value,) in pairs("--fix", self.fixed, 1).items()}
        within = {name: (low, high) for name, (low, high) in pairs("--within", self.within, 2).items()}
        resolution = None if self.resolution is None else in_its_unit(mechanism, names, held, self.resolution)
        if rpy is not None:
            others["orientation"] = pf.pose([0, 0, 0], rpy=rpy, degrees=True)[:3, :3]
        note_slow(mechanism)
        within = above_bed(mech, "z" in (names or "z") and not {"z"} & {*held, *within}) | within
        return pf.workspace(
            mechanism, over=names, fixed=held or None, within=within or None, resolution=resolution, **others
        )


def coordinates(mechanism: pf.Mechanism) -> dict[str, None]:
    """Names of the coordinates that a workspace of a machine may have."""
    from ..capabilities.workspace.space import free_coordinates, space_of

    usual = space_of(mechanism, None, None, None, mechanism.home_pose).names
    return dict.fromkeys((*usual, *free_coordinates(mechanism)))


HOLD, LOOK = "Hold a coordinate [length or deg]. May be repeated.", "Where to look [length or deg]. May be repeated."

spanning = together(
    "space",
    SpaceOptions,
    click.option(
        "--over",
        metavar="NAME,NAME[,NAME]",
        shell_complete=completing(coordinates),
        help="Coordinates: of x, y, z, tilt_x, tilt_y, yaw. Default: x,y,z.",
    ),
    named_values("--fix", "fixed", coordinates, HOLD, "NAME=VALUE"),
    named_values("--within", "within", coordinates, LOOK, "NAME=MIN:MAX"),
    click.option("--resolution", type=FINITE, metavar="R", help="Cells at the border [length; deg if all are angles]."),
)
"""Adds ``--over``, ``--fix``, ``--within`` and ``--resolution``, which a command gets as one `space`."""


@click.command()
@click.argument("mech", type=MECH)
@spanning
@rpy_option
@click.option("--any-orientation", is_flag=True, help="Positions that are reached with some orientation or other.")
@click.option("--tilt", type=FINITE, metavar="DEG", help="Positions where it can lean so far to every side.")
@click.option("--certified", is_flag=True, help="Also prove two bounds that the size lies between.")
@click.option("--largest", type=click.Choice(["sphere", "box", "cylinder"]), help="The largest that fits in.")
@click.option("--centre", metavar="V,V[,V]", help="Its centre [length or deg]. Default: where it is largest.")
@click.option(
    "-o",
    "--output",
    "outputs",
    multiple=True,
    type=click.Path(path_type=Path),
    help="File to write: .npz, .stl, .ply, .csv, or a picture: .png, .svg, .pdf. May be repeated.",
)
@pictured()
@json_option()
def workspace(
    mech: str,
    space: SpaceOptions,
    rpy: Triple | None,
    any_orientation: bool,
    tilt: float | None,
    certified: bool,
    largest: Kind | None,
    centre: str | None,
    outputs: tuple[Path, ...],
    drawn: PictureOptions,
    as_json: bool,
) -> int:
    """Tell how big the workspace is, and which limits form its border.

    By default over the positions at home's orientation; with `--fix z=200` a slice; with x, y and z fixed, the
    orientations there. Machines that hardly move but tilt are looked at over their angles. A picture shows the largest
    shape too; where nothing is within reach it says so, and the exit code is 1.
    """
    if any_orientation and rpy is not None:
        raise click.UsageError("--rpy and --any-orientation: give one of them")
    if centre is not None and largest is None:
        raise click.UsageError("--centre says nothing without --largest")
    if tilt is not None and not 0.0 <= tilt <= 180.0:
        raise click.UsageError(f"--tilt {tilt:g}: expected an angle from 0 to 180 degrees")
    from ..capabilities.workspace.saving import ENDINGS

    check_outputs([("-o", path) for path in outputs], [Path(mech)], as_json=as_json)
    pictures = [path for path in outputs if path.suffix.lower() in PICTURES]
    for path in outputs:
        require_format(path, (*ENDINGS, *PICTURES))
    for path in pictures:
        require_picture(path)
    if not pictures:
        note_no_picture("a picture")
    mechanism = load(mech)
    others: dict[str, Any] = {"orientation": "any"} if any_orientation else {}
    others["tilt"] = None if tilt is None else math.radians(tilt)
    found = space.workspace(mech, mechanism, rpy, certified=certified, **others)
    middle = None if centre is None else point(found, centre)
    try:
        shape = None if largest is None else found.inscribed(largest, middle)
    except pf.errors.InvalidArgument as error:
        if error.argument != "kind":
            raise
        raise click.UsageError(f"--largest{str(error).removeprefix(error.argument)}") from error
    for path in outputs:
        if path in pictures:
            write_picture(path, partial(found.plot, shape=shape, **drawn.in_space), drawn)
        else:
            found.save(path)
            say_wrote(path)
    print_result(as_json, found, {} if shape is None else {"largest": shape})
    return 0 if len(found.faces) else 1


@click.command()
@click.argument("mech", type=MECH)
@targeted
@spanning
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Picture of the map: PNG, SVG or PDF.")
@pictured()
@json_option()
def singularities(
    mech: str, target: TargetOptions, space: SpaceOptions, output: Path | None, drawn: PictureOptions, as_json: bool
) -> int:
    """Tell how near singularities are, at a pose or over a workspace.

    At a pose, home by default: the measure of each kind, 0 at a singularity, the motion that is nearest to being lost,
    with the actuators that make it, and the one nearest to being gained, which no actuator holds; and the mobility.

    With --over, --fix, --within, --resolution or -o, over a workspace at one orientation, as `pfabrik workspace` has
    it: the parts between parallel singularities, the least of each measure, and the share of points near to 0.
    """
    check_outputs([("-o", output)], [Path(mech)], as_json=as_json)
    require_picture(output)
    if output is None:
        note_no_picture("-o")
    if not space.is_given and output is None:
        solution = answered(load(mech), target)
        if solution is not None:
            print_result(as_json, pf.singularity(solution), {"mobility": pf.mobility(solution.mechanism)})
        return 0 if solution else 1
    if target.position or target.joint:
        raise click.UsageError("--position and --joint are of one pose: over a workspace, --fix holds a coordinate")
    mechanism = load(mech)
    found = pf.singularity_map(mechanism, space.workspace(mech, mechanism, target.rpy))
    if output is not None:
        write_picture(output, partial(found.plot, **drawn.in_space), drawn)
    print_result(as_json, found)
    return 0 if len(found.points) else 1


def note_slow(mechanism: pf.Mechanism) -> None:
    """Note before the work begins that it takes longer where no closed forms answer, and why."""
    from ..kinematics import why_not_measured

    reason = why_not_measured(mechanism)
    if reason:
        note(f"no closed forms, {reason}: points are tried one by one, which takes a minute or more")


def above_bed(mech: str, is_over_z: bool) -> dict[str, tuple[float, float]]:
    """The ends of z to which a printer's firmware keeps; notes say what else it keeps to, which a machine does not."""
    from ..machine.files import print_region_of

    printer = print_region_of(mech)
    if printer is None:
        return {}
    radius = f"{printer.radius}, a setting of the firmware, is not applied, and " if printer.radius else ""
    note(f"{radius}how far the joints tilt is in no firmware's file: an upper bound")
    if not is_over_z:
        return {}
    note(f"z from {printer.lowest:g} on, {printer.floor}; --within z=MIN:MAX looks elsewhere")
    return {"z": (printer.lowest, math.inf)}


def pairs(option: str, words: Sequence[str], n: int) -> dict[str, list[float]]:
    """Name -> n values [length or rad] from words such as ``z=200`` or ``tilt_x=-10:10``, in degrees for angles."""
    read = {}
    for word in words:
        name, equals, listed = word.partition("=")
        values = listed.split(":")
        if not equals or len(values) != n or not all(map(is_finite, values)):
            expected = "NAME=VALUE" if n == 1 else "NAME=MIN:MAX"
            raise click.UsageError(f"{option}: found '{word}'; expected {expected} with finite numbers")
        is_angle = name not in ("x", "y", "z")
        read[name] = [math.radians(float(value)) if is_angle else float(value) for value in values]
    return read


def in_its_unit(
    mechanism: pf.Mechanism, names: Sequence[str] | None, held: Mapping[str, float], resolution: float
) -> float:
    """A resolution as `workspace` takes it: from degrees to rad where all coordinates are angles."""
    from ..capabilities.workspace.space import space_of

    units = space_of(mechanism, names, held, None, mechanism.home_pose).units
    return math.radians(resolution) if set(units) == {"rad"} else resolution


def point(space: pf.Workspace, words: str) -> list[float]:
    """A point [length or rad] from words such as ``0,0,200``."""
    numbers = zip(numbers_of("--centre", words, [len(space.names)]), space.units, strict=True)
    return [math.radians(number) if unit == "rad" else number for number, unit in numbers]
