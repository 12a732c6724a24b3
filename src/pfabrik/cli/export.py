"""``pfabrik export``: a mechanism as a file for another program. Each target is an option of its own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import pfabrik as pf

from .mech import MECH, load
from .whole import OUTPUT, STANDARD, refuse_existing, whole_file

if TYPE_CHECKING:
    from ..description.mechanism import Mechanism


def mjcf(mechanism: Mechanism) -> str:
    """A MuJoCo model."""
    return pf.interop.to_mjcf(mechanism)


def c_double(mechanism: Mechanism) -> str:
    """One file of C in double precision."""
    from ..export.export_c import c_source

    return c_source(mechanism)


def c_float(mechanism: Mechanism) -> str:
    """One file of C in single precision."""
    from ..export.export_c import c_source

    return c_source(mechanism, precision="float")


def linuxcnc(mechanism: Mechanism) -> str:
    """What LinuxCNC needs."""
    from ..export.linuxcnc import linuxcnc as settings

    return settings(mechanism)


def klipper(mechanism: Mechanism) -> str:
    """What Klipper needs."""
    from ..export.klipper import klipper as settings

    return settings(mechanism)


TARGETS: dict[str, tuple[Callable[[Mechanism], str], str]] = {
    "mjcf": (mjcf, "A MuJoCo model, which starts closed; what weighs and drives it is made up."),
    "c": (c_double, "One file of C99: inverse and forward kinematics with every limit."),
    "c_float": (c_float, "The same in single precision."),
    "linuxcnc": (linuxcnc, "HAL lines where LinuxCNC has these kinematics, else a module in C for halcompile."),
    "klipper": (klipper, "[printer] and [stepper_*] of a delta printer."),
}
"""Name of an option -> the text that a mechanism becomes, and what the help says of it."""


def one_option_each(command: Callable[..., Any]) -> Callable[..., Any]:
    """An option for every target, which takes the file to write."""
    for name, (_, said) in reversed(TARGETS.items()):
        command = click.option(option(name), metavar="FILE", help=said, **OUTPUT)(command)
    return command


def option(name: str) -> str:
    """A target as an option."""
    return f"--{name.replace('_', '-')}"


@click.command()
@click.argument("mech", type=MECH)
@one_option_each
@click.option("--force", is_flag=True, help="Replace files that exist.")
def export(mech: str, force: bool, **files: Path | None) -> int:
    """Write a mechanism for another program.

    One file for each option that is given; - is standard output.
    """
    wanted = {name: path for name, path in files.items() if path is not None}
    if not wanted:
        raise click.UsageError(f"say what to write: {', '.join(f'{option(name)} FILE' for name in TARGETS)}")
    for path in wanted.values():
        refuse_existing(path, force)
    mechanism = load(mech)
    for name, path in wanted.items():
        text = TARGETS[name][0](mechanism)
        with whole_file(path, [Path(mech)]) as handle:
            handle.write(text)
        if path != STANDARD:
            click.echo(f"wrote {path}", err=True)
        if name == "linuxcnc" and text.startswith("/*"):
            click.echo("pfabrik: note: LinuxCNC has no kinematics that are this machine's: a module for it", err=True)
    return 0
