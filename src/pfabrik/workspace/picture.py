"""Pictures of workspaces: the border, each face in the colour of the limit that forms it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Ints
from ..drawing import SMALL
from .axes import axes_for
from .border import REST, Group, groups_of
from .sizes import in_words

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .region import Region

MOST_FACES = 40_000
"""Faces of a mesh that are drawn one by one; of a finer one, vertices that are near each other are drawn as one."""

LIGHT = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
DARKEST = 0.55
"""Brightness of faces that point away from the light."""

WITHIN = "#eef3f7"
"""Colour of the area within reach, in a plane."""

SHORTEST_NAMED = 0.08
"""Shortest stretch of a border that its limit is written beside, as a share of the picture's diagonal."""

OFF, SIDEWAYS = 5.0, 0.2
"""Distance of a name from the border [points]; component of a direction from which on it stands to that side."""

Strings: TypeAlias = NDArray[np.str_]


def plot(region: Region, ax: Axes | None = None) -> Axes:
    """Draw a workspace on matplotlib axes, or on those of a new figure, which is `ax.figure`."""
    d = len(region.names)
    axes = axes_for(ax, d)
    from matplotlib.lines import Line2D

    groups = groups_of(region)
    (_draw_solid if d == 3 else _draw_plane)(axes, region, groups)
    handles = [Line2D([], [], color=colour, linewidth=4, label=label) for label, colour, *_ in groups]
    if handles:
        anchor = (1.12 if d == 3 else 1.02, 0.5)
        legend = axes.legend(
            handles=handles,
            loc="center left",
            bbox_to_anchor=anchor,
            frameon=False,
            fontsize=SMALL,
            title_fontsize=SMALL,
        )
        legend.set_title("border formed by")
    axes.set_title(f"{region.mechanism.name}: {in_words(region)}", fontsize=SMALL + 1)
    return axes


def _face_colours(region: Region, groups: list[Group]) -> Strings:
    colours = np.full(len(region.limits), REST)
    for group in groups:
        colours[group.limits] = group.colour
    return colours


def _draw_plane(axes: Any, region: Region, groups: list[Group]) -> None:
    from matplotlib.collections import LineCollection
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    points = shown(region, region.vertices)
    segments = points[region.faces]
    loops = _loops(region.faces)
    for loop in loops:
        _name_stretches(axes, region, points, loop)
    if loops:
        ends = [np.vstack([points[loop], points[loop[:1]]]) for loop in loops]
        codes = [[Path.MOVETO, *[Path.LINETO] * (len(end) - 2), Path.CLOSEPOLY] for end in ends]
        axes.add_patch(PathPatch(Path(np.concatenate(ends), np.concatenate(codes)), facecolor=WITHIN, edgecolor="none"))
    axes.add_collection(
        LineCollection(
            list(segments),
            colors=_face_colours(region, groups)[region.face_limit].tolist(),
            linewidths=1.8,
            capstyle="round",
        )
    )
    axes.set(**dict(zip(("xlabel", "ylabel"), labels(region), strict=True)))
    axes.autoscale_view()
    axes.margins(0.1)  # for the names beside the border
    if len(set(region.units)) == 1:
        axes.set_aspect("equal")


def _name_stretches(axes: Any, region: Region, points: Floats, loop: list[int]) -> None:
    """Write the limit that forms each stretch of a border beside its middle, outside; short stretches have no room."""
    limit_of = dict(zip(map(tuple, region.faces.tolist()), region.face_limit.tolist(), strict=True))
    limits = np.array([limit_of[pair] for pair in zip(loop, [*loop[1:], loop[0]], strict=True)])
    changes = np.flatnonzero(limits != np.roll(limits, 1))
    first = int(changes[0]) if len(changes) else 0
    corners, limits = points[np.roll(loop, -first)], np.roll(limits, -first)
    steps = np.roll(corners, -1, axis=0) - corners
    lengths = np.linalg.norm(steps, axis=1)
    for stretch in np.split(np.arange(len(loop)), np.flatnonzero(np.diff(limits)) + 1):
        along = np.cumsum(lengths[stretch])
        if along[-1] < SHORTEST_NAMED * np.linalg.norm(np.ptp(points, axis=0)):
            continue
        middle = stretch[int(np.searchsorted(along, 0.5 * along[-1]))]
        outward = np.array([steps[middle, 1], -steps[middle, 0]]) / max(lengths[middle], 1e-300)
        axes.annotate(
            " ".join(region.limits[limits[middle]]).strip(),
            corners[middle] + 0.5 * steps[middle],
            xytext=OFF * outward,
            textcoords="offset points",
            ha="left" if outward[0] > SIDEWAYS else "right" if outward[0] < -SIDEWAYS else "center",
            va="bottom" if outward[1] > SIDEWAYS else "top" if outward[1] < -SIDEWAYS else "center",
            fontsize=SMALL,
        )


def _draw_solid(axes: Any, region: Region, groups: list[Group]) -> None:
    from matplotlib.colors import to_rgb
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    vertices, faces, limits = _thinned(shown(region, region.vertices), region.faces, region.face_limit)
    spans = np.ptp(vertices, axis=0) if len(vertices) else np.ones(3)
    box = spans if len(set(region.units)) == 1 else np.ones(3)
    corners = vertices[faces]
    scaled = corners / spans * box
    normals = _smooth(np.cross(scaled[:, 1] - scaled[:, 0], scaled[:, 2] - scaled[:, 0]), faces, len(vertices))
    bright = DARKEST + (1.0 - DARKEST) * 0.5 * (1.0 + normals @ LIGHT)
    palette = np.array([to_rgb(colour) for colour in _face_colours(region, groups).tolist()])
    colours = palette[limits] * bright[:, None]
    axes.add_collection3d(Poly3DCollection(corners, facecolors=colours, edgecolors=colours, linewidths=0.2))
    if len(vertices):
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(tuple(box / box.max()), zoom=0.86)
    axes.set(**dict(zip(("xlabel", "ylabel", "zlabel"), labels(region), strict=True)))
    axes.locator_params(nbins=5)


def shown(region: Region, points: Floats) -> Floats:
    """Coordinates as people read them: angles in degrees."""
    return points * np.where([unit == "rad" for unit in region.units], 180.0 / np.pi, 1.0)


def labels(region: Region) -> list[str]:
    return [
        f"{name} [{'deg' if unit == 'rad' else unit}]" for name, unit in zip(region.names, region.units, strict=True)
    ]


def _smooth(normals: Floats, faces: Ints, n: int) -> Floats:
    """Unit normals of faces, each the mean of those around its corners: so that slivers do not show."""
    around = np.zeros((n, 3))
    for corner in faces.T:
        np.add.at(around, corner, normals)
    mean = around[faces].sum(axis=1)
    lengths = np.linalg.norm(mean, axis=1, keepdims=True)
    return np.asarray(np.divide(mean, lengths, out=np.zeros_like(mean), where=lengths > 0.0))


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


def _thinned(vertices: Floats, faces: Ints, limits: Ints) -> tuple[Floats, Ints, Ints]:
    """A mesh with no more faces than are worth drawing: vertices in the same small box become their middle."""
    cells = 2.0 * np.cbrt(max(len(vertices), 1))
    while len(faces) > MOST_FACES:
        span = np.ptp(vertices, axis=0)
        low = vertices.min(axis=0)
        boxes = np.floor((vertices - low) / np.where(span > 0.0, span, 1.0) * cells).astype(np.int64)
        _, group = np.unique(boxes @ np.array([1, 1 << 20, 1 << 40]), return_inverse=True)
        counts = np.bincount(group)
        vertices = np.stack([np.bincount(group, column) / counts for column in vertices.T], axis=1)
        faces = group[faces]
        whole = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
        faces, limits = faces[whole], limits[whole]
        cells *= 0.8
    return vertices, faces, limits
