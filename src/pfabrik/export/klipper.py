"""Settings for Klipper: the deltas that it has kinematics for."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..description.mechanism import Mechanism
from ..errors import UnsupportedMechanism
from ..tolerances import TOLERANCES
from .fits import Thigh, Tower, angle_of, thighs_of, towers_of
from .machine_data import Machine
from .rod_lengths import uneven_rods, with_lengths
from .wording import comment

LETTERS = "abc"


def klipper(mechanism: Mechanism) -> str:
    """The sections `[printer]` and `[stepper_*]` of a delta for Klipper, and a list of what they lack.

    Deltas with upright rails are its delta, those that hang from cranks its rotary_delta.

    Raises
    ------
    UnsupportedMechanism : a machine that Klipper has no kinematics for.
    """
    uneven = [with_lengths(rods, mechanism.length_unit) for rods in uneven_rods(mechanism)]
    if uneven:
        reasons = [f"rods {each} differ, and Klipper's deltas have pairs of rods of one length" for each in uneven]
        raise UnsupportedMechanism(mechanism.name, reasons, "exported")
    machine = Machine(mechanism)
    towers, thighs = towers_of(machine), thighs_of(machine)
    if towers is not None:
        return _delta(mechanism, towers)
    if thighs is not None:
        return _rotary_delta(mechanism, thighs)
    reason = (
        "Klipper's delta has three upright rails, each with one pair of parallel rods, its rotary_delta hangs from "
        "three cranks outward, and this machine does neither"
    )
    raise UnsupportedMechanism(mechanism.name, [reason], "exported")


def _rotary_delta(mechanism: Mechanism, thighs: list[Thigh]) -> str:
    size, tolerance = mechanism.characteristic_length, TOLERANCES.alignment
    outward = [thigh.hip[:2] / math.hypot(*thigh.hip[:2]) for thigh in thighs]
    radii = [float(direction @ (thigh.hip - thigh.ankle)[:2]) for direction, thigh in zip(outward, thighs, strict=True)]
    misalignments = [
        (thigh.hip - thigh.ankle)[:2] - direction * r
        for direction, r, thigh in zip(outward, radii, thighs, strict=True)
    ]
    heights = [float((thigh.hip - thigh.ankle)[2]) for thigh in thighs]
    if max(np.ptp(radii), np.ptp(heights), np.abs(misalignments).max()) > tolerance * size:
        reason = "Klipper's rotary_delta has one radius and one height for its three shoulders, and these differ"
        raise UnsupportedMechanism(mechanism.name, [reason], "exported")
    if heights[0] <= tolerance * size:
        reason = f"Klipper counts heights from its bed, below the shoulders, and these are at z = {heights[0]:.6g}"
        raise UnsupportedMechanism(mechanism.name, [reason], "exported")
    lines = _begun(mechanism, "rotary_delta", ["which way steppers turn: it counts arms upward"])
    lines += [f"shoulder_radius: {radii[0]:.9g}", f"shoulder_height: {heights[0]:.9g}"]
    for letter, thigh in zip(LETTERS, thighs, strict=True):
        lines += ["", f"[stepper_{letter}]", f"angle: {angle_of(thigh.hip):.9g}"]
        lines += [f"upper_arm_length: {thigh.length:.9g}", f"lower_arm_length: {thigh.shin:.9g}"]
        reach = radii[0] + thigh.length * math.cos(thigh.least) if math.isfinite(thigh.least) else math.inf
        if reach < thigh.shin:
            elbow = heights[0] - thigh.length * math.sin(thigh.least)
            lines.append(f"position_endstop: {elbow - math.sqrt(thigh.shin**2 - reach**2):.9g}")
        else:
            lines.append("# position_endstop: the arm has no upper end of its range with the nozzle in the middle")
    return "\n".join([*lines, ""])


def _begun(mechanism: Mechanism, kind: str, more: Sequence[str] = ()) -> list[str]:
    """The head of the file: what Klipper does not know of the machine, and the kind of printer."""
    unknown = ["pins, steps and currents of the steppers", "limits of the rods' joints", *more]
    if mechanism.clearance is not None:
        unknown.append(f"the clearance between links, {mechanism.clearance:.9g} {comment(mechanism.length_unit)}")
    if mechanism.length_unit != "mm":
        unknown.append(f"lengths in {comment(mechanism.length_unit)}: it counts in mm")
    return [
        f"# '{comment(mechanism.name)}' for Klipper, written by pfabrik.",
        "# What it cannot know of this machine, or pfabrik of the printer:",
        *(f"# - {each}" for each in unknown),
        "[printer]",
        f"kinematics: {kind}",
    ]


def _delta(mechanism: Mechanism, towers: list[Tower]) -> str:
    radii = [math.hypot(*tower.place[:2]) for tower in towers]
    if np.ptp(radii) > TOLERANCES.alignment * mechanism.characteristic_length:
        places = ", ".join(f"{radius:.6g}" for radius in radii)
        reason = f"Klipper's delta has one radius for its three towers, and these have {places}"
        raise UnsupportedMechanism(mechanism.name, [reason], "exported")
    lines = [*_begun(mechanism, "delta"), f"delta_radius: {radii[0]:.9g}"]
    speeds = [mechanism.joint(name).max_speed for name in mechanism.actuator_names]
    given = [speed for speed in speeds if speed is not None]
    lines.append(
        f"# the carriages' own: at most {min(given):.9g} a second" if given else "# max_velocity, max_accel: yours"
    )
    for letter, tower in zip(LETTERS, towers, strict=True):
        lines += ["", f"[stepper_{letter}]", f"arm_length: {tower.rod:.9g}", f"angle: {angle_of(tower.place):.9g}"]
        height = tower.place[2] + tower.highest - math.sqrt(max(tower.rod**2 - radii[0] ** 2, 0.0))
        if math.isfinite(height):
            lines.append(f"position_endstop: {height:.9g}")
        else:
            lines.append("# position_endstop: the carriage has no upper end of its range")
    return "\n".join([*lines, ""])
