"""``pfabrik workspace``: how far and how much the end effector can move, and what stops it."""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

import pfabrik as pf

from ..answers.aligned_text import aligned
from ..checks import require_ending
from ..extras import require
from ..view.save_picture import PICTURES
from ..workspace.saving import ENDINGS
from .finite import FINITE, is_finite
from .group import complain
from .mech import MECH, load
from .outputs import STANDARD, check_outputs
from .pictures import picture
from .target import Triple

if TYPE_CHECKING:
    from ..description.mechanism import Mechanism
    from ..telling import OnProgress
    from ..workspace.inscribed import Inscribed, Kind
    from ..workspace.result import Workspace

MOST_LIMITS = 12

SECONDS_A_LINE = 5.0
"""Between two lines that tell how far it is."""


@click.command()
@click.argument("mech", type=MECH)
@click.option(
    "--over", metavar="NAME,NAME[,NAME]", help="Coordinates: of x, y, z, tilt_x, tilt_y, yaw. Default: x,y,z."
)
@click.option(
    "--fix", "fixed", multiple=True, metavar="NAME=VALUE", help="Hold a coordinate [length or deg]. May be repeated."
)
@click.option("--rpy", type=FINITE, nargs=3, metavar="R P Y", help="Roll, pitch, yaw [deg] from home. Default: 0 0 0.")
@click.option("--any-orientation", is_flag=True, help="Positions that are reached with some orientation or other.")
@click.option("--tilt", type=FINITE, metavar="DEG", help="Positions where it can lean so far to every side.")
@click.option("--within", multiple=True, metavar="NAME=MIN:MAX", help="Where to look [length or deg]. May be repeated.")
@click.option("--resolution", type=FINITE, metavar="R", help="Cells at the border [length; deg if all are angles].")
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
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout; angles in radians.")
def workspace(
    mech: str,
    over: str | None,
    fixed: tuple[str, ...],
    rpy: Triple | None,
    any_orientation: bool,
    tilt: float | None,
    within: tuple[str, ...],
    resolution: float | None,
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
    check_outputs([*(("-o", path) for path in outputs), ("--json", STANDARD if as_json else None)], [Path(mech)])
    for path in outputs:
        require_ending(path, (*ENDINGS, *PICTURES))
        if path.suffix.lower() in PICTURES:
            require("pictures", "matplotlib", "plot")
    mechanism = load(mech)
    turned = None if rpy is None else pf.pose([0, 0, 0], rpy=rpy, degrees=True)[:3, :3]
    held = {name: value for name, (value,) in pairs("--fix", fixed, 1).items()}
    names = None if over is None else over.split(",")
    note_slow(mechanism)
    found = pf.workspace(
        mechanism,
        over=names,
        fixed=held or None,
        orientation="any" if any_orientation else turned,
        tilt=None if tilt is None else math.radians(tilt),
        within={name: (low, high) for name, (low, high) in pairs("--within", within, 2).items()} or None,
        resolution=None if resolution is None else in_its_unit(mechanism, names, held, resolution),
        on_progress=None if sys.stderr.isatty() else told_in_lines(),
    )
    middle = None if centre is None else point(found, centre)
    shape = None if largest is None else found.inscribed(largest, middle)
    for path in outputs:
        write(found, path)
    click.echo(json.dumps(plain_object(found, shape), allow_nan=False) if as_json else describe(found, shape))
    return 0 if len(found.faces) else 1


def note_slow(mechanism: Mechanism) -> None:
    """Say at once that it takes longer where no closed forms answer, and why."""
    from ..model import model_of

    reason = model_of(mechanism).why_poses_do_not_suffice
    if reason:
        complain(f"note: no closed forms, {reason}: points are tried one by one, for about a minute")


def told_in_lines() -> OnProgress:
    """What tells how far it is where no terminal shows a bar: a line on stderr every few seconds."""
    last = time.monotonic()

    def tell(done: int, total: int) -> None:
        nonlocal last
        if time.monotonic() - last >= SECONDS_A_LINE:
            last = time.monotonic()
            complain(f"workspace: {done} of about {total} points")

    return tell


def pairs(option: str, words: Sequence[str], n: int) -> dict[str, list[float]]:
    """Name -> n values [length or rad] from words such as ``z=200`` or ``tilt_x=-10:10``, in degrees for angles."""
    found = {}
    for word in words:
        name, equals, listed = word.partition("=")
        values = listed.split(":")
        if not equals or len(values) != n or not all(map(is_finite, values)):
            expected = "NAME=VALUE" if n == 1 else "NAME=MIN:MAX"
            raise click.UsageError(f"{option}: found '{word}'; expected {expected} with finite numbers")
        turns = name not in ("x", "y", "z")
        found[name] = [math.radians(float(value)) if turns else float(value) for value in values]
    return found


def in_its_unit(
    mechanism: Mechanism, names: Sequence[str] | None, held: Mapping[str, float], resolution: float
) -> float:
    """A resolution as `workspace` takes it: from degrees to rad where all coordinates are angles."""
    from ..workspace.space import space_of

    units = space_of(mechanism, names, held, None, mechanism.home_pose).units
    return math.radians(resolution) if set(units) == {"rad"} else resolution


def point(found: Workspace, words: str) -> list[float]:
    """A point [length or rad] from words such as ``0,0,200``."""
    values = words.split(",")
    if len(values) != len(found.names) or not all(map(is_finite, values)):
        raise click.UsageError(
            f"--centre: found '{words}'; expected {len(found.names)} finite numbers with commas between"
        )
    return [math.radians(float(v)) if unit == "rad" else float(v) for v, unit in zip(values, found.units, strict=True)]


def write(found: Workspace, path: Path) -> None:
    """A mesh, or a picture, whole or not at all."""
    if path.suffix.lower() in PICTURES:
        with picture(path):
            found.plot()
        return
    found.save(path)
    click.echo(f"wrote {path}", err=True)


def plain_object(found: Workspace, shape: Inscribed | None) -> dict[str, object]:
    """What is printed as JSON."""
    told: dict[str, object] = found.to_dict()
    if shape is not None:
        told["largest"] = {
            "kind": shape.kind,
            "centre": shape.centre.tolist(),
            "extents": shape.extents.tolist(),
            "size": shape.size,
        }
    return told


def describe(found: Workspace, shape: Inscribed | None) -> str:
    """Size, ends, what forms the border, and parts."""
    from ..workspace.sizes import in_words, kind_of

    if not len(found.faces):
        return "nothing within reach"
    shown = [180.0 / math.pi if unit == "rad" else 1.0 for unit in found.units]
    units = ["deg" if unit == "rad" else unit for unit in found.units]
    rows = [
        (name, f"{low * factor:.6g}", f"{high * factor:.6g}", unit)
        for name, low, high, factor, unit in zip(found.names, *found.bounds.tolist(), shown, units, strict=True)
    ]
    shares = list(found.shares.items())
    limits = [(f"{100.0 * share:.1f}%", " ".join(limit).strip(), kind_of(found, limit[0])) for limit, share in shares]
    formed = aligned(["border", "formed by", "joint"], limits[:MOST_LIMITS])
    blocks = [in_words(found), aligned(["", "min", "max", "unit"], rows), formed]
    if len(shares) > MOST_LIMITS:
        blocks[-1] += f"\nand {len(shares) - MOST_LIMITS} more"
    if len(found.components) > 1:
        blocks.append("\n".join(described_part(found, part) for part in found.components))
    elif found.at_start is None:
        blocks.append("the start is not within it")
    if shape is not None:
        lengths = ", ".join(f"{e * f:.4g}" for e, f in zip(shape.extents.tolist(), shown, strict=True))
        middle = ", ".join(f"{c * f:.4g}" for c, f in zip(shape.centre.tolist(), shown, strict=True))
        blocks.append(f"largest {shape.kind}: {lengths} about {middle} [{', '.join(dict.fromkeys(units))}]")
    return "\n\n".join(blocks)


def described_part(found: Workspace, part: Workspace) -> str:
    from ..workspace.sizes import in_words

    return f"{'with' if part is found.at_start else 'apart from'} the start: {in_words(part)}"
