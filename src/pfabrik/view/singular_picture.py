"""Pictures of singularities: along a path, in a plane, and in space with slices of the measure across the locus."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..capabilities.workspace.parts import connected
from ..capabilities.workspace.singular import signed_at
from ..capabilities.workspace.surface import face_normals, sizes_of
from ..capabilities.workspace.workspace_table import for_people, labels
from ..common.arrays import Floats, Ints
from ..common.drawing import SMALL, Size, Theme, View, dotted_where_alone, new_figure
from .canvas import checked_size, draw_title, wrapped
from .eye import eye_of, upright
from .frame import PLANE_SIZE, axes_for, box_of, draw_box, draw_image, draw_lines, fit_bare
from .looks import SINGULAR, Look, look_of
from .raster import lines_between, rasterised
from .slices import area_of, cut_mesh, draw_slice, loops_of, plane_across
from .solid import best_eye, corner_normals, in_the_light, picked_faces, scale_of, seen_solid

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..capabilities.workspace.singular import SingularityMap, SingularityTrack

LINES = {
    "serial": ("#0072b2", "-"),
    "parallel": ("#e69f00", "--"),
    "constraint": ("#009e73", "-."),
    "passive": ("#cc79a7", ":"),
}
"""Colour and dashes of each measure along a path."""

RIM, WIDTH = "#4a1033", 2.0
"""Colour of the rims of singularities, and the width of their lines [points]."""

MAP, MEASURE, LEVELS = "cividis", "parallel measure", 14
"""Colours of the measure, its name, and in how many steps it is drawn at most."""

HIGHEST = 0.98
"""Share of the points whose measure has a colour of its own; above, all have the last one."""

SIZE = (9.6, 4.8)
"""Of a figure in space with slices [inches]."""

SPACE, BAR = (0.0, 0.01, 0.49, 0.91), (0.93, 0.2, 0.012, 0.56)
SLICES_IN = {"left": 0.55, "right": 0.9, "top": 0.86, "bottom": 0.11, "hspace": 0.25, "wspace": 0.12}
"""Places of what is in space, of the bar of colours and of slices in a figure."""

SLICES = (0.10, 0.37, 0.63, 0.90)
"""Where slices are, as shares of the locus from its lowest to its highest point."""

ROOMY, ALONE = (7.2, 3.8), (0.0, 0.0, 1.0, 0.86)
"""Width and height of a figure below which a locus has no slices [inches], and the place of it alone."""

ACROSS = 44
"""Points of a slice along its longer side: each is solved for."""

LAYERS, REFINED = 3, 3
"""Layers of points that a measure is carried beyond the border, and times that their distance is divided."""

SMALLEST, SHORTEST = 6.0, 2.0
"""Area of a sheet in space and length of a curve in a plane below which it is a speck [cells² and cells]."""

RIM_ROUNDS, NORMAL_ROUNDS = 20, 4
"""How often the rim of a sheet is moved towards the middle of its neighbours along it, and normals are averaged."""

PIXELS, HULL_PIXELS, JUMP = 800, 450, 2.0
"""Pixels across the locus and across the workspace; least difference in depth where a sheet hides another [cells]."""

HULL, HULL_LINE = 0.10, 0.6
"""How opaque the workspace around a locus is, and the width of its lines [points]."""


def plot_singular_track(found: SingularityTrack, ax: Axes | None, size: Size | None, theme: Theme) -> Axes:
    """As `SingularityTrack.plot`."""
    look = look_of(theme)
    axes = axes_for(ax, size or PLANE_SIZE, look)
    for name, (colour, dashes) in LINES.items():
        values = np.asarray(getattr(found.measures, name))
        if np.isfinite(values).any():
            style = {"color": colour, "linestyle": dashes, "label": name} | dotted_where_alone(values)
            axes.plot(np.arange(1, len(values) + 1), values, **style)
    for count, row in enumerate(found.crossings.tolist()):
        label = "" if count else "parallel singularity"
        axes.axvline(row + 0.5, color=SINGULAR, linewidth=1.2, label=label)
    axes.set(xlabel="target", ylabel="measure of singularity", ylim=(0.0, None))
    axes.legend(frameon=False, fontsize=SMALL, labelcolor=look.ink)
    return axes


def plot_singular_map(
    found: SingularityMap, ax: Axes | None, view: View | None, size: Size | None, theme: Theme
) -> Axes:
    """As `SingularityMap.plot`."""
    look, region = look_of(theme), found.workspace
    vertices, faces = without_specks(found.locus_vertices, found.locus_faces, found.step)
    found = replace(found, locus_vertices=vertices, locus_faces=faces)
    what = "parallel singularities" if len(faces) else "no parallel singularity"
    title = f"{region.mechanism.name}: {what} within reach"
    if len(region.names) == 3 and len(region.faces):
        return _plot_in_space(found, ax, view, size, look, title)
    axes: Any = axes_for(ax, size or PLANE_SIZE, look)
    from matplotlib.patches import PathPatch

    draw_title(axes, title, look)
    if not len(found.points):
        axes.axis("off")
        return axes  # type: ignore[no-any-return]
    start = region._question.space.start
    places = np.round((found.points - start) / found.step).astype(np.int64)
    grid, low = on_grid(places, found._signed)
    factors = np.array(for_people(region.units)[0])
    points = region.vertices * factors
    area = area_of([points[loop] for loop in loops_of(region.faces)])
    highest = _highest(np.abs(found._signed))
    first, step = (low * found.step + start) * factors, found.step * factors
    drawn = draw_measure(axes, grid, first, step, highest, area)
    _draw_curves(axes, (vertices * factors)[faces], area)
    axes.add_patch(PathPatch(area, facecolor="none", edgecolor=look.soft, linewidth=0.8, zorder=3))
    axes.autoscale_view()
    axes.margins(0.03)
    if len(set(region.units)) == 1:
        axes.set_aspect("equal")
    axes.set(**dict(zip(("xlabel", "ylabel"), labels(region), strict=True)))
    _dress_bar(axes.figure.colorbar(drawn, ax=axes, shrink=0.8, pad=0.03), look)
    return axes  # type: ignore[no-any-return]


def _plot_slices(found: SingularityMap, size: Size | None, look: Look, title: str) -> Axes:
    """Slices of the measure alone: where nothing is singular there is no locus to see; a small figure has one slice."""
    width, height = checked_size(size or SIZE)
    figure, across = new_figure(width, height, look.paper), 2 if _is_roomy(width, height) else 1
    panels = figure.subplots(across, across, squeeze=False).ravel().tolist()
    words = "\n".join(wrapped(text, width, SMALL) for text in (title, _least_in_words(found)))
    figure.suptitle(words, fontsize=SMALL, color=look.ink)
    drawn = _draw_slices(panels, found, look)
    if drawn is not None:
        _dress_bar(figure.colorbar(drawn, ax=panels, shrink=0.8, pad=0.02), look)
    return panels[0]  # type: ignore[no-any-return]


def _is_roomy(width: float, height: float) -> bool:
    return width >= ROOMY[0] and height >= ROOMY[1]


def _least_at(found: SingularityMap) -> Floats:
    """Where the parallel measure is least (d,) [length or rad]."""
    return np.asarray(found.points[int(np.nanargmin(found.measures.parallel))])


def _least_in_words(found: SingularityMap) -> str:
    """The least parallel measure and where it is, and the least of the other measures."""
    region = found.workspace
    factors, units = for_people(region.units)
    at = ", ".join(
        f"{name} {value * factor + 0.0:.3g} {unit}".replace("-", "\N{MINUS SIGN}")
        for name, value, factor, unit in zip(region.names, _least_at(found), factors, units, strict=True)
    )
    others = [(kind, np.asarray(getattr(found.measures, kind))) for kind in ("serial", "constraint")]
    least = [f"least {kind} {np.nanmin(values):.2g}" for kind, values in others if np.isfinite(values).any()]
    return "; ".join([f"least parallel measure {np.nanmin(found.measures.parallel):.2g} at {at}", *least])


def _dress_bar(bar: Any, look: Look) -> None:
    bar.set_label(MEASURE, fontsize=SMALL, color=look.ink)
    bar.ax.tick_params(labelsize=SMALL - 1.0, colors=look.ink)
    bar.outline.set_edgecolor(look.soft)


def _highest(values: Floats) -> float:
    known = values[np.isfinite(values)]
    return float(np.quantile(known, HIGHEST)) or 1.0 if len(known) else 1.0


def without_specks(vertices: Floats, faces: Ints, step: Floats) -> tuple[Floats, Ints]:
    """The faces of sheets that are larger than a few cells; in space their rims are smoothed.

    Parameters
    ----------
    vertices, faces : of triangles in space, or segments in a plane.
    step : size of a cell, (d,).
    """
    if not len(faces):
        return vertices, faces
    d = faces.shape[1]
    pairs = np.concatenate([faces[:, (k, (k + 1) % d)] for k in range(d if d == 3 else 1)])
    _, sheet = np.unique(connected(len(vertices), pairs), return_inverse=True)
    of_faces = sheet[faces[:, 0]]
    kept = faces[
        np.bincount(of_faces, sizes_of((vertices / step)[faces]))[of_faces] >= (SMALLEST if d == 3 else SHORTEST)
    ]
    return (_with_smooth_rim(vertices, kept) if d == 3 else vertices), kept


def _with_smooth_rim(vertices: Floats, faces: Ints) -> Floats:
    """Vertices (v, 3) with those on the rim of sheets moved towards the middle of both neighbours along it."""
    sides = np.sort(np.concatenate([faces[:, (k, (k + 1) % 3)] for k in range(3)]), axis=1)
    edges, counts = np.unique(sides, axis=0, return_counts=True)
    rim = edges[counts == 1]
    number = np.bincount(rim.ravel(), minlength=len(vertices))
    moved = number == 2
    for _ in range(RIM_ROUNDS):
        total = np.zeros(vertices.shape)
        np.add.at(total, rim[:, 0], vertices[rim[:, 1]])
        np.add.at(total, rim[:, 1], vertices[rim[:, 0]])
        vertices = np.where(moved[:, None], 0.5 * vertices + 0.25 * total, vertices)
    return vertices


def on_grid(places: Ints, values: Floats) -> tuple[Floats, Ints]:
    """Values at lattice places of a plane as a grid (n, m), carried a few layers beyond, and its first place (2,)."""
    low = places.min(axis=0) - LAYERS
    grid = np.full(places.max(axis=0) - low + LAYERS + 1, np.nan)
    grid[tuple((places - low).T)] = values
    for _ in range(LAYERS):
        guesses = []
        for axis in (0, 1):
            for way in (1, -1):
                one, two = np.roll(grid, way, axis), np.roll(grid, 2 * way, axis)
                guesses.append(np.where(np.isnan(two), one, 2.0 * one - two))
        known = np.isfinite(guesses)
        mean = np.where(known, guesses, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
        grid = np.where(np.isnan(grid) & known.any(axis=0), mean, grid)
    return grid, low


def draw_measure(axes: Any, grid: Floats, low: Floats, step: Floats, highest: float, area: Any) -> Any:
    """Draw the magnitude of a signed measure on a grid (n, m) of a plane, within an area."""
    from matplotlib.ticker import MaxNLocator

    fine = _refined(_refined(grid).T).T
    ticks = [low[k] + step[k] / REFINED * np.arange(n) for k, n in enumerate(fine.shape)]
    levels = MaxNLocator(LEVELS, steps=[1, 2, 2.5, 5, 10]).tick_values(0.0, highest)
    drawn = axes.contourf(*ticks, np.abs(fine).T, levels, cmap=MAP, extend="max", zorder=1)
    if area is not None:
        drawn.set_clip_path(area, axes.transData)
    return drawn


def _refined(grid: Floats) -> Floats:
    """Values between the rows of a grid, by straight lines; NaN beside NaN."""
    at = np.arange(REFINED * (len(grid) - 1) + 1) / REFINED
    low = np.minimum(at.astype(np.int64), len(grid) - 2)
    share = (at - low)[:, None]
    return np.asarray(np.where(share > 0.0, grid[low] + share * (grid[low + 1] - grid[low]), grid[low]))


def _draw_curves(axes: Any, segments: Floats, area: Any) -> None:
    """Draw where the locus is in a plane, within an area."""
    curves = draw_lines(axes, list(segments), SINGULAR, WIDTH, 4)
    if area is not None:
        curves.set_clip_path(area, axes.transData)


def _plot_in_space(
    found: SingularityMap, ax: Axes | None, view: View | None, size: Size | None, look: Look, title: str
) -> Axes:
    """Draw the locus in the workspace, and slices beside it; on axes that are given, without slices."""
    if ax is None and not len(found.locus_faces):
        return _plot_slices(found, size, look, title)
    width, height = SIZE if ax is not None else checked_size(size or SIZE)
    has_slices = ax is None and _is_roomy(width, height)
    figure: Any = new_figure(width, height, look.paper, layout=None) if ax is None else ax.figure
    axes: Axes = figure.add_axes(SPACE if has_slices else ALONE) if ax is None else axes_for(ax, SIZE, look)
    _draw_locus(axes, found, view, look)
    if not has_slices:
        draw_title(axes, title, look)
        return axes
    grid = figure.add_gridspec(2, 2, **SLICES_IN)
    panels = [figure.add_subplot(grid[place // 2, place % 2]) for place in range(len(SLICES))]
    drawn = _draw_slices(panels, found, look)
    if drawn is not None:
        _dress_bar(figure.colorbar(drawn, cax=figure.add_axes(BAR)), look)
    figure.text(0.0125, 0.97, title, fontsize=SMALL + 2, color=look.ink, ha="left", va="top")
    return axes


def _draw_locus(axes: Any, found: SingularityMap, view: View | None, look: Look) -> None:
    """The locus in the light, in the workspace as a pale solid, from a direction or from where most of it is seen."""
    from matplotlib.colors import to_rgb

    region, faces = found.workspace, found.locus_faces
    scale, order = scale_of(region), upright(region.names)
    points = found.locus_vertices * scale
    if view is not None:
        eye = eye_of(view, order)
    elif len(faces):
        both_sides = np.concatenate([faces, faces[:, ::-1]])
        slopes = np.abs(face_normals(points[both_sides])).argmax(axis=1)
        eye = best_eye(picked_faces(points, both_sides, slopes), order)
    else:
        eye = best_eye(picked_faces(region.vertices * scale, region.faces, region.face_limit), order)
    box = box_of(region, scale)
    fit_bare(axes, eye.seen(box.corners)[:, :2])
    hull = seen_solid(region, eye, HULL_PIXELS)
    draw_image(axes, hull.raster, to_rgb(look.soft), HULL * (hull.limit >= 0), 2)
    draw_lines(axes, hull.lines, look.soft, HULL_LINE, 5, alpha=0.8)
    if len(faces):
        raster = rasterised(eye.seen(points), faces, PIXELS, both_sides=True)
        normals = corner_normals(points, faces, rounds=NORMAL_ROUNDS)
        normal = (raster.weights[..., None] * normals[raster.face]).sum(axis=2)
        normal *= np.where(normal @ eye.axes[2] < 0.0, -1.0, 1.0)[..., None]
        rgb = in_the_light(normal, eye, np.array(to_rgb(SINGULAR)))
        draw_image(axes, raster, rgb, 1.0 * (raster.face >= 0), 3)
        rims = lines_between(np.minimum(raster.face, 0), raster, JUMP * float((found.step * scale).max()))
        draw_lines(axes, rims, RIM, 0.8, 4)
    draw_box(axes, eye, box, look, [])


def _draw_slices(panels: list[Any], found: SingularityMap, look: Look) -> Any:
    """Draw the measure in planes across the locus; what a colour bar is of, or None."""
    region, vertices, faces = found.workspace, found.locus_vertices, found.locus_faces
    order, scale = upright(region.names), scale_of(region)
    factors = np.array(for_people(region.units)[0])
    axis = _axis_across(vertices / found.step, faces, order[2])
    heights = vertices[np.unique(faces), axis] if len(faces) else region.vertices[:, axis]
    levels = np.quantile(heights, SLICES) if len(panels) > 1 else [_least_at(found)[axis]]
    planes = [plane_across(axis, float(level), order) for level in levels]
    highest, drawn = _highest(np.abs(found._signed)), None
    for panel, plane in zip(panels, planes, strict=True):
        area = draw_slice(panel, region, plane, look)
        step = float((np.ptp(region.bounds, axis=0) * scale)[plane.across].max()) / ACROSS / scale[plane.across]
        low, high = region.bounds[:, plane.across]
        counts = np.maximum(np.ceil((high - low) / step).astype(np.int64), 1) + 1
        places = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 2)
        points = np.full((len(places), 3), plane.level)
        points[:, plane.across] = low + places * step
        signed = signed_at(region, points)
        known = np.isfinite(signed)
        if known.any():
            grid, first = on_grid(places[known], signed[known])
            corner = (low + first * step) * factors[plane.across]
            drawn = draw_measure(panel, grid, corner, step * factors[plane.across], highest, area)
        cut = cut_mesh(vertices, faces, plane)
        _draw_curves(panel, (cut.points * factors[plane.across])[cut.segments], area)
    for place, panel in enumerate(panels[: len(panels) // 2 * 2]):  # all have the same axes
        if place % 2:
            panel.set_ylabel("")
            panel.tick_params(labelleft=False)
        if place < 2:
            panel.set_xlabel("")
            panel.tick_params(labelbottom=False)
    return drawn


def _axis_across(vertices: Floats, faces: Ints, usual: int) -> int:
    """The coordinate along which the normals of a mesh have the least component; of nearly equal ones the usual one."""
    if not len(faces):
        return usual
    normals = np.abs(face_normals(vertices[faces])).sum(axis=0)
    shares = np.round(normals / normals.max(), 1)
    return usual if shares[usual] == shares.min() else int(2 - shares[::-1].argmin())
