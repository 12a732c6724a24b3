"""G-code: straight moves and arcs, absolute and relative, in inches and millimetres; the rest refused by name."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats
from ...common.text_lines import WrongText
from ...machine.files.units import METRES
from .path import MOST_STEPS

WITHOUT_OFFSETS = "positions as the machine has them, without offsets but the first (G54)"
IN_ONE_PROGRAM = "all moves one after the other in one program"
PLAIN_MOVES = "G0 to G3, G17 to G21, G90 or G91"
IN_NUMBERS = "words with numbers, such as X12.5"

OF_PROGRAMS: tuple[tuple[re.Pattern[str], str, str], ...] = (
    (
        re.compile(r"O ?[<\[#\d]\S{0,40} ?(SUB|ENDSUB|CALL|RETURN)\b|O ?<"),
        "a subroutine, or a call of one",
        IN_ONE_PROGRAM,
    ),
    (re.compile(r"O ?[<\[#\d]\S{0,40} ?[A-Z]{2,}"), "a condition or a loop", IN_ONE_PROGRAM),
    (re.compile(r"M ?0*(97|98|198)(?![\d.])|CALL\b|G ?0*(65|66)(?![\d.])"), "a call of a subroutine", IN_ONE_PROGRAM),
    (re.compile(r"M ?0*99(?![\d.])"), "the end of a subroutine, or a jump", IN_ONE_PROGRAM),
    (re.compile(r"M ?0*47(?![\d.])"), "a jump back to the beginning", IN_ONE_PROGRAM),
    (re.compile(r"\b(IF|THEN|ELSE|WHILE|GOTO|END\d*|DO\d+)\b"), "a condition, a loop or a jump", IN_ONE_PROGRAM),
    (re.compile(r"[A-Z]? ?#\S*"), "a variable", IN_NUMBERS),
    (re.compile(r"[A-Z]? ?\[\S*"), "an expression", IN_NUMBERS),
)
"""Patterns of lines that steer a program, what each is, and what is expected in its place."""

LABELS = ("EXCLUDE_OBJECT_DEFINE",)
"""Commands of Klipper whose words are no numbers, and that move nothing: slicers write outlines of parts."""

MAY_STEER = re.compile(r"[O#\[M]|[A-Z]{2}|G ?0*6[56]")
"""Characters that each of these lines has and most others do not."""

SET_OFFSETS = "offsets or tool data that are set"
CODES: dict[str, tuple[str, str]] = {
    **dict.fromkeys(("G5", "G5.1", "G5.2", "G6.2"), ("a spline", PLAIN_MOVES)),
    "G7": ("diameters in place of positions", PLAIN_MOVES),
    "G10": (SET_OFFSETS, WITHOUT_OFFSETS),
    **dict.fromkeys(("G12.1", "G16"), ("polar coordinates", PLAIN_MOVES)),
    **dict.fromkeys(("G28", "G30"), ("a move to a place that the program does not say", PLAIN_MOVES)),
    **dict.fromkeys(("G32", "G33", "G33.1"), ("a thread", PLAIN_MOVES)),
    **dict.fromkeys(("G31", "G38.2", "G38.3", "G38.4", "G38.5"), ("a move until something is touched", PLAIN_MOVES)),
    **dict.fromkeys(("G41", "G41.1", "G42", "G42.1"), ("an offset by the tool's radius", WITHOUT_OFFSETS)),
    **dict.fromkeys(("G43", "G43.1", "G43.2", "G43.4", "G44"), ("an offset by the tool's length", WITHOUT_OFFSETS)),
    **dict.fromkeys(("G50", "G51"), ("a scale of positions", PLAIN_MOVES)),
    "G52": ("a local work offset", WITHOUT_OFFSETS),
    "G53": ("a move past the work offset", WITHOUT_OFFSETS),
    **dict.fromkeys(
        ("G54.1", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3"),
        ("a work offset that the program does not say", WITHOUT_OFFSETS),
    ),
    **dict.fromkeys(("G68", "G68.1", "G68.2"), ("a turned coordinate system", PLAIN_MOVES)),
    **dict.fromkeys([f"G{code}" for code in (73, 74, 76, *range(81, 90))], ("a canned cycle", PLAIN_MOVES)),
    "G90.1": ("centres of arcs in absolute positions", "centres from where arcs begin (G91.1)"),
    **dict.fromkeys(("G92", "G92.1", "G92.2", "G92.3"), ("an offset of all positions", WITHOUT_OFFSETS)),
    "G93": ("feeds as shares of a move", "feeds per minute (G94)"),
    "G95": ("feeds per turn of a spindle", "feeds per minute (G94)"),
    "M72": ("a return to modes that were saved", IN_ONE_PROGRAM),
    **dict.fromkeys(("M206", "M428", "SET_GCODE_OFFSET"), ("an offset of all positions", WITHOUT_OFFSETS)),
    "RESTORE_GCODE_STATE": ("a return to modes that were saved", IN_ONE_PROGRAM),
    "SET_KINEMATIC_POSITION": ("an offset of all positions", WITHOUT_OFFSETS),
}
"""Codes that change the meaning of later words, or where they lead."""


def refuse_steering(plain: str, number: int) -> None:
    """WrongText for a line that steers a program: subroutines, conditions, variables."""
    spaced = " ".join(plain.split())
    if MAY_STEER.search(spaced) is None or spaced.startswith(LABELS):
        return
    for pattern, what, expected in OF_PROGRAMS:
        match = pattern.search(spaced)
        if match:
            raise WrongText(f"line {number}: found {match[0].strip()[:20]}, {what}; expected {expected}")


def refuse_code(code: str, number: int) -> None:
    """WrongText for a code that is not followed."""
    what, expected = CODES.get(code, ("which is not followed here", PLAIN_MOVES))
    raise WrongText(f"line {number}: found {code}, {what}; expected {expected}")


def has_offset(code: str, words: Mapping[str, Sequence[float]], axes: str) -> bool:
    """True if G10 or G92 sets an offset; a printer uses them to retract, or to count filament."""
    places = any(letter in words for letter in axes)
    return places or ("L" in words if code == "G10" else "E" not in words)


WORD = re.compile(r"([A-Z])\s*([+-]?(?:\d+\.?\d*|\.\d+))")
COMMENT = re.compile(r"\([^()]*\)|;.*")
AXES = "XYZABC"
OFFSETS = "IJK"
PLANES = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}
IGNORED = {11, 40, 49, 54, 61, 64, 69, 80, 91.1, 94, 97}
"""Codes that change no position here: no offset of the tool, no turn, the first work offset, feed per minute."""

RETRACTS = (10, 92)
"""Codes of printers that change no position either, unless they are those of other machines: `has_offset`."""

OTHER_AXES = "UVW"

CODE = re.compile(r"(?:N\s*\d+\s*)?M\s*(\d{1,9})(?![\d.])")
"""The beginning of a line whose first code is an M code."""

LEVELLING = (29, 34)
"""Codes of printers that measure the bed or turn it level: they end where they begin."""

MACRO = re.compile(r"(_?[A-Z]{2}[A-Z0-9]*(?:_[A-Z0-9]+)*)((?:\s+\w+=(?:\"[^\"]*\"|'[^']*'|[^\s\"']*))*)\s*")
"""A command by its name, with parameters: `START_PRINT BED=60`."""

MESSAGES = (117, 118)
"""Codes followed by words for people."""

CALLS = (97, 98, 99, 198)
"""Codes that steer a program, and set nothing."""

FARTHEST = 1e9
"""Numbers beyond this are no positions of a machine."""

ROUNDING = 1e-12
"""Share by which a length may exceed a whole number of steps, by rounding of the division."""

OFF_ROUND, DIGITS = 1e-3, 1e-6
"""Shares of an arc's radius by which its ends may differ in theirs, as other readers have it, and by which a radius
may be too short for them: programs are written with some six digits."""

ONE_PLACE = 1e-9
"""Angle of an arc below which its ends coincide, so that it is a full circle [rad]."""


class Move(NamedTuple):
    """A place on the way: x, y, z, and a, b, c [deg]; the feed toward it, as of a `Path`; the line; the time at rest
    before it [s], which is at the same place then."""

    place: Floats
    feed: float
    line: int
    dwell: float = 0.0


@dataclass
class ModalState:
    """Modal state: values that hold until another word changes them.

    Attributes
    ----------
    place : x, y, z [length of the machine], and a, b, c [deg].
    unit : of the program's lengths, in those of the machine.
    has_number : True once the program has given its number.
    passed : levelling and macros so far, with the first line of each.
    feed : as the program gives it, per minute; NaN before it does.
    is_printers : True for a program of a printer, whose dwells count P in ms; others count it in s.
    """

    place: Floats
    unit: float
    motion: int | None = None
    is_relative: bool = False
    plane: int = 17
    feed: float = math.nan
    has_number: bool = False
    is_printers: bool = False
    units: dict[int, float] = field(default_factory=dict)
    passed: dict[str, int] = field(default_factory=dict)


def steps_of(
    lines: Iterable[str],
    home: Floats,
    length_unit: str,
    tolerance: float,
    longest: float,
    passed: dict[str, int] | None = None,
    is_printers: bool = False,
) -> Iterator[Move]:
    """The steps of a program, the first at home.

    Parameters
    ----------
    home : where the program begins, (6,): x, y, z [length], a, b, c [deg].
    length_unit : of the machine; one that is not known counts as millimetres.
    tolerance : how far chords may be off their arc [length].
    longest : of a straight part of a move [length].
    passed : levelling and macros are added, with the first line of each.
    is_printers : the program is a printer's, as one that feeds a filament (E) is anyway.
    """
    unit = METRES.get(length_unit.strip(), METRES["mm"])
    inches, millimetres = METRES["in"] / unit, METRES["mm"] / unit
    state = ModalState(np.array(home, dtype=float), millimetres, units={20: inches, 21: millimetres})
    state.passed, state.is_printers = {} if passed is None else passed, is_printers
    yield Move(state.place.copy(), math.nan, 0)
    for number, text in enumerate(lines, 1):
        words = _words(text, number, state.passed)
        state.is_printers |= "E" in words
        _obey(state, words, number)
        dwell = _dwell(words, state.is_printers, number) if is_dwell(words) else 0.0
        if dwell > 0.0:
            yield Move(state.place.copy(), math.nan, number, dwell)
        moves = any(letter in words for letter in AXES)
        if state.motion is None and moves:
            raise WrongText(f"line {number}: a position without G0, G1, G2 or G3")
        if state.motion is not None and (moves or any(letter in words for letter in OFFSETS + "R")):
            yield from _move(state, words, number, tolerance, longest)
        if any(code in (2, 30) for code in words.get("M", [])):
            return


def _words(text: str, number: int, passed: dict[str, int]) -> dict[str, list[float]]:
    """The words of a line by their letter."""
    plain = COMMENT.sub(" ", text).strip().upper()
    if plain.startswith(("%", "/")) or _is_setting(plain):
        if plain.startswith("M420"):
            passed.setdefault("M420", number)
        return {}
    refuse_steering(plain, number)
    words: dict[str, list[float]] = {}
    unread = WORD.sub(" ", plain).split()
    if unread and _is_macro(plain, number):
        passed.setdefault(plain.split()[0], number)
        return {}
    if unread:
        raise WrongText(f"line {number}: found '{unread[0][:20]}'; expected words such as X12.5")
    for letter, value in WORD.findall(plain):
        if abs(float(value)) > FARTHEST:
            raise WrongText(f"line {number}: found {letter}{value[:20]}; expected a number below {FARTHEST:g}")
        if letter in OTHER_AXES:
            raise WrongText(f"line {number}: found {letter}{value[:20]}; expected axes {', '.join(AXES)}")
        if letter in words and letter in AXES:
            raise WrongText(f"line {number}: found {letter} twice; expected one place")
        words.setdefault(letter, []).append(float(value))
    return words


def _is_macro(plain: str, number: int) -> bool:
    """True for a command by its name, that of a macro: of parts, with parameters, or one that is known."""
    match = MACRO.fullmatch(plain)
    if match is None or not ("_" in match[1] or match[2] or match[1] in ("PAUSE", "RESUME")):
        return False
    if match[1] in CODES:
        refuse_code(match[1], number)
    return True


def _is_setting(plain: str) -> bool:
    """True if all words of a line belong to its M code, as those of printers do: `M205 X8` limits the jerk."""
    begin = CODE.match(plain)
    code = int(begin[1]) if begin else 0
    is_printers = code in (17, 18, 73) or code >= 80  # others may stand beside a motion
    return code in MESSAGES or (is_printers and f"M{code}" not in CODES and code not in CALLS and "G" not in plain)


def _obey(state: ModalState, words: dict[str, list[float]], number: int) -> None:
    """Update the modal state from the words of a line that are no motion."""
    if "O" in words:
        if state.has_number or state.motion is not None:
            raise WrongText(f"line {number}: found O{words['O'][-1]:g}, another program; expected {IN_ONE_PROGRAM}")
        state.has_number = True
    for code in words.get("M", []):
        if f"M{code:g}" in CODES:
            refuse_code(f"M{code:g}", number)
    for code in words.get("G", []):
        if code in (0, 1, 2, 3):
            state.motion = int(code)
        elif code in PLANES:
            state.plane = int(code)
        elif code in state.units:
            state.unit = state.units[int(code)]
        elif code in (90, 91):
            state.is_relative = code == 91
        elif (code == 4 and is_dwell(words)) or (code in RETRACTS and not has_offset(f"G{code:g}", words, AXES)):
            continue
        elif code in LEVELLING:
            state.passed.setdefault(f"G{code:g}", number)
        elif code == 28 and state.motion is None:
            continue  # homing, before anything else
        elif code not in IGNORED:
            refuse_code(f"G{code:g}", number)
    if "F" in words and 4.0 not in words.get("G", []):  # whose F is a time
        state.feed = words["F"][-1]
        if not state.feed > 0.0:
            raise WrongText(f"line {number}: found F{state.feed:g}; expected a feed above zero")


def is_dwell(words: Mapping[str, Sequence[float]]) -> bool:
    """True for G4, which moves no axis."""
    return 4.0 in words.get("G", []) and not any(letter in words for letter in AXES)


def _dwell(words: Mapping[str, Sequence[float]], is_printers: bool, number: int) -> float:
    """Time of G4 [s]: P in ms in the firmwares of printers and in s elsewhere; S and F in s."""
    units = {"S": 1.0, "F": 1.0, "P": 1e-3 if is_printers else 1.0}
    letter = next((letter for letter in units if letter in words), "")
    time = words[letter][-1] * units[letter] if letter else 0.0
    if time < 0.0:
        raise WrongText(f"line {number}: found {letter}{words[letter][-1]:g}; expected a time from zero")
    return time


def _move(
    state: ModalState, words: dict[str, list[float]], number: int, tolerance: float, longest: float
) -> Iterator[Move]:
    end = state.place.copy()
    for place, letter in enumerate(AXES):
        if letter in words:
            value = words[letter][-1] * (state.unit if place < 3 else 1.0)
            end[place] = end[place] + value if state.is_relative else value
    begin, feed = state.place, state.feed * state.unit / 60.0
    if state.motion not in (2, 3) and (end[:3] == begin[:3]).all():
        feed = state.feed / 60.0  # of turning alone, in degrees
    if state.motion in (2, 3):
        places = _arc(state, words, end, number, tolerance, longest)
    else:
        feed = math.inf if state.motion == 0 else feed
        count = _parts(float(np.linalg.norm(end[:3] - begin[:3])), longest, number)
        places = (begin + (end - begin) * (part / count) for part in range(1, count + 1))
    for each in places:
        yield Move(each, feed, number)
    state.place = end


def _parts(length: float, longest: float, number: int) -> int:
    if length / longest > MOST_STEPS:
        raise WrongText(
            f"line {number}: a move of {length:g}, in steps of {longest:g}: too many steps; expected longer ones"
        )
    return max(1, math.ceil(length / longest * (1.0 - ROUNDING)))


def _arc(
    state: ModalState, words: dict[str, list[float]], end: Floats, number: int, tolerance: float, longest: float
) -> Iterator[Floats]:
    """Places on a circle or a helix, clockwise (G2) or not, seen against the plane's normal."""
    if words.get("P", [1.0])[-1] != 1.0:
        raise WrongText(f"line {number}: found P{words['P'][-1]:g}; expected an arc of one turn at most")
    u, v, _ = plane = PLANES[state.plane]
    begin, sense = state.place, -1.0 if state.motion == 2 else 1.0
    chord = end[[u, v]] - begin[[u, v]]
    if "R" in words:
        centre = _centre_of(chord, words["R"][-1] * state.unit, sense, number)
    else:
        offsets = [words.get(OFFSETS[axis], [0.0])[-1] * state.unit for axis in plane[:2]]
        centre = np.array(offsets)
    radius, off = float(np.hypot(*centre)), float(np.hypot(*(chord - centre)))
    if not radius > 0.0 or abs(radius - off) > max(OFF_ROUND * radius, 2.0 * tolerance):
        raise WrongText(f"line {number}: an arc from radius {radius:g} to {off:g}; expected the same")
    start, stop = math.atan2(-centre[1], -centre[0]), math.atan2(*(chord - centre)[::-1])
    turn = (sense * (stop - start)) % (2.0 * math.pi)
    turn = 2.0 * math.pi if turn < ONE_PLACE else turn
    flat = math.pi / 2.0
    if tolerance < radius:  # the cosine of half of it would be 1, rounded, where the tolerance is small
        flat = 4.0 * math.asin(math.sqrt(tolerance) / math.sqrt(2.0 * radius))
    if turn / flat > MOST_STEPS:
        fault = f"an arc of radius {radius:g} in steps that are off by {tolerance:g} at most: too many steps"
        raise WrongText(f"line {number}: {fault}; expected a larger tolerance")
    count = max(_parts(radius * turn, longest, number), math.ceil(turn / flat))
    for part in range(1, count):
        share = part / count
        place = begin + (end - begin) * share
        here = start + sense * turn * share
        around = radius + (off - radius) * share
        place[[u, v]] = begin[[u, v]] + centre + around * np.array([math.cos(here), math.sin(here)])
        yield place
    yield end.copy()


def _centre_of(chord: Floats, radius: float, sense: float, number: int) -> Floats:
    """The centre of an arc given by its radius; a negative one is that of the longer arc."""
    half = float(np.hypot(*chord)) / 2.0
    if half == 0.0 or half > abs(radius) * (1.0 + DIGITS):
        raise WrongText(f"line {number}: found R{radius:g} for ends {2.0 * half:g} apart; expected at least half of it")
    height = math.sqrt(max(radius * radius - half * half, 0.0)) * math.copysign(1.0, radius) * sense
    return chord / 2.0 + height * np.array([-chord[1], chord[0]]) / (2.0 * half)
