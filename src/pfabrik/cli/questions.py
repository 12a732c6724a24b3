"""``pfabrik ik``, ``fk``, ``travel`` and ``speed``: what is asked of one target or one configuration."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

import pfabrik as pf

from ..cells import is_finite
from ..errors import counted, near_miss
from ..tolerances import TOLERANCES
from .arguments import (
    FINITE,
    MECH,
    TargetOptions,
    Triple,
    load,
    note_left_out,
    note_unused_projection,
    projecting,
    targeted,
)
from .outputs import PictureOptions, check_outputs, note_no_picture, picture, pictured
from .printing import complain, json_option, note, print_answer, print_result

if TYPE_CHECKING:
    from ..arrays import Floats
    from ..targets import Target


@click.command()
@click.argument("mech", type=MECH)
@targeted
@projecting
@click.option("--margins", "with_margins", is_flag=True, help="List how far off every limit is, nearest first.")
@click.option("--force", "force", type=float, nargs=3, help="A force on the end effector: what do actuators exert?")
@click.option("--moment", "moment", type=float, nargs=3, help="A moment beside it, in units of force times length.")
@click.option("--all", "list_all", is_flag=True, help="List every working mode, limits kept or not.")
@json_option()
def ik(
    mech: str,
    target: TargetOptions,
    options: pf.Options,
    with_margins: bool,
    force: Triple | None,
    moment: Triple | None,
    list_all: bool,
    as_json: bool,
) -> int:
    """Solve for one target.

    A target out of reach gets the feasible answer nearest to it, with the limits that hold it back, the hardest first.

    A margin is a share of the room there is: 1 in the middle of a range, 0 on the limit. Where links have a
    thickness, a line says how far apart they are, and the clearance that is kept.

    With --force, or --moment, it also says what the actuators exert to hold it: positive drives a coordinate up.

    With --all only what reaches the target is listed, and the exit code is 0 if some mode keeps all limits.
    """
    if list_all and with_margins:
        raise click.UsageError("--margins is of one answer: it does not go with --all")
    if list_all and (force or moment):
        raise click.UsageError("--force and --moment are of one answer: they do not go with --all")
    if not target.is_given:
        raise click.UsageError("no target: give --position, --rpy or both, or --joint")
    from ..answers.margins import nearest_first
    from ..description.links import has_pairs

    mechanism = load(mech)
    pose = target.of(mechanism)
    note_left_out(ignored(mechanism, target), mechanism)
    note_only_tilt(mechanism, pose)
    if list_all:
        note_unused_projection("--all")
        return print_modes(lambda: pf.working_modes(mechanism, pose), as_json)
    solution = pf.solve_ik(mechanism, pose, options=options)
    wrench = (force or (0.0, 0.0, 0.0)) + (moment or ()) if force or moment else None
    held = None if wrench is None else pf.forces(solution, wrench)
    margins = pf.margins(solution) if with_margins else None
    apart = pf.clearance(solution) if with_margins and has_pairs(mechanism) else None

    def as_object() -> dict[str, object]:
        plain = solution.to_dict() | ({} if solution else {"reason": solution.reason})
        plain |= {} if held is None else {"forces": held.to_dict()}
        plain |= {} if apart is None else {"clearance": apart.to_dict()}
        nearest = [dict(zip(("joint", "bound", "margin"), limit, strict=True)) for limit in nearest_first(solution)]
        return plain | ({} if margins is None else {"margins": nearest})

    def in_words() -> str:
        parts: list[object] = [each for each in (solution.table(), held, margins) if each is not None]
        return "\n\n".join(map(str, parts if apart is None else [*parts, apart.in_words]))

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


def note_only_tilt(mechanism: pf.Mechanism, target: Target) -> None:
    """Note what does not count of a tilt where the end effector tilts about one axis alone."""
    from ..kinematics import tilt_axis
    from ..overview import vector
    from ..poses import as_poses
    from ..targets import as_targets

    axis = tilt_axis(mechanism)
    if axis is not None and abs(as_targets(mechanism, target)[0] - as_poses(target)[0]).max() > TOLERANCES.alignment:
        note(f"of the tilt only the angle about {vector(axis)} counts, about which alone the end effector tilts")


def ignored(mechanism: pf.Mechanism, target: TargetOptions) -> Iterator[str]:
    """Options, or parts of them, that the task leaves out."""
    task, position, rpy = set(mechanism.task), target.position, target.rpy
    if position and not task & set("xyz"):
        yield "--position"
    elif position:
        for axis, value, home in zip("xyz", position, mechanism.reference_point, strict=True):
            if axis not in task and value != home:
                yield f"{axis} of --position"
    if rpy and not task & {"rotation", "tilt", "yaw"}:
        yield "--rpy"
    elif rpy and "yaw" in task and any(rpy[:2]):
        yield "the tilt in --rpy"
    elif rpy and "tilt" in task and any(rpy) and not any(rpy[:2]):
        yield "the yaw of --rpy"


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
        with picture(path, drawn):
            pf.plot_travel(distances, **drawn.looks)
        click.echo(f"wrote {path}", err=True)
    print_result(as_json, distances)
    return 0


speed_option = click.option(
    "--speed",
    "speeds",
    multiple=True,
    metavar="[NAME=]VALUE",
    help="Highest speed of an actuator, or of all [deg/s or length/s]. May be repeated. Default: the file's max_speed.",
)


@click.command()
@click.argument("mech", type=MECH)
@targeted
@speed_option
@json_option()
def speed(mech: str, target: TargetOptions, speeds: tuple[str, ...], as_json: bool) -> int:
    """Tell how fast the platform may move.

    Along and about each axis at a pose (default: home), and along the slowest direction of all.
    """
    mechanism = load(mech)
    solution = pf.solve_ik(mechanism, target.of(mechanism))
    if not solution:
        raise click.ClickException(f"not reached: {str(solution.status).lower()}; see `pfabrik ik`")
    highest = pf.platform_speed(solution, speed=speed_limits(mechanism, speeds) or None)
    print_result(as_json, highest)
    return 0


def speed_limits(mechanism: pf.Mechanism, words: Sequence[str], option: str = "--speed") -> dict[str, float]:
    """Speeds by name [rad/s or length/s] from words such as ``5`` or ``A1=5``; those with a name prevail."""
    from ..kinematics import readouts

    shown = {readout.name: readout for readout in readouts(mechanism)}
    limits: dict[str, float] = {}
    for word in sorted(words, key=lambda word: "=" in word):
        name, equals, value = word.rpartition("=")
        if equals and name not in shown:
            hint = near_miss(name, tuple(shown)) or f" (known: {', '.join(shown)})"
            raise click.UsageError(f"{option} {word}: no actuator '{name}'{hint}")
        if not is_finite(value) or float(value) <= 0.0:
            raise click.UsageError(f"{option} {word}: found '{value}'; expected a positive number")
        limits |= dict.fromkeys([name] if equals else shown, float(value))
    return {name: shown[name].coordinate(value) for name, value in limits.items()}


def own_limits(mechanism: pf.Mechanism) -> dict[str, float]:
    """The speeds that the mechanism's file gives, by name [rad/s or length/s]."""
    from ..timing.time_path import limits_of

    speeds = zip(mechanism.actuator_names, limits_of(mechanism, "speed", None).tolist(), strict=True)
    return {name: speed for name, speed in speeds if math.isfinite(speed)}
