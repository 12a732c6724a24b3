"""Axes and surfaces of pictures that workspaces are in."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Ints
from ..checks import require_method
from ..drawing import SMALL, is_spatial, new_figure, require_spatial
from ..errors import InvalidArgument
from ..workspace.workspace_table import labels

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..workspace.region import Region

SIZE = (6.4, 4.8)
"""Of a new figure [inches]."""

FREE_EDGE = 0.1
"""Around axes [inches]: those of one scale are shrunk after their place was found."""

ELEVATION, AZIMUTH = 24.0, -58.0
"""Where the eye is [deg]."""

MOST_FACES = 40_000
"""Faces of a mesh that are drawn one by one; of a finer one, vertices that are near each other are drawn as one."""

LIGHT = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
DARKEST = 0.55
"""Brightness of faces that point away from the light."""

NEAR_SIDE = 0.62
"""Opacity of the near side of a workspace, through which the machine is seen."""

THINNEST, MANY_TICKS = 0.2, 0.6
"""Least side of a box in space, and the side from which on it has more than three ticks, as shares of its longest."""

Strings: TypeAlias = NDArray[np.str_]


def axes_for(ax: Axes | None, d: int) -> Axes:
    """Axes that were given, or those of a new figure, for a picture of d coordinates; their letters small.

    Raises
    ------
    InvalidArgument : two-dimensional axes for what is drawn in space, or the other way round.
    MissingLibrary : matplotlib is not installed.
    """
    if ax is None:
        figure = new_figure(*SIZE)
        figure.set_layout_engine("constrained", w_pad=FREE_EDGE, h_pad=FREE_EDGE)
        space: dict[str, Any] = {"projection": "3d", "elev": ELEVATION, "azim": AZIMUTH}
        ax = figure.add_subplot(**(space if d == 3 else {}))
    require_method("ax", ax, "tick_params", "matplotlib axes, or None")
    if d == 3:
        require_spatial(ax, "a workspace of three coordinates")
    elif is_spatial(ax):
        raise InvalidArgument("ax", "three-dimensional axes for a workspace of two coordinates", "two-dimensional ones")
    ax.tick_params(labelsize=SMALL)
    return ax


def frame_solid(axes: Any, region: Region, drawn: list[Floats], *, zoom: float = 0.86) -> None:
    """Show all that is drawn, points (n, 3) each, at one scale where all coordinates have one unit, with axes named."""
    points = np.concatenate(drawn)
    low, high = (points.min(axis=0), points.max(axis=0)) if len(points) else (np.zeros(3), np.ones(3))
    spans = np.maximum(high - low, THINNEST * float((high - low).max()))
    ends = 0.5 * (low + high) + 0.5 * spans * np.array([[-1.0], [1.0]])
    axes.set(**{f"{name}lim": tuple(pair) for name, pair in zip("xyz", ends.T, strict=True)})
    box = spans if len(set(region.units)) == 1 else np.ones(3)
    axes.set_box_aspect(tuple(box / box.max()), zoom=zoom)
    axes.set(**dict(zip(("xlabel", "ylabel", "zlabel"), labels(region), strict=True)))
    for name, side in zip("xyz", box / box.max(), strict=True):
        axes.locator_params(axis=name, nbins=5 if side > MANY_TICKS else 3)


def add_surface(axes: Any, vertices: Floats, faces: Ints, colours: Strings, *, see_through: bool) -> None:
    """Add a mesh in the light; where it is seen through, its far side first, then its near side, half transparent."""
    from matplotlib.colors import to_rgb
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    spans = np.ptp(vertices, axis=0)
    scaled = vertices / np.where(spans > 0.0, spans, 1.0)
    normals = vertex_normals(scaled, faces)[faces].sum(axis=1)  # smooth, so that slivers do not show
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0.0)
    bright = DARKEST + (1.0 - DARKEST) * 0.5 * (1.0 + normals @ LIGHT)
    names, of_faces = np.unique(colours, return_inverse=True)
    shaded = np.array([to_rgb(name) for name in names.tolist()])[of_faces] * bright[:, None]
    up, turn = np.radians([axes.elev, axes.azim])
    is_near = normals @ [np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)] > 0.0
    axes.computed_zorder = False
    for rows, alpha, zorder in ((~is_near, 1.0, 1), (is_near, NEAR_SIDE if see_through else 1.0, 3)):
        if rows.any():
            edges: Any = "none" if alpha < 1.0 else shaded[rows]
            looks: dict[str, Any] = {"facecolors": shaded[rows], "edgecolors": edges, "alpha": alpha}
            axes.add_collection3d(Poly3DCollection(vertices[faces[rows]], linewidths=0.2, zorder=zorder, **looks))


def thinned(vertices: Floats, faces: Ints, limits: Ints) -> tuple[Floats, Ints, Ints]:
    """A mesh with no more faces than are worth drawing: vertices in the same small box become their middle.

    Two sheets of the border that pass through one box stay apart: their normals point to different sides.

    Parameters
    ----------
    limits : of the vertices, (v,); the first in each box counts.
    """
    cells = 2.0 * np.cbrt(max(len(vertices), 1))
    while len(faces) > MOST_FACES:
        span = np.ptp(vertices, axis=0)
        low = vertices.min(axis=0)
        boxes = np.floor((vertices - low) / np.where(span > 0.0, span, 1.0) * cells).astype(np.int64)
        sides = (vertex_normals(vertices, faces) > 0.0) @ np.array([1, 2, 4])
        keys = boxes @ np.array([8, 1 << 22, 1 << 41]) + sides
        _, first, group = np.unique(keys, return_index=True, return_inverse=True)
        counts = np.bincount(group)
        vertices = np.stack([np.bincount(group, column) / counts for column in vertices.T], axis=1)
        faces, limits = group[faces], limits[first]
        faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
        cells *= 0.8
    return vertices, faces, limits


def vertex_normals(vertices: Floats, faces: Ints) -> Floats:
    """Sums of the outward normals of the faces around each vertex, (v, d)."""
    corners = vertices[faces]
    if faces.shape[1] == 2:
        along = corners[:, 1] - corners[:, 0]
        of_faces = np.column_stack([along[:, 1], -along[:, 0]])
    else:
        of_faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    around = np.zeros_like(vertices)
    for corner in faces.T:
        np.add.at(around, corner, of_faces)
    return around
