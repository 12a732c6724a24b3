"""Constructs of G-code that are not followed here; each is refused by its name."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from ..text_lines import WrongText

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

OFFSETS = "offsets or tool data that are set"
CODES: dict[str, tuple[str, str]] = {
    **dict.fromkeys(("G5", "G5.1", "G5.2", "G6.2"), ("a spline", PLAIN_MOVES)),
    "G7": ("diameters in place of positions", PLAIN_MOVES),
    "G10": (OFFSETS, WITHOUT_OFFSETS),
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
