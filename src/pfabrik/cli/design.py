"""``pfabrik design``: dimensions for what a machine must do, with the proof."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import click

import pfabrik as pf

from ..errors import InvalidArgument
from .arguments import FINITE, MECH, load, numbers_of
from .certify import RegionOptions, regioned
from .options import named_values
from .outputs import (
    OUTPUT,
    PictureOptions,
    check_outputs,
    force_option,
    note_no_picture,
    pictured,
    refuse_both_on_stdout,
    refuse_existing,
    require_picture,
    whole_file,
    write_picture,
)
from .printing import json_option, note, print_result

ABOUT = "Where positions count from: the base's origin, or the reference point at home."
WHAT = "size, stroke, or an expression of dimensions; twice for a front. Default: size."


@click.command()
@click.argument("mech", type=MECH, nargs=-1, required=True)
@named_values(
    "--vary", "vary", lambda m: m.dimensions, "A dimension and its bounds, in its units.", "NAME=MIN:MAX", required=True
)
@regioned
@click.option("--about", type=click.Choice(["base", "home"]), default="base", show_default=True, help=ABOUT)
@click.option("--margin", type=FINITE, metavar="M", help="Share of half its range that every limit keeps. Default: 0.")
@click.option("--stroke", type=FINITE, metavar="RATIO", help="Longest by shortest length of struts, at most.")
@click.option("--singularity", type=FINITE, metavar="S", help="Least measure of singularities; 0: none. Default: 0.05.")
@click.option("--factors", metavar="MIN:MAX", help="Velocity factors, from actuators to end effector.")
@click.option("--clearance", type=FINITE, metavar="D", help="Least distance between links [length].")
@click.option("--keep", "relations", multiple=True, metavar="'A<=B'", help="Of dimensions, such as 'rod >= 1.2*arm'.")
@click.option("--minimise", multiple=True, default=["size"], metavar="WHAT", help=WHAT)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of starts and samples.")
@click.option("-o", "--output", help="Mechanism file to write, with the dimensions found.", **OUTPUT)
@click.option("--plot", type=click.Path(path_type=Path), metavar="FILE", help="Before and after: PNG, SVG or PDF.")
@pictured()
@force_option
@json_option()
def design(
    mech: tuple[str, ...],
    vary: tuple[str, ...],
    region: RegionOptions,
    about: Any,
    relations: tuple[str, ...],
    minimise: Any,
    seed: int,
    output: Path | None,
    plot: Path | None,
    drawn: PictureOptions,
    force: bool,
    as_json: bool,
    **kept: Any,
) -> int:
    """Find dimensions with which a machine does what it must, as small as can be.

    Margins of limits are proved over the region, all else is decided by samples. Several MECH are compared: the best
    is written and drawn. Exit code 0: found. 1: not found, or left open.
    """
    read = [*mech, *([str(region.path)] if region.path else [])]
    check_outputs([("-o", output), ("--plot", plot)], map(Path, read), as_json=as_json)
    refuse_both_on_stdout(output, as_json)
    require_picture(plot)
    if plot is None:
        note_no_picture("--plot")
    if output is not None:
        refuse_existing(output, force)
    if len(minimise) > 2:
        raise click.UsageError(f"--minimise: found it {len(minimise)} times; expected once, or twice for a front")
    bounds, machines = _bounds(vary), {name: load(name) for name in mech}
    for name, mechanism in machines.items():
        if not mechanism.dimensions or (len(machines) > 1 and not bounds.keys() & mechanism.dimensions):
            known = ", ".join(mechanism.dimensions) or "dimensions: `pfabrik new --list` has kinds of files with some"
            raise click.UsageError(f"--vary: found none of {name}; expected {known}")
    first = machines[mech[0]]
    reach: Any = region.of(first)
    if region.path is not None:
        reach = pf.track(first, reach)
    asked: Any = machines if len(machines) > 1 else first
    result = pf.design(
        asked,
        bounds,
        reach,
        keep=[*_requirements(kept), *relations],
        minimise=minimise if len(minimise) > 1 else minimise[0],
        about=about,
        seed=seed,
    )
    best: pf.Design = result[0] if isinstance(result, pf.Designs) else result
    if output is not None and best.mechanism is not None:
        from ..machine.files import dumps

        with whole_file(output) as file:
            file.write(dumps(best.mechanism))
    if plot is not None:
        write_picture(plot, partial(best.plot, **drawn.in_space), drawn)
    print_result(as_json, result)
    if output is not None and best.mechanism is None:
        note(f"{output} is not written: nothing was found")
    return int(not result)


def _bounds(vary: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Dimension -> its bounds, from words such as ``rod=100:300``."""
    bounds: dict[str, tuple[float, float]] = {}
    for words in vary:
        name, equals, ends = words.partition("=")
        name = name.strip()
        if not equals or name in bounds:
            raise click.UsageError(f"--vary: found '{words}'; expected NAME=MIN:MAX, each dimension once")
        low, high = numbers_of(f"--vary {name}", ends, (2,), ":")
        bounds[name] = low, high
    return bounds


def _requirements(kept: Mapping[str, Any]) -> list[Any]:
    """Requirements of `pf.keep` by their options; an error names the option."""
    found = []
    for name, value in kept.items():
        if value is not None:
            values = numbers_of("--factors", value, (2,), ":") if name == "factors" else [value]
            try:
                found.append(getattr(pf.keep, name)(*values))
            except InvalidArgument as error:
                raise click.UsageError(f"--{name}{str(error).removeprefix(error.argument)}") from error
    return found
