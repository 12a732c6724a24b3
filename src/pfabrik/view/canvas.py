"""Axes to draw points of space on: three-dimensional, or two-dimensional for a planar machine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import Floats
from ..checks import require_method
from ..drawing import (
    NAME_STEP,
    SMALL,
    axes_of,
    hidden_names,
    is_spatial,
    new_figure,
    numbers_at,
    part_ticks,
    require_spatial,
    viewpoint,
)
from .eye import Eye
from .looks import Look

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARGIN = 1.1
"""Extent of the axes, as a multiple of the drawing's."""

THINNEST = 0.3
"""The least that the axes of a flat machine in space span across it, as a share of its largest extent."""

TICKS, ROOM_ACROSS, ROOM_UP = 6, 24.0, 18.0
"""Ticks of an axis at most, and the room each needs on an axis of any direction, and on an upright one [points]."""

OFF_CORNERS = 0.06
"""Distance of ticks from the corners of a box, where those of two axes would meet, as a share of its side."""

TICKS_OFF, TICKS_OFF_THIN = 2.0, 12.0
"""Distance of the numbers at ticks beyond matplotlib's own, in a cube, and what it grows to where the box is thin."""

ZOOMS = (1.1, 1.05, 1.0, 0.95, 0.9, 0.85, 0.8, 0.75, 0.7)
"""Sizes of a box in space, tried until all that belongs to it is within the figure."""

MOST_ADJUSTMENTS = 30
"""Largest number of adjustments of a picture in space."""

FREE_EDGE = 2.0
"""Least distance of all that belongs to a box from the edge of the figure [points]."""

LABEL_OFF = 4.0
"""Distance of the names of axes in space from their ticks, beyond matplotlib's own [points]."""

SPATIAL = (0.0, 0.0, 1.0, 0.9)
"""Place of axes in space in a figure: left, bottom, width, height."""

PANE, GRID = (1.0, 1.0, 1.0, 0.0), "#d9d9d9"


@dataclass(frozen=True)
class Canvas:
    """Axes, with the map of points (n, 3) of the base frame to their coordinates.

    Attributes
    ----------
    plane : the directions to the right and up, (2, 3), of two-dimensional axes; None for three-dimensional ones.
    """

    axes: Any
    plane: Floats | None

    def seen(self, points: Floats) -> Floats:
        """Points (..., 3) in the coordinates of the axes, (..., 2 or 3)."""
        return points if self.plane is None else points @ self.plane.T

    def line(self, points: Floats, **style: Any) -> Any:
        """Straight lines from point to point, (n, 3)."""
        return self.axes.plot(*self.seen(points).T, **style)[0]

    def face(self, points: Floats, **style: Any) -> Any:
        """A filled polygon of corners (n, 3)."""
        if self.plane is None:
            from mpl_toolkits.mplot3d.art3d import Poly3DCollection

            return self.axes.add_collection3d(Poly3DCollection([points], linewidth=0, **style))
        from matplotlib.patches import Polygon

        return self.axes.add_patch(Polygon(self.seen(points), linewidth=0, **style))

    def solid(self, triangles: Floats, **style: Any) -> Any:
        """A solid of triangles (n, 3, 3)."""
        if self.plane is None:
            from mpl_toolkits.mplot3d.art3d import Poly3DCollection

            return self.axes.add_collection3d(Poly3DCollection(triangles, linewidth=0, **style))
        from matplotlib.collections import PolyCollection

        return self.axes.add_collection(PolyCollection(list(self.seen(triangles)), linewidth=0, **style))

    def marks(self, points: Floats, **style: Any) -> Any:
        """Markers at points (n, 3)."""
        style |= {"depthshade": False} if self.plane is None else {}
        return self.axes.scatter(*self.seen(points).T, **style)

    def words(self, place: Floats, text: str, **style: Any) -> Any:
        """A text at a point (3,)."""
        from matplotlib.patheffects import withStroke

        outline = withStroke(linewidth=2.0, foreground="white")
        return self.axes.text(*self.seen(place), text, **({"fontsize": SMALL, "path_effects": [outline]} | style))

    def frame(self, points: Floats, unit: str) -> None:
        """Show all of points (n, 3), at one scale, with axes named and ticks that keep out of each other's way."""
        seen = self.seen(points)
        low, high = seen.min(axis=0), seen.max(axis=0)
        largest = float(np.max(high - low)) or 1.0
        spans = MARGIN * np.maximum(high - low, THINNEST * largest)
        ends = np.stack([(low + high - spans) / 2.0, (low + high + spans) / 2.0])
        for name, limits in zip("xyz", ends.T.tolist(), strict=False):
            self.axes.set(**{f"{name}lim": limits})
        if self.plane is not None:
            self.axes.set_aspect("equal")
        else:
            self.axes.set_box_aspect(spans)
            self.axes.computed_zorder = False
            elevation, azimuth = viewpoint(points)
            self.axes.view_init(elev=elevation, azim=azimuth)
            for place, name in enumerate("xyz"):  # matplotlib's own distance shrinks with the other two sides
                others = float(np.delete(spans, place).mean() / spans.max())
                self.axes.tick_params(axis=name, pad=TICKS_OFF + TICKS_OFF_THIN * (1.0 - others))
        for place, name in enumerate("xyz"[: len(spans)]):
            low_end, high_end = ends[:, place].tolist()
            ticks = _ticks(low_end, high_end, self._most_ticks(place, ends))
            self.axes.set(**{f"{name}ticks": ticks, f"{name}label": f"{self._direction(place)} [{unit}]"})
        if self.plane is None:
            self._fit(spans)
            part_ticks(self.axes)

    def _fit(self, spans: Floats) -> None:
        """Move the names of axes in space off their ticks, and shrink the box until all of them are in the figure."""
        root = self.axes.get_figure(root=True)
        zooms = iter(ZOOMS)
        self.axes.set_box_aspect(spans, zoom=next(zooms))
        for _ in range(MOST_ADJUSTMENTS):
            root.draw_without_rendering()
            edge = self.axes.figure.bbox.padded(-FREE_EDGE * root.dpi / 72.0)
            boxes = [text.get_window_extent() for text in self.axis_words]
            hidden = hidden_names(self.axes)
            for axis in hidden:
                axis.labelpad += NAME_STEP
            if hidden:
                continue
            if all(edge.x0 <= box.x0 and box.x1 <= edge.x1 and edge.y0 <= box.y0 for box in boxes):
                return
            self.axes.set_box_aspect(spans, zoom=next(zooms, ZOOMS[-1]))

    @property
    def axis_words(self) -> list[Any]:
        """The names of all axes, then the numbers at their ticks, where they were drawn last."""
        axes = axes_of(self.axes)
        return [axis.label for axis in axes] + [text for axis in axes for _, text in numbers_at(axis)]

    def on_screen(self, places: Floats) -> Floats:
        """Points (n, 3), or points of the axes themselves, in pixels, (n, 2)."""
        seen = self.seen(places) if places.shape[1] == 3 else places
        if self.plane is None:
            from mpl_toolkits.mplot3d.proj3d import proj_transform

            seen = np.transpose(proj_transform(*seen.T, self.axes.get_proj()))[:, :2]
        return np.asarray(self.axes.transData.transform(seen))

    def _most_ticks(self, place: int, ends: Floats) -> int:
        """The number of ticks that fit on an axis of the figure as it is; `ends` are its lowest and highest corner."""
        if self.plane is None:
            line = np.repeat(ends.mean(axis=0)[None], 2, axis=0)
            line[:, place] = ends[:, place]
            self.axes.apply_aspect()
            length = np.linalg.norm(np.diff(self.on_screen(line), axis=0))
            upright = place == 2
        else:
            box = self.axes.get_window_extent()
            length, upright = (box.width, box.height)[place], place == 1
        points = length * 72.0 / self.axes.get_figure(root=True).dpi
        return int(np.clip(points / (ROOM_UP if upright else ROOM_ACROSS), 2, TICKS))

    def _direction(self, place: int) -> str:
        """The name of an axis: "x" if it is one of the base frame, else its direction."""
        if self.plane is None:
            return "xyz"[place]
        along = self.plane[place]
        nearest = int(np.argmax(np.abs(along)))
        is_base_axis = np.isclose(along[nearest], 1.0)
        return "xyz"[nearest] if is_base_axis else f"along ({', '.join(f'{part:.3g}' for part in along)})"


def canvas_on(ax: Axes | None, plane: Floats | None) -> Canvas:
    """A canvas on axes that are given, or on new ones; planar machines take both kinds.

    Raises
    ------
    InvalidArgument : two-dimensional axes for a machine in space.
    MissingLibrary : matplotlib is not installed.
    """
    if ax is None:
        ax = new_axes(new_figure(5.0, 4.5, layout=None if plane is None else "constrained"), plane)
    require_method("ax", ax, "tick_params", "matplotlib axes, or None")
    if plane is None:
        require_spatial(ax, "a machine that is not planar")
    if is_spatial(ax):
        plane = None
        _dress(ax)
    ax.tick_params(labelsize=SMALL)
    for name in "xyz"[: 2 if plane is not None else 3]:
        getattr(ax, f"{name}axis").label.set_size(SMALL + 1.0)
    return Canvas(ax, plane)


def _dress(axes: Any) -> None:
    """Remove the walls of axes in space, and write their names upright."""
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.labelpad = LABEL_OFF
        axis.set_rotate_label(False)
        axis.label.set_rotation(90.0 if axis is axes.zaxis else 0.0)
        axis.set_pane_color(PANE)
        axis._axinfo["grid"] |= {"color": GRID, "linewidth": 0.6}


def new_axes(figure: Figure | Any, plane: Floats | None) -> Axes:
    """New axes that fill a figure but for a key above: two-dimensional ones for what is planar."""
    if plane is not None:
        axes: Axes = figure.add_subplot()
        axes.spines[["top", "right"]].set_visible(False)
        return axes
    spatial: Axes = figure.add_axes(SPATIAL, projection="3d")  # no layout engine knows how much room its names need
    return spatial


def _ticks(low: float, high: float, most: int) -> list[float]:
    """Round numbers between both ends of an axis, off its corners."""
    from matplotlib.ticker import MaxNLocator

    off = OFF_CORNERS * (high - low)
    for number in (most, TICKS):  # an axis with room for few has one at least
        ticks = MaxNLocator(number, steps=[1, 2, 5, 10]).tick_values(low, high)
        within = [float(tick) for tick in ticks if low + off <= tick <= high - off]
        if within:
            return within if number == most else within[len(within) // 2 :][:1]
    return []


TRIAD, LETTER_OFF, ON_EDGE = 17.0, 7.0, 0.12
"""Length of the arrows of a triad and distance of its letters from their tips [points]; share of its length below which
an axis is seen on its edge, and is left out."""

BAR, BAR_WIDTH, BAR_OFF = 0.28, 1.6, 3.0
"""Longest scale bar, as a share of what it is a scale of; its width, and the distance of its words [points]."""

SMALL_BAR, SMALLER = 0.1, {"m": ("mm", 1000.0)}
"""Length below which a bar speaks of a smaller unit, and this unit, with how many of it are one of the other."""


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


def round_length(most: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is not above `most`."""
    power = 10.0 ** np.floor(np.log10(most))
    return float(max(step for step in (1.0, 2.0, 5.0) if step * power <= most) * power)
