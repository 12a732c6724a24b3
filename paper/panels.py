"""What the pictures of the experiments share: one colour, one meaning; dashes and lightness tell lines apart too."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D

from pfabrik import Solution, Status

from .arrays import Floats, Mask

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

ASKED, ACHIEVED, SHADE = "#8c8c8c", "#00204d", "#ececec"
HELD = "#d55e00"
"""What a limit holds back, or what is not as it was asked for."""

LINE_COLOURS = ("#00204d", "#0072b2", "#009e73", "#e69f00", "#cc79a7", "#999999")
DASHES = ("-", (0, (6, 2)), (0, (1.5, 1.5)))
LIMIT_DASHES = (0, (8, 3, 1, 3))
SMALL = 9.0

HELD_BY = 1e-4
"""Share of what is shown within which a value is at its limit."""

ROOM = 0.14
"""Room above and below a range, as a share of it: for the names of limits."""


def line_style(place: int) -> dict[str, Any]:
    """Colour and dashes of the line at a place."""
    return {"color": LINE_COLOURS[place % len(LINE_COLOURS)], "linestyle": DASHES[place % len(DASHES)]}


def shade_steps(axes: Axes, marked: Mask) -> None:
    """A grey band behind every run of marked steps."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(int)))
    for start, stop in edges.reshape(-1, 2):
        axes.axvspan(start - 0.5, stop - 0.5, color=SHADE, linewidth=0, zorder=0)


def draw_joint(axes: Axes, solution: Solution, name: str) -> None:
    """The coordinate of a joint over the steps, its limits named at the axis, and where it is held by one."""
    mechanism = solution.mechanism
    coordinate = next(each for each in mechanism.coordinates if each.name == name)
    is_angle = coordinate.kind == "angle"
    values, limits = np.asarray(solution.joints[name]), np.asarray(coordinate.limits)
    if is_angle:
        values, limits = np.degrees(values), np.degrees(limits)
    shade_steps(axes, np.asarray(solution.status) != Status.REACHED)
    axes.plot(values, color=ACHIEVED, linewidth=1.5)
    draw_limits(axes, values, limits)
    axes.set_xlim(0, max(len(solution) - 1, 1))
    unit = "deg" if is_angle else mechanism.length_unit
    axes.set_ylabel(f"{name}\n[{unit}]", rotation=0, ha="right", va="center", fontsize=SMALL)


def draw_limits(axes: Axes, values: Floats, limits: Floats) -> None:
    """Limits as lines that are named at the axis; orange where the values are at one."""
    bounds = limits[np.isfinite(limits)]
    shown = np.concatenate([values, bounds])
    low, high = shown.min(), shown.max()
    for bound in bounds:
        axes.axhline(bound, color="black", linewidth=0.9, linestyle=LIMIT_DASHES, zorder=1)
        at = np.abs(values - bound) <= HELD_BY * (high - low)
        axes.plot(np.where(at, values, np.nan), color=HELD, linewidth=3.0, solid_capstyle="butt")
    room = ROOM * (high - low) or 1.0
    axes.set_ylim(low - room, high + room)
    named = [(bound, f"{word} {bound:.4g}") for bound, word in zip(limits, ("min", "max"), strict=True)]
    named = [(bound, text) for bound, text in named if np.isfinite(bound)] or [(v, f"{v:.4g}") for v in (low, high)]
    axes.set_yticks([bound for bound, _ in named], [text for _, text in named], fontsize=SMALL)


def common_keys() -> list[Artist]:
    """What the legend explains once for all panels."""
    return [
        Line2D([], [], color="black", linewidth=1, linestyle=LIMIT_DASHES, label="limit"),
        Line2D([], [], color=HELD, linewidth=3, label="at a limit"),
        Line2D([], [], color=SHADE, linewidth=7, label="target out of reach"),
    ]
