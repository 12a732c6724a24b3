"""The axes that pictures of workspaces are drawn on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..checks import require_method
from ..errors import InvalidArgument
from ..extras import require

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIZE = (6.4, 4.8)
"""Of a new figure [inches]."""

ELEVATION, AZIMUTH = 24.0, -58.0
"""Where the eye is [deg]."""

SMALL = 8.0
"""Letters [points]."""


def axes_for(ax: Axes | None, d: int) -> Axes:
    """Axes that were given, or those of a new figure, for a picture of d coordinates; their letters small.

    Raises
    ------
    InvalidArgument : two-dimensional axes for what is drawn in space.
    MissingLibrary : matplotlib is not installed.
    """
    require("pictures", "matplotlib", "plot")
    if ax is not None:
        require_method("ax", ax, "tick_params", "matplotlib axes, or None")
    else:
        from matplotlib import pyplot

        figure = pyplot.figure(figsize=SIZE, dpi=150, layout="constrained")
        space: dict[str, Any] = {"projection": "3d", "elev": ELEVATION, "azim": AZIMUTH}
        ax = figure.add_subplot(**(space if d == 3 else {}))
    if d == 3 and not hasattr(ax, "get_zlim"):
        expected = "three-dimensional ones, as of figure.add_subplot(projection='3d')"
        raise InvalidArgument("ax", "two-dimensional axes for a workspace of three coordinates", expected)
    ax.tick_params(labelsize=SMALL)
    return ax
