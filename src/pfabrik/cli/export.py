"""``pfabrik export``: a mechanism as a file for another program."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import click
from click.shell_completion import CompletionItem

import pfabrik as pf

from .arguments import MECH, comma_separated, load, named_joints
from .options import joints_option
from .outputs import OUTPUT, STANDARD, check_outputs, force_option, refuse_existing, say_wrote, whole_file
from .printing import note

FIRMWARES = ("klipper", "reprap", "marlin")
FORMATS = ("c", "c-float", "mjcf", "linuxcnc", *FIRMWARES)
NAMED = ("c", "c-float")
"""Formats whose names begin with one that can be chosen, and that take joints."""

BACKENDS = ("torch", "jax", "numpy")
FILES = (*BACKENDS, "web")
"""Formats that are options with a file of their own."""

FOLDER: dict[str, Any] = {"metavar": "FOLDER", "type": click.Path(path_type=Path, file_okay=False)}
"""Settings of an option that takes a folder to write."""


def text_of(
    mechanism: pf.Mechanism,
    form: str,
    name: str,
    joints: tuple[str, ...] | None = None,
    file: str = "FILE",
    parts: Sequence[str] | None = None,
) -> str:
    """The text of a mechanism in a format."""
    if form == "mjcf":
        return pf.interop.to_mjcf(mechanism)
    if form == "linuxcnc":
        from ..exchange.export.linuxcnc import linuxcnc

        return linuxcnc(mechanism)
    if form in FIRMWARES:
        from ..exchange.export import firmware_settings

        return str(getattr(firmware_settings, form)(mechanism))
    if form == "web":
        from ..view.page.export_web import exported_page

        return exported_page(mechanism)
    if form in BACKENDS:
        from ..exchange.export.tensors import tensor_source

        return tensor_source(mechanism, backend=cast(Any, form), joints=joints or None)
    from ..exchange.export.export_c import c_source

    chosen, precision = cast(Any, parts or None), cast(Any, "float" if form == "c-float" else "double")
    return c_source(mechanism, precision=precision, parts=chosen, name=name, joints=joints, file=file)


def complete_format(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """The formats that begin so."""
    return [CompletionItem(form) for form in FORMATS if form.startswith(incomplete)]


@click.command()
@click.argument("mech", type=MECH)
@click.argument("words", metavar="[FORMAT]", nargs=-1, shell_complete=complete_format)
@click.option("-o", "--output", default="-", help="File to write a FORMAT to. Default: print it.", **OUTPUT)
@click.option("--torch", help="Write a file of PyTorch tensors, with gradients.", **OUTPUT)
@click.option("--jax", help="The same in JAX.", **OUTPUT)
@click.option("--numpy", help="The same in NumPy, without gradients.", **OUTPUT)
@click.option("--web", help="Write a page, HTML, on which one drags the machine; it needs no network.", **OUTPUT)
@click.option("--ros2-control", "folder", help="Write a package with a transmission for ros2_control.", **FOLDER)
@click.option(
    "--ros2-node",
    "node",
    help="Write a package with a ROS 2 node for a platform: poses in, commands of actuators out.",
    **FOLDER,
)
@joints_option("Joints in series from the base to the end effector, as coordinates. Default: poses of the platform.")
@click.option(
    "--name",
    metavar="NAME",
    help="Of c, c-float and packages of ROS 2: what names begin with.  [default: pfk, or FOLDER's]",
)
@click.option(
    "--parts",
    metavar="A,B,...",
    callback=comma_separated,
    help="Of c, c-float: some of ik, limits, fk, rates, nearest; bodies, effort.  [default: all but the last two]",
)
@force_option
def export(
    mech: str,
    words: tuple[str, ...],
    output: Path,
    folder: Path | None,
    node: Path | None,
    joints: tuple[str, ...],
    name: str | None,
    parts: list[str] | None,
    force: bool,
    **files: Path | None,
) -> int:
    """Write a mechanism for another program.

    FORMAT is one of:

    \b
    c         C99, a file and its header: inverse and forward kinematics, Jacobians and torques, with every limit
    c-float   the same in single precision
    mjcf      a MuJoCo model, which starts closed; what weighs and drives it is made up
    linuxcnc  HAL lines where LinuxCNC has these kinematics, else a module in C for halcompile
    klipper   [printer] and [stepper_*] of a delta printer
    reprap    M665 and M666, or M669, of a delta printer, for RepRapFirmware
    marlin    M665 and M666 of a delta printer

    In place of it, files that need nothing of pfabrik: --torch, --jax, --numpy, --web, --ros2-control,
    --ros2-node.
    """
    from ..exchange.export.export_c import header_of, in_two

    outputs = {form: path for form in FILES if (path := files[form]) is not None}
    packages = [option for option, path in (("--ros2-control", folder), ("--ros2-node", node)) if path is not None]
    if words and not (outputs or packages):
        form, words = words[0], words[1:]
        if form not in FORMATS:
            raise click.UsageError(f"'{form}' is no FORMAT: choose from {', '.join(FORMATS)}")
        outputs = {form: output}
    elif output != STANDARD:
        raise click.UsageError("-o is of a FORMAT: give one")
    if words and not joints:
        raise click.UsageError(f"found {' '.join(words)}; expected one FORMAT, or names after --joints")
    if not outputs and not packages:
        options = "--torch, --jax, --numpy, --web, --ros2-control or --ros2-node"
        raise click.UsageError(f"expected a FORMAT ({', '.join(FORMATS)}), {options}")
    joints = named_joints(joints, words)
    _check_settings([*outputs, *packages], name, joints)
    if parts and not outputs.keys() & {*NAMED}:
        raise click.UsageError(f"--parts is of {', '.join(NAMED)}")
    for form, path in outputs.items():
        refuse_existing(path, force)
        if form in NAMED and path != STANDARD:
            refuse_existing(header_of(path), force)
    check_outputs([(f"--{form}" if form in FILES else "-o", path) for form, path in outputs.items()], [Path(mech)])
    mechanism = load(mech)
    for form, path in outputs.items():
        file = "FILE" if path == STANDARD else path.name
        text = text_of(mechanism, form, "pfk" if name is None else name, joints or None, file, parts)
        if form in NAMED and path != STANDARD:
            declarations, text = in_two(text, header_of(path).name)
            _write(header_of(path), form, declarations)
        _write(path, form, text)
    if folder is not None:
        from ..exchange.export.ros2_control import ros2_control_texts

        _write_package(folder, ros2_control_texts(mechanism, folder, joints=joints, name=name), force)
    if node is not None:
        from ..exchange.export.ros2_node import commands, ros2_node_texts

        _write_package(node, ros2_node_texts(mechanism, node, name=name), force)
        for line in ("build it in a workspace, and try it:", *commands(mechanism, node, name)):
            click.echo(line, err=True)
    return 0


def _check_settings(forms: Sequence[str], name: str | None, joints: tuple[str, ...]) -> None:
    """Stop where a setting is of no output."""
    for form in forms:
        if name is not None and form not in (*NAMED, "--ros2-control", "--ros2-node"):
            raise click.UsageError(f"--name is of {', '.join(NAMED)}, --ros2-control and --ros2-node: {form} has none")
        if joints and form not in (*NAMED, *BACKENDS, "--ros2-control"):
            raise click.UsageError(f"--joints is of {', '.join((*NAMED, *BACKENDS))} and --ros2-control, not of {form}")
    if "--ros2-control" in forms and not joints:
        series = "--ros2-control needs --joints: those of the robot's description, in series"
        raise click.UsageError(f"{series}; for poses of a platform use --ros2-node")


def _write(path: Path, form: str, text: str) -> None:
    with whole_file(path) as handle:
        handle.write(text)
    if form == "linuxcnc" and text.startswith("/*"):
        note("LinuxCNC has no kinematics that are this machine's: a module for it")


def _write_package(folder: Path, texts: dict[str, str], force: bool) -> None:
    from ..exchange.export.ros2_texts import write_package

    for place in texts:
        refuse_existing(folder / place, force)
    write_package(folder, texts)
    say_wrote(folder, f": {', '.join(texts)}")
