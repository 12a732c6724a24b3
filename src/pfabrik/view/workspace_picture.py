"""Pictures of workspaces: the border, each face in the colour of the limit that forms it."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from ..answers.words import limit_name
from ..arrays import Floats, Ints
from ..drawing import SMALL, keep_apart
from ..skeleton import skeleton_of
from ..workspace.border import Group, group_of_limits, groups_of
from ..workspace.space import POSITIONS
from ..workspace.workspace_table import in_words, labels, shown
from .border_parts import patches_of
from .surfaces import add_surface, axes_for, frame_solid, thinned

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..workspace.region import Region

WITHIN = "#eef3f7"
"""Colour of the area within reach, in a plane."""

SHORTEST_NAMED = 0.08
"""Shortest stretch of a border that its limit is written beside, as a share of the picture's diagonal."""

DASHES = (0, (3.0, 0.7))
"""Of a border in a plane that no motor's stop forms."""

BORDER = 2.2
"""Width of a border in a plane [points]."""

MACHINE = "#404040"
"""Colour of the machine in its workspace."""

SMALLEST_WITH_MACHINE = 0.1
"""Least size of a workspace that its machine is drawn with, as a share of the machine's: else it would be a dot."""

MOST_WIDENINGS, EDGE_FREE = 12, 12.0
"""How often axes are widened for names, at most, and the distance of names from their edge [pixels]."""

OFF, SIDEWAYS = 5.0, 0.2
"""Distance of a name from the border [points]; component of a direction from which on it stands to that side."""


def plot_workspace(region: Region, ax: Axes | None = None) -> Axes:
    """Draw a workspace on matplotlib axes, or on those of a new figure, which is `ax.figure`."""
    d = len(region.names)
    axes = axes_for(ax, d)
    groups = groups_of(region)
    (_draw_solid if d == 3 else _draw_plane)(axes, region, groups)
    if groups:
        _draw_key(axes, groups, d)
    axes.set_title(f"{region.mechanism.name}: {in_words(region)}", fontsize=SMALL + 1)
    (_make_room if d == 2 else keep_apart)(axes)
    return axes


def _draw_key(axes: Any, groups: list[Group], d: int) -> None:
    """The limits beside the axes: stops of motors, links that are too near, then all else, each with its line."""
    from matplotlib.lines import Line2D

    handles: list[Line2D] = []
    kinds = ((True, False, "stops of motors"), (False, True, "links"), (False, False, "passive joints, reach"))
    for is_motors, is_links, title in kinds:
        of_kind = [group for group in groups if (group.is_motors, group.is_links) == (is_motors, is_links)]
        if of_kind:
            handles.append(Line2D([], [], linestyle="", label=title))
        for group in of_kind:
            style: Any = "-" if is_motors or d == 3 else DASHES
            handles.append(Line2D([], [], color=group.colour, linewidth=4, linestyle=style, label=group.name))
    anchor = (1.12 if d == 3 else 1.02, 0.5)
    letters: dict[str, Any] = {"fontsize": SMALL, "title_fontsize": SMALL}
    legend = axes.legend(handles=handles, loc="center left", bbox_to_anchor=anchor, frameon=False, **letters)
    legend.set_title("border formed by")


def _draw_plane(axes: Any, region: Region, groups: list[Group]) -> None:
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    points = shown(region, region.vertices)
    if groups:
        place = group_of_limits(region, groups)
        patches = patches_of(region, region.vertices, region.faces, place[region.vertex_limit], place)
        points = shown(region, patches.vertices)
        group_of = dict(zip(map(tuple, patches.faces.tolist()), patches.groups.tolist(), strict=True))
        for loop in _loops(patches.faces):
            for group, corners in _stretches(loop, group_of):
                drawn = groups[group]
                style: Any = "-" if drawn.is_motors else DASHES
                axes.plot(*points[corners].T, color=drawn.colour, linewidth=BORDER, linestyle=style, zorder=4)
    loops = _loops(region.faces)
    places = shown(region, region.vertices)
    machine = draw_machine(axes, region)
    for loop in loops:
        _name_stretches(axes, region, places, loop)
    if loops:
        ends = [np.vstack([places[loop], places[loop[:1]]]) for loop in loops]
        codes = [[Path.MOVETO, *[Path.LINETO] * (len(end) - 2), Path.CLOSEPOLY] for end in ends]
        filled = Path(np.concatenate(ends), np.concatenate(codes))
        axes.add_patch(PathPatch(filled, facecolor=WITHIN, edgecolor="none", zorder=0))
    axes.set(**dict(zip(("xlabel", "ylabel"), labels(region), strict=True)))
    axes.autoscale_view()
    axes.margins(0.05)
    if machine or len(set(region.units)) == 1:
        axes.set_aspect("equal")


def _make_room(axes: Any) -> None:
    """Widen the ends of axes in a plane until the names beside the border are within them."""
    root = axes.get_figure(root=True)
    for _ in range(MOST_WIDENINGS):
        root.draw_without_rendering()
        box = axes.get_window_extent()
        names = np.array([text.get_window_extent().extents for text in axes.texts]).reshape(-1, 4)
        over = np.array([*(box.extents[:2] - names[:, :2].min(axis=0, initial=np.inf)),
                         *(names[:, 2:].max(axis=0, initial=-np.inf) - box.extents[2:])])  # fmt: skip
        over = np.maximum(np.where(np.isfinite(over), over, 0.0) + EDGE_FREE, 0.0)
        if (over <= 0.5 * EDGE_FREE).all():
            return
        for name, size, low, high in (("x", box.width, over[0], over[2]), ("y", box.height, over[1], over[3])):
            start, end = getattr(axes, f"get_{name}lim")()
            unit = (end - start) / size
            axes.set(**{f"{name}lim": (start - unit * low, end + unit * high)})


def _stretches(loop: list[int], group_of: dict[tuple[int, ...], int]) -> Iterator[tuple[int, list[int]]]:
    """The stretches of a loop that are of one group, each with the places that it passes, its end included."""
    ends = [*loop[1:], loop[0]]
    groups = [group_of[pair] for pair in zip(loop, ends, strict=True)]
    first = next((k for k in range(len(loop)) if groups[k] != groups[k - 1]), 0)
    order = [(first + k) % len(loop) for k in range(len(loop))]
    for group, members in groupby(order, key=groups.__getitem__):
        places = list(members)
        yield group, [*(loop[place] for place in places), ends[places[-1]]]


def _name_stretches(axes: Any, region: Region, points: Floats, loop: list[int]) -> None:
    """Write the limit that forms each stretch of a border beside its middle, outside; short stretches have no room."""
    limit_of = dict(zip(map(tuple, region.faces.tolist()), region.face_limit.tolist(), strict=True))
    for limit, corners in _stretches(loop, limit_of):
        steps = np.diff(points[corners], axis=0)
        along = np.cumsum(np.linalg.norm(steps, axis=1))
        if along[-1] < SHORTEST_NAMED * np.linalg.norm(np.ptp(points, axis=0)):
            continue
        middle = int(np.searchsorted(along, 0.5 * along[-1]))
        outward = np.array([steps[middle, 1], -steps[middle, 0]]) / max(np.linalg.norm(steps[middle]), 1e-300)
        axes.annotate(
            limit_name(*region.limits[limit]),
            points[corners[middle]] + 0.5 * steps[middle],
            xytext=OFF * outward,
            textcoords="offset points",
            ha="left" if outward[0] > SIDEWAYS else "right" if outward[0] < -SIDEWAYS else "center",
            va="bottom" if outward[1] > SIDEWAYS else "top" if outward[1] < -SIDEWAYS else "center",
            fontsize=SMALL,
            zorder=5,
        )


def _draw_solid(axes: Any, region: Region, groups: list[Group]) -> None:
    vertices, faces, limits = thinned(region.vertices, region.faces, region.vertex_limit)
    machine = draw_machine(axes, region)
    if groups and len(faces):
        place = group_of_limits(region, groups)
        patches = patches_of(region, vertices, faces, place[limits], place)
        colours = np.array([group.colour for group in groups])[patches.groups]
        add_surface(axes, shown(region, patches.vertices), patches.faces, colours, see_through=bool(machine))
    frame_solid(axes, region, [shown(region, vertices), *machine])


def draw_machine(axes: Any, region: Region) -> list[Floats]:
    """Draw the machine where the workspace starts, in thin lines; returns their points, (n, d) each.

    Nothing is drawn, and the list is empty, where a coordinate is an angle, and where the workspace is far smaller.
    """
    if not set(region.names) <= set(POSITIONS) or not len(region.faces):
        return []
    start = region._question.start
    skeleton = skeleton_of(region.mechanism if start is None else start)
    if np.ptp(region.bounds, axis=0).max() < SMALLEST_WITH_MACHINE * np.ptp(skeleton.points, axis=0).max():
        return []
    columns = [POSITIONS.index(name) for name in region.names]
    lines = [line.outline for line in skeleton.parts] + list(skeleton.rails)
    drawn = [line[:, columns] for line in lines]
    for line in drawn:
        axes.plot(*line.T, color=MACHINE, linewidth=1.1, solid_capstyle="round", zorder=2)
    places = np.array([mark.place for mark in skeleton.marks])[:, columns]
    axes.plot(*places.T, color=MACHINE, linestyle="", marker="o", markersize=2.2, zorder=2)
    axes.plot(*skeleton.reference[columns][:, None], color=MACHINE, marker="+", markersize=8, zorder=2)
    return [*drawn, places]


def _loops(segments: Ints) -> list[list[int]]:
    """Closed loops of segments (f, 2), each as the places that it passes."""
    following: dict[int, list[int]] = {}
    for start, end in segments.tolist():
        following.setdefault(start, []).append(end)
    loops = []
    while following:
        start = next(iter(following))
        loop, here = [], start
        while here in following:
            loop.append(here)
            after = following[here].pop()
            if not following[here]:
                del following[here]
            here = after
        loops.append(loop)
    return loops
