"""``pfabrik export``: a mechanism as a file for another program."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .mech import MECH, load
from .outputs import OUTPUT, STANDARD, check_outputs, refuse_existing
from .whole import whole_file

if TYPE_CHECKING:
    from ..description.mechanism import Mechanism

FORMATS = ("c", "c-float", "mjcf", "linuxcnc", "klipper")
NAMED = ("c", "c-float")
"""Formats whose names begin with one that can be chosen."""


def text_of(mechanism: Mechanism, wanted: str, name: str) -> str:
    """The text that a mechanism becomes in a format."""
    from ..export.export_c import c_source
    from ..export.klipper import klipper
    from ..export.linuxcnc import linuxcnc
    from ..interop import to_mjcf

    makers: dict[str, Callable[[Mechanism], str]] = {
        "c": partial(c_source, name=name),
        "c-float": partial(c_source, precision="float", name=name),
        "mjcf": to_mjcf,
        "linuxcnc": linuxcnc,
        "klipper": klipper,
    }
    return makers[wanted](mechanism)


@click.command()
@click.argument("mech", type=MECH)
@click.argument("wanted", metavar="FORMAT", type=click.Choice(FORMATS))
@click.option("-o", "--output", default="-", help="File to write. Default: print it.", **OUTPUT)
@click.option("--name", metavar="NAME", help="Of c, c-float: what every name in the file begins with.  [default: pfk]")
@click.option("--force", is_flag=True, help="Replace the file if it exists.")
def export(mech: str, wanted: str, output: Path, name: str | None, force: bool) -> int:
    """Write a mechanism for another program.

    FORMAT is one of:

    \b
    c         one file of C99: inverse and forward kinematics with every limit
    c-float   the same in single precision
    mjcf      a MuJoCo model, which starts closed; what weighs and drives it is made up
    linuxcnc  HAL lines where LinuxCNC has these kinematics, else a module in C for halcompile
    klipper   [printer] and [stepper_*] of a delta printer
    """
    if name is not None and wanted not in NAMED:
        raise click.UsageError(f"--name is of {' and '.join(NAMED)}: {wanted} has none")
    refuse_existing(output, force)
    check_outputs([("-o", output)], [Path(mech)])
    text = text_of(load(mech), wanted, "pfk" if name is None else name)
    with whole_file(output, [Path(mech)]) as handle:
        handle.write(text)
    if output != STANDARD:
        click.echo(f"wrote {output}", err=True)
    if wanted == "linuxcnc" and text.startswith("/*"):
        click.echo("pfabrik: note: LinuxCNC has no kinematics that are this machine's: a module for it", err=True)
    return 0
