"""``pfabrik plot``: a picture of a machine, at home or in its answer to a target."""

from __future__ import annotations

from pathlib import Path

import click

import pfabrik as pf

from .mech import MECH, load
from .outputs import check_outputs
from .pictures import picture
from .target import Triple, target_of, targeted


@click.command()
@click.argument("mech", type=MECH)
@targeted
@click.option("-o", "--output", type=click.Path(path_type=Path), help="PNG, SVG or PDF.  [default: NAME.png]")
@click.option("--names", is_flag=True, help="Write the names of joints beside them.")
def plot(
    mech: str, position: Triple | None, rpy: Triple | None, joint: str | None, output: Path | None, names: bool
) -> int:
    """Draw a machine at home, or where a target takes it.

    A planar machine is drawn in its plane. A target out of reach shows the nearest feasible pose, the joints that hold
    it back in orange and named; the exit code is then 1.
    """
    path = output or Path(f"{Path(mech).stem if mech != '-' else 'mechanism'}.png")
    check_outputs([("-o", path)], [Path(mech)])
    mechanism = load(mech)
    home = position is None and rpy is None and joint is None
    shown = mechanism if home else pf.solve_ik(mechanism, target_of(mechanism, position, rpy, joint))
    with picture(path, quiet=True):
        pf.plot(shown, names=names)
    click.echo(f"wrote {path}")
    return 0 if home or shown else 1
