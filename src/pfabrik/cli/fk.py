"""``pfabrik fk``: actuator values in, pose out; or all poses that have them."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import click

import pfabrik as pf

from .group import complain
from .table import aligned

if TYPE_CHECKING:
    from ..assembly import AssemblyModes
    from ..mechanism import Mechanism
    from ..report import Floats
    from ..solution import Solution


def finite_numbers(context: click.Context, parameter: click.Parameter, words: tuple[str, ...]) -> tuple[float, ...]:
    """The words as finite numbers; options that do not exist arrive here too."""
    from .pathfile import is_finite

    for word in words:
        if not is_finite(word):
            expected = "a finite number, or an option of this command" if word.startswith("-") else "a finite number"
            raise click.BadParameter(f"found '{word}'; expected {expected}", context, parameter)
    return tuple(map(float, words))


@click.command(context_settings={"ignore_unknown_options": True})  # so that -5 is a value
@click.argument("mech")
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
    mechanism = pf.load(mech)
    asked = coordinates(mechanism, values)
    if list_all:
        return tell_modes(mechanism, asked, as_json)
    solution = pf.solve_fk(mechanism, asked)
    click.echo(json.dumps(solution.to_dict(), allow_nan=False) if as_json else describe_fk(solution, asked))
    return 0 if solution else 1


def coordinates(mechanism: Mechanism, values: tuple[float, ...]) -> Floats:
    """The values as coordinates (n_a,) [length or rad]; a usage error for too few or too many."""
    import numpy as np

    from ..report import readouts

    shown = readouts(mechanism)
    if len(values) != len(shown):
        expected = ", ".join(f"{readout.name} [{readout.unit}]" for readout in shown)
        raise click.UsageError(f"VALUE...: found {len(values)} values; expected {len(shown)}: {expected}")
    return np.array([readout.coordinate(value) for readout, value in zip(shown, values, strict=True)])


def describe_fk(solution: Solution, asked: Floats) -> str:
    """The answer for people."""
    from .answer import describe

    return describe(solution, asked)


def tell_modes(mechanism: Mechanism, asked: Floats, as_json: bool) -> int:
    """Print all assembly modes; the exit code."""
    try:
        found = pf.assembly_modes(mechanism, asked)
    except pf.errors.ContinuumOfSolutions as error:
        complain(str(error))
        return 1
    click.echo(json.dumps(as_object(found), allow_nan=False) if as_json else describe_modes(mechanism, found))
    return 0 if any(found) else 1


def as_object(found: AssemblyModes) -> dict[str, object]:
    """Assembly modes as plain numbers, lists and dicts."""
    return {
        "modes": [mode.to_dict() for mode in found],
        "hits": list(found.hits),
        "starts": found.starts,
        "unseen": found.unseen,
    }


def describe_modes(mechanism: Mechanism, found: AssemblyModes) -> str:
    """How many modes, a table of them, and how sure it is that there are no others."""
    searched = (
        f"{found.starts} starts; another one would find a new mode with a probability of about {found.unseen:.2%}"
    )
    if not found:
        return f"no assembly mode found\n\n{searched}"
    kept = sum(map(bool, found))
    count = f"{len(found)} assembly mode{'s' * (len(found) > 1)}, {kept or 'none'} within all limits"
    return "\n\n".join([count, mode_table(mechanism, found), searched])


def mode_table(mechanism: Mechanism, found: AssemblyModes) -> str:
    """Every mode with its pose, how many starts led to it, and the limits it exceeds."""
    from ..report import by_bound, exceeded
    from .answer import pose_texts

    header = ["mode", *(f"{name} [{mechanism.length_unit}]" for name in "xyz")]
    header += ["roll [deg]", "pitch [deg]", "yaw [deg]", "starts", "exceeds"]
    rows = []
    for number, (mode, hits) in enumerate(zip(found, found.hits, strict=True), 1):
        position, angles = pose_texts(mode)
        rows.append([str(number), *position, *angles, str(hits), by_bound(exceeded(mode)) or "nothing"])
    return aligned(header, rows)
