"""``pfabrik calibrate``: the parameters of a machine from what was measured of it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial, reduce
from operator import add
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

import pfabrik as pf

from .arguments import MECH, load
from .export import text_of
from .outputs import (
    OUTPUT,
    check_outputs,
    force_option,
    refuse_both_on_stdout,
    refuse_existing,
    require_picture,
    whole_file,
    write_picture,
)
from .printing import json_option, note, print_result

if TYPE_CHECKING:
    from ..capabilities.calibration.free_names import FreeNames


@click.command()
@click.argument("mech", type=MECH)
@click.argument("data", nargs=-1, type=click.Path(path_type=Path))
@click.option(
    "--free",
    multiple=True,
    metavar="NAME",
    help="What may vary: dimensions, points, axes, lengths, offsets, frame, tool, scale, or a name. May be repeated.",
)
@click.option("--list", "is_list", is_flag=True, help="List what may be freed, by kind, with the described values.")
@click.option("--tied", is_flag=True, help="Correct all copies of a joint alike: fewer unknowns.")
@click.option("--sigma", type=float, help="Standard deviation of a measurement [length or rad]. Default: estimated.")
@click.option("-o", "--output", help="Mechanism file to write, with the calibrated values.", **OUTPUT)
@click.option("--klipper", help="File to write with the settings for Klipper.", **OUTPUT)
@click.option("--reprap", help="The same for RepRapFirmware.", **OUTPUT)
@click.option("--marlin", help="The same for Marlin.", **OUTPUT)
@click.option("--plot", type=click.Path(path_type=Path), metavar="FILE", help="Picture: PNG, SVG or PDF.")
@force_option
@json_option()
def calibrate(
    mech: str,
    data: tuple[Path, ...],
    free: tuple[str, ...],
    is_list: bool,
    tied: bool,
    sigma: float | None,
    output: Path | None,
    plot: Path | None,
    force: bool,
    as_json: bool,
    **settings: Path | None,
) -> int:
    """Find the parameters of a machine from measurements.

    DATA is a CSV file with a column for each actuator and for what was measured: x, y, z, roll, pitch, yaw, height,
    distance and distance_to, other joints. In place of actuators it may have what was commanded: x, y and height. Or it
    is what a probe wrote: lines of a log such as "probe at 30,40 is z=0.12", or RepRapFirmware's heightmap.csv. Several
    files count together. Without DATA, MECH is Klipper's printer.cfg: what it has measured is in it.

    Of a printer's settings, actuators are what the firmware counts with them, and endstops, radius, angles and arms may
    vary. What the measurements do not determine stays as described, also in the files that are written.
    """
    if is_list:
        print_result(as_json, _free_names(mech))
        return 0
    written = {form: path for form, path in settings.items() if path is not None}
    outputs = [("-o", output), ("--plot", plot), *((f"--{form}", path) for form, path in written.items())]
    check_outputs(outputs, [Path(mech), *data], as_json=as_json)
    refuse_both_on_stdout(output, as_json)
    require_picture(plot)
    for path in (output, *written.values()):
        if path is not None:
            refuse_existing(path, force)
    result, machine = _calibrated(mech, data, free or None, "copies" if tied else None, sigma)
    held = [each.name for each in result.parameters if not each.determined]
    if output is not None:
        from ..machine.files import dumps

        with whole_file(output) as file:
            file.write(_said_of(held, "#") + dumps(machine))
    for form, path in written.items():
        text = _said_of(held, "#" if form == "klipper" else ";") + text_of(machine, form, "")
        with whole_file(path) as file:
            file.write(text)
    if plot is not None:
        write_picture(plot, partial(pf.plot_calibration, result))
    print_result(as_json, result)
    if held:
        note(
            "the data leave parameters open, which stay as described: measure other poses or quantities, or free fewer"
        )
    return 0


def _calibrated(
    mech: str, data: tuple[Path, ...], free: tuple[str, ...] | None, ties: Literal["copies"] | None, sigma: float | None
) -> tuple[pf.Calibration, pf.Mechanism]:
    """The calibration, and the machine to write."""
    from ..machine.files import printer_settings_of

    if printer_settings_of(mech) is not None:
        printer = pf.read_printer(mech, sigma=sigma)
        measured = _read(data, printer.mechanism, sigma, printer.probe_offset) if data else printer.measurements
        if measured is not None:
            result = printer.calibrate(measured, free, ties=ties)
            return result, printer.corrected(result)
        if mech.endswith(".cfg"):
            raise click.ClickException(f"{mech}: no measurements; run DELTA_CALIBRATE and SAVE_CONFIG first")
    mechanism = load(mech)
    if not data:
        raise click.UsageError("Missing argument 'DATA': a CSV file of measurements")
    result = pf.calibrate(mechanism, _read(data, mechanism, sigma), free=free, ties=ties)
    return result, result.mechanism


def _read(
    files: tuple[Path, ...], mechanism: pf.Mechanism, sigma: float | None, probe: Sequence[float] = (0.0, 0.0, 0.0)
) -> pf.Measurements:
    """What all files have, as one."""
    seen: dict[Path, Path] = {}
    for file in files:
        if not file.exists():
            raise click.ClickException(f"{file}: no such file")
        first = seen.setdefault(file.resolve(), file)
        if first is not file:
            same = "" if str(file) == str(first) else f", as {first}"
            raise click.UsageError(f"DATA: {file} is given twice{same}; its rows would count twice")
    parts = [pf.read_measurements(file, mechanism, sigma=sigma, probe_offset=probe) for file in files]
    touched = [str(file) for file, part in zip(files, parts, strict=True) if part.names[0].startswith("line ")]
    if touched:
        x, y, z = (f"{each:g}" for each in probe)
        note(
            f"{', '.join(touched)}: the probe is taken to be at x {x}, y {y} of the nozzle, and to trigger at z {z}: "
            f"{'by the printer file' if any(probe) else 'MECH says nothing else of it'}"
        )
    return reduce(add, parts)


def _free_names(mech: str) -> FreeNames:
    """What may be freed of a machine, or of a printer as its firmware counts it."""
    from ..capabilities.calibration.free_names import free_names
    from ..machine.files import printer_settings_of

    if printer_settings_of(mech) is None:
        return free_names([load(mech)])
    printer = pf.read_printer(mech)
    return free_names([printer.mechanism, printer.described])


def _said_of(held: list[str], mark: str) -> str:
    """A comment on parameters that are as described, before what is written."""
    if not held:
        return ""
    return f"{mark} Not determined by the measurements, and so as described: {', '.join(held)}.\n"
