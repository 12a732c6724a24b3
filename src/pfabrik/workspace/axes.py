"""The axes that pictures of workspaces are drawn on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..checks import require_method
from ..drawing import SMALL, new_figure, require_spatial

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIZE = (6.4, 4.8)
"""Of a new figure [inches]."""

FREE_EDGE = 0.1
"""Around axes [inches]: those of one scale are shrunk after their place was found."""

ELEVATION, AZIMUTH = 24.0, -58.0
"""Where the eye is [deg]."""


def axes_for(ax: Axes | None, d: int) -> Axes:
    """Axes that were given, or those of a new figure, for a picture of d coordinates; their letters small.

    Raises
    ------
    InvalidArgument : two-dimensional axes for what is drawn in space.
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
    ax.tick_params(labelsize=SMALL)
    return ax
