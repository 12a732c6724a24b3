"""Settings for the firmwares of printers that have kinematics of deltas: Klipper, RepRapFirmware, Marlin."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ...common.arrays import Floats
from ...errors import UnsupportedMechanism
from ...machine.description.mechanism import Mechanism
from ...machine.files.printers.deltas import TOWERS
from ...machine.files.printers.m_codes import ROTARY_ANGLES
from ...machine.files.printers.marlin import ANGLES
from ...tolerances import TOLERANCES
from .fits import Thigh, Tower, angle_of, thighs_of, towers_of
from .machine_data import Machine
from .rod_lengths import uneven_rods, with_lengths
from .static_data import comment


def klipper(mechanism: Mechanism) -> str:
    """The sections `[printer]` and `[stepper_*]` of a delta for Klipper, and a list of what they lack.

    Deltas with upright rails are its delta, those that hang from cranks its rotary_delta.

    Raises
    ------
    UnsupportedMechanism : a machine that Klipper has no kinematics for.
    """
    towers, thighs = _fitting(mechanism, "Klipper", "rotary_delta")
    lines = _klipper_delta(mechanism, towers) if towers else _klipper_rotary_delta(mechanism, thighs)
    return _with_head(mechanism, "Klipper", "#", not towers, lines)


def reprap(mechanism: Mechanism) -> str:
    """M665 and M666, or M669 and M666, of a delta for RepRapFirmware, and a list of what they lack.

    Deltas with upright rails are its linear delta, those that hang from cranks its rotary delta.

    Raises
    ------
    UnsupportedMechanism : a machine that RepRapFirmware has no kinematics for.
    """
    towers, thighs = _fitting(mechanism, "RepRapFirmware", "rotary delta")
    lines = _reprap_linear(mechanism, towers) if towers else _reprap_rotary(mechanism, thighs)
    return _with_head(mechanism, "RepRapFirmware", ";", not towers, lines)


def marlin(mechanism: Mechanism) -> str:
    """M665 and M666 of a delta with upright rails for Marlin, to be kept by M500, and a list of what they lack.

    Raises
    ------
    UnsupportedMechanism : a machine that Marlin has no kinematics for.
    """
    towers, _ = _fitting(mechanism, "Marlin")
    return _with_head(mechanism, "Marlin", ";", False, _marlin_delta(mechanism, towers))


def _fitting(mechanism: Mechanism, firmware: str, rotary: str | None = None) -> tuple[list[Tower], list[Thigh]]:
    """The towers of a delta, or its thighs where a firmware has a name for such; one of the lists is empty."""
    uneven = [with_lengths(rods, mechanism.length_unit) for rods in uneven_rods(mechanism)]
    if uneven:
        reasons = [f"rods {each} differ, and {firmware}'s deltas have pairs of rods of one length" for each in uneven]
        raise UnsupportedMechanism(mechanism.name, reasons, "exported")
    machine = Machine(mechanism)
    towers, thighs = towers_of(machine) or [], thighs_of(machine, either_way=True) if rotary else None
    if not towers and not thighs:
        hanging = f", its {rotary} hangs from three cranks outward, and this machine does neither"
        reason = f"{firmware}'s delta has three upright rails, each with one pair of parallel rods"
        raise UnsupportedMechanism(mechanism.name, [reason + (hanging if rotary else "")], "exported")
    return towers, thighs or []


def _with_head(mechanism: Mechanism, firmware: str, mark: str, is_rotary: bool, lines: Iterator[str]) -> str:
    """The settings under a list of what the firmware does not know of the machine, or pfabrik of the printer."""
    unknown = ["pins, steps and currents of the steppers", "limits of the rods' joints"]
    if is_rotary:
        unknown.append("which way steppers turn: it counts arms upward")
    speeds = [speed for name in mechanism.actuator_names if (speed := mechanism.joint(name).max_speed) is not None]
    if speeds:
        unknown.append(f"speeds of the actuators, at most {min(speeds):.9g} a second")
    if mechanism.clearance is not None:
        unknown.append(f"the clearance between links, {mechanism.clearance:.9g} {comment(mechanism.length_unit)}")
    if mechanism.length_unit != "mm":
        unknown.append(f"lengths in {comment(mechanism.length_unit)}: it counts in mm")
    head = [
        f"'{comment(mechanism.name)}' for {firmware}, written by pfabrik.",
        "What it cannot know of this machine, or pfabrik of the printer:",
        *(f"- {each}" for each in unknown),
    ]
    return "\n".join([*(f"{mark} {line}" for line in head), *lines, ""])


def _klipper_delta(mechanism: Mechanism, towers: list[Tower]) -> Iterator[str]:
    radius = _radius(mechanism, towers)
    yield from ("[printer]", "kinematics: delta", f"delta_radius: {_text(radius)}")
    for letter, tower, height in zip(TOWERS, towers, _endstops(towers, radius), strict=True):
        yield from ("", f"[stepper_{letter}]", f"arm_length: {_text(tower.rod)}")
        yield f"angle: {_text(angle_of(tower.place))}"
        if math.isfinite(height):
            yield f"position_endstop: {_text(height)}"
        else:
            yield "# position_endstop: the carriage has no upper end of its range"


def _klipper_rotary_delta(mechanism: Mechanism, thighs: list[Thigh]) -> Iterator[str]:
    radius, heights = _shoulders(mechanism, thighs)
    height = _one(mechanism, heights, "height for its three shoulders")
    if height <= TOLERANCES.alignment * mechanism.characteristic_length:
        reason = f"Klipper counts heights from its bed, below the shoulders, and these are at z = {height:.6g}"
        raise UnsupportedMechanism(mechanism.name, [reason], "exported")
    yield from ("[printer]", "kinematics: rotary_delta", f"shoulder_radius: {_text(radius)}")
    yield f"shoulder_height: {_text(height)}"
    for letter, thigh in zip(TOWERS, thighs, strict=True):
        yield from ("", f"[stepper_{letter}]", f"angle: {_text(angle_of(thigh.hip))}")
        yield from (f"upper_arm_length: {_text(thigh.length)}", f"lower_arm_length: {_text(thigh.shin)}")
        yield _rotary_endstop(thigh, radius, height)


def _rotary_endstop(thigh: Thigh, radius: float, height: float) -> str:
    """The height of the nozzle in the middle with an arm at the upper end of its range, or why there is none.

    An arm at angle a below the horizontal has its elbow at (radius + length cos a, height - length sin a); the rod from
    there descends by d = sqrt(shin² - out²) to the middle. Beyond the angle at which arm and rod are in line,
    d cos a + out sin a = 0, Klipper takes the other arm of the same height.
    """
    out = radius + thigh.length * math.cos(thigh.least) if math.isfinite(thigh.least) else math.inf
    if out >= thigh.shin:
        return "# position_endstop: the arm has no upper end of its range with the nozzle in the middle"
    descent = math.sqrt(thigh.shin**2 - out**2)
    if descent * math.cos(thigh.least) + out * math.sin(thigh.least) <= 0.0:
        return (
            "# position_endstop: at the upper end of its range the arm is past its rod's line, where Klipper has no arm"
        )
    return f"position_endstop: {_text(height - thigh.length * math.sin(thigh.least) - descent)}"


def _reprap_linear(mechanism: Mechanism, towers: list[Tower]) -> Iterator[str]:
    radius = _radius(mechanism, towers)
    ends = _endstops(towers, radius)
    height = float(np.mean(ends))
    homed = [f"H{_text(height)}"] if math.isfinite(height) else []
    yield " ".join(["M665", f"L{_list([tower.rod for tower in towers])}", f"R{_text(radius)}", *homed, *_turns(towers)])
    yield from _m666(ends - height)


def _reprap_rotary(mechanism: Mechanism, thighs: list[Thigh]) -> Iterator[str]:
    radius, heights = _shoulders(mechanism, thighs)
    lowest, highest = (-np.degrees([getattr(thigh, end) for thigh in thighs]) for end in ("most", "least"))
    top = float(np.median(highest))
    corrections = [_turn(angle_of(thigh.hip), angle) for thigh, angle in zip(thighs, ROTARY_ANGLES, strict=True)]
    words = [f"U{_list([thigh.length for thigh in thighs])}", f"L{_list([thigh.shin for thigh in thighs])}"]
    words += [f"H{_list(heights)}", f"R{_text(radius)}"]
    words += [f"A{_text(float(lowest.min()))}:{_text(top)}"] if math.isfinite(lowest.min() + top) else []
    yield " ".join(["M669 K10", *words, *_xyz(corrections)])
    yield from _m666(highest - top)


def _marlin_delta(mechanism: Mechanism, towers: list[Tower]) -> Iterator[str]:
    radius = _radius(mechanism, towers, "; DELTA_RADIUS_TRIM_TOWER of Configuration.h says by how much")
    ends = _endstops(towers, radius)
    height, rods = float(ends.min()), np.array([tower.rod for tower in towers])
    rod = float(rods.mean()) if np.ptp(rods) > 0.0 else float(rods[0])
    homed = [f"H{_text(height)}"] if math.isfinite(height) else []
    trims = [f"{letter}{_text(trim)}" for letter, trim in zip("ABC", rods - rod, strict=True)]
    yield "; H is less the probe's offset (M851 Z) where there is a probe"
    yield " ".join([f"M665 L{_text(rod)} R{_text(radius)}", *homed, *_turns(towers), *trims])
    yield from _m666(height - ends)


def _radius(mechanism: Mechanism, towers: list[Tower], way: str = "") -> float:
    return _one(mechanism, [math.hypot(*tower.place[:2]) for tower in towers], "radius for its three towers", way)


def _shoulders(mechanism: Mechanism, thighs: list[Thigh]) -> tuple[float, Sequence[float]]:
    """The one radius of three cranks, less the platform's, and their heights above the nozzle's zero."""
    offsets = [thigh.hip - thigh.ankle for thigh in thighs]
    outward = [thigh.hip[:2] / math.hypot(*thigh.hip[:2]) for thigh in thighs]
    radii = [float(way @ offset[:2]) for way, offset in zip(outward, offsets, strict=True)]
    aside = [np.abs(offset[:2] - way * r).max() for way, offset, r in zip(outward, offsets, radii, strict=True)]
    if max(aside) > TOLERANCES.alignment * mechanism.characteristic_length:
        reason = "the firmware has rods in the planes of their cranks, and these are beside them"
        raise UnsupportedMechanism(mechanism.name, [reason], "exported")
    return _one(mechanism, radii, "radius for its three shoulders"), [float(offset[2]) for offset in offsets]


def _one(mechanism: Mechanism, values: Sequence[float], what: str, way: str = "") -> float:
    """The value of three that are one."""
    if np.ptp(values) > TOLERANCES.alignment * mechanism.characteristic_length:
        listed = ", ".join(f"{value:.6g}" for value in values)
        reason = f"the firmware has one {what}, and these have {listed}{way}"
        raise UnsupportedMechanism(mechanism.name, [reason], "exported")
    return float(np.mean(values))


def _endstops(towers: list[Tower], radius: float) -> Floats:
    """Heights (3,) of the nozzle in the middle with each carriage at its upper end; infinite without one."""
    tops = np.array([tower.place[2] + tower.highest for tower in towers])
    heights: Floats = tops - np.sqrt(np.maximum([tower.rod**2 - radius**2 for tower in towers], 0.0))
    return heights


def _turns(towers: list[Tower]) -> list[str]:
    """Corrections X, Y, Z [deg] of the towers' angles."""
    return _xyz([_turn(angle_of(tower.place), angle) for tower, angle in zip(towers, ANGLES, strict=True)])


def _turn(angle: float, nominal: float) -> float:
    """From one angle to another the shorter way [deg]."""
    return (angle - nominal + 180.0) % 360.0 - 180.0


def _m666(adjustments: Floats) -> Iterator[str]:
    if np.isfinite(adjustments).all():
        yield " ".join(["M666", *_xyz(adjustments)])
    else:
        yield "; M666: the actuators have no upper end of their range"


def _xyz(values: Sequence[float] | Floats) -> list[str]:
    return [f"{axis}{_text(float(value))}" for axis, value in zip("XYZ", values, strict=True)]


def _list(values: Sequence[float]) -> str:
    """Numbers with colons between; one if they are all the same."""
    texts = [_text(value) for value in values]
    return texts[0] if len(set(texts)) == 1 else ":".join(texts)


def _text(value: float) -> str:
    """A number to a billionth, so that those of a file come back as they were."""
    return f"{round(value, 9) + 0.0:.15g}"
