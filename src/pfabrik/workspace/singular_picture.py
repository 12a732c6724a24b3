"""Pictures of singularities: over a workspace, and along a path."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Floats, Ints
from ..drawing import SMALL
from ..motion.singularities import Singularity
from .axes import axes_for
from .picture import labels, shown
from .region import Region
from .singular_slices import LOCUS, MAP, MEASURE, Field, plot_in_space

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MARK = 9.0
LINES = {
    "serial": ("#0072b2", "-"),
    "parallel": ("#e69f00", "--"),
    "constraint": ("#009e73", "-."),
    "passive": ("#cc79a7", ":"),
}


def plot_map(
    space: Region,
    step: Floats,
    points: Floats,
    measures: Singularity,
    vertices: Floats,
    faces: Ints,
    ax: Axes | None = None,
) -> Axes:
    """Draw the parallel measure at points (n, d) of a plane, or in slices of space, and the locus: vertices, faces."""
    parallel = np.asarray(measures.parallel)
    what = "parallel singularities" if len(faces) else "no parallel singularity"
    title = f"{space.mechanism.name}: {what}"
    if len(space.names) == 3:
        return plot_in_space(space, Field(points, step, parallel), vertices, faces, title, ax)
    axes = axes_for(ax, 2)
    from matplotlib.collections import LineCollection

    points = shown(space, points)
    drawn = axes.scatter(points[:, 0], points[:, 1], c=parallel, s=MARK, marker="s", linewidths=0, cmap=MAP, vmin=0.0)
    axes.add_collection(LineCollection(list(shown(space, vertices)[faces]), colors=LOCUS, linewidths=2.0))
    if len(set(space.units)) == 1:
        axes.set_aspect("equal")
    axes.figure.colorbar(drawn, ax=axes, label=MEASURE, shrink=0.8, pad=0.03)
    axes.set(**dict(zip(("xlabel", "ylabel"), labels(space), strict=True)))
    axes.set_title(title, fontsize=SMALL + 1)
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
