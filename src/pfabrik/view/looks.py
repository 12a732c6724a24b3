"""Colours and markers of pictures and the viewer: one meaning each, which lightness or shape distinguish too."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..common.checks import require_choice
from ..common.drawing import ACHIEVED, SHADE, Theme
from ..machine.description.joints import JointType

EDGE = "#1a1a1a"
HELD = "#d55e00"
"""Colour of what is at a limit or not on its target, and of nothing else."""

SINGULAR = "#aa3377"
"""Colour of singularities, and of nothing else."""

ASKED = "#8c8c8c"

MARKERS: dict[JointType, str] = {
    "revolute": "o",
    "prismatic": "s",
    "universal": "D",
    "spherical": "^",
    "cylindrical": "h",
    "fixed": "X",
}


@dataclass(frozen=True)
class Look:
    """The colours of a picture on a ground.

    Attributes
    ----------
    ink : lines and letters.
    paper : the ground, halos, and joints that are not driven.
    soft : what is said beside: axes, ticks, the triad.
    faint : grids, and bands behind lines.
    within : what is within reach, in a plane.
    faces, edges : the filling and the border of bodies, by role.
    asked, achieved : targets, and what was reached of them.
    lines : colours of lines that differ in their names only; neighbours also differ in dashes.
    """

    ink: str
    paper: str
    soft: str
    faint: str
    within: str
    faces: dict[str, str]
    edges: dict[str, str]
    asked: str
    achieved: str
    lines: tuple[str, ...]


LINES = ("#0072b2", "#009e73", "#e69f00", "#cc79a7", "#999999")

LOOKS: dict[str, Look] = {
    "light": Look(
        ink=EDGE,
        paper="#ffffff",
        soft="#5a5a5a",
        faint=SHADE,
        within="#eef3f7",
        faces={"base": "#ececec", "platform": "#9cc7e3", "link": "#e4e0d8"},
        edges={"base": "#8a8a8a", "platform": "#2b6c99", "link": "#3a3a3a"},
        asked=ASKED,
        achieved=ACHIEVED,
        lines=(ACHIEVED, *LINES),
    ),
    "dark": Look(
        ink="#e8e8e8",
        paper="#14161a",
        soft="#a8a8a8",
        faint="#2a2e34",
        within="#23303a",
        faces={"base": "#2a2e34", "platform": "#2f6f9c", "link": "#4c4a45"},
        edges={"base": "#7d8288", "platform": "#9cc7e3", "link": "#c9c5bc"},
        asked="#9a9a9a",
        achieved="#9fc4ff",
        lines=("#e8e8e8", "#56b4e9", *LINES[1:]),
    ),
}
"""Every colour that pictures are drawn in, for light and for dark ground."""


def look_of(theme: Theme) -> Look:
    """The colours of a theme; InvalidArgument where there is none of that name."""
    require_choice("theme", theme, LOOKS)
    return LOOKS[theme]


def dress(axes: Any, look: Look) -> None:
    """Draw the lines, ticks and names of two-dimensional axes in a theme's colours, on its ground."""
    axes.set_facecolor(look.paper)
    axes.tick_params(colors=look.ink)
    axes.spines[:].set_color(look.ink)
    for text in (axes.title, axes.xaxis.label, axes.yaxis.label):
        text.set_color(look.ink)


def rgb(colour: str) -> tuple[int, int, int]:
    """A colour such as "#d55e00" as three numbers from 0 to 255."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)
