"""Pictures of workspaces in a plane: the border named beside it, the machine, and the limits in a key."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..answers.words import limit_name
from ..capabilities.workspace.border import Group, group_of_limits, groups_of
from ..capabilities.workspace.space import POSITIONS
from ..capabilities.workspace.workspace_table import labels, shown
from ..common.arrays import Floats
from ..common.drawing import SMALL
from .canvas import draw_title, number_axes
from .frame import dense, machine_of, title_of
from .looks import Look
from .skeleton import Skeleton
from .slices import DASHED, area_of, loops_of, outline_of, stretches_of

if TYPE_CHECKING:
    from ..capabilities.workspace.inscribed import Inscribed
    from ..capabilities.workspace.region import Region

SHORTEST_NAMED = 0.08
"""Shortest stretch of a border that its limit is written beside, as a share of the picture's diagonal."""

DASHES = (0, (3.0, 0.7))
"""Of a border in a plane that no motor's stop forms."""

BORDER, MACHINE = 2.2, 1.1
"""Width of a border in a plane, and of the lines of the machine [points]."""

WINDOW = 0.75
"""How much is shown around a workspace at most, as a share of its size: a machine may be far larger."""

MOST_WIDENINGS, EDGE_FREE, WIDEST = 12, 12.0, 2.0
"""How often axes are widened for names, at most, the distance of names from their edge [pixels], and how much wider
they become at most: where that is not enough, the key alone names limits."""

BESIDE = 5.0
"""Width of a figure from which on its key is beside the axes [inches]."""

SHARES = (0.5, 0.3, 0.7, 0.15, 0.85)
"""Where along its stretch a name may stand, the best first."""

OFF, SIDEWAYS = 5.0, 0.2
"""Distance of a name from the border [points]; component of a direction from which on it stands to that side."""


def plot_plane(region: Region, axes: Any, shape: Inscribed | None, look: Look) -> None:
    """Draw a workspace in a plane on axes."""
    groups = groups_of(region)
    _draw_plane(axes, region, groups, look)
    if shape is not None:
        axes.plot(*shown(region, outline_of(shape)).T, color=look.ink, **DASHED)
    width = axes.figure.bbox.width / axes.figure.dpi
    _draw_key(axes, groups, look, is_below=width < BESIDE)
    draw_title(axes, title_of(region), look)
    _make_room(axes)
    number_axes(axes)


def _draw_key(axes: Any, groups: list[Group], look: Look, *, is_below: bool) -> None:
    """The limits beside the axes: stops of motors, links that are too near, then all else, each with its line.

    Parameters
    ----------
    is_below : True for a short key below the axes, without the names of kinds.
    """
    from matplotlib.lines import Line2D

    handles: list[Line2D] = []
    kinds = ((True, False, "stops of motors"), (False, True, "links"), (False, False, "passive joints, reach"))
    for is_motors, is_links, title in kinds:
        of_kind = [group for group in groups if (group.is_motors, group.is_links) == (is_motors, is_links)]
        if of_kind and not is_below:
            handles.append(Line2D([], [], linestyle="", label=title))
        for group in of_kind:
            style: Any = "-" if is_motors else DASHES
            handles.append(Line2D([], [], color=group.colour, linewidth=4, linestyle=style, label=group.name))
    letters: dict[str, Any] = {"fontsize": SMALL, "title_fontsize": SMALL, "labelcolor": look.ink}
    if is_below:
        columns = min(len(handles), 2)
        axes.figure.legend(handles=handles, loc="outside lower center", ncols=columns, frameon=False, **letters)
        return
    legend = axes.legend(handles=handles, loc="center left", bbox_to_anchor=(1.02, 0.5), frameon=False, **letters)
    legend.set_title("border formed by")
    legend.get_title().set_color(look.ink)


def _draw_plane(axes: Any, region: Region, groups: list[Group], look: Look) -> None:
    from matplotlib.patches import PathPatch

    place = group_of_limits(region, groups)
    group_of = dict(zip(map(tuple, region.faces.tolist()), place[region.face_limit].tolist(), strict=True))
    loops, places = loops_of(region.faces), shown(region, region.vertices)
    for loop in loops:
        for group, corners in stretches_of(loop, group_of):
            drawn = groups[group]
            style: Any = "-" if drawn.is_motors else DASHES
            axes.plot(*places[corners].T, color=drawn.colour, linewidth=BORDER, linestyle=style, zorder=4)
    skeleton = machine_of(region)
    if skeleton is not None:
        _draw_machine(axes, skeleton, [POSITIONS.index(name) for name in region.names], look)
    area = area_of([places[loop] for loop in loops])
    axes.add_patch(PathPatch(area, facecolor=look.within, edgecolor="none", zorder=0))
    axes.set(**dict(zip(("xlabel", "ylabel"), labels(region), strict=True)))
    axes.autoscale_view()
    axes.margins(0.05)
    low, high = places.min(axis=0), places.max(axis=0)
    around = WINDOW * (high - low if len(set(region.units)) > 1 else np.full(2, (high - low).max()))
    for k, name in enumerate("xy"):
        start, end = getattr(axes, f"get_{name}lim")()
        axes.set(**{f"{name}lim": (max(start, low[k] - around[k]), min(end, high[k] + around[k]))})
    if skeleton is not None or len(set(region.units)) == 1:
        axes.set_aspect("equal")
    axes.get_figure(root=True).draw_without_rendering()  # names are placed on axes that are laid out
    lines = [(line.get_xydata(), line.get_linestyle() != "None") for line in axes.lines]
    dots = np.concatenate([dense(each) if is_line and len(each) > 1 else each for each, is_line in lines])
    for loop in loops:
        _name_stretches(axes, region, places, loop, look, axes.transData.transform(dots))


def _make_room(axes: Any) -> None:
    """Widen the ends of axes in a plane until the names beside the border are within them, or leave the names out."""
    root = axes.get_figure(root=True)
    usual = axes.get_xlim(), axes.get_ylim()
    for _ in range(MOST_WIDENINGS):
        for _ in range(2):  # a layout of axes at one scale is settled by the second
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
        if any(
            np.ptp(now) > WIDEST * np.ptp(was)
            for now, was in zip((axes.get_xlim(), axes.get_ylim()), usual, strict=True)
        ):
            break
    for text in list(axes.texts):
        text.remove()
    axes.set(xlim=usual[0], ylim=usual[1])


def _name_stretches(axes: Any, region: Region, points: Floats, loop: list[int], look: Look, dots: Floats) -> None:
    """Write the limit that forms each stretch of a border beside it, outside, where it covers least of what is drawn.

    Short stretches have no room.

    Parameters
    ----------
    dots : on what is drawn (n, 2) [pixels].
    """
    from matplotlib.patheffects import withStroke

    limit_of = dict(zip(map(tuple, region.faces.tolist()), region.face_limit.tolist(), strict=True))
    for limit, corners in stretches_of(loop, limit_of):
        steps = np.diff(points[corners], axis=0)
        along = np.cumsum(np.linalg.norm(steps, axis=1))
        if along[-1] < SHORTEST_NAMED * np.linalg.norm(np.ptp(points, axis=0)):
            continue
        tried: list[tuple[int, int, Any]] = []
        for share in SHARES:
            place = int(np.searchsorted(along, share * along[-1]))
            outward = np.array([steps[place, 1], -steps[place, 0]]) / max(np.linalg.norm(steps[place]), 1e-300)
            name = axes.annotate(
                limit_name(*region.limits[limit]),
                points[corners[place]] + 0.5 * steps[place],
                xytext=OFF * outward,
                textcoords="offset points",
                ha="left" if outward[0] > SIDEWAYS else "right" if outward[0] < -SIDEWAYS else "center",
                va="bottom" if outward[1] > SIDEWAYS else "top" if outward[1] < -SIDEWAYS else "center",
                fontsize=SMALL,
                color=look.ink,
                zorder=5,
                path_effects=[withStroke(linewidth=2.0, foreground=look.paper)],
            )
            box = name.get_window_extent().padded(1.0)
            covered = int(np.count_nonzero((dots > box.min).all(axis=1) & (dots < box.max).all(axis=1)))
            tried.append((covered, len(tried), name))
        best = min(tried)[2]
        for *_, name in tried:
            if name is not best:
                name.remove()
        best.set_bbox({"facecolor": look.paper, "edgecolor": "none", "pad": 0.5})


def _draw_machine(axes: Any, skeleton: Skeleton, columns: list[int], look: Look) -> None:
    """Draw a machine in a plane in thin lines."""
    for line in [*(line.outline for line in skeleton.parts), *skeleton.rails]:
        axes.plot(*line[:, columns].T, color=look.soft, linewidth=MACHINE, solid_capstyle="round", zorder=2)
    places = np.array([mark.place for mark in skeleton.marks])[:, columns]
    axes.plot(*places.T, color=look.soft, linestyle="", marker="o", markersize=2.2, zorder=2)
    axes.plot(*skeleton.reference[columns][:, None], color=look.soft, marker="+", markersize=8, zorder=2)
