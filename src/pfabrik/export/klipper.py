"""Settings for Klipper: the deltas that it has kinematics for."""

from __future__ import annotations

import math

import numpy as np

from ..description.mechanism import Mechanism
from ..errors import UnsupportedMechanism
from ..tolerances import TOLERANCES
from .fits import Tower, angles_of, towers_of
from .machine import Machine
from .wording import comment

LETTERS = "abc"


def klipper(mechanism: Mechanism) -> str:
    """`[printer]` and `[stepper_*]` of a delta for Klipper, with what it cannot know of this machine listed.

    Raises
    ------
    UnsupportedMechanism : a machine that Klipper has no kinematics for.
    """
    machine = Machine(mechanism)
    towers = towers_of(machine)
    if towers is None:
        reason = (
            "Klipper's delta has three upright rails, each with one pair of parallel rods, and this machine has not"
        )
        raise UnsupportedMechanism(mechanism.name, [reason], "exported")
    return _delta(mechanism, towers)


def _delta(mechanism: Mechanism, towers: list[Tower]) -> str:
    radii = [math.hypot(*tower.place[:2]) for tower in towers]
    unknown = ["pins, steps and currents of the steppers", "limits of the rods' joints"]
    if np.ptp(radii) > TOLERANCES.alignment * mechanism.characteristic_length:
        places = ", ".join(f"{radius:.6g}" for radius in radii)
        reason = f"Klipper's delta has one radius for its three towers, and these have {places}"
        raise UnsupportedMechanism(mechanism.name, [reason], "exported")
    if mechanism.length_unit != "mm":
        unknown.append(f"lengths in {mechanism.length_unit}: it counts in mm")
    lines = [
        f"# '{comment(mechanism.name)}' for Klipper, written by pfabrik.",
        "# What it cannot know of this machine, or pfabrik of the printer:",
        *(f"# - {each}" for each in unknown),
        "[printer]",
        "kinematics: delta",
        f"delta_radius: {radii[0]:.9g}",
    ]
    speeds = [mechanism.joint(name).max_speed for name in mechanism.actuator_names]
    known = [speed for speed in speeds if speed is not None]
    lines.append(
        f"# the carriages' own: at most {min(known):.9g} a second" if known else "# max_velocity, max_accel: yours"
    )
    for letter, tower, angle in zip(LETTERS, towers, angles_of(towers), strict=True):
        lines += ["", f"[stepper_{letter}]", f"arm_length: {tower.rod:.9g}", f"angle: {angle:.9g}"]
        height = tower.place[2] + tower.highest - math.sqrt(max(tower.rod**2 - radii[0] ** 2, 0.0))
        if math.isfinite(height):
            lines.append(f"position_endstop: {height:.9g}")
        else:
            lines.append("# position_endstop: the carriage has no upper end of its range")
    return "\n".join([*lines, ""])
