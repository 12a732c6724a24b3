"""Highest speeds of actuators: of the file, and by ``--speed``, which the commands about time share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from ..errors import near_miss
from .finite import is_finite

if TYPE_CHECKING:
    from ..description.mechanism import Mechanism

speed_option = click.option(
    "--speed",
    "speeds",
    multiple=True,
    metavar="[NAME=]VALUE",
    help="Highest speed of an actuator, or of all [deg/s or length/s]. May be repeated. Default: the file's max_speed.",
)


def own_limits(mechanism: Mechanism) -> dict[str, float]:
    """The speeds that the mechanism says, by name."""
    from ..timing.time_path import limits_of

    speeds = zip(mechanism.actuator_names, limits_of(mechanism, "speed", None).tolist(), strict=True)
    return {name: speed for name, speed in speeds if math.isfinite(speed)}


def speed_limits(mechanism: Mechanism, given: Sequence[str], option: str = "--speed") -> dict[str, float]:
    """Speeds by name [rad/s or length/s], from words as of ``--speed``; what is said of one counts before all."""
    from ..description.readouts import readouts

    shown = {readout.name: readout for readout in readouts(mechanism)}
    said: dict[str, float] = {}
    for word in sorted(given, key=lambda word: "=" in word):
        name, _, value = word.rpartition("=")
        if "=" in word and name not in shown:
            hint = near_miss(name, tuple(shown)) or f" (known: {', '.join(shown)})"
            raise click.UsageError(f"{option} {word}: no actuator '{name}'{hint}")
        said |= dict.fromkeys([name] if "=" in word else shown, positive(option, word, value))
    return {name: shown[name].coordinate(value) for name, value in said.items()}


def positive(option: str, word: str, value: str) -> float:
    """A speed as a positive number."""
    if not is_finite(value) or float(value) <= 0.0:
        raise click.UsageError(f"{option} {word}: found '{value}'; expected a positive number")
    return float(value)
