"""``pfabrik workspace``: how far and how much the end effector can move, and what stops it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

import pfabrik as pf

from ..cells import is_finite
from ..checks import require_ending
from ..extras import require
from ..view.save_picture import PICTURES
from .arguments import FINITE, MECH, Triple, load, numbers_of, rpy_option
from .outputs import check_outputs, picture
from .printing import json_option, note, print_result

if TYPE_CHECKING:
    from ..workspace.inscribed import Kind


@click.command()
@click.argument("mech", type=MECH)
@click.option(
    "--over", metavar="NAME,NAME[,NAME]", help="Coordinates: of x, y, z, tilt_x, tilt_y, yaw. Default: x,y,z."
)
@click.option(
    "--fix", "fixed", multiple=True, metavar="NAME=VALUE", help="Hold a coordinate [length or deg]. May be repeated."
)
@rpy_option
@click.option("--any-orientation", is_flag=True, help="Positions that are reached with some orientation or other.")
@click.option("--tilt", type=FINITE, metavar="DEG", help="Positions where it can lean so far to every side.")
@click.option("--within", multiple=True, metavar="NAME=MIN:MAX", help="Where to look [length or deg]. May be repeated.")
@click.option("--resolution", type=FINITE, metavar="R", help="Cells at the border [length; deg if all are angles].")
@click.option("--certified", is_flag=True, help="Enclose the size between two bounds that are proved, too.")
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
@json_option()
def workspace(
    mech: str,
    over: str | None,
    fixed: tuple[str, ...],
    rpy: Triple | None,
    any_orientation: bool,
    tilt: float | None,
    within: tuple[str, ...],
    resolution: float | None,
    certified: bool,
    largest: Kind | None,
    centre: str | None,
    outputs: tuple[Path, ...],
    as_json: bool,
) -> int:
    """Tell how big the workspace is, and which limits form its border.

    By default over the positions at home's orientation; with `--fix z=200` a slice; with x, y and z fixed, the
    orientations there. Machines that hardly move but tilt are looked at over their angles.
    """
    if any_orientation and rpy is not None:
        raise click.UsageError("--rpy and --any-orientation: give one of them")
    if centre is not None and largest is None:
        raise click.UsageError("--centre says nothing without --largest")
    if tilt is not None and not 0.0 <= tilt <= 180.0:
        raise click.UsageError(f"--tilt {tilt:g}: expected an angle from 0 to 180 degrees")
    from ..workspace.saving import ENDINGS

    check_outputs([("-o", path) for path in outputs], [Path(mech)], as_json=as_json)
    for path in outputs:
        require_ending(path, (*ENDINGS, *PICTURES))
        if path.suffix.lower() in PICTURES:
            require("pictures", "matplotlib", "plot")
    mechanism = load(mech)
    orientation = None if rpy is None else pf.pose([0, 0, 0], rpy=rpy, degrees=True)[:3, :3]
    held = {name: value for name, (value,) in pairs("--fix", fixed, 1).items()}
    names = None if over is None else over.split(",")
    note_slow(mechanism)
    space = pf.workspace(
        mechanism,
        over=names,
        fixed=held or None,
        orientation="any" if any_orientation else orientation,
        tilt=None if tilt is None else math.radians(tilt),
        within={name: (low, high) for name, (low, high) in pairs("--within", within, 2).items()} or None,
        resolution=None if resolution is None else in_its_unit(mechanism, names, held, resolution),
        certified=certified,
    )
    middle = None if centre is None else point(space, centre)
    shape = None if largest is None else space.inscribed(largest, middle)
    for path in outputs:
        write(space, path)
    print_result(as_json, space, {} if shape is None else {"largest": shape})
    return 0 if len(space.faces) else 1


def note_slow(mechanism: pf.Mechanism) -> None:
    """Note before the work begins that it takes longer where no closed forms answer, and why."""
    from ..engine import why_not_measured

    reason = why_not_measured(mechanism)
    if reason:
        note(f"no closed forms, {reason}: points are tried one by one, for about a minute")


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
    from ..workspace.space import space_of

    units = space_of(mechanism, names, held, None, mechanism.home_pose).units
    return math.radians(resolution) if set(units) == {"rad"} else resolution


def point(space: pf.Workspace, words: str) -> list[float]:
    """A point [length or rad] from words such as ``0,0,200``."""
    numbers = zip(numbers_of("--centre", words, [len(space.names)]), space.units, strict=True)
    return [math.radians(number) if unit == "rad" else number for number, unit in numbers]


def write(space: pf.Workspace, path: Path) -> None:
    """Write a mesh, or a picture, whole or not at all."""
    if path.suffix.lower() in PICTURES:
        with picture(path):
            space.plot()
    else:
        space.save(path)
    click.echo(f"wrote {path}", err=True)
