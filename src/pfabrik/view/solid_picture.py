"""Pictures of workspaces in space: the solid in its box, from below where that shows more, and three slices."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..answers.words import limit_name
from ..capabilities.workspace.border import Group, group_of_limits, groups_of
from ..capabilities.workspace.workspace_table import for_people
from ..common.arrays import Floats, Ints, Mask
from ..common.drawing import SMALL, Size, View, new_figure
from .canvas import checked_size, draw_key, draw_title, draw_triad
from .eye import Eye, eye_of, upright
from .frame import PADS, axes_for, box_of, dense, draw_box, draw_image, draw_lines, fit_bare, machine_lines, title_of
from .looks import Look
from .raster import counted_around
from .slices import DASHED, draw_slice, edges_of, outline_of, plane_across
from .solid import PickedFaces, SeenSolid, best_eye, in_the_light, is_told_apart, picked_faces, scale_of, seen_solid

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..capabilities.workspace.inscribed import Inscribed
    from ..capabilities.workspace.region import Region

ACROSS, ACROSS_BELOW = 760, 560
"""Pixels across a solid, and across the one from below: as many as 300 an inch on paper."""

TITLE, KEY_ROW, GAP, EDGE = 0.62, 0.19, 0.2, 0.12
"""Height of the title, and of a row of the key; free between and around panels [inches]."""

WIDEST, SHORTEST, TALLEST, SECOND, SLICE = 4.3, 3.3, 4.1, 2.8, 1.9
"""Width of a solid in its box, at most, its least and greatest height, and widths of the second solid and of slices, at
most [inches]."""

ROOMY, ROOMY_FOR_TWO = (5.5, 4.0), 8.0
"""Width and height of a figure below which it has no slices, and the width from which on it may have a second solid
[inches]."""

ALONE = (0.0, 0.16, 1.0, 0.74)
"""Place of a solid without slices in a figure, between its title and its key."""

SLICE_GAP, SLICE_BELOW, SLICE_LEFT = 0.62, 0.3, 0.55
"""Room for words between slices, below the last one and on their left [inches]."""

KEYS = 4
"""Groups in a row of the key."""

LEAST = 0.005
"""Share of the border from which on a group is in the key."""

FROM_BELOW = -28.0
"""Elevation of the second solid [deg]."""

HIDDEN, SHOWN = 0.01, 0.02
"""Shares of the picture: below the first a group is not seen, and from the second on it is worth a second solid."""

EDGE_COLOUR, EDGE_WIDTH = "#101010", 0.8
MACHINE_WIDTH, HALO, DOTTED = 1.3, 1.7, (0, (1.2, 1.5))
"""Lines of the solid, of the machine and of the paper around it [points]; dashes of what is in the solid or behind."""

LIGHTNESS, BRIGHT = np.array([0.3, 0.59, 0.11]), 0.5
"""Shares of red, green and blue in the lightness of a colour, and the one from which on letters on it are dark."""

LETTERS = SMALL - 0.5
"""Size of names on faces [points]."""


class Colours(NamedTuple):
    """What each limit looks like: the groups, the place of each limit's group, and their colours (n, 3)."""

    groups: list[Group]
    place: Ints
    rgb: Floats


def plot_solid(
    region: Region, ax: Axes | None, shape: Inscribed | None, view: View | None, size: Size | None, look: Look
) -> Axes:
    """Draw a workspace in space on axes that are given, or on those of a new figure, with slices beside it."""
    from matplotlib.colors import to_rgb

    groups = groups_of(region)
    colours = Colours(groups, group_of_limits(region, groups), np.array([to_rgb(group.colour) for group in groups]))
    sample = picked_faces(region.vertices * scale_of(region), region.faces, region.face_limit)
    eye = best_eye(sample, upright(region.names)) if view is None else eye_of(view, upright(region.names))
    first = seen_solid(region, eye, ACROSS)
    if ax is None and size is not None and (size[0] < ROOMY[0] or size[1] < ROOMY[1]):
        ax = new_figure(*checked_size(size), look.paper, layout=None).add_axes(ALONE)
    if ax is not None:
        axes: Any = axes_for(ax, (0.0, 0.0), look)
        _draw_solid(axes, first, colours, shape, look)
        draw_title(axes, title_of(region), look)
        key = {"loc": "upper center", "bbox_to_anchor": (0.5, 0.0), **_key(groups, look)}
        draw_key(axes, axes.get_window_extent().width, key, min(len(key["handles"]), KEYS))
        return axes  # type: ignore[no-any-return]
    has_room = view is None and (size is None or size[0] >= ROOMY_FOR_TWO)
    below = _eye_below(sample, eye, colours.place) if has_room else None
    second = None if below is None else seen_solid(region, below, ACROSS_BELOW)
    figure, axes, beside, slices = _panels(first, second, size, groups, look)
    _draw_solid(axes, first, colours, shape, look)
    if second is not None:
        _draw_second(beside, second, colours, look)
    _draw_slices(slices, first, colours, shape, look)
    left = EDGE / figure.get_size_inches()[0]
    top = 1.0 - 0.16 / figure.get_size_inches()[1]
    figure.text(left, top, title_of(region), fontsize=SMALL + 2, color=look.ink, ha="left", va="top")
    started = "home" if region._question.start is None else "the start"
    which = "the limit that ends it there" if is_told_apart(region) else "one of the limits that bind there"
    inside = ", inside" if _is_hidden(first) else ""
    words = f"each face in the colour of {which}; + is {started}{inside}"
    under = top - 0.2 / figure.get_size_inches()[1]
    figure.text(left, under, words, fontsize=SMALL, color=look.soft, ha="left", va="top")
    seen = np.max([sample.shares(each.eye, colours.place) for each in (first, second) if each is not None], axis=0)
    hidden = [group for group, share in zip(groups, seen, strict=True) if share < HIDDEN and group.share > SHOWN]
    key = _key(groups, look, hidden)
    columns = min(len(key["handles"]), KEYS)
    figure.legend(loc="lower left", bbox_to_anchor=(0.5 * left, 0.0), ncols=columns, **key)
    return axes  # type: ignore[no-any-return]


def _key(groups: list[Group], look: Look, hidden: Sequence[Group] = ()) -> dict[str, Any]:
    """Settings of a key: stops of motors, then passive joints, then links, the rest last, each with its share.

    Those that are hidden, as within a shell, say so.
    """
    from matplotlib.patches import Patch

    order = sorted(
        groups, key=lambda group: (not group.is_motors, group.is_links, group.name[0].isdigit(), -group.share)
    )
    shown = [group for group in order if group.share >= LEAST]
    words = [f"{group.name}{', hidden' * (group in hidden)}  {100 * group.share:.0f} %" for group in shown]
    style: dict[str, Any] = {"edgecolor": look.ink, "linewidth": 0.5}
    handles = [Patch(facecolor=group.colour, label=label, **style) for group, label in zip(shown, words, strict=True)]
    letters = {"fontsize": SMALL, "labelcolor": look.ink}
    return {"handles": handles, "frameon": False, "handlelength": 1.2, "columnspacing": 1.4, **letters}


def _eye_below(sample: PickedFaces, eye: Eye, place: Ints) -> Eye | None:
    """An eye from below, if it sees groups that the first does not."""
    eyes = [Eye(FROM_BELOW, eye.azimuth + turn, eye.order) for turn in (0.0, 180.0)]
    best = max(eyes, key=lambda below: float(np.sqrt(sample.shares(below, place)).sum()))
    is_new = (sample.shares(eye, place) < HIDDEN) & (sample.shares(best, place) > SHOWN)
    return best if is_new.any() else None


def _panels(
    first: SeenSolid, second: SeenSolid | None, size: Size | None, groups: list[Group], look: Look
) -> tuple[Any, Any, Any, list[Any]]:
    """A new figure, axes of its solids, and those of slices, as wide as what they show, one below the other."""
    rows = -(-sum(group.share >= LEAST for group in groups) // KEYS)
    bottom = KEY_ROW * rows + 0.16
    content, pads = np.ptp(_content(first), axis=0), np.array([PADS[0] + PADS[1], PADS[2] + PADS[3]]) / 72.0
    tall = float(np.clip((WIDEST - pads[0]) * content[1] / content[0] + pads[1], SHORTEST, TALLEST))
    wide = min(float(content[0] / content[1]) * (tall - pads[1]) + pads[0], WIDEST)
    wider = 0.0 if second is None else min(second.limit.shape[1] / second.limit.shape[0] * tall, SECOND)
    spans = np.ptp(first.region.bounds * first.scale, axis=0)[list(first.eye.order)]
    shapes = np.array([spans[1] / spans[0], spans[2] / spans[0], spans[2] / spans[1]])  # all at one scale
    breadths = np.array([spans[0], spans[0], spans[1]]) / max(spans[0], spans[1])
    slice_wide = min((tall - 2.0 * SLICE_GAP - SLICE_BELOW) / float(shapes @ breadths), SLICE)
    lefts = np.cumsum([EDGE, wide + (GAP if wider else 0.0), wider + SLICE_LEFT])
    width, height = float(lefts[-1]) + slice_wide + 2.0 * EDGE, tall + bottom + TITLE
    figure = new_figure(*checked_size(size or (width, height)), look.paper, layout=None)

    def panel(left: float, below: float, across: float, high: float) -> Any:
        return figure.add_axes((left / width, below / height, across / width, high / height), facecolor=look.paper)

    main = panel(lefts[0], bottom, wide, tall)
    beside = panel(lefts[1], bottom, wider, tall) if second is not None else None
    talls = slice_wide * shapes * breadths
    spare = (tall - SLICE_BELOW - float(talls.sum())) / 2.0
    lows = bottom + tall - np.cumsum(talls) - spare * np.arange(3)
    slices = [
        panel(lefts[2], low, slice_wide * breadth, high)
        for low, breadth, high in zip(lows, breadths, talls, strict=True)
    ]
    return figure, main, beside, slices


def _content(solid: SeenSolid) -> Floats:
    """Points (n, 2) of the picture: the box, and the machine."""
    corners = box_of(solid.region, solid.scale).corners
    return solid.eye.seen(np.concatenate([corners, *machine_lines(solid.region)]))[:, :2]


def _draw_faces(axes: Any, solid: SeenSolid, colours: Colours) -> None:
    """Draw each pixel in the colour of its limit, in the light, and the lines between."""
    rgb = in_the_light(solid.normal, solid.eye, colours.rgb[colours.place][solid.limit])
    draw_image(axes, solid.raster, rgb, 1.0 * (solid.limit >= 0), 2)
    draw_lines(axes, solid.lines, EDGE_COLOUR, EDGE_WIDTH, 3)


def _draw_solid(axes: Any, solid: SeenSolid, colours: Colours, shape: Inscribed | None, look: Look) -> None:
    """Draw a solid in its box, with the machine, a shape that fits in, and the names of its faces."""
    region, eye = solid.region, solid.eye
    lines = machine_lines(region)
    fit_bare(axes, _content(solid))
    _draw_faces(axes, solid, colours)
    before, hidden = _draw_lines(axes, solid, lines, look)
    for edge in [] if shape is None else edges_of(shape):
        hidden |= _draw_hidden(axes, solid, dense(edge * solid.scale))
    home = region._question.space.start * solid.scale
    if ((home >= region.bounds[0] * solid.scale) & (home <= region.bounds[1] * solid.scale)).all():
        _mark(axes, eye.seen(home)[:2], is_hidden=_is_hidden(solid))
        hidden |= solid.raster.mask_of(eye.seen(home[None]))
    draw_box(axes, eye, box_of(region, solid.scale), look, [eye.seen(dense(line))[:, :2] for line in lines])
    _name_faces(axes, solid, colours, before, hidden)


def _is_hidden(solid: SeenSolid) -> bool:
    """True if the start is within the solid, or behind it."""
    return bool(solid.hides((solid.region._question.space.start * solid.scale)[None])[0])


def _mark(axes: Any, place: Floats, *, is_hidden: bool) -> None:
    """The start, as a cross that is seen on every colour; pale, as lines are, where it is in the solid or behind it."""
    pale, bold = ("white", 7.0, 0.9 * EDGE_WIDTH, 4.0), (("white", 11.0, 3.0, 6.0), ("black", 9.0, 1.2, 7.0))
    for colour, size, width, order in (pale,) if is_hidden else bold:
        axes.plot(*place, "+", color=colour, markersize=size, markeredgewidth=width, zorder=order)


def _draw_lines(axes: Any, solid: SeenSolid, lines: list[Floats], look: Look) -> tuple[Mask, Mask]:
    """Draw lines of the machine whole before the solid, dotted in it and behind; masks of the pixels of both."""
    before, hidden = np.zeros((2, *solid.limit.shape), bool)
    for line in lines:
        points = dense(line)
        is_hidden = solid.hides(points)
        seen = np.where(is_hidden[:, None], np.nan, solid.eye.seen(points)[:, :2])
        axes.plot(*seen.T, color=look.paper, linewidth=MACHINE_WIDTH + HALO, zorder=3.5, solid_capstyle="butt")
        axes.plot(*seen.T, color=look.soft, linewidth=MACHINE_WIDTH, zorder=4, solid_capstyle="round")
        before |= solid.raster.mask_of(seen)
        hidden |= _draw_hidden(axes, solid, np.where(is_hidden[:, None], points, np.nan))
    return before, hidden


def _draw_hidden(axes: Any, solid: SeenSolid, points: Floats) -> Mask:
    """Draw a line (n, 3) in the solid or behind it, dotted, with gaps at NaN; the mask of its pixels."""
    seen = solid.eye.seen(points)[:, :2]
    axes.plot(*seen.T, color="white", linewidth=EDGE_WIDTH, linestyle=DOTTED, alpha=0.9, zorder=4)
    return solid.raster.mask_of(seen)


def _name_faces(axes: Any, solid: SeenSolid, colours: Colours, before: Mask, hidden: Mask) -> None:
    """Write the name of its limit on each face that has room, off lines before it, and off hidden ones if it can."""
    if is_told_apart(solid.region):
        labels, names = solid.limit, [limit_name(*limit) for limit in solid.region.limits]
        tints = colours.rgb[colours.place]
    else:
        labels = np.where(solid.limit >= 0, colours.place[solid.limit], -1)
        names, tints = [group.name for group in colours.groups], colours.rgb
    pixel = float(np.ptp(axes.transData.transform([[0.0, 0.0], [solid.raster.pixel, 0.0]])[:, 0]))
    free, covered = counted_around(before, 2) == 0, counted_around(hidden, 1) > 0
    for label in np.unique(labels[labels >= 0]).tolist():
        style: dict[str, Any] = {"ha": "center", "va": "center", "zorder": 5}
        text = axes.text(*solid.raster.low, names[label], fontsize=LETTERS, **style)
        box = text.get_window_extent()
        half = [int(0.5 * side / pixel + 4.0 / pixel) + 1 for side in (box.width, box.height)]
        place = _room((labels == label) & free, covered, half[0], half[1])
        if place is None:
            text.remove()
            continue
        column, row = place
        shade = in_the_light(solid.normal[row, column], solid.eye, tints[label])
        text.set_color("white" if shade @ LIGHTNESS < BRIGHT else "black")
        text.set_position(solid.raster.low + solid.raster.pixel * place)


def _room(mask: Mask, covered: Mask, wide: int, tall: int) -> Ints | None:
    """Column and row of the middle of a rectangle within a mask: of those that cover least, the most central one."""
    used = [np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0)]
    if not all(map(len, used)):
        return None
    part = np.s_[used[0][0] : used[0][-1] + 1, used[1][0] : used[1][-1] + 1]
    fits = counted_around(mask[part], wide, tall) == (2 * wide + 1) * (2 * tall + 1)
    if not fits.any():
        return None
    cost = counted_around(covered[part], wide, tall)
    fits &= cost == cost[fits].min()
    while (inner := counted_around(fits, 2) == 25).any():
        fits = inner
    places = np.argwhere(fits)
    row, column = places[np.linalg.norm(places - places.mean(axis=0), axis=1).argmin()]
    return np.array([used[1][0] + column, used[0][0] + row])


def _draw_second(axes: Any, solid: SeenSolid, colours: Colours, look: Look) -> None:
    """Draw the solid from below, with the directions of its coordinates."""
    left, right, low, high = solid.raster.extent
    fit_bare(axes, np.array([[left, low], [right, high]]), (4.0, 4.0, 46.0, 4.0))
    _draw_faces(axes, solid, colours)
    nothing = np.zeros(solid.limit.shape, bool)
    _name_faces(axes, solid, colours, nothing, nothing)
    below: dict[str, Any] = {"textcoords": "offset points", "annotation_clip": False, "ha": "center", "va": "top"}
    axes.annotate(
        "from below", (0.5 * (left + right), low), xytext=(0.0, -6.0), fontsize=SMALL, color=look.soft, **below
    )
    unit = float(axes.transData.inverted().get_matrix()[0, 0]) * axes.get_figure(root=True).dpi / 72.0
    corner = np.array([left, low]) + unit * np.array([24.0, -24.0])
    draw_triad(axes, solid.eye, look, corner, solid.region.names)


def _draw_slices(panels: list[Any], solid: SeenSolid, colours: Colours, shape: Inscribed | None, look: Look) -> None:
    """Draw slices through the start, or through the middle of a shape."""
    region, order = solid.region, solid.eye.order
    start, (low, high) = region._question.space.start, region.bounds
    at = start if shape is None else shape.centre
    at = np.where((at >= low) & (at <= high), at, 0.5 * (low + high))
    factors = np.array(for_people(region.units)[0])
    for panel, axis in zip(panels, reversed(order), strict=True):
        plane = plane_across(axis, float(at[axis]), order)
        draw_slice(panel, region, plane, look, colours.place, colours.rgb)
        panel.set_anchor("W")
        if abs(start[axis] - at[axis]) < region.resolution[axis]:
            panel.plot(*(start * factors)[plane.across], "+", color=look.ink, markersize=7.0, zorder=5)
        if shape is not None:
            panel.plot(*(outline_of(shape, plane) * factors[plane.across]).T, color=look.ink, **DASHED)
