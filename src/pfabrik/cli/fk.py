"""``pfabrik fk``: actuator values in, pose out; or all poses that have them."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import click
import numpy as np

import pfabrik as pf

from ..description.readouts import readouts
from ..errors import counted
from .finite import is_finite
from .mech import MECH, load
from .report import describe, pose_header, pose_texts, tell_modes

if TYPE_CHECKING:
    from ..answers.solution import Solution
    from ..arrays import Floats
    from ..description.mechanism import Mechanism


def finite_numbers(context: click.Context, parameter: click.Parameter, words: tuple[str, ...]) -> tuple[float, ...]:
    """The words as finite numbers; options that do not exist arrive here too."""
    for word in words:
        if not is_finite(word):
            expected = "a finite number, or an option of this command" if word.startswith("-") else "a finite number"
            raise click.BadParameter(f"found '{word}'; expected {expected}", context, parameter)
    return tuple(map(float, words))


@click.command(context_settings={"ignore_unknown_options": True})  # so that -5 is a value
@click.argument("mech", type=MECH)
@click.argument("values", nargs=-1, metavar="VALUE...", callback=finite_numbers)
@click.option("--all", "list_all", is_flag=True, help="List every assembly mode, limits kept or not.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout; angles in radians.")
def fk(mech: str, values: tuple[float, ...], list_all: bool, as_json: bool) -> int:
    """Find the pose that has given actuator values.

    VALUE... are the actuated coordinates, in the order in which `pfabrik info MECH` lists the actuators: angles in
    degrees, lengths in the unit of the mechanism. Negative numbers need no special care.

    The search starts at home and takes an assembly mode near it. Values that no configuration within the limits is
    found for get the feasible one whose actuators are nearest. With --all the exit code is 0 if some mode keeps all
    limits.
    """
    mechanism = load(mech)
    asked = coordinates(mechanism, values)
    if list_all:
        return list_modes(mechanism, asked, as_json)
    solution = pf.solve_fk(mechanism, asked)
    click.echo(json.dumps(solution.to_dict(), allow_nan=False) if as_json else describe(solution, asked))
    return 0 if solution else 1


def coordinates(mechanism: Mechanism, values: tuple[float, ...]) -> Floats:
    """The values as coordinates (n_a,) [length or rad]; a usage error for too few or too many."""
    shown = readouts(mechanism)
    if len(values) != len(shown):
        expected = ", ".join(f"{readout.name} [{readout.unit}]" for readout in shown)
        raise click.UsageError(f"VALUE...: found {counted(len(values), 'value')}; expected {len(shown)}: {expected}")
    return np.array([readout.coordinate(value) for readout, value in zip(shown, values, strict=True)])


def list_modes(mechanism: Mechanism, asked: Floats, as_json: bool) -> int:
    """Print all assembly modes, each with its pose; the exit code."""

    def cells(mode: Solution) -> list[str]:
        position, angles = pose_texts(mode)
        return [*position, *angles]

    return tell_modes(lambda: pf.assembly_modes(mechanism, asked), "assembly", pose_header(mechanism), cells, as_json)
