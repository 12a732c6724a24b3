"""``pfabrik ik``, ``fk``, ``travel`` and ``speed``: what is asked of one target or one configuration."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

import pfabrik as pf

from ..common.cells import is_finite
from ..errors import counted
from .arguments import (
    FINITE,
    MECH,
    TargetOptions,
    Triple,
    at_a_pose,
    by_name,
    load,
    note_unused_projection,
    noted,
    positive,
    projecting,
    targeted,
)
from .options import actuators, named_values
from .outputs import PictureOptions, check_outputs, note_no_picture, pictured, write_picture
from .printing import Result, complain, json_option, print_answer, print_result, printing_result

if TYPE_CHECKING:
    from ..common.arrays import Floats


@click.command()
@click.argument("mech", type=MECH)
@targeted
@projecting
@click.option("--margins", "with_margins", is_flag=True, help="List how far off every limit is, nearest first.")
@click.option("--all", "list_all", is_flag=True, help="List every working mode, limits kept or not.")
@json_option()
def ik(mech: str, target: TargetOptions, options: pf.Options, with_margins: bool, list_all: bool, as_json: bool) -> int:
    """Solve for one target.

    A target out of reach gets the feasible answer nearest to it, with the limits that hold it back,
    the most restrictive first.

    A margin is a share of the room there is: 1 in the middle of a range, 0 on the limit. Where links have a
    thickness, a line says how far apart they are, and the clearance that is kept.

    With --all only what reaches the target is listed, and the exit code is 0 if some mode keeps all limits.
    """
    if list_all and with_margins:
        raise click.UsageError("--margins is of one answer: it does not go with --all")
    if not target.is_given:
        raise click.UsageError("no target: give --position, --rpy or both, or --joint")
    from ..machine.description.links import has_pairs

    mechanism = load(mech)
    pose = noted(mechanism, target)
    if list_all:
        note_unused_projection("--all")
        return print_modes(lambda: pf.working_modes(mechanism, pose), as_json)
    solution = pf.solve_ik(mechanism, pose, options=options)
    margins = pf.margins(solution) if with_margins else None
    apart = pf.clearance(solution) if with_margins and has_pairs(mechanism) else None

    def as_object() -> dict[str, object]:
        plain = solution.to_dict() | ({} if solution else {"reason": solution.reason})
        plain |= {} if apart is None else {"clearance": apart.to_dict()}
        return plain | ({} if margins is None else margins.to_dict())

    def in_words() -> str:
        parts = (solution.table(), margins, None if apart is None else apart.in_words)
        return "\n\n".join(str(each) for each in parts if each is not None)

    print_answer(as_json, as_object, in_words)
    return 0 if solution else 1


def print_modes(search: Callable[[], pf.WorkingModes | pf.AssemblyModes], as_json: bool) -> int:
    """Print all modes that a search finds; the exit code."""
    try:
        modes = search()
    except pf.errors.ContinuumOfSolutions as error:
        complain(str(error))
        return 1
    print_result(as_json, modes)
    return 0 if any(modes) else 1


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

    from ..kinematics import readouts

    shown = readouts(mechanism)
    if len(values) != len(shown):
        expected = ", ".join(f"{readout.name} [{readout.unit}]" for readout in shown)
        raise click.UsageError(f"VALUE...: found {counted(len(values), 'value')}; expected {len(shown)}: {expected}")
    return np.array([readout.coordinate(value) for readout, value in zip(shown, values, strict=True)])


@click.command()
@click.argument("mech", type=MECH)
@targeted
@click.option("--along", type=FINITE, nargs=3, multiple=True, metavar="X Y Z", help="A direction. May be repeated.")
@click.option("--about", type=FINITE, nargs=3, multiple=True, metavar="X Y Z", help="An axis to turn about. Likewise.")
@click.option("--pivot", type=FINITE, nargs=3, metavar="X Y Z", help="What stays where it is. Default: --position.")
@click.option("--plot", "path", type=click.Path(path_type=Path), metavar="FILE", help="Picture too: PNG, SVG or PDF.")
@pictured(with_view=False)
@json_option()
def travel(
    mech: str,
    target: TargetOptions,
    along: tuple[Triple, ...],
    about: tuple[Triple, ...],
    pivot: Triple | None,
    path: Path | None,
    drawn: PictureOptions,
    as_json: bool,
) -> int:
    """Tell how far the end effector can go along and about axes.

    It starts at a pose within reach (default: home) and stays in its working mode; a limit, or the length of the links,
    stops it. By default it goes both ways along and about each axis of the task.
    """
    check_outputs([("--plot", path)], [Path(mech)], as_json=as_json)
    mechanism = load(mech)
    start = pf.solve_ik(mechanism, target.of(mechanism))
    if not start:
        raise click.ClickException(f"cannot start there: {str(start.status).lower()}; see `pfabrik ik`")
    distances = pf.travel(start, along=along or None, about=about or None, pivot=pivot)
    if path is None:
        note_no_picture("--plot")
    else:
        write_picture(path, partial(pf.plot_travel, distances, **drawn.looks), drawn)
    print_result(as_json, distances)
    return 0


speed_option = named_values(
    "--speed",
    "speeds",
    actuators,
    "Highest speed of an actuator, or of all [deg/s or length/s]. May be repeated. Default: the file's max_speed.",
)


@click.command()
@at_a_pose
@speed_option
@printing_result
def speed(solution: pf.Solution, speeds: tuple[str, ...]) -> Result:
    """Tell how fast the platform may move.

    Along and about each axis at a pose (default: home), and along the slowest direction of all.
    """
    return pf.platform_speed(solution, speed=speed_limits(solution.mechanism, speeds) or None)


def speed_limits(mechanism: pf.Mechanism, words: Sequence[str], option: str = "--speed") -> dict[str, float]:
    """Speeds by name [rad/s or length/s] from words such as ``5`` or ``A1=5``; those with a name prevail."""
    from ..kinematics import readouts

    shown = {readout.name: readout for readout in readouts(mechanism)}
    limits = by_name(option, words, "actuator", shown, positive)
    return {name: shown[name].coordinate(value) for name, value in limits.items()}


def own_limits(mechanism: pf.Mechanism) -> dict[str, float]:
    """The speeds that the mechanism's file gives, by name [rad/s or length/s]."""
    from ..kinematics import drive_limits

    speeds = zip(mechanism.actuator_names, drive_limits(mechanism, "speed", None).tolist(), strict=True)
    return {name: speed for name, speed in speeds if math.isfinite(speed)}
