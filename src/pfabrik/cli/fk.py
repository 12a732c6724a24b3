"""``pfabrik fk``: actuator values in, pose out; or all poses that have them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

import pfabrik as pf

from ..cells import is_finite
from ..errors import counted
from .arguments import MECH, load
from .printing import json_option, print_result

if TYPE_CHECKING:
    from ..arrays import Floats


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
@json_option()
def fk(mech: str, values: tuple[float, ...], list_all: bool, as_json: bool) -> int:
    """Find the pose that has given actuator values.

    VALUE... are the actuated coordinates, in the order in which `pfabrik info MECH` lists the actuators: angles in
    degrees, lengths in the unit of the mechanism. Negative numbers need no special care.

    The search starts at home and takes an assembly mode near it. Values that no configuration within the limits is
    found for get the feasible one whose actuators are nearest. With --all the exit code is 0 if some mode keeps all
    limits.
    """
    from .report import print_modes

    mechanism = load(mech)
    actuators = coordinates(mechanism, values)
    if list_all:
        return print_modes(lambda: pf.assembly_modes(mechanism, actuators), as_json)
    solution = pf.solve_fk(mechanism, actuators)
    print_result(as_json, solution)
    return 0 if solution else 1


def coordinates(mechanism: pf.Mechanism, values: tuple[float, ...]) -> Floats:
    """The values as coordinates (n_a,) [length or rad]; a usage error for too few or too many."""
    import numpy as np

    from ..description.readouts import readouts

    shown = readouts(mechanism)
    if len(values) != len(shown):
        expected = ", ".join(f"{readout.name} [{readout.unit}]" for readout in shown)
        raise click.UsageError(f"VALUE...: found {counted(len(values), 'value')}; expected {len(shown)}: {expected}")
    return np.array([readout.coordinate(value) for readout, value in zip(shown, values, strict=True)])
