"""``pfabrik forces``, ``stiffness``, ``accuracy``, ``transmission`` and ``clearance``: of a machine at rest."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import click

import pfabrik as pf

from ..common.cells import is_finite
from .arguments import FINITE, Triple, at_a_pose, by_name, numbers_of, positive
from .options import actuators, joints, named_values, together
from .printing import Result, json_option, note, print_result, printing_result

Loads: TypeAlias = dict[str, tuple[float, list[float]]]


def bodies(mechanism: pf.Mechanism) -> tuple[str, ...]:
    """Names of the bodies that move."""
    return tuple(name for name in mechanism.bodies if name != mechanism.base)


def _by_body(loads: tuple[str, ...]) -> Loads:
    """Body -> its mass and centre, from words such as ``platform=5,0,0,190``."""
    found: Loads = {}
    for body, _, numbers in (words.rpartition("=") for words in loads):
        mass, *centre = numbers_of("--load BODY=MASS,X,Y,Z", numbers, (4,))
        found[body] = mass, centre
    return found


MOMENT = "Beside it, or alone [force times length]."
CARRIED, DOWN = "A mass that a body carries, and its centre, at home.", (0, 0, -9.81)
carrying = together(
    "loads",
    _by_body,
    named_values("--load", "loads", bodies, CARRIED, "BODY=MASS,X,Y,Z"),
    click.option(
        "--gravity", type=FINITE, nargs=3, default=DOWN, metavar="X Y Z", help="Of masses.  [default: 0 0 -9.81]"
    ),
)
"""Adds ``--load``, which a command gets as `loads` by body, and ``--gravity``."""


def weighed(mechanism: pf.Mechanism, loads: Loads) -> pf.Mechanism:
    """The machine with a mass of every body; a note names those that count as none, and none at all is an error."""
    if not (loads or mechanism.masses or any(shape.density for shape in mechanism.shapes)):
        raise click.UsageError("nothing has a mass: give --load, or `mass` in tables [[body]] of the file")
    from ..capabilities.dynamics.weights import lacking_masses

    weightless = lacking_masses(mechanism)
    if left := [body for body in weightless if body not in loads]:
        note(f"without a mass, and counted as none: {', '.join(left)}; `mass` in its table [[body]] gives a body one")
    return mechanism.with_masses([*mechanism.masses, *(pf.Mass(body, 0.0) for body in weightless)])


def pressing(command: Callable[..., Any]) -> Callable[..., Any]:
    """Adds the load on the end effector and on bodies, and ``--limit``, by actuator."""
    for option in (
        named_values("--limit", "limits", actuators, "Of an actuator, or of all.", "[NAME=]VALUE|MIN:MAX"),
        carrying,
        click.option("--moment", type=FINITE, nargs=3, metavar="X Y Z", help=MOMENT),
        click.option("--force", type=FINITE, nargs=3, metavar="X Y Z", help="What acts on the end effector."),
    ):
        command = option(command)
    return command


@click.command()
@at_a_pose
@pressing
@click.option("--friction", type=FINITE, metavar="MU", help="Between the ground and feet that are passive balls on it.")
@click.option("--reactions", is_flag=True, help="List what every joint transmits, and forces along rods.")
@json_option()
def forces(
    solution: pf.Solution,
    force: Triple | None,
    moment: Triple | None,
    loads: Loads,
    gravity: Triple,
    limits: tuple[str, ...],
    friction: float | None,
    reactions: bool,
    as_json: bool,
) -> int:
    """Tell what the actuators exert to hold a load.

    At a pose, home by default. Positive drives a coordinate up. Forces are in any unit, moments and torques in it times
    the unit of length, and masses in the one that --gravity makes such forces of: kg, say, and N.

    With --limit it says too how large a force may come on top, in whichever direction; or, with exit code 1, which
    actuators would be beyond theirs to hold the load, and by how much.

    With --friction the masses of the file weigh too, and feet neither slip nor lift: the one that is the first to is
    named, with the normal force that it has to spare.
    """
    if friction is not None:
        loads = weights(solution.mechanism) | loads
    if not (force or moment or loads or limits):
        raise click.UsageError("no load: give --force, --moment or --load; or --limit, for what can be held")
    wrench = (force or (0.0, 0.0, 0.0)) + (moment or ())
    bounds = by_name("--limit", limits, "actuator", actuators(solution.mechanism), bounds_of)
    held = pf.forces(solution, wrench, loads=loads, gravity=gravity, limits=bounds or None, friction=friction)
    others: dict[str, Result] = {"reactions": held.reactions} if reactions else {}
    if bounds and friction is None and not held.reason:
        used = pf.forces(solution, wrench, loads=loads, gravity=gravity).actuators.tolist()
        left: dict[str, tuple[float, float]] = {}
        for name, force_used in zip(solution.mechanism.actuator_names, used, strict=True):
            low, high = bound if isinstance(bound := bounds[name], tuple) else (-bound, bound)
            left[name] = low - force_used, high - force_used
        others["capacity"] = pf.wrench_capacity(solution, left)
    print_result(as_json, held, others)
    return int(bool(held.reason))


def weights(mechanism: pf.Mechanism) -> Loads:
    """The masses of a machine's bodies as loads."""
    from ..machine.description.body_inertias import inertias_of
    from ..machine.files.units import metres_of

    own = inertias_of(mechanism, metres_of(mechanism.length_unit))
    return {body: (each.mass, each.centre.tolist()) for body, each in own.items()}


def bounds_of(words: str) -> float | tuple[float, float]:
    """A positive number, or a lowest and a highest; a ValueError says what was expected."""
    low, colon, high = words.partition(":")
    if not colon:
        return positive(words)
    if not (is_finite(low) and is_finite(high)):
        raise ValueError("a positive number, or MIN:MAX")
    return float(low), float(high)


def rods(mechanism: pf.Mechanism) -> tuple[str, ...]:
    """Names of the rods."""
    from ..capabilities.statics.forces import rods_of

    return rods_of(mechanism).names


@click.command()
@at_a_pose
@named_values("--k", "k", actuators, "Of an actuator, or all [force/length, torque/rad]", required=True)
@named_values("--rod", "given", rods, "Of a rod, or all [force/length]. Default: rigid.")
@pressing
@printing_result
def stiffness(
    solution: pf.Solution,
    k: tuple[str, ...],
    given: tuple[str, ...],
    force: Triple | None,
    moment: Triple | None,
    loads: Loads,
    gravity: Triple,
    limits: tuple[str, ...],
) -> pf.Stiffness:
    """Tell how stiff a machine is whose actuators and rods give.

    At a pose, home by default: along and about each axis, the force or moment that moves the end effector by one unit
    of length, or by one rad.

    With a load, what that changes as the end effector moves counts too; --limit says what cables pull: -200:-5, say.
    """
    by_actuator = by_name("--k", k, "actuator", actuators(solution.mechanism), positive)
    by_rod = by_name("--rod", given, "rod", rods(solution.mechanism), positive)
    held = None
    if force or moment or loads or limits:
        bounds = by_name("--limit", limits, "actuator", actuators(solution.mechanism), bounds_of) if limits else None
        wrench = (force or (0.0, 0.0, 0.0)) + (moment or ())
        held = pf.forces(solution, wrench, loads=loads, gravity=gravity, limits=bounds)
    return pf.stiffness(solution, by_actuator, rods=by_rod or None, forces=held)


def error_names(mechanism: pf.Mechanism) -> dict[str, None]:
    """Names of actuators, and of joints."""
    return dict.fromkeys((*actuators(mechanism), *joints(mechanism)))


@click.command()
@at_a_pose
@named_values(
    "--error",
    "errors",
    error_names,
    "How far an actuator or all may be off [deg or length], or the play of a joint [length].",
    required=True,
)
@click.option("--rms", is_flag=True, help="Errors are standard deviations, not bounds.")
@printing_result
def accuracy(solution: pf.Solution, errors: tuple[str, ...], rms: bool) -> pf.PoseAccuracy:
    """Tell how far off a pose is if actuators are off and joints have play.

    At a pose, home by default. The error of an actuator is half its resolution and half its backlash together; play of
    a joint is half the clearance of its diameter.
    """
    from ..kinematics import readouts

    drives = {readout.name: readout for readout in readouts(solution.mechanism)}
    bounds = by_name("--error", errors, "actuator or joint", error_names(solution.mechanism), positive, drives)
    by_unit = {name: drives[name].coordinate(value) if name in drives else value for name, value in bounds.items()}
    return pf.accuracy(solution, by_unit, "rms" if rms else "worst")


@click.command()
@at_a_pose
@printing_result
def transmission(solution: pf.Solution) -> pf.Transmission:
    """Tell the velocity and force of the end effector per actuator.

    At a pose, home by default: in directions square to each other, the fastest first.
    """
    return pf.transmission(solution)


@click.command()
@at_a_pose
@printing_result
def clearance(solution: pf.Solution) -> pf.Clearance:
    """Tell how far apart links are, and which two are nearest.

    At a pose, home by default. Links have the thickness that the file gives legs, or the shapes of its [[body]] tables.
    """
    return pf.clearance(solution)
