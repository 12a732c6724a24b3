"""Klipper's `printer.cfg`: its sections, and the deltas among its kinematics."""

from __future__ import annotations

import configparser
import math
import os
import re
from collections.abc import Iterator
from difflib import get_close_matches
from glob import glob
from pathlib import Path

from ....errors import InvalidMechanism
from ..texts import text_of
from .deltas import LOOPLESS, TOWERS, Table, deltesian, fault, linear_delta, rotary_delta
from .print_region import PrintRegion

_INCLUDE = re.compile(r"^\[include +([^\]]+)\]", re.MULTILINE)

_MOST_FILES = 100
"""Files that are included, at most."""

_OTHER_WORDS = {
    "diagonal_rod": "arm_length",
    "delta_diagonal_rod": "arm_length",
    "rod_length": "arm_length",
    "radius": "delta_radius",
    "printable_radius": "print_radius",
    "endstop_position": "position_endstop",
    "min_z_position": "minimum_z_position",
}
"""Words of other firmwares, and habits, with Klipper's in their place."""

_LIKE = 0.8
"""Share of letters that a slip has in common with a key; Klipper's own keys are all less like those read here."""


class KlipperSettings:
    """The sections of a `printer.cfg`, with the files that it includes.

    What SAVE_CONFIG wrote at its end, behind `#*#`, holds where the text above does not say it.
    """

    def __init__(self, text: str, folder: Path | None) -> None:
        lines = text.splitlines()
        saved = "\n".join(["", *(line[3:].removeprefix(" ") for line in lines if line.startswith("#*#"))])
        saved = saved[saved.find("\n[") :] if "\n[" in saved else ""
        self._read: dict[str, set[str]] = {}
        self._sections = configparser.RawConfigParser(strict=False, inline_comment_prefixes=(";", "#"))
        above = "\n".join(line for line in lines if not line.startswith("#*#"))
        for part in (saved, _included(above, folder, iter(range(_MOST_FILES)))):
            try:
                self._sections.read_string("\n".join(line.partition("#")[0] for line in part.splitlines()))
            except configparser.Error as error:
                raise fault("file", f"no settings of Klipper: {' '.join(str(error).split())}", "sections") from None

    def text(self, section: str, key: str) -> str | None:
        """The value of a key, or None."""
        self._read.setdefault(section, set()).add(key)
        return self._sections.get(section, key, fallback=None)

    def number(self, section: str, key: str, default: float | None = None, above: float = -math.inf) -> float:
        """A number above a bound."""
        said = self.text(section, key)
        if said is None and default is not None:
            return default
        try:
            value = float(said) if said is not None else math.nan
        except ValueError:
            value = math.nan
        if not (math.isfinite(value) and value > above):
            expected = "a number" if above == -math.inf else f"a number above {above:g}"
            slip = "".join(f", but '{name}'" for name, meant in self._unread(section) if meant == key)
            raise fault(f"[{section}] {key}", f"nothing{slip}" if said is None else repr(said), expected)
        return value

    def of_towers(self, key: str, defaults: tuple[float, ...] = (), above: float = -math.inf) -> list[float]:
        """A number of each stepper; where one says nothing, its default, else what the first says."""
        values: list[float] = []
        for place, letter in enumerate(TOWERS):
            default = defaults[place] if defaults else (values[0] if values else None)
            values.append(self.number(f"stepper_{letter}", key, default, above))
        return values

    @property
    def slips(self) -> tuple[str, ...]:
        """Remarks on keys that nothing has read, though they are much like one that was."""
        return tuple(
            f"[{section}] {name} is not read; did you mean '{meant}'?"
            for section in self._read
            for name, meant in self._unread(section)
        )

    def _unread(self, section: str) -> Iterator[tuple[str, str]]:
        """Keys of a section that nothing has read, each with one that it was probably meant for."""
        read = self._read[section]
        for name in self._sections[section] if self._sections.has_section(section) else ():
            meant = get_close_matches(_OTHER_WORDS.get(name, name), read - {name}, 1, _LIKE)
            if name not in read and meant:
                yield name, meant[0]


def _included(text: str, folder: Path | None, read: Iterator[int]) -> str:
    """A text with the files that it includes in their places, each of which takes one of those that may be read."""

    def content(match: re.Match[str]) -> str:
        pattern = match[1].strip()
        texts = []
        for file in map(Path, sorted(glob(os.path.join(folder or "", pattern)))):
            if next(read, None) is None:
                raise fault("[include]", f"more than {_MOST_FILES} files", "files that do not include themselves")
            try:
                text = text_of(file)
            except InvalidMechanism as error:
                raise fault(f"[include {pattern}]", error.faults[0].found, "settings of Klipper") from None
            texts.append(_included(text, file.parent, read))
        if not texts and not re.search(r"[*?\[]", pattern):
            raise fault(f"[include {pattern}]", "no such file", "settings of Klipper beside this file")
        return "\n".join(texts)

    return _INCLUDE.sub(content, text)


BEGIN = r"^\[(printer|stepper_\w+)\]"
"""Beginning of a line that Klipper's settings have."""


def settings_of(text: str, folder: Path | None) -> KlipperSettings | None:
    """The settings in a text; None if it is another firmware's."""
    return KlipperSettings(text, folder) if re.search(BEGIN, text, re.MULTILINE) else None


def klipper_table(text: str, folder: Path | None) -> Table:
    """The machine of a `printer.cfg`: kinematics delta or deltesian, with the carriages' heights, or rotary_delta."""
    return _machine_of(KlipperSettings(text, folder))


def klipper_region(text: str, folder: Path | None) -> PrintRegion:
    """What a `printer.cfg` says beside the machine."""
    settings = KlipperSettings(text, folder)
    _machine_of(settings)
    radius, lowest = (settings.text("printer", name) for name in ("print_radius", "minimum_z_position"))
    return PrintRegion(
        f"print_radius {radius}" if radius else "",
        settings.number("printer", "minimum_z_position", 0.0),
        "minimum_z_position" if lowest else PrintRegion().floor,
        settings.slips,
    )


def _machine_of(settings: KlipperSettings) -> Table:
    kinematics = settings.text("printer", "kinematics")
    if kinematics == "delta":
        return _delta_of(settings)
    if kinematics == "rotary_delta":
        return _rotary_delta_of(settings)
    if kinematics == "deltesian":
        return _deltesian_of(settings)
    found = "nothing" if kinematics is None else f"'{kinematics}', {LOOPLESS}"
    raise fault("[printer] kinematics", found, "delta, rotary_delta or deltesian")


def _delta_of(settings: KlipperSettings) -> Table:
    """The machine of kinematics delta; see `linear_delta`."""
    radius = settings.number("printer", "delta_radius", above=0.0)
    towers = {
        "angle": settings.of_towers("angle", (210.0, 330.0, 90.0)),
        "arm_length": settings.of_towers("arm_length", above=radius),
        "position_endstop": settings.of_towers("position_endstop"),
    }
    lowest = settings.number("printer", "minimum_z_position", 0.0)
    return linear_delta(radius, towers, lowest)


def _deltesian_of(settings: KlipperSettings) -> Table:
    """The machine of kinematics deltesian; see `deltesian`."""

    def of_sides(key: str, above: float = -math.inf) -> list[float]:
        left = settings.number("stepper_left", key, above=above)
        return [left, settings.number("stepper_right", key, left, above)]

    keys = {"arm_x_length": 0.0, "arm_length": 0.0, "position_endstop": -math.inf}
    lowest = settings.number("printer", "minimum_z_position", 0.0)
    y = settings.number("stepper_y", "position_min", 0.0), settings.number("stepper_y", "position_max")
    if not y[0] < y[1]:
        raise fault("[stepper_y] position_max", f"{y[1]:g}", f"a number above position_min, {y[0]:g}")
    return deltesian({key: of_sides(key, above) for key, above in keys.items()}, lowest, y)


def _rotary_delta_of(settings: KlipperSettings) -> Table:
    radius = settings.number("printer", "shoulder_radius", above=0.0)
    arms = {
        "angle": settings.of_towers("angle", (30.0, 150.0, 270.0)),
        "upper_arm_length": settings.of_towers("upper_arm_length", above=0.0),
        "lower_arm_length": settings.of_towers("lower_arm_length", above=0.0),
        "shoulder_height": [settings.number("printer", "shoulder_height", above=0.0)] * len(TOWERS),
        "position_endstop": settings.of_towers("position_endstop"),
    }
    return rotary_delta(radius, arms)
