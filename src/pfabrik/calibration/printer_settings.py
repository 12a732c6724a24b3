"""Klipper's deltas: the machine that its settings describe, counted as its steps are, and what it measured."""

from __future__ import annotations

import math
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from ..arrays import Floats
from ..checks import require_path
from ..description.mechanism import Mechanism
from ..errors import InvalidMechanism
from ..files.printers.deltas import TOWERS, fault
from ..files.printers.klipper import KlipperSettings, delta_of
from ..files.reading import read_mechanism
from ..files.texts import text_of
from .measurements import Measurements

BASIC = ("delta_radius", "angle_a", "angle_b", *(f"position_endstop_{letter}" for letter in TOWERS))
"""Dimensions that heights determine."""

EXTENDED = (*BASIC, *(f"arm_length_{letter}" for letter in TOWERS))
"""Dimensions that heights and distances determine together."""

DISTANCE_WEIGHT = 0.5
"""Weight of all distances together beside that of all heights, as Klipper's delta_calibrate has it."""


@dataclass(frozen=True)
class KlipperDelta:
    """A delta printer as Klipper calibrates it.

    An actuator's value is how far its carriage is above its endstop: minus the steps below, over the steps per mm. The
    machine that `load` makes of the same file counts carriages from the bed.

    Attributes
    ----------
    mechanism : Mechanism
        The machine, with Klipper's settings as dimensions: delta_radius, and for each tower angle_a, arm_length_a and
        position_endstop_a.
    measurements : Measurements or None
        What DELTA_CALIBRATE and DELTA_ANALYZE stored; None if nothing.
    """

    mechanism: Mechanism
    measurements: Measurements | None

    @property
    def free(self) -> tuple[str, ...]:
        """The dimensions that the measurements determine: BASIC, or EXTENDED with distances."""
        return EXTENDED if self.measurements is not None and len(self.measurements.distances) else BASIC


def read_klipper(path: str | PathLike[str]) -> KlipperDelta:
    """A delta and its measurements from a `printer.cfg`.

    Parameters
    ----------
    path : str or PathLike
        Klipper's `printer.cfg`.

    Raises
    ------
    InvalidMechanism
        No settings of a delta, or a value that is missing or no number.
    """
    file = Path(require_path("path", path))
    try:
        settings = KlipperSettings(text_of(file), file.parent)
        if settings.text("printer", "kinematics") != "delta":
            raise fault("[printer] kinematics", str(settings.text("printer", "kinematics")), "delta")
        mechanism = read_mechanism(delta_of(settings, from_endstops=True))
        return KlipperDelta(mechanism, _measured(settings))
    except InvalidMechanism as error:
        raise InvalidMechanism(error.faults, str(file)) from None


def _numbers(settings: KlipperSettings, section: str, key: str) -> Floats | None:
    """A list of numbers; None where nothing is said."""
    said = settings.text(section, key)
    if said is None:
        return None
    try:
        return np.array([float(part) for part in said.split(",")])
    except ValueError:
        raise fault(f"[{section}] {key}", repr(said), "numbers with commas between") from None


def _steps_per_mm(settings: KlipperSettings, letter: str) -> float:
    """Steps per mm of a tower's stepper; of tower a where it says nothing itself."""
    section = f"stepper_{letter}"
    if settings.text(section, "rotation_distance") is None and settings.text(section, "step_distance") is None:
        section = "stepper_a"
    if settings.text(section, "step_distance") is not None:
        return 1.0 / settings.number(section, "step_distance")
    turns = 1.0
    for ratio in (settings.text(section, "gear_ratio") or "1:1").split(","):
        over, _, under = ratio.partition(":")
        turns *= float(over) / float(under)
    steps = settings.number(section, "full_steps_per_rotation", 200.0) * settings.number(section, "microsteps")
    return steps * turns / settings.number(section, "rotation_distance")


def _measured(settings: KlipperSettings) -> Measurements | None:
    """The measurements that DELTA_CALIBRATE keeps: heights and distances at stepper positions."""
    per_mm = np.array([_steps_per_mm(settings, letter) for letter in TOWERS])
    rows: list[Floats] = []
    heights: list[float] = []
    distances: list[tuple[int, int, float]] = []
    section = "delta_calibrate"
    for kind in ("height", "manual_height"):
        for number in range(1000):
            steps = _numbers(settings, section, f"{kind}{number}_pos")
            if steps is None:
                break
            rows.append(-steps / per_mm)
            heights.append(settings.number(section, f"{kind}{number}"))
    for number in range(1000):
        ends = [_numbers(settings, section, f"distance{number}_pos{end}") for end in (1, 2)]
        if ends[0] is None or ends[1] is None:
            break
        distances.append((len(rows), len(rows) + 1, settings.number(section, f"distance{number}")))
        rows += [-ends[0] / per_mm, -ends[1] / per_mm]
        heights += [math.nan, math.nan]
    if not rows:
        return None
    if not distances:
        return Measurements(np.array(rows), height=heights)
    sigma = {"height": math.sqrt(DISTANCE_WEIGHT * np.isfinite(heights).sum() / len(distances)), "distances": 1.0}
    return Measurements(np.array(rows), height=heights, distances=distances, sigma=sigma, absolute_sigma=False)
