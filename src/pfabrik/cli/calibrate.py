"""``pfabrik calibrate``: the parameters of a machine from what was measured of it."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path

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


@click.command()
@click.argument("mech", type=MECH)
@click.argument("data", required=False, type=click.Path(path_type=Path))
@click.option(
    "--free",
    multiple=True,
    metavar="NAME",
    help="What may vary: dimensions, points, axes, lengths, offsets, frame, tool, scale, or a name. May be repeated.",
)
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
    data: Path | None,
    free: tuple[str, ...],
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
    distance and distance_to, other joints. Without DATA, MECH is Klipper's printer.cfg: what it has measured is in it.
    """
    written = {form: path for form, path in settings.items() if path is not None}
    outputs = [("-o", output), ("--plot", plot), *((f"--{form}", path) for form, path in written.items())]
    check_outputs(outputs, [Path(mech), *([data] if data else [])], as_json=as_json)
    refuse_both_on_stdout(output, as_json)
    require_picture(plot)
    for path in (output, *written.values()):
        if path is not None:
            refuse_existing(path, force)
    mechanism, measurements, names = _given(mech, data, free, sigma)
    result = pf.calibrate(mechanism, measurements, free=names, ties="copies" if tied else None)
    if output is not None:
        from ..files import dumps

        with whole_file(output) as file:
            file.write(dumps(result.mechanism))
    for form, path in written.items():
        text = text_of(result.mechanism, form, "")
        with whole_file(path) as file:
            file.write(text)
    if plot is not None:
        write_picture(plot, partial(pf.plot_calibration, result))
    print_result(as_json, result)
    if not result.determined.all():
        note("the data leave parameters open: measure other poses or quantities, or free fewer")
    return 0


def _given(
    mech: str, data: Path | None, free: tuple[str, ...], sigma: float | None
) -> tuple[pf.Mechanism, pf.Measurements, tuple[str, ...] | None]:
    """The machine, what was measured of it, and what may vary."""
    if data is None and mech.endswith(".cfg"):
        printer = pf.read_klipper(mech)
        if printer.measurements is None:
            raise click.ClickException(f"{mech}: no measurements; run DELTA_CALIBRATE and SAVE_CONFIG first")
        return printer.mechanism, printer.measurements, free or printer.free
    if data is None:
        raise click.UsageError("Missing argument 'DATA': a CSV file of measurements")
    if not os.path.exists(data):
        raise click.ClickException(f"{data}: no such file")
    mechanism = load(mech)
    return mechanism, pf.read_measurements(data, mechanism, sigma=sigma), free or None
