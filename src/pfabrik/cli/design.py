"""``pfabrik design``: dimensions for what a machine must do, with the proof."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

import pfabrik as pf

from .arguments import FINITE, MECH, load, numbers_of
from .certify import RegionOptions, regioned
from .options import named_values
from .outputs import (
    OUTPUT,
    check_outputs,
    force_option,
    picture,
    refuse_both_on_stdout,
    refuse_existing,
    require_picture,
    whole_file,
)
from .printing import json_option, note, print_result


def dimensions(mechanism: pf.Mechanism) -> tuple[str, ...]:
    """Names of the dimensions of a machine's file."""
    return tuple(mechanism.dimensions)


@click.command()
@click.argument("mech", type=MECH, nargs=-1, required=True)
@named_values(
    "--vary", "vary", dimensions, "A dimension and its bounds, in units of the file.", "NAME=MIN:MAX", required=True
)
@regioned
@click.option(
    "--about",
    type=click.Choice(["base", "home"]),
    default="base",
    show_default=True,
    help="Where positions count from: the base's origin, or the reference point at home.",
)
@click.option("--margin", type=FINITE, metavar="M", help="Share of half its range that every limit keeps. Default: 0.")
@click.option("--stroke", type=FINITE, metavar="RATIO", help="Longest by shortest length of struts, at most.")
@click.option("--singularity", type=FINITE, metavar="S", help="Least measure of singularities; 0: none. Default: 0.05.")
@click.option("--factors", metavar="MIN:MAX", help="Velocity factors, from actuators to end effector.")
@click.option("--clearance", type=FINITE, metavar="D", help="Least distance between links [length].")
@click.option("--keep", "relations", multiple=True, metavar="'A <= B'", help="Of dimensions: 'rod >= 1.2*arm'.")
@click.option(
    "--minimise",
    multiple=True,
    default=["size"],
    metavar="WHAT",
    help="size, stroke, or an expression of dimensions; twice for a front. Default: size.",
)
@click.option("--seed", type=int, default=0, show_default=True, metavar="N", help="Of starts and samples.")
@click.option("-o", "--output", help="Mechanism file to write, with the dimensions found.", **OUTPUT)
@click.option("--plot", type=click.Path(path_type=Path), metavar="FILE", help="Picture of the rounds: PNG, SVG or PDF.")
@force_option
@json_option()
def design(
    mech: tuple[str, ...],
    vary: tuple[str, ...],
    region: RegionOptions,
    about: Any,
    relations: tuple[str, ...],
    minimise: tuple[str, ...],
    seed: int,
    output: Path | None,
    plot: Path | None,
    force: bool,
    as_json: bool,
    **kept: Any,
) -> int:
    """Find dimensions with which a machine does what it must, as small as can be.

    Margins of limits are proved over the region, all else is decided by samples. Several MECH are compared; the best
    is written. Exit code 0: found. 1: not found, or left open.
    """
    check_outputs([("-o", output), ("--plot", plot)], [*map(Path, mech), *filter(None, [region.path])], as_json=as_json)
    refuse_both_on_stdout(output, as_json)
    require_picture(plot)
    if output is not None:
        refuse_existing(output, force)
    if len(minimise) > 2:
        raise click.UsageError(f"--minimise: found it {len(minimise)} times; expected once, or twice for a front")
    machines, bounds = {name: load(name) for name in mech}, _bounds(vary)
    first = machines[mech[0]]
    reach = region.of(first)
    result = pf.design(
        first if len(machines) == 1 else machines,
        bounds,
        pf.track(first, reach) if region.path else reach,
        keep=[*_requirements(**kept), *relations],
        minimise=minimise if len(minimise) > 1 else minimise[0],
        about=about,
        seed=seed,
    )
    best: pf.Design = result if len(machines) == 1 else result[0]
    if output is not None and best:
        from ..files import dumps

        with whole_file(output) as file:
            file.write(dumps(best.mechanism))
    if plot is not None and best.rounds:
        with picture(plot):
            best.plot()
    print_result(as_json, result)
    for path, is_written in ((output, bool(best)), (plot, bool(best.rounds))):
        if path is not None and not is_written:
            note(f"{path} is not written: nothing was found")
    return int(not result)


def _bounds(vary: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Dimension -> its bounds, from words such as ``rod=100:300``."""
    bounds: dict[str, tuple[float, float]] = {}
    for words in vary:
        name, equals, ends = words.partition("=")
        if not equals or name in bounds:
            expected = "each dimension once" if equals else "NAME=MIN:MAX"
            raise click.UsageError(f"--vary: found '{words}'; expected {expected}")
        low, high = numbers_of(f"--vary {name}", ends, (2,), ":")
        bounds[name] = low, high
    return bounds


def _requirements(
    margin: float | None, stroke: float | None, singularity: float | None, factors: str | None, clearance: float | None
) -> list[Any]:
    """Requirements by their options."""
    given = {"margin": margin, "stroke": stroke, "singularity": singularity, "clearance": clearance}
    found = [getattr(pf.keep, name)(value) for name, value in given.items() if value is not None]
    return found if factors is None else [*found, pf.keep.factors(*numbers_of("--factors", factors, (2,), ":"))]
