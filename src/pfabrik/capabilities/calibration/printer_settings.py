"""Delta printers as their firmwares count them, what they measured of themselves, and their true settings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Literal

import numpy as np

from ...common.arrays import Floats
from ...common.checks import names_of, require_path
from ...errors import InvalidArgument, InvalidMechanism
from ...machine.description.mechanism import Mechanism
from ...machine.files import load, printer_settings_of
from ...machine.files.printers import printer_table
from ...machine.files.printers.deltas import TOWERS, counted_from_endstops, fault
from ...machine.files.printers.klipper import KlipperSettings, settings_of
from ...machine.files.reading import read_mechanism
from .calibration import Calibration
from .least_squares import calibrate, largest_determined
from .measurements import Measurements, Sigma
from .parameters import Free, independent_dimensions, parameters

STAGES = (
    ("position_endstop_a", "position_endstop_b", "position_endstop_c", "highest_a", "highest_b", "highest_c"),
    ("delta_radius", "shoulder_height", "shoulder_height_a", "shoulder_height_b", "shoulder_height_c"),
    ("angle_a", "angle_b", "shoulder_radius"),
    ("arm_length_a", "arm_length_b", "arm_length_c"),
    ("lower_arm_length_a", "lower_arm_length_b", "lower_arm_length_c"),
    ("upper_arm_length_a", "upper_arm_length_b", "upper_arm_length_c"),
)
"""Dimensions of printers, those first that need the least to be determined: each stage asks for all before it.

The third tower's angle is left out, as the frame turns with it; where a tower's radius differs, its trim stays."""

BY_HEIGHTS = 3
"""Stages that heights determine: a longer arm and a larger radius touch a flat bed in the same places."""

PROBES = ("probe", "bltouch", "smart_effector")
"""Sections of Klipper's probes."""

DISTANCE_WEIGHT = 0.5
"""Weight of all distances together beside that of all heights, as Klipper's delta_calibrate has it."""


@dataclass(frozen=True)
class Printer:
    """A delta printer as its firmware counts it; made by `read_printer`.

    Attributes
    ----------
    mechanism : Mechanism
        The machine, with its settings as dimensions, in Klipper's words: delta_radius, and for each tower angle_a,
        arm_length_a and position_endstop_a. Its actuators are what the firmware counts with the settings of the file:
        from its endstop, wherever the bed is by other dimensions.
    described : Mechanism
        The machine that `load` makes of the file. Its actuators count from the bed, wherever its endstops are.
    measurements : Measurements or None
        What Klipper's DELTA_CALIBRATE and DELTA_ANALYZE stored; None if nothing.
    probe_offset : tuple of float
        Place of Klipper's probe from the nozzle, z at its trigger [length]; 0 where the file has none.
    """

    mechanism: Mechanism
    described: Mechanism
    measurements: Measurements | None = None
    probe_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def free(self) -> tuple[str, ...]:
        """The dimensions of the file that measurements can determine."""
        return _known(self.mechanism, STAGES)

    def calibrate(
        self, measurements: Measurements | None = None, free: Free = None, *, ties: Literal["copies"] | None = None
    ) -> Calibration:
        """The printer's dimensions by measurements, as `pf.calibrate` finds them.

        What they do not determine stays as described, stage by stage: lengths of arms first, then angles of towers,
        the radius, and endstops. Heights alone leave the arms as described.

        Parameters
        ----------
        measurements : Measurements, optional
            Readings as the firmware counts with these settings, and what was measured. Default: the printer's own.
        free : str or sequence of str, optional
            What may vary in place of `free`. Offsets and other kinds than dimensions are those of `described`.
        ties : str, optional
            As in `parameters`.
        """
        measurements = measurements or self.measurements
        if measurements is None:
            raise InvalidArgument("measurements", "none in the file", "measurements of this printer")
        if free is not None:
            machine = self.mechanism if self._are_dimensions(free) else self.described
            return calibrate(machine, measurements, free=free, ties=ties)
        stages = STAGES[: BY_HEIGHTS if _are_heights(measurements) else None]
        sets = [names for n in range(len(stages), 0, -1) if (names := _known(self.mechanism, stages[:n]))]
        return largest_determined(parameters(self.mechanism, self.free), measurements, list(dict.fromkeys(sets)))

    def corrected(self, found: Calibration) -> Mechanism:
        """The machine that `load` would make of this printer's settings as calibrated.

        Parameters
        ----------
        found : Calibration
            Of this printer.
        """
        if self._are_dimensions(found.names):
            changed = {each.name: each.value for each in found.parameters if each.value != each.described}
            return self.described.with_dimensions(changed) if changed else self.described
        ends = {drive.name: self.described.joint(drive.name).range for drive in self.described.drives}
        return found.mechanism.with_limits({name: limits for name, limits in ends.items() if limits is not None})

    def _are_dimensions(self, free: Free) -> bool:
        return set(names_of("free", free)) <= {"dimensions", *independent_dimensions(self.mechanism)}


def read_printer(path: str | PathLike[str], *, sigma: Sigma = None) -> Printer:
    """A delta printer, and the measurements that are in its settings.

    Parameters
    ----------
    path : str or PathLike
        Klipper's `printer.cfg`, RepRapFirmware's `config.g`, or Marlin's `Configuration.h`, as in `load`.
    sigma : float or mapping of str to float, optional
        Standard deviations of the measurements, as in `Measurements`. Default: heights and distances are weighted as
        Klipper does, and how good they are is estimated from what is left.

    Raises
    ------
    InvalidMechanism
        No settings of a delta, or a value that is missing or no number.
    """
    file = Path(require_path("path", path))
    described = load(str(file))
    text = printer_settings_of(str(file))
    try:
        table = None if text is None else printer_table(text, file.parent)
        if text is None or table is None:
            raise fault("file", "no settings of a printer", "those of Klipper, RepRapFirmware or Marlin")
        tops = dict(zip(described.actuator_names, (_tops(described) / _unit(described)).tolist(), strict=True))
        printer = Printer(read_mechanism(counted_from_endstops(table, tops)), described)
        settings = settings_of(text, file.parent)
        if settings is None:
            return printer
        measured = _measured(settings, described, sigma)
        return replace(printer, measurements=measured, probe_offset=_probe_offset(settings))
    except InvalidMechanism as error:
        raise InvalidMechanism(error.faults, str(file)) from None


def _probe_offset(settings: KlipperSettings) -> tuple[float, float, float]:
    """Place of the probe from the nozzle, z at its trigger."""
    section = next((name for name in PROBES if settings.text(name, "z_offset") is not None), PROBES[0])
    x, y, z = (settings.number(section, f"{axis}_offset", 0.0) for axis in "xyz")
    return x, y, z


def _known(mechanism: Mechanism, stages: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """The dimensions of stages that a machine has, in the order of its own."""
    own = independent_dimensions(mechanism)
    return tuple(name for stage in stages for name in stage if name in own)


def _are_heights(measurements: Measurements) -> bool:
    """True if nothing but heights was measured."""
    position = measurements.position
    aside = position is not None and np.isfinite(position[:, :2]).any()
    return not (aside or len(measurements.distances) or measurements.joints)


def _tops(mechanism: Mechanism) -> Floats:
    """Actuator values at the endstops, the upper ends of their ranges."""
    ranges = [mechanism.joint(name).range for name in mechanism.actuator_names]
    return np.array([math.inf if ends is None else ends[1] for ends in ranges])


def _unit(mechanism: Mechanism) -> float:
    """A file's unit of actuators, in theirs: mm, or a degree."""
    return math.radians(1.0) if mechanism.drives[0].kind == "angle" else 1.0


def _numbers(settings: KlipperSettings, section: str, key: str) -> Floats | None:
    """A list of numbers; None where nothing is said."""
    said = settings.text(section, key)
    if said is None:
        return None
    try:
        return np.array([float(part) for part in said.split(",")])
    except ValueError:
        raise fault(f"[{section}] {key}", repr(said), "numbers with commas between") from None


def _per_step(settings: KlipperSettings, letter: str, turn: float) -> float:
    """Travel of a step of a tower's stepper; of tower a's where it says nothing itself.

    Parameters
    ----------
    turn : of the last wheel, where that is no setting; NaN where it is.
    """
    section = f"stepper_{letter}"
    if all(settings.text(section, key) is None for key in ("rotation_distance", "step_distance", "gear_ratio")):
        section = "stepper_a"
    if settings.text(section, "step_distance") is not None:
        return settings.number(section, "step_distance")
    turns = 1.0
    for ratio in (settings.text(section, "gear_ratio") or "1:1").split(","):
        over, _, under = ratio.partition(":")
        turns *= float(over) / float(under)
    steps = settings.number(section, "full_steps_per_rotation", 200.0) * settings.number(section, "microsteps")
    return (settings.number(section, "rotation_distance") if math.isnan(turn) else turn) / (steps * turns)


def _measured(settings: KlipperSettings, described: Mechanism, sigma: Sigma) -> Measurements | None:
    """The measurements that DELTA_CALIBRATE keeps: heights and distances at steps below the endstops."""
    turn = 2.0 * math.pi if described.drives[0].kind == "angle" else math.nan
    rows: list[Floats] = []
    heights: list[float] = []
    distances: list[tuple[int, int, float]] = []
    names: list[str] = []
    spans: list[str] = []
    section = "delta_calibrate"
    for kind in ("height", "manual_height"):
        for number in range(1000):
            name = f"{kind}{number}"
            steps = _numbers(settings, section, f"{name}_pos")
            if steps is None:
                break
            rows.append(steps)
            names.append(name)
            heights.append(settings.number(section, name))
    for number in range(1000):
        name = f"distance{number}"
        places = [f"{name}_pos{end}" for end in (1, 2)]
        ends = [_numbers(settings, section, place) for place in places]
        if ends[0] is None or ends[1] is None:
            break
        distances.append((len(rows), len(rows) + 1, settings.number(section, name)))
        spans.append(name)
        rows += [ends[0], ends[1]]
        names += places
        heights += [math.nan, math.nan]
    if not rows:
        return None
    per_step = np.array([_per_step(settings, letter, turn) for letter in TOWERS])
    readings = _tops(described) - np.array(rows) * per_step
    if sigma is not None or not distances:
        return Measurements(readings, height=heights, distances=distances or None, sigma=sigma, names=[*names, *spans])
    weights = {"height": math.sqrt(DISTANCE_WEIGHT * np.isfinite(heights).sum() / len(distances)), "distances": 1.0}
    return Measurements(
        readings, height=heights, distances=distances, sigma=weights, absolute_sigma=False, names=[*names, *spans]
    )
