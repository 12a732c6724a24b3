"""``pfabrik calibrate``: the parameters of a machine from what was measured of it."""

from __future__ import annotations

import os
from pathlib import Path

import click

import pfabrik as pf

from .arguments import MECH, load
from .outputs import OUTPUT, check_outputs, force_option, picture, refuse_both_on_stdout, refuse_existing, whole_file
from .printing import json_option, note, print_answer


@click.command()
@click.argument("mech", type=MECH)
@click.argument("data", required=False, type=click.Path(path_type=Path))
@click.option(
    "--free",
    multiple=True,
    metavar="NAME",
    help="What may vary: dimensions, points, axes, lengths, offsets, frame, tool, scale, or a name. May be repeated.",
)
@click.option("--tied", is_flag=True, help="Let copies of a joint vary as one.")
@click.option("--sigma", type=float, help="Standard deviation of a measurement [length or rad]. Default: estimated.")
@click.option("-o", "--output", help="Mechanism file to write, with the calibrated values.", **OUTPUT)
@click.option("--klipper", "settings", help="File to write with Klipper's settings.", **OUTPUT)
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
    settings: Path | None,
    plot: Path | None,
    force: bool,
    as_json: bool,
) -> int:
    """Find the parameters of a machine from measurements.

    DATA is a CSV file with a column for each actuator and for what was measured: x, y, z, roll, pitch, yaw, height,
    distance and distance_to, other joints. With Klipper's printer.cfg in place of MECH there is no DATA: machine and
    measurements are both in it.
    """
    from ..calibration.least_squares import calibrate as calibrated

    check_outputs([("-o", output), ("--klipper", settings), ("--plot", plot)], [data] if data else [], as_json=as_json)
    refuse_both_on_stdout(output, as_json)
    for path in (output, settings):
        if path is not None:
            refuse_existing(path, force)
    mechanism, measurements, names = _given(mech, data, free, sigma)
    result = calibrated(mechanism, measurements, free=names, ties="copies" if tied else None)
    if output is not None:
        from ..files import dumps

        with whole_file(output) as file:
            file.write(dumps(result.mechanism))
    if settings is not None:
        from ..calibration.printer_settings import klipper_settings

        text = klipper_settings(result)
        with whole_file(settings) as file:
            file.write(text)
    if plot is not None:
        from ..calibration.plot_calibration import plot_calibration

        with picture(plot):
            plot_calibration(result)
    print_answer(as_json, result.to_dict, result.table)
    if not result.determined.all():
        note("the data leave parameters open: measure other poses or quantities, or free fewer")
    return 0


def _given(
    mech: str, data: Path | None, free: tuple[str, ...], sigma: float | None
) -> tuple[pf.Mechanism, pf.Measurements, tuple[str, ...] | None]:
    """The machine, what was measured of it, and what may vary."""
    if mech.endswith(".cfg"):
        from ..calibration.printer_settings import read_klipper

        if data is not None:
            raise click.UsageError("DATA goes with a mechanism: a printer.cfg has both")
        printer = read_klipper(mech)
        if printer.measurements is None:
            raise click.ClickException(f"{mech}: no measurements; run DELTA_CALIBRATE and SAVE_CONFIG first")
        return printer.mechanism, printer.measurements, free or printer.free
    if data is None:
        raise click.UsageError("Missing argument 'DATA': a CSV file of measurements")
    if not os.path.exists(data):
        raise click.ClickException(f"{data}: no such file")
    mechanism = load(mech)
    return mechanism, pf.read_measurements(data, mechanism, sigma=sigma), free or None
