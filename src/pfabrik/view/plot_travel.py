"""`plot_travel`: how far the end effector can go, and what stops it, as bars."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from ..answers.words import short_names
from ..checks import require_method
from ..drawing import SMALL, new_figure
from ..errors import InvalidArgument
from ..travel import Reach, Travel
from .looks import EDGE, LINK, PLATFORM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HEIGHT = 0.55
"""Height of a row [inches]."""

MOST_FOR_NAMES = 0.8
"""The largest share of a side that names beyond its bars may take."""

LETTERS = 16
"""Approximate length of a line of names."""

BESIDE = 4.0
"""Distance of these lines from the end of a bar [points]."""

STUB = 0.25
"""Length of a bar without end, as a share of the longest one that has one."""

SAME = 1e-9
"""Directions that differ by less, up to their sign, have one row."""


def plot_travel(found: Travel, figure: Figure | None = None) -> dict[str, Axes]:
    """Draw how far the end effector can go along and about each axis, with the limit that stops it at the end.

    Opposite directions share a row. A dashed bar has no end: nothing stops it.

    Parameters
    ----------
    found : what `travel` answered.
    figure : matplotlib figure or subfigure to draw in; default: a new one.

    Returns
    -------
    dict : axes by what they show: "along" [length] and "about" [deg], if there are such directions.

    Raises
    ------
    InvalidArgument : what is no Travel, or one without a direction.
    MissingLibrary : matplotlib is not installed.
    """
    if not isinstance(found, Travel) or not len(found):
        what = type(found).__name__ if not isinstance(found, Travel) else "no direction"
        raise InvalidArgument("found", what, "a Travel, as `travel` returns")
    kinds = {kind: _rows([each for each in found if each.kind == kind]) for kind in ("along", "about")}
    kinds = {kind: rows for kind, rows in kinds.items() if rows}
    if figure is None:
        figure = new_figure(4.4 * len(kinds) + 0.4, 1.6 + HEIGHT * max(map(len, kinds.values())))
    require_method("figure", figure, "subplots", "a matplotlib figure, or None")
    mechanism = found.origin.mechanism
    place = ", ".join(f"{part:.4g}" for part in found.origin.pose[:3, 3])
    figure.suptitle(f"{mechanism.name} from ({place}) {mechanism.length_unit}", fontsize=SMALL + 2.0)
    panels = figure.subplots(1, len(kinds), squeeze=False)[0]
    longest = []
    for axes, (kind, rows) in zip(panels, kinds.items(), strict=True):
        longest.append(_draw(axes, kind, rows, mechanism.length_unit if kind == "along" else "deg"))
    figure.get_figure(root=True).draw_without_rendering()
    for axes, length in zip(panels, longest, strict=True):
        _make_room(axes, length)
    return dict(zip(kinds, panels, strict=True))


def _rows(reaches: Sequence[Reach]) -> list[list[Reach]]:
    """Reaches in rows: one for each direction, with its opposite if that is one of them too."""
    rows: list[list[Reach]] = []
    for reach in reaches:
        for row in rows:
            if len(row) == 1 and np.abs(np.add(row[0].direction, reach.direction)).max() <= SAME:
                row.append(reach)
                break
        else:
            rows.append([reach])
    return rows


def _draw(axes: Axes, kind: str, rows: list[list[Reach]], unit: str) -> float:
    """Draw one panel, a row for each direction, its own side to the right; returns the length of the longest bar."""
    from matplotlib.ticker import MaxNLocator

    ends = [_shown(each, unit) for row in rows for each in row if np.isfinite(each.distance)]
    longest = max(ends, default=0.0) or 1.0
    for height, row in enumerate(rows):
        for reach, side in zip(row, (1.0, -1.0), strict=False):
            _bar(axes, reach, side, height, longest, unit)
    axes.axvline(0.0, color=EDGE, linewidth=0.9)
    left = -longest if any(len(row) > 1 for row in rows) else 0.0
    axes.set(xlim=(left, longest), ylim=(len(rows) - 0.4, -0.6), xlabel=f"{kind} [{unit}]")
    axes.set_yticks(range(len(rows)), [_name(row[0].direction) for row in rows])
    ticks = [tick for tick in MaxNLocator(4).tick_values(left, longest) if left <= tick <= longest]
    axes.set_xticks(ticks, [f"{abs(tick):g}" for tick in ticks])
    axes.tick_params(labelsize=SMALL, left=False)
    axes.xaxis.label.set_fontsize(SMALL + 1.0)
    axes.spines[["top", "right", "left"]].set_visible(False)
    return longest


def _make_room(axes: Axes, longest: float) -> None:
    """Widen a panel until the text beyond the bars is within it."""
    left = axes.get_xlim()[0]
    width = axes.get_window_extent().width
    widest = max(text.get_window_extent().width for text in axes.texts) + BESIDE * axes.figure.dpi / 72.0
    sides = 2.0 if left < 0.0 else 1.0
    share = min(sides * widest / width, MOST_FOR_NAMES)
    axes.set_xlim(left / (1.0 - share), longest / (1.0 - share))


def _bar(axes: Axes, reach: Reach, side: float, height: int, longest: float, unit: str) -> None:
    """Draw one reach as a bar, with the limit that stops it on two lines at its end."""
    is_bounded = np.isfinite(reach.distance)
    length = _shown(reach, unit) if is_bounded else STUB * longest
    colour = PLATFORM if is_bounded else "none"
    axes.barh(
        height, side * length, 0.5, color=colour, edgecolor=EDGE, linewidth=0.8, linestyle="-" if is_bounded else "--"
    )
    lines = [f"{length:.4g}", *_stop(reach)] if is_bounded else ["unlimited"]
    align = "left" if side > 0.0 else "right"
    offset = (BESIDE * side, 0.0)
    style: dict[str, Any] = {"ha": align, "va": "center", "fontsize": SMALL - 1.0, "color": LINK}
    axes.annotate("\n".join(lines), (side * length, height), offset, textcoords="offset points", **style)


def _stop(reach: Reach) -> list[str]:
    """The limits that stop a reach; those beyond the second are counted."""
    if not reach.stopped_by:
        return wrap(reach.why, LETTERS)
    named = short_names(reach.stopped_by[:2])
    n_more = len(reach.stopped_by) - 2
    return wrap(f"{named}; {n_more} more" if n_more > 0 else named, LETTERS)


def _shown(reach: Reach, unit: str) -> float:
    return float(np.degrees(reach.distance)) if unit == "deg" and reach.kind == "about" else reach.distance


def _name(direction: tuple[float, float, float]) -> str:
    """ "x" for an axis of the base, "−x" for its opposite, else the three numbers."""
    for place, name in enumerate("xyz"):
        if abs(abs(direction[place]) - 1.0) <= SAME:
            return name if direction[place] > 0.0 else f"−{name}"
    return f"({', '.join(f'{part:.2g}' for part in direction)})"
