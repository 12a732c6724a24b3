"""Pictures of singularities: over a workspace, and along a path."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import Floats, Ints
from ..drawing import SMALL
from ..motion.singularities import Singularity
from .axes import axes_for
from .picture import labels, shown
from .region import Region

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LOCUS = "#d55e00"
MARK, FINE, FAINT = 9.0, 6.0, 0.5
LINES = {
    "serial": ("#0072b2", "-"),
    "parallel": ("#e69f00", "--"),
    "constraint": ("#009e73", "-."),
    "passive": ("#cc79a7", ":"),
}


def plot_map(
    space: Region, points: Floats, measures: Singularity, vertices: Floats, faces: Ints, ax: Axes | None = None
) -> Axes:
    """Draw the parallel measure at points (n, d) of a plane, or of space, and the locus: vertices (v, d), faces."""
    d = len(space.names)
    axes = axes_for(ax, d)
    from matplotlib.collections import LineCollection

    points, parallel = shown(space, points), np.asarray(measures.parallel)
    locus = list(shown(space, vertices)[faces])
    if d == 2:
        drawn = axes.scatter(
            points[:, 0], points[:, 1], c=parallel, s=MARK, marker="s", linewidths=0, cmap="cividis", vmin=0.0
        )
        axes.add_collection(LineCollection(locus, colors=LOCUS, linewidths=2.0))
        if len(set(space.units)) == 1:
            axes.set_aspect("equal")
    else:
        from mpl_toolkits.mplot3d.art3d import Poly3DCollection

        solid: Any = axes
        drawn = solid.scatter(*points.T, c=parallel, s=FINE, linewidths=0, cmap="cividis", vmin=0.0, alpha=FAINT)
        solid.add_collection3d(Poly3DCollection(locus, facecolors=LOCUS, edgecolors="none", alpha=0.8))
    axes.figure.colorbar(drawn, ax=axes, label="parallel measure", shrink=0.8, pad=0.12 if d == 3 else 0.03)
    axes.set(**dict(zip(("xlabel", "ylabel", "zlabel"), labels(space), strict=False)))
    what = "parallel singularities" if locus else "no parallel singularity"
    axes.set_title(f"{space.mechanism.name}: {what}", fontsize=SMALL + 1)
    return axes


def plot_track(measures: Singularity, crossings: Ints, ax: Axes | None = None) -> Axes:
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
