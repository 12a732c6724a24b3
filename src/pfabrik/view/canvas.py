"""Axes to draw points of space on, as an eye sees them: with numbers for a plane, else with a triad and a scale bar."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from ..common.arrays import Floats
from ..common.checks import require_method, require_positive
from ..common.drawing import SMALL, Size, new_figure, require_flat, round_length
from ..errors import InvalidArgument
from .eye import Eye
from .looks import Look, dress

if TYPE_CHECKING:
    from matplotlib.artist import Artist

SIDE, LEAST = 4.4, 0.5
"""Longer side of a machine in a new figure [inches], and the least of its shorter side, as a share of it."""

NUMBERS = (0.75, 0.5)
"""Room for numbers and names of axes beside and below a plane [inches]."""

END_ON = 0.02
"""Least width and height that is shown, as a share of the machine: of an arm that is seen end-on, say."""

EDGE_FREE, STRIP_FREE = 9.0, 3.0
"""Distance of what is drawn from the edge of its axes, and from the key above and the bar below it [points]."""

TITLE, TITLE_LINE = SMALL + 2.0, 15.0
"""Size of the letters of a title, and the height of one of its lines [points]."""

"""Width and height of a figure [inches]."""

LEAST_SIZE = (3.0, 2.5)
"""Of a picture with axes and words, which are not legible in less [inches]: a column of a page is wider."""

LETTER = 0.56
"""Width of a letter, as a share of its size: more than the mean, so that what is estimated fits."""

KEY: dict[str, Any] = {
    "loc": "upper center",
    "frameon": False,
    "fontsize": SMALL,
    "handletextpad": 0.4,
    "columnspacing": 1.2,
    "borderaxespad": 0.0,
}
"""Settings of a key in the upper part of axes."""

TRIAD, LETTER_OFF, ON_EDGE = 17.0, 7.0, 0.12
"""Length of the arrows of a triad and distance of its letters from their tips [points]; share of its length below which
an axis is seen on its edge, and is left out."""

BAR, BAR_WIDTH, BAR_OFF = 0.28, 1.6, 3.0
"""Longest scale bar, as a share of what it is a scale of; its width, and the distance of its words [points]."""

ACROSS, UP = 32.0, 18.0
"""Room that each number of a plane's axes has at least: on the level one, and on the upright one [points]."""

SMALL_BAR, SMALLER = 0.1, {"m": ("mm", 1000.0)}
"""Length below which a bar speaks of a smaller unit, and this unit, with how many of it are one of the other."""


@dataclass(frozen=True)
class Canvas:
    """Two-dimensional axes, with the eye that they show points (n, 3) of the base frame to, in a theme's colours.

    Attributes
    ----------
    is_plane : True for a planar machine in its plane, which has numbers at its axes.
    """

    axes: Any
    eye: Eye
    look: Look
    is_plane: bool = False

    def seen(self, points: Floats) -> Floats:
        """Points (..., 3) in the coordinates of the axes, (..., 2)."""
        return self.eye.seen(points)[..., :2]

    def line(self, points: Floats, **style: Any) -> Any:
        """Straight lines from point to point, (n, 3)."""
        return self.axes.plot(*self.seen(np.atleast_2d(points)).T, **style)[0]

    def face(self, points: Floats, **style: Any) -> Any:
        """A filled polygon of corners (n, 3)."""
        from matplotlib.patches import Polygon

        return self.axes.add_patch(Polygon(self.seen(points), joinstyle="round", **style))

    def words(self, place: Floats, text: str, **style: Any) -> Any:
        """A text beside a point (3,), at an offset from it [points]."""
        from matplotlib.patheffects import withStroke

        middle = {"ha": "center", "va": "center", "fontsize": SMALL, "annotation_clip": False}
        around = [withStroke(linewidth=2.0, foreground=self.look.paper)]
        places: dict[str, Any] = {"xytext": (0.0, 0.0), "textcoords": "offset points", "path_effects": around}
        return self.axes.annotate(text, self.seen(place), **(middle | places | style))

    @property
    def points_per_length(self) -> float:
        """The size of a unit of length on the screen [points]."""
        ends = self.axes.transData.transform([(0.0, 0.0), (1.0, 0.0)])
        return float(ends[1, 0] - ends[0, 0]) * 72.0 / float(self.axes.get_figure(root=True).dpi)

    def frame(
        self, points: Floats, unit: str, key: Sequence[Artist] = (), beside: float = 0.0, spans: Any = 0.0
    ) -> None:
        """Show all of points (n, 3) at one scale, between a key above and what tells directions and lengths below.

        Parameters
        ----------
        beside : room for names on the left and right [points].
        spans : width and height that have room at least [length], (2,).
        """
        flat = self.seen(points)
        low, high = flat.min(axis=0), flat.max(axis=0)
        if self.is_plane:  # first, for they take room
            self.axes.set(xlabel=f"{self._direction(0)} [{unit}]", ylabel=f"{self._direction(1)} [{unit}]")
            self.axes.update_datalim([low, high])
            self.axes.autoscale_view()
        above = self._draw_key(key, _size(self.axes)[0])
        triad = self._triad_box
        below = 0.0 if self.is_plane else float(max(triad[3] - triad[1], SMALL + 2.0 * BAR_OFF)) + STRIP_FREE
        least = END_ON * (float(np.ptp(points, axis=0).max()) or 1.0)
        spare = 0.5 * np.maximum(np.maximum(spans, least) - (high - low), 0.0)
        pads = EDGE_FREE + np.array([beside, beside, below, above])
        start, end, point = fit(self.axes, low - spare, high + spare, pads)
        if self.is_plane:
            number_axes(self.axes)
            return
        draw_triad(self.axes, self.eye, self.look, start + (EDGE_FREE - triad[:2]) * point)
        corner = np.array([end[0] - EDGE_FREE * point, start[1] + (EDGE_FREE + SMALL + BAR_OFF) * point])
        draw_scale_bar(self.axes, self.look, corner, float((high - low + 2.0 * spare).max()), unit)

    def _draw_key(self, key: Sequence[Artist], width: float) -> float:
        """Draw a key in as few rows as fit into a width; its height with what is free below it [points]."""
        if not key:
            return 0.0
        point = float(self.axes.get_figure(root=True).dpi) / 72.0
        legend = draw_key(self.axes, width * point, {"handles": key, "labelcolor": self.look.ink, **KEY}, len(key))
        legend.set_zorder(ON_TOP)
        return float(legend.get_window_extent().height) / point + STRIP_FREE

    @property
    def _triad_box(self) -> Floats:
        """Left, bottom, right and top of a triad and its letters, from where it starts [points]."""
        tips = self.seen(np.eye(3))
        lengths = np.linalg.norm(tips, axis=1, keepdims=True)
        letters = (TRIAD + LETTER_OFF / np.maximum(lengths, ON_EDGE)) * tips * (lengths > ON_EDGE)
        half = 0.5 * SMALL
        return np.concatenate(
            [np.minimum(letters.min(axis=0) - half, 0.0), np.maximum(letters.max(axis=0) + half, 0.0)]
        )

    def _direction(self, place: int) -> str:
        """The name of an axis: "x" if it is one of the base frame, else its direction."""
        along = self.eye.axes[place]
        nearest = int(np.argmax(np.abs(along)))
        is_base_axis = np.isclose(along[nearest], 1.0)
        return "xyz"[nearest] if is_base_axis else f"along ({', '.join(f'{part:.3g}' for part in along)})"


ON_TOP = 40.0
"""Order of what is written, above all that is drawn."""


def canvas_on(ax: Any, eye: Eye, look: Look, *, is_plane: bool = False) -> Canvas:
    """A canvas on two-dimensional axes: with their lines and numbers for a plane, without them for what is in space.

    Raises
    ------
    InvalidArgument : no axes, or three-dimensional ones.
    """
    require_method("ax", ax, "tick_params", "matplotlib axes, or None")
    require_flat(ax)
    if is_plane:
        dress(ax, look)
        ax.spines[["top", "right"]].set_visible(False)
        ax.tick_params(labelsize=SMALL)
        for axis in (ax.xaxis, ax.yaxis):
            axis.label.set_size(SMALL + 1.0)
    else:
        ax.set(xticks=[], yticks=[], facecolor=look.paper)
        ax.spines[:].set_visible(False)
    return Canvas(ax, eye, look, is_plane)


def new_canvas(
    points: Floats, eye: Eye, look: Look, *, is_plane: bool, title: str, size: Size | None, beside: float
) -> Canvas:
    """A canvas in a new figure, which takes the shape of points (n, 3) where it is given no size.

    Parameters
    ----------
    size : of the whole figure [inches].
    beside : room for names on the left and right [points].

    Raises
    ------
    InvalidArgument : a size that is not two positive numbers.
    MissingLibrary : matplotlib is not installed.
    """
    width, height = usual_size(points, eye, is_plane=is_plane) if size is None else checked_size(size, (0.0, 0.0))
    if size is None:
        width += 2.0 * beside / 72.0
    figure = new_figure(width, height, look.paper, layout="constrained" if is_plane else None)
    title = wrapped(title, width)
    if is_plane:
        axes = figure.add_subplot()
    else:
        high = TITLE_LINE * (title.count("\n") + 1) / 72.0
        if size is None:
            figure.set_size_inches(width, height := height + high)
        axes = figure.add_axes((0.0, 0.0, 1.0, max(1.0 - high / height, 0.1)))
    axes.set_title(title, fontsize=TITLE, color=look.ink, pad=1.0)
    return canvas_on(axes, eye, look, is_plane=is_plane)


def usual_size(points: Floats, eye: Eye, *, is_plane: bool) -> Size:
    """Width and height of a figure in the shape of points (n, 3), with room for a key and a scale [inches]."""
    spans = np.ptp(eye.seen(points)[:, :2], axis=0)
    shape = np.maximum(spans / (float(spans.max()) or 1.0), LEAST) * SIDE
    width, height = (shape + (NUMBERS if is_plane else (0.0, 2.0 * STRIP / 72.0))).tolist()
    return width, height


def fit(axes: Any, low: Floats, high: Floats, pads: Any) -> tuple[Floats, Floats, float]:
    """Set the ends of axes, at one scale, so that a box (2,) is in the middle: both ends, and the size of a point.

    Parameters
    ----------
    pads : room to the left, to the right, below and above [points], (4,).
    """
    size, (left, right, below, above) = _size(axes), pads
    free = np.maximum(size - [left + right, below + above], 0.1 * size)
    point = float(np.max((high - low) / free)) or 1.0
    first = 0.5 * (low + high) - 0.5 * point * (size + [left - right, below - above])
    last = first + point * size
    axes.set(xlim=(first[0], last[0]), ylim=(first[1], last[1]), aspect="equal")
    return first, last, point


def draw_key(axes: Any, width: float, key: dict[str, Any], columns: int) -> Any:
    """A key in at most so many columns, and in as few rows as fit into a width [pixels]."""
    while True:
        legend = axes.legend(ncols=columns, **key)
        if columns == 1 or legend.get_window_extent().width <= width:
            return legend
        columns -= 1


def draw_title(axes: Any, title: str, look: Look) -> None:
    """Write a title above axes that are as wide as their figure, in as many lines as it needs."""
    width = axes.figure.bbox.width / axes.figure.dpi
    axes.set_title(wrapped(title, width, SMALL + 1), fontsize=SMALL + 1, color=look.ink)


def wrapped(title: str, width: float, letters: float = TITLE) -> str:
    """A title in as many lines as its letters [points] need in a width [inches]."""
    return "\n".join(wrap(title, letters_in(width, letters)))


def letters_in(width: float, size: float) -> int:
    """The number of letters of a size [points] that fit into a width [inches]."""
    return max(int(width * 72.0 / (LETTER * size)), 4)


STRIP = 30.0
"""Room above and below a machine in a new figure, for its key and its scale [points]."""


def checked_size(size: Any, least: Size = LEAST_SIZE) -> Size:
    """Width and height of a figure [inches]; InvalidArgument for what is not two positive numbers, or too small."""
    try:
        width, height = size
    except (TypeError, ValueError):
        raise InvalidArgument("size", repr(size), "two numbers: width and height in inches") from None
    width, height = require_positive("size", width), require_positive("size", height)
    if width < least[0] or height < least[1]:
        raise InvalidArgument("size", f"{width:g} x {height:g} inches", f"{least[0]:g} x {least[1]:g} at least")
    return width, height


def _size(axes: Any) -> Floats:
    """Width and height of axes as they are laid out [points]."""
    root = axes.get_figure(root=True)
    if root.get_layout_engine() is not None:
        root.draw_without_rendering()
    box = axes.get_window_extent()
    return np.array([box.width, box.height]) * 72.0 / float(root.dpi)


def number_axes(axes: Any) -> None:
    """Round numbers at axes that are laid out, no more than have room."""
    from matplotlib.ticker import MaxNLocator

    for axis, length, room in zip((axes.xaxis, axes.yaxis), _size(axes), (ACROSS, UP), strict=True):
        axis.set_major_locator(MaxNLocator(int(np.clip(length / room, 1, 9)), steps=[1, 2, 2.5, 5, 10]))


def draw_triad(axes: Any, eye: Eye, look: Look, at: Floats, names: Sequence[str] = "xyz") -> None:
    """Draw the directions of the coordinates as arrows from a place (2,) of the axes, of one length in space."""
    corner: dict[str, Any] = {"xy": at, "textcoords": "offset points", "annotation_clip": False}
    arrow = {"arrowstyle": "<-", "color": look.soft, "linewidth": 0.9, "shrinkA": 0.0, "shrinkB": 0.0}
    letters: dict[str, Any] = {"color": look.soft, "fontsize": SMALL, "ha": "center", "va": "center"}
    for tip, name in zip(eye.seen(np.eye(3))[:, :2], names, strict=True):
        length = float(np.linalg.norm(tip))
        if length > ON_EDGE:
            axes.annotate("", xytext=TRIAD * tip, arrowprops=arrow, **corner)
            axes.annotate(name, xytext=(TRIAD + LETTER_OFF / length) * tip, **letters, **corner)


def draw_scale_bar(axes: Any, look: Look, at: Floats, span: float, unit: str) -> None:
    """Draw a bar of 1, 2 or 5 times a power of ten [length] that ends at a place (2,) of the axes.

    Parameters
    ----------
    span : extent of what is drawn; the bar is at most a little more than a quarter of it [length].
    """
    length = round_length(BAR * span)
    named, many = SMALLER[unit] if unit in SMALLER and length < SMALL_BAR else (unit, 1.0)
    places = np.array([at - [length, 0.0], at])
    axes.plot(*places.T, color=look.ink, linewidth=BAR_WIDTH, solid_capstyle="butt", clip_on=False)
    words: dict[str, Any] = {"color": look.ink, "fontsize": SMALL, "ha": "center", "va": "top"}
    below: dict[str, Any] = {"xytext": (0.0, -BAR_OFF), "textcoords": "offset points", "annotation_clip": False}
    axes.annotate(f"{length * many:g} {named}", places.mean(axis=0), **below, **words)
