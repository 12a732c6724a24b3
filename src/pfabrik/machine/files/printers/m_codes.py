"""Deltas by M665, M666 and M669: RepRapFirmware's `config.g`, and what Marlin answers to M503."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from ..texts import text_of
from .deltas import LOOPLESS, Table, fault, linear_delta, rotary_delta
from .marlin import ANGLES, marlin_delta
from .print_region import PrintRegion

_CODE = re.compile(r"(?:echo:)?\s*(?:N\d+\s*)?M(\d+)\b(.*)", re.IGNORECASE)
_WORD = re.compile(r"([A-Z])\s*([-+.\d:]+)?")

_OVERRIDE = "config-override.g"
"""Beside `config.g`, what M500 has saved, read by M501."""

ROTARY_ANGLES = (-150.0, -30.0, 90.0)
"""Angles of RepRapFirmware's rotary arms [deg], to which corrections are added."""

_LINEAR, _ROTARY = 3, 10

_LINEAR_DEFAULTS = {"L": [215.0], "R": [105.6], "H": [240.0]}
_ROTARY_DEFAULTS = {"U": [100.0], "L": [200.0], "R": [50.0], "H": [250.0], "A": [-45.0, 45.0]}
"""RepRapFirmware's own values, where a file says nothing."""

Words = dict[str, list[float]]


def m_codes_table(text: str, folder: Path | None) -> Table:
    """The machine of a file with M665, M666 and M669; of Marlin's, if M665 has words that are Marlin's alone."""
    codes = list(_codes(text, folder))
    return _marlin(codes) if _is_marlin(codes) else _reprap(codes)


def m_codes_region(text: str, folder: Path | None) -> PrintRegion:
    """What such a file says beside the machine; of Marlin's, B is no radius."""
    codes = list(_codes(text, folder))
    radii = [words["B"][0] for code, words in codes if code in (665, 669) and "B" in words and not _is_marlin(codes)]
    return PrintRegion(f"B{radii[-1]:g}" if radii else "")


def _is_marlin(codes: list[tuple[int, Words]]) -> bool:
    return any(code == 665 and words.keys() & set("SAC") for code, words in codes)


def _codes(text: str, folder: Path | None) -> Iterator[tuple[int, Words]]:
    override = (folder or Path()) / _OVERRIDE
    if re.search(r"^\s*M501\b", text, re.MULTILINE) and folder is not None and override.is_file():
        text = f"{text}\n{text_of(override)}"
    for number, line in enumerate(text.splitlines(), 1):
        match = _CODE.match(line.partition(";")[0].strip())
        if match is None or int(match[1]) not in (665, 666, 669, 851):
            continue
        words: Words = {}
        rest = match[2].upper()
        for letter, value in _WORD.findall(rest):
            try:
                words[letter] = [float(part) for part in value.split(":")]
            except ValueError:
                words[letter] = []
        if _WORD.sub("", rest).strip() or [] in words.values():
            raise fault(f"line {number}", line.strip()[:60], "numbers, such as L250.1")
        yield int(match[1]), words


def _marlin(codes: list[tuple[int, Words]]) -> Table:
    said: dict[int, Words] = {665: {}, 666: {}, 851: {}}
    for code, words in codes:
        said.setdefault(code, {}).update(words)

    def three(code: int, letters: str) -> list[float]:
        return [said[code].get(letter, [0.0])[0] for letter in letters]

    missing = [letter for letter in "LRH" if letter not in said[665]]
    if missing:
        raise fault("M665", f"no {', '.join(missing)}", "L, R and H: rod, radius and height")
    rod, radius, height = three(665, "LRH")
    trims = {"angle_trims": three(665, "XYZ"), "rod_trims": three(665, "ABC")}
    return marlin_delta(rod, radius, height - three(851, "Z")[0], adjustments=three(666, "XYZ"), **trims)


def _reprap(codes: list[tuple[int, Words]]) -> Table:
    kind: int | None = None
    said: Words = {}
    adjusted: Words = {}
    for code, words in codes:
        becomes = int(words["K"][0]) if code == 669 and "K" in words else kind
        becomes = _LINEAR if code == 665 and "L" in words else becomes
        if becomes != kind:
            kind, said, adjusted = becomes, {}, {}
        if code == 666:
            adjusted |= words
        elif (code, kind) in ((665, _LINEAR), (669, _ROTARY)):
            said |= words
    if kind not in (_LINEAR, _ROTARY):
        found = "no M665 with L, and no M669 with K" if kind is None else f"K{kind}, {LOOPLESS}"
        raise fault("M669", found, "M665 of a linear delta, or M669 K10 of a rotary one")
    corrections, adjustments = ([given.get(axis, [0.0])[0] for axis in "XYZ"] for given in (said, adjusted))
    nominal = ROTARY_ANGLES if kind == _ROTARY else ANGLES
    angles = [angle + correction for angle, correction in zip(nominal, corrections, strict=True)]
    if kind == _ROTARY:
        return _rotary(_ROTARY_DEFAULTS | said, angles, adjustments)
    said = _LINEAR_DEFAULTS | said
    tilts = [f"{axis}{adjusted[axis][0]:g}" for axis in "AB" if adjusted.get(axis, [0.0])[0] != 0.0]
    if tilts:
        raise fault("M666", f"{' '.join(tilts)}, which shears z", "A0 B0: a bed's tilt is no part of a machine")
    ends = [said["H"][0] + adjustment for adjustment in adjustments]
    towers = {"angle": angles, "arm_length": _three("M665 L", said["L"]), "position_endstop": ends}
    return linear_delta(said["R"][0], towers)


def _rotary(said: Words, angles: list[float], adjustments: list[float]) -> Table:
    upper, lower, heights = (_three(f"M669 {letter}", said[letter]) for letter in "ULH")
    if len(said["A"]) != 2 or said["A"][0] >= said["A"][1]:
        raise fault("M669 A", ":".join(map(str, said["A"])), "the least and the largest angle, such as A-45:45")
    arms = {"angle": angles, "upper_arm_length": upper, "lower_arm_length": lower, "shoulder_height": heights}
    ends = {"lowest": said["A"][:1] * 3, "highest": [said["A"][1] + adjustment for adjustment in adjustments]}
    return rotary_delta(said["R"][0], arms | ends)


def _three(place: str, values: list[float]) -> list[float]:
    if len(values) not in (1, 3):
        raise fault(place, f"{len(values)} numbers", "one number, or one for each of three towers")
    return values * 3 if len(values) == 1 else values
