"""``pfabrik export``: a mechanism as a file for another program. Each target is an option of its own."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .mech import MECH, load
from .whole import OUTPUT, STANDARD, refuse_existing, whole_file

if TYPE_CHECKING:
    from ..description.mechanism import Mechanism

TARGETS = {
    "mjcf": "A MuJoCo model, which starts closed; what weighs and drives it is made up.",
    "c": "One file of C99: inverse and forward kinematics with every limit.",
    "c_float": "The same in single precision.",
    "linuxcnc": "HAL lines where LinuxCNC has these kinematics, else a module in C for halcompile.",
    "klipper": "[printer] and [stepper_*] of a delta printer.",
}
"""Name of an option -> what the help says of it."""


def text_of(mechanism: Mechanism, name: str) -> str:
    """The text that a mechanism becomes."""
    from ..export.export_c import c_source
    from ..export.klipper import klipper
    from ..export.linuxcnc import linuxcnc
    from ..interop import to_mjcf

    makers: dict[str, Callable[[Mechanism], str]] = {
        "mjcf": to_mjcf,
        "c": c_source,
        "c_float": partial(c_source, precision="float"),
        "linuxcnc": linuxcnc,
        "klipper": klipper,
    }
    return makers[name](mechanism)


def one_option_each(command: Callable[..., Any]) -> Callable[..., Any]:
    """An option for every target, which takes the file to write."""
    for name, said in reversed(TARGETS.items()):
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
    same = [option(name) for name, path in wanted.items() if list(wanted.values()).count(path) > 1]
    if same:
        raise click.UsageError(f"{' and '.join(same)} name one place: give each its own")
    for path in wanted.values():
        refuse_existing(path, force)
    mechanism = load(mech)
    texts = {name: text_of(mechanism, name) for name in wanted}  # all of them, before any is written
    for name, path in wanted.items():
        text = texts[name]
        with whole_file(path, [Path(mech)]) as handle:
            handle.write(text)
        if path != STANDARD:
            click.echo(f"wrote {path}", err=True)
        if name == "linuxcnc" and text.startswith("/*"):
            click.echo("pfabrik: note: LinuxCNC has no kinematics that are this machine's: a module for it", err=True)
    return 0
