"""Pictures of singularities: along a path, in a plane, and in space with slices of the measure across the locus."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import Floats, Ints
from ..drawing import SMALL, keep_apart, new_figure
from ..motion.singularities import Singularity
from ..workspace.region import Region
from ..workspace.workspace_table import for_people, labels, shown
from .surfaces import AZIMUTH, ELEVATION, add_surface, axes_for, frame_solid, thinned

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..workspace.singular import SingularityMap

MARK = 9.0
LINES = {
    "serial": ("#0072b2", "-"),
    "parallel": ("#e69f00", "--"),
    "constraint": ("#009e73", "-."),
    "passive": ("#cc79a7", ":"),
}
"""Colour and dashes of each measure along a path; size of the points of a map."""

LOCUS = "#d55e00"
"""Colour of singularities."""

MAP, MEASURE = "cividis", "parallel measure"
"""Colours of the measure, and its name."""

SIZE = (9.6, 4.8)
"""Of a figure with slices [inches]."""

ZOOM = 0.76
"""Size of the box in space: its names need room, and no layout knows of it."""

SLICES = (0.14, 0.38, 0.62, 0.86)
"""Where slices are, as shares of the points from the lowest to the highest."""

HULL = "#9aa5b1"
"""Colour of the workspace around the locus."""


@dataclass(frozen=True)
class Field:
    """A measure on a lattice: points (n, 3) at distances `step`, (3,), and values (n,)."""

    points: Floats
    step: Floats
    values: Floats


@dataclass(frozen=True)
class Slice:
    """A slice across one coordinate.

    Attributes
    ----------
    level : the value of this coordinate [length or rad].
    axis, across : the coordinate, and the other two.
    grid : the measure, (n, m), NaN beyond reach: rows along the second of the other two.
    low : the point (2,) in the middle of the grid's first cell.
    locus : segments (k, 2, 2) where it cuts the locus.
    """

    level: float
    axis: int
    across: list[int]
    grid: Floats
    low: Floats
    locus: Floats


def plot_singular_track(measures: Singularity, crossings: Ints, ax: Axes | None = None) -> Axes:
    """Draw the measures along a path, one line each, and where it leads through parallel singularities."""
    axes = axes_for(ax, 2)
    for name, (colour, dashes) in LINES.items():
        values = np.asarray(getattr(measures, name))
        if np.isfinite(values).any():
            axes.plot(np.arange(1, len(values) + 1), values, color=colour, linestyle=dashes, label=name)
    for count, row in enumerate(crossings.tolist()):
        label = "" if count else "parallel singularity"
        axes.axvline(row + 0.5, color=LOCUS, linewidth=1.2, label=label)
    axes.set(xlabel="target", ylabel="measure of singularity", ylim=(0.0, None))
    axes.legend(frameon=False, fontsize=SMALL)
    return axes


def plot_singular_map(found: SingularityMap, ax: Axes | None = None) -> Axes:
    """Draw the parallel measure at the points of a plane, or in slices of space, and the locus."""
    space, vertices, faces = found.workspace, found.locus_vertices, found.locus_faces
    parallel = np.asarray(found.measures.parallel)
    title = f"{space.mechanism.name}: {'parallel singularities' if len(faces) else 'no parallel singularity'}"
    if len(space.names) == 3:
        return _plot_in_space(space, Field(found.points, found.step, parallel), vertices, faces, title, ax)
    axes = axes_for(ax, 2)
    from matplotlib.collections import LineCollection

    points = shown(space, found.points)
    drawn = axes.scatter(points[:, 0], points[:, 1], c=parallel, s=MARK, marker="s", linewidths=0, cmap=MAP, vmin=0.0)
    axes.add_collection(LineCollection(list(shown(space, vertices)[faces]), colors=LOCUS, linewidths=2.0))
    if len(set(space.units)) == 1:
        axes.set_aspect("equal")
    axes.figure.colorbar(drawn, ax=axes, label=MEASURE, shrink=0.8, pad=0.03)
    axes.set(**dict(zip(("xlabel", "ylabel"), labels(space), strict=True)))
    axes.set_title(title, fontsize=SMALL + 1)
    return axes


def _plot_in_space(
    space: Region, field: Field, vertices: Floats, faces: Ints, title: str, ax: Axes | None = None
) -> Axes:
    """Draw the locus, vertices (v, 3) and faces (f, 3), and slices across it: beside it, or on axes that are given."""
    slices = slices_of(field, vertices, faces)
    highest = float(np.max(field.values[np.isfinite(field.values)], initial=0.0)) or 1.0
    if ax is not None:
        axes: Any = axes_for(ax, 3)
        panels: list[Any] = []
    else:
        figure = new_figure(*SIZE)
        grid = figure.add_gridspec(2, 4)
        eye: dict[str, Any] = {"projection": "3d", "elev": ELEVATION, "azim": AZIMUTH}
        axes = axes_for(figure.add_subplot(grid[:, :2], **eye), 3)
        panels = [figure.add_subplot(grid[place // 2, 2 + place % 2]) for place in range(len(slices))]
    _draw_locus(axes, space, vertices, faces)
    if not panels or not len(faces):
        for each in slices:
            _draw_in_space(axes, space, each, field.step, highest)
    axes.set_title(title, fontsize=SMALL + 1)
    for panel, each in zip(panels, slices, strict=False):
        _draw_slice(panel, space, each, field.step, highest)
    for place, panel in enumerate(panels):  # all have the same axes
        if place % 2:
            panel.set_ylabel("")
            panel.tick_params(labelleft=False)
        if place + 2 < len(slices):
            panel.set_xlabel("")
            panel.tick_params(labelbottom=False)
    _add_scale(axes, panels, highest)
    keep_apart(axes)
    return axes  # type: ignore[no-any-return]


def slices_of(field: Field, vertices: Floats, faces: Ints) -> list[Slice]:
    """Slices across the coordinate that the locus is least square to; across the last one without a locus."""
    if not len(field.points):
        return []
    axis = _axis_across(vertices / field.step, faces)
    across = [k for k in range(3) if k != axis]
    low = field.points.min(axis=0)
    places = np.round((field.points - low) / field.step).astype(np.int64)
    levels = np.unique(np.quantile(places[:, axis], SLICES, method="nearest"))
    shape = places[:, across].max(axis=0) + 1
    slices = []
    for level in levels.tolist():
        rows = places[:, axis] == level
        grid = np.full(shape[::-1], np.nan)
        grid[places[rows, across[1]], places[rows, across[0]]] = field.values[rows]
        value = float(low[axis] + level * field.step[axis])
        slices.append(Slice(value, axis, across, grid, low[across], _cut(vertices, faces, axis, value, field.step)))
    return slices


def _axis_across(vertices: Floats, faces: Ints) -> int:
    """The coordinate along which the normals of a mesh have the least component; the last of equal ones."""
    if not len(faces):
        return 2
    corners = vertices[faces]
    normals = np.abs(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])).sum(axis=0)
    return int(2 - np.argmin(np.round(normals / normals.max(), 1)[::-1]))


def _cut(vertices: Floats, faces: Ints, axis: int, level: float, step: Floats) -> Floats:
    """Segments (k, 2, 2) in which the plane at a level of one coordinate cuts a mesh."""
    if not len(faces):
        return np.zeros((0, 2, 2))
    across = [k for k in range(3) if k != axis]
    corners = vertices[faces]
    height = corners[:, :, axis] - level - 1e-6 * step[axis]  # no corner of the lattice is in the plane
    crossed = (height > 0.0).any(axis=1) & (height <= 0.0).any(axis=1)
    corners, height = corners[crossed], height[crossed]
    alone = np.where((height > 0.0).sum(axis=1) == 1, np.argmax(height, axis=1), np.argmin(height, axis=1))
    rows = np.arange(len(corners))
    ends = []
    for turn in (1, 2):
        other = (alone + turn) % 3
        share = height[rows, alone] / (height[rows, alone] - height[rows, other])
        ends.append(corners[rows, alone] + share[:, None] * (corners[rows, other] - corners[rows, alone]))
    return np.stack(ends, axis=1)[:, :, across]


def _draw_locus(axes: Any, space: Region, vertices: Floats, faces: Ints) -> None:
    """The locus in the light, in the workspace as a faint hull."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    hull, sides, _ = thinned(space.vertices, space.faces, space.vertex_limit)
    if len(sides):
        axes.computed_zorder = False
        style: dict[str, Any] = {"facecolors": HULL, "edgecolors": "none", "alpha": 0.07, "zorder": 4}
        axes.add_collection3d(Poly3DCollection(shown(space, hull)[sides], **style))
    if len(faces):
        colours = np.full(len(faces), LOCUS)
        add_surface(axes, shown(space, vertices), faces, colours, see_through=False)
    frame_solid(axes, space, [shown(space, space.vertices), shown(space, vertices)], zoom=ZOOM)


def _draw_in_space(axes: Any, space: Region, each: Slice, step: Floats, highest: float) -> None:
    """A slice where it is, each point as a square in the colour of its measure."""
    from matplotlib import colormaps
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    rows, columns = np.nonzero(np.isfinite(each.grid))
    middles = each.low + np.stack([columns, rows], axis=1) * step[each.across]
    square = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]) * step[each.across]
    corners = np.full((len(middles), 4, 3), each.level)
    corners[:, :, each.across] = middles[:, None] + square
    colours = colormaps[MAP](np.clip(each.grid[rows, columns] / highest, 0.0, 1.0))
    style: dict[str, Any] = {"facecolors": colours, "edgecolors": "none", "alpha": 0.85, "zorder": 2}
    axes.add_collection3d(Poly3DCollection(shown(space, corners), **style))


def _draw_slice(panel: Any, space: Region, each: Slice, step: Floats, highest: float) -> None:
    """A slice in its plane, with the curve in which it cuts the locus."""
    from matplotlib.collections import LineCollection

    factors = np.array(for_people(space.units)[0])
    first, second = each.across
    rows, columns = each.grid.shape
    low = (each.low - 0.5 * step[each.across]) * factors[each.across]
    high = low + np.array([columns, rows]) * step[each.across] * factors[each.across]
    extent = (low[0], high[0], low[1], high[1])
    alike = space.units[first] == space.units[second]
    style: dict[str, Any] = {"cmap": MAP, "vmin": 0.0, "vmax": highest, "aspect": "equal" if alike else "auto"}
    panel.imshow(each.grid, origin="lower", extent=extent, **style)
    panel.add_collection(LineCollection(list(each.locus * factors[each.across]), colors=LOCUS, linewidths=2.0))
    names = labels(space)
    panel.set_xlabel(names[first], fontsize=SMALL)
    panel.set_ylabel(names[second], fontsize=SMALL)
    panel.tick_params(labelsize=SMALL)
    panel.locator_params(nbins=4)
    unit = names[each.axis].rpartition(" ")[2].strip("[]")
    panel.set_title(f"{space.names[each.axis]} = {each.level * factors[each.axis]:.4g} {unit}", fontsize=SMALL)


def _add_scale(axes: Any, panels: list[Any], highest: float) -> None:
    """The scale of the measure beside the slices."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    scale = ScalarMappable(Normalize(0.0, highest), MAP)
    beside: dict[str, Any] = {"shrink": 0.8, "pad": 0.03} if panels else {"shrink": 0.8, "pad": 0.12}
    bar = axes.figure.colorbar(scale, ax=panels or axes, **beside)
    bar.set_label(MEASURE, fontsize=SMALL)
    bar.ax.tick_params(labelsize=SMALL)
