"""``pfabrik export``: a mechanism as a file for another program."""

from __future__ import annotations

from pathlib import Path

import click

import pfabrik as pf

from .arguments import MECH, load
from .outputs import OUTPUT, STANDARD, check_outputs, force_option, refuse_existing, whole_file
from .printing import note

FORMATS = ("c", "c-float", "mjcf", "linuxcnc", "klipper")
NAMED = ("c", "c-float")
"""Formats whose names begin with one that can be chosen."""


def text_of(mechanism: pf.Mechanism, form: str, name: str) -> str:
    """The text of a mechanism in a format."""
    if form == "mjcf":
        from ..interop import to_mjcf

        return to_mjcf(mechanism)
    if form == "linuxcnc":
        from ..export.linuxcnc import linuxcnc

        return linuxcnc(mechanism)
    if form == "klipper":
        from ..export.klipper import klipper

        return klipper(mechanism)
    from ..export.export_c import c_source

    return c_source(mechanism, precision="float" if form == "c-float" else "double", name=name)


@click.command()
@click.argument("mech", type=MECH)
@click.argument("form", metavar="FORMAT", type=click.Choice(FORMATS))
@click.option("-o", "--output", default="-", help="File to write. Default: print it.", **OUTPUT)
@click.option("--name", metavar="NAME", help="Of c, c-float: what every name in the file begins with.  [default: pfk]")
@force_option
def export(mech: str, form: str, output: Path, name: str | None, force: bool) -> int:
    """Write a mechanism for another program.

    FORMAT is one of:

    \b
    c         one file of C99: inverse and forward kinematics with every limit
    c-float   the same in single precision
    mjcf      a MuJoCo model, which starts closed; what weighs and drives it is made up
    linuxcnc  HAL lines where LinuxCNC has these kinematics, else a module in C for halcompile
    klipper   [printer] and [stepper_*] of a delta printer
    """
    if name is not None and form not in NAMED:
        raise click.UsageError(f"--name is of {' and '.join(NAMED)}: {form} has none")
    refuse_existing(output, force)
    check_outputs([("-o", output)], [Path(mech)])
    text = text_of(load(mech), form, "pfk" if name is None else name)
    with whole_file(output) as handle:
        handle.write(text)
    if output != STANDARD:
        click.echo(f"wrote {output}", err=True)
    if form == "linuxcnc" and text.startswith("/*"):
        note("LinuxCNC has no kinematics that are this machine's: a module for it")
    return 0
