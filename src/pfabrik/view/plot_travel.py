"""`plot_travel`: how far the end effector can go, and what stops it, as bars."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from ..answers.words import short_names
from ..common.checks import require_method
from ..common.drawing import SMALL, Theme, new_figure, round_length
from ..errors import InvalidArgument
from ..travel import Reach, Travel
from .canvas import LEAST_SIZE, TITLE, checked_size, wrapped
from .looks import Look, dress, look_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HEIGHT, THICK = 0.55, 0.42
"""Height of a row [inches]; thickness of a bar, as a share of it."""

NARROW, SPARSE = 3.6, 0.42
"""Width for each panel below which they stand one below the other, and height of a row below which its bars name one
limit each [inches]."""

ROUND_PANEL, LEAST_HEIGHT = 0.5, 0.28
"""Height of what is around a panel, and the least height of a row [inches]."""

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


def plot_travel(
    found: Travel, figure: Figure | None = None, *, size: tuple[float, float] | None = None, theme: Theme = "light"
) -> dict[str, Axes]:
    """Draw how far the end effector can go along and about each axis, with the limit that stops it at the end.

    Opposite directions share a row. A dashed bar has no end: nothing stops it.

    Parameters
    ----------
    found : Travel
        What `travel` answered.
    figure : Figure, optional
        Matplotlib figure or subfigure to draw in; default: a new one.
    size : (float, float), optional
        Width and height of a new figure [inches].
    theme : {"light", "dark"}, optional
        As in `plot`.

    Returns
    -------
    dict of str to Axes
        Axes by what they show: "along" [length] and "about" [deg], if there are such directions.

    Raises
    ------
    InvalidArgument
        What is no Travel, or one without a direction; no such size or theme.
    MissingLibrary
        Matplotlib is not installed.
    """
    if not isinstance(found, Travel) or not len(found):
        what = type(found).__name__ if not isinstance(found, Travel) else "no direction"
        raise InvalidArgument("found", what, "a Travel, as `travel` returns")
    kinds = {kind: _rows([each for each in found if each.kind == kind]) for kind in ("along", "about")}
    kinds = {kind: rows for kind, rows in kinds.items() if rows}
    look = look_of(theme)
    if figure is None:
        usual = (4.4 * len(kinds) + 0.4, 1.6 + HEIGHT * max(map(len, kinds.values())))
        n_rows = sum(map(len, kinds.values()))
        least = (LEAST_SIZE[0], max(LEAST_SIZE[1], ROUND_PANEL * len(kinds) + LEAST_HEIGHT * n_rows))
        figure = new_figure(*(checked_size(size, least) if size else usual))
    require_method("figure", figure, "subplots", "a matplotlib figure, or None")
    figure.set_facecolor(look.paper)
    mechanism = found.origin.mechanism
    place = ", ".join(f"{part:.4g}" for part in found.origin.pose[:3, 3])
    title = f"Travel of {mechanism.name} from ({place}) {mechanism.length_unit}"
    width, height = figure.bbox.width / figure.dpi, figure.bbox.height / figure.dpi
    is_narrow = width < NARROW * len(kinds)
    letters = SMALL if is_narrow else TITLE
    figure.suptitle(wrapped(title, width, letters), fontsize=letters, color=look.ink)
    if is_narrow:
        shares = [len(rows) for rows in kinds.values()]
        panels = figure.subplots(len(kinds), 1, squeeze=False, height_ratios=shares)[:, 0]
        per_row = (height - ROUND_PANEL * len(kinds)) / sum(shares)
    else:
        panels = figure.subplots(1, len(kinds), squeeze=False)[0]
        per_row = (height - ROUND_PANEL) / max(map(len, kinds.values()))
    terse = is_narrow or per_row < SPARSE
    longest = []
    for axes, (kind, rows) in zip(panels, kinds.items(), strict=True):
        dress(axes, look)
        longest.append(_draw(axes, kind, [[_bar_of(found, reach) for reach in row] for row in rows], look, terse))
    figure.get_figure(root=True).draw_without_rendering()
    share = max(_names_share(axes) for axes in panels)  # of all panels the same, so that their longest bars are alike
    for axes, length in zip(panels, longest, strict=True):
        _make_room(axes, length, share)
    return dict(zip(kinds, panels, strict=True))


@dataclass(frozen=True)
class Bar:
    """A reach as it is drawn: as long as its table says [length or deg], inf without an end, and what stops it."""

    reach: Reach
    length: float
    unit: str


def _bar_of(found: Travel, reach: Reach) -> Bar:
    words, unit = found._distance(reach)
    return Bar(reach, float(words) if np.isfinite(reach.distance) else np.inf, unit)


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


def _draw(axes: Axes, kind: str, rows: list[list[Bar]], look: Look, terse: bool) -> float:
    """Draw one panel, a row for each direction, its own side to the right; returns the length of the longest bar."""
    longest = max((bar.length for row in rows for bar in row if np.isfinite(bar.length)), default=0.0) or 1.0
    for height, row in enumerate(rows):
        for bar, side in zip(row, (1.0, -1.0), strict=False):
            _draw_bar(axes, bar, side, height, longest, look, terse)
    axes.axvline(0.0, color=look.ink, linewidth=0.9)
    left = -longest if any(len(row) > 1 for row in rows) else 0.0
    axes.set(xlim=(left, longest), ylim=(len(rows) - 0.4, -0.6), xlabel=f"{kind} [{rows[0][0].unit}]")
    axes.set_yticks(range(len(rows)), [_name(row[0].reach.direction) for row in rows])
    step = round_length(longest) / (1.0 if longest >= 2.0 * round_length(longest) else 2.0)
    step *= 2.0 if terse else 1.0
    ticks = np.arange(np.ceil(left / step), np.floor(longest / step) + 1.0) * step
    axes.set_xticks(ticks.tolist(), [f"{abs(tick):g}" for tick in ticks.tolist()])
    axes.grid(axis="x", color=look.faint, linewidth=0.8)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=SMALL, left=False)
    axes.xaxis.label.set_fontsize(SMALL + 1.0)
    axes.spines[["top", "right", "left"]].set_visible(False)
    return longest


def _names_share(axes: Axes) -> float:
    """The share of a panel that the text beyond its bars takes."""
    width = axes.get_window_extent().width
    widest = max(text.get_window_extent().width for text in axes.texts) + BESIDE * axes.figure.dpi / 72.0
    sides = 2.0 if axes.get_xlim()[0] < 0.0 else 1.0
    return float(min(sides * widest / width, MOST_FOR_NAMES))


def _make_room(axes: Axes, longest: float, share: float) -> None:
    """Widen a panel until the text beyond the bars is within it."""
    axes.set_xlim(axes.get_xlim()[0] / (1.0 - share), longest / (1.0 - share))


def _draw_bar(axes: Axes, bar: Bar, side: float, height: int, longest: float, look: Look, terse: bool) -> None:
    """Draw one reach as a bar, with the limits that stop it at its end: two of them, or one if terse."""
    is_bounded = np.isfinite(bar.length)
    length = side * (bar.length if is_bounded else STUB * longest)
    fill, edge = look.faces["platform"] if is_bounded else "none", look.edges["platform"]
    axes.barh(height, length, THICK, color=fill, edgecolor=edge, linewidth=1.0, linestyle="-" if is_bounded else "--")
    lines = [f"{bar.length:.4g}", *_stop(bar.reach, 1 if terse else 2)] if is_bounded else ["unlimited"]
    beside: dict[str, Any] = {"textcoords": "offset points", "ha": "left" if side > 0.0 else "right", "va": "center"}
    letters: dict[str, Any] = {"fontsize": SMALL - 1.0, "color": look.ink, "linespacing": 1.1}
    axes.annotate("\n".join(lines), (length, height), (BESIDE * side, 0.0), **beside, **letters)


def _stop(reach: Reach, most: int) -> list[str]:
    """The limits that stop a reach; those beyond the first few are counted."""
    if not reach.stopped_by:
        return wrap(reach.why, LETTERS)
    named = short_names(reach.stopped_by[:most])
    n_more = len(reach.stopped_by) - most
    if most == 1:  # on one line, whatever its length
        return [f"{named} +{n_more}" if n_more > 0 else named]
    return wrap(f"{named}; {n_more} more" if n_more > 0 else named, LETTERS)


def _name(direction: tuple[float, float, float]) -> str:
    """ "x" for an axis of the base, "−x" for its opposite, else the three numbers."""
    for place, name in enumerate("xyz"):
        if abs(abs(direction[place]) - 1.0) <= SAME:
            return name if direction[place] > 0.0 else f"−{name}"
    return f"({', '.join(f'{part:.2g}' for part in direction)})"
