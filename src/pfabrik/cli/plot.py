"""``pfabrik plot``: a picture of a machine, at home or in its answer to a target."""

from __future__ import annotations

from pathlib import Path

import click

import pfabrik as pf

from .arguments import MECH, STANDARD_INPUT, TargetOptions, load, targeted
from .outputs import check_outputs, picture
from .torque_map_options import TorqueMap, torque_map_options


@click.command()
@click.argument("mech", type=MECH)
@targeted
@click.option("-o", "--output", type=click.Path(path_type=Path), help="PNG, SVG or PDF.  [default: NAME.png]")
@click.option("--names", is_flag=True, help="Write the names of joints beside them.")
@torque_map_options
def plot(mech: str, target: TargetOptions, output: Path | None, names: bool, torque_map: TorqueMap | None) -> int:
    """Draw a machine at home, or where a target takes it.

    A planar machine is drawn in its plane. A target out of reach shows the nearest feasible pose, the joints that hold
    it back in orange and named; the exit code is then 1.

    With --torque-map: the torques that the actuators give two joints in series, over the range of these.
    """
    path = output or Path(f"{Path(mech).stem if mech != STANDARD_INPUT else 'mechanism'}.png")
    check_outputs([("-o", path)], [Path(mech)])
    mechanism = load(mech)
    if torque_map is not None:
        if target.is_given or names:
            raise click.UsageError("--torque-map is of the whole range: it does not go with a target or --names")
        with picture(path):
            torque_map.draw(mechanism)
        click.echo(f"wrote {path}")
        return 0
    shown = pf.solve_ik(mechanism, target.of(mechanism)) if target.is_given else mechanism
    with picture(path):
        pf.plot(shown, names=names)
    click.echo(f"wrote {path}")
    return 0 if shown else 1
