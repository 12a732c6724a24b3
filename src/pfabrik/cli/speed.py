"""``pfabrik speed``: the highest speeds of the platform at a pose, and the actuators that limit them; ``--speed``."""

from __future__ import annotations

import math
from collections.abc import Sequence

import click

import pfabrik as pf

from ..cells import is_finite
from ..errors import near_miss
from .arguments import MECH, TargetOptions, load, targeted
from .printing import json_option, print_result

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
    from ..description.readouts import readouts

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
