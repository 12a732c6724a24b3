"""Klipper's deltas: the machine that its settings describe, what it measured, and settings from a calibration."""

from __future__ import annotations

import configparser
import math
import re
from collections.abc import Iterator, Mapping
from os import PathLike
from pathlib import Path

import numpy as np

from ..arrays import Floats
from ..checks import require_path
from ..description.mechanism import Mechanism
from ..errors import InvalidArgument
from ..files.reading import read_mechanism
from .calibration import Calibration
from .measurements import Measurements

TOWERS = "abc"

BASIC = ("radius", "angle_a", "angle_b", "endstop_a", "endstop_b", "endstop_c")
"""Dimensions that heights determine."""

EXTENDED = (*BASIC, "arm_a", "arm_b", "arm_c")
"""Dimensions that heights and distances determine together."""

APART = 40.0
"""Distance of the two rods of a pair in the machine that is made [mm]: positions do not depend on it."""

DISTANCE_WEIGHT = 0.5
"""Weight of all distances together beside that of all heights, as Klipper's delta_calibrate has it."""

LARGEST = 5_000_000
"""Largest settings file read [characters]."""


class KlipperDelta:
    """A delta printer as Klipper's settings have it.

    An actuator's value is how far its carriage is above its endstop: minus the steps below, over the steps per mm.

    Attributes
    ----------
    mechanism : the machine, with dimensions radius, and for each tower angle_a, arm_a and endstop_a.
    measurements : what DELTA_CALIBRATE and DELTA_ANALYZE stored; None if nothing.
    free : the dimensions that these determine: BASIC, or EXTENDED with distances.
    """

    def __init__(self, mechanism: Mechanism, measurements: Measurements | None) -> None:
        self.mechanism, self.measurements = mechanism, measurements
        has_distances = measurements is not None and len(measurements.distances) > 0
        self.free = EXTENDED if has_distances else BASIC


def read_klipper(path: str | PathLike[str]) -> KlipperDelta:
    """A delta and its measurements from a `printer.cfg`.

    Raises
    ------
    InvalidArgument : no settings of a delta, or a value that is missing or no number.
    """
    file = Path(require_path("path", path))
    text = file.read_text(encoding="utf-8", errors="replace")
    if len(text) > LARGEST:
        raise InvalidArgument("path", f"a file of {len(text)} characters", "a printer.cfg")
    settings = _Settings(text)
    if settings.text("printer", "kinematics") != "delta":
        raise InvalidArgument("path", f"kinematics '{settings.text('printer', 'kinematics')}'", "kinematics: delta")
    radius = settings.number("printer", "delta_radius")
    towers: dict[str, dict[str, float]] = {}
    for number, letter in enumerate(TOWERS):
        section = f"stepper_{letter}"
        towers[letter] = {
            "angle": settings.number(section, "angle", (210.0, 330.0, 90.0)[number]),
            "arm": settings.number(section, "arm_length", None if number == 0 else towers["a"]["arm"]),
            "endstop": settings.number(section, "position_endstop", None if number == 0 else towers["a"]["endstop"]),
        }
    mechanism = delta_mechanism(radius, towers)
    return KlipperDelta(mechanism, _measured(settings))


def delta_mechanism(radius: float, towers: Mapping[str, Mapping[str, float]], name: str = "Delta printer") -> Mechanism:
    """The machine of Klipper's parameters: rods in pairs from carriages on upright towers to the nozzle.

    Parameters
    ----------
    radius : from the middle to each tower's joints, less the platform's [mm].
    towers : of "a", "b" and "c": "angle" [deg], "arm" and "endstop" [mm].
    """
    dimensions: dict[str, float] = {"radius": radius, "apart": APART}
    joints: list[dict[str, object]] = []
    for letter in TOWERS:
        dimensions |= {f"{what}_{letter}": float(towers[letter][what]) for what in ("angle", "arm", "endstop")}
        joints += _tower(letter)
    table = {
        "schema": 1,
        "name": name,
        "units": {"length": "mm", "angle": "deg"},
        "end_effector": "platform",
        "reference_point": [0, 0, 0],
        "task": ["x", "y", "z"],
        "dimensions": dimensions,
        "joint": joints,
    }
    return read_mechanism(table)


def _tower(letter: str) -> Iterator[dict[str, object]]:
    """A carriage and its two rods, at home with the nozzle at the origin."""
    angle, height = f"angle_{letter}", f"sqrt(arm_{letter}**2 - radius**2)"
    yield {
        "name": f"carriage_{letter}",
        "type": "prismatic",
        "actuated": True,
        "connects": ["base", f"slide_{letter}"],
        "axis": [0, 0, 1],
        "home": f"-endstop_{letter}",
        "range": [f"-endstop_{letter} - arm_{letter}", 0],
    }
    for side, sign in (("l", "-"), ("r", "+")):
        across = [
            f"{'-' if sign == '+' else ''}apart/2*sin({angle})",
            f"{'-' if sign == '-' else ''}apart/2*cos({angle})",
        ]
        yield {
            "name": f"upper_{letter}{side}",
            "type": "spherical",
            "connects": [f"slide_{letter}", f"rod_{letter}{side}"],
            "at": [f"radius*cos({angle}) + ({across[0]})", f"radius*sin({angle}) + ({across[1]})", height],
        }
        yield {
            "name": f"lower_{letter}{side}",
            "type": "spherical",
            "connects": [f"rod_{letter}{side}", "platform"],
            "at": [*across, 0],
        }


def klipper_settings(calibration: Calibration) -> str:
    """The calibrated values as lines for `printer.cfg`, for a machine of `read_klipper`.

    Raises
    ------
    InvalidArgument : a machine with other dimensions.
    """
    dimensions = calibration.mechanism.dimensions
    missing = [name for name in (*EXTENDED, "angle_c") if name not in dimensions]
    if missing:
        raise InvalidArgument("calibration", f"a machine without {', '.join(missing)}", "one of `read_klipper`")
    lines = ["[printer]", f"delta_radius: {dimensions['radius']:.6f}"]
    for letter in TOWERS:
        lines += ["", f"[stepper_{letter}]", f"angle: {dimensions[f'angle_{letter}']:.6f}"]
        lines += [f"arm_length: {dimensions[f'arm_{letter}']:.6f}"]
        lines += [f"position_endstop: {dimensions[f'endstop_{letter}']:.6f}"]
    return "\n".join([*lines, ""])


class _Settings:
    """Sections of a `printer.cfg`; what Klipper saved at its end, behind `#*#`, comes on top."""

    def __init__(self, text: str) -> None:
        saved = "\n".join(line[3:].removeprefix(" ") for line in text.splitlines() if line.startswith("#*#"))
        self._sections = [_parsed(saved), _parsed(text)]

    def text(self, section: str, key: str) -> str | None:
        for parsed in self._sections:
            if parsed.has_option(section, key):
                return parsed.get(section, key).partition("#")[0].strip()
        return None

    def number(self, section: str, key: str, default: float | None = None) -> float:
        said = self.text(section, key)
        if said is None and default is not None:
            return default
        try:
            value = float(said) if said is not None else math.nan
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise InvalidArgument("path", f"'{key}' of [{section}]: {said}", "a number")
        return value

    def numbers(self, section: str, key: str) -> Floats | None:
        """A list of numbers."""
        said = self.text(section, key)
        if said is None:
            return None
        try:
            return np.array([float(part) for part in said.split(",")])
        except ValueError:
            raise InvalidArgument("path", f"'{key}' of [{section}]: {said}", "numbers with commas between") from None

    def steps_per_mm(self, letter: str) -> float:
        """Steps per mm of a tower's stepper; of tower a where it says nothing itself."""
        section = f"stepper_{letter}"
        if self.text(section, "rotation_distance") is None and self.text(section, "step_distance") is None:
            section = "stepper_a"
        if self.text(section, "step_distance") is not None:
            return 1.0 / self.number(section, "step_distance")
        turns = 1.0
        for ratio in (self.text(section, "gear_ratio") or "1:1").split(","):
            over, _, under = ratio.partition(":")
            turns *= float(over) / float(under)
        steps = self.number(section, "full_steps_per_rotation", 200.0) * self.number(section, "microsteps")
        return steps * turns / self.number(section, "rotation_distance")


def _parsed(text: str) -> configparser.RawConfigParser:
    """Sections of a text, leniently: lines that are neither sections nor settings are left out."""
    kept, inside = [], False
    for line in text.splitlines():
        if line.startswith("#*#") or not line.strip() or line.lstrip().startswith(("#", ";")):
            continue
        inside = inside or line.startswith("[")
        if inside and (line.startswith("[") or re.match(r"^[\w ]+\s*[:=]", line) or line[0].isspace()):
            kept.append(line)
    parser = configparser.RawConfigParser(strict=False, delimiters=(":", "="), allow_no_value=True)
    parser.read_string("\n".join(kept))
    return parser


def _measured(settings: _Settings) -> Measurements | None:
    """The measurements that DELTA_CALIBRATE keeps: heights and distances at stepper positions."""
    per_mm = np.array([settings.steps_per_mm(letter) for letter in TOWERS])
    rows: list[Floats] = []
    heights: list[float] = []
    distances: list[tuple[int, int, float]] = []
    section = "delta_calibrate"
    for kind in ("height", "manual_height"):
        for number in range(1000):
            steps = settings.numbers(section, f"{kind}{number}_pos")
            if steps is None:
                break
            rows.append(-steps / per_mm)
            heights.append(settings.number(section, f"{kind}{number}"))
    for number in range(1000):
        ends = [settings.numbers(section, f"distance{number}_pos{end}") for end in (1, 2)]
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
