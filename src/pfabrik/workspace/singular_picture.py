"""Pictures of singularities: over a workspace, and along a path."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .drawing import SMALL, axes_for
from .picture import labels, shown

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .singular import SingularityMap, SingularityTrack

LOCUS = "#d55e00"
MARK, FINE, FAINT = 9.0, 6.0, 0.5
LINES = {
    "serial": ("#0072b2", "-"),
    "parallel": ("#e69f00", "--"),
    "constraint": ("#009e73", "-."),
    "passive": ("#cc79a7", ":"),
}


def plot_map(found: SingularityMap, ax: Axes | None = None) -> Axes:
    """Draw the parallel measure of a plane, or of space, and the locus in it."""
    space = found.workspace
    d = len(space.names)
    axes = axes_for(ax, d)
    from matplotlib.collections import LineCollection

    points, locus = shown(space, found.points), shown(space, found.locus_vertices)
    parallel = np.asarray(found.measures.parallel)
    faces = list(locus[found.locus_faces])
    if d == 2:
        drawn = axes.scatter(
            points[:, 0], points[:, 1], c=parallel, s=MARK, marker="s", linewidths=0, cmap="cividis", vmin=0.0
        )
        axes.add_collection(LineCollection(faces, colors=LOCUS, linewidths=2.0))
        if len(set(space.units)) == 1:
            axes.set_aspect("equal")
    else:
        from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

        solid: Any = axes
        drawn = solid.scatter(*points.T, c=parallel, s=FINE, linewidths=0, cmap="cividis", vmin=0.0, alpha=FAINT)
        solid.add_collection3d(Poly3DCollection(faces, facecolors=LOCUS, edgecolors="none", alpha=0.8))
    axes.figure.colorbar(drawn, ax=axes, label="parallel measure", shrink=0.8, pad=0.12 if d == 3 else 0.03)
    axes.set(**dict(zip(("xlabel", "ylabel", "zlabel"), labels(space), strict=False)))
    axes.set_title(_title(found), fontsize=SMALL + 1)
    return axes


def _title(found: SingularityMap) -> str:
    what = "parallel singularities" if len(found.locus_faces) else "no parallel singularity"
    return f"{found.workspace.mechanism.name}: {what}"


def plot_track(found: SingularityTrack, ax: Axes | None = None) -> Axes:
    """Draw the measures along a path, one line each, and where it leads through parallel singularities."""
    axes = axes_for(ax, 2)
    for name, (colour, dashes) in LINES.items():
        values = np.asarray(getattr(found.measures, name))
        if np.isfinite(values).any():
            axes.plot(np.arange(1, len(values) + 1), values, color=colour, linestyle=dashes, label=name)
    for count, row in enumerate(found.crossings.tolist()):
        label = "" if count else "parallel singularity"
        axes.axvline(row + 0.5, color=LOCUS, linewidth=1.2, label=label)
    axes.set(xlabel="target", ylabel="measure of singularity", ylim=(0.0, None))
    axes.legend(frameon=False, fontsize=SMALL)
    return axes
