"""Colours and markers of pictures and the viewer: one meaning each, which lightness or shape distinguish too."""

from __future__ import annotations

from ..description.joints import JointType

BASE, PLATFORM, LINK, EDGE = "#c8c8c8", "#79b4d9", "#4d4d4d", "#1a1a1a"
ACTUATED, PASSIVE = "#1a1a1a", "#ffffff"
HELD = "#d55e00"
"""Colour of what is at a limit or not on its target, and of nothing else."""

ASKED, ACHIEVED, SHADE = "#8c8c8c", "#00204d", "#ececec"

LINE_COLOURS = ("#00204d", "#0072b2", "#009e73", "#e69f00", "#cc79a7", "#999999")
"""Colours of lines that differ in their names only; neighbours also differ in dashes."""

MARKERS: dict[JointType, str] = {
    "revolute": "o",
    "prismatic": "s",
    "universal": "D",
    "spherical": "^",
    "cylindrical": "h",
    "fixed": "X",
}


def of_a_body(role: str) -> str:
    """The colour of a body: the base, the platform, or a link between them."""
    return {"base": BASE, "platform": PLATFORM}.get(role, LINK)


def rgb(colour: str) -> tuple[int, int, int]:
    """A colour such as "#d55e00" as three numbers from 0 to 255."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)
