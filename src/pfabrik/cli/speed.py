"""``pfabrik speed``: the highest speeds of the platform at a pose, and the actuators that limit them; ``--speed``."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import click

import pfabrik as pf

from ..answers.aligned_text import aligned, plain
from ..cells import is_finite
from ..errors import near_miss
from .arguments import MECH, TargetOptions, load, targeted
from .printing import json_option, print_answer

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
    print_answer(as_json, lambda: as_object(highest), lambda: speed_table(highest, mechanism.length_unit))
    return 0


def as_object(highest: Iterable[pf.PlatformSpeed]) -> dict[str, object]:
    """Platform speeds as plain numbers; None where nothing limits one."""
    finite = [motion.speed if math.isfinite(motion.speed) else None for motion in highest]
    return {"speeds": [motion._asdict() | {"speed": value} for motion, value in zip(highest, finite, strict=True)]}


def speed_table(highest: Iterable[pf.PlatformSpeed], length_unit: str) -> str:
    """Platform speeds as a table, a row for each direction or axis."""
    rows = []
    for motion in highest:
        turns = motion.kind == "about"
        value = math.degrees(motion.speed) if turns else motion.speed
        shown = plain(value, 1e-9) if math.isfinite(value) else "unlimited"
        direction = [plain(component, 1e-9) for component in motion.direction]
        rows.append((motion.kind, *direction, shown, f"{'deg' if turns else length_unit}/s", motion.limited_by))
    return aligned(["", "x", "y", "z", "speed", "unit", "limited by"], rows)


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
