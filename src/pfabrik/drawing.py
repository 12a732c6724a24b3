"""Figures, sizes of letters and axes in space, for pictures of machines and of workspaces."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .errors import InvalidArgument
from .extras import require

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SMALL = 8.0
"""Size of letters [points]."""


def new_figure(width: float, height: float, *, dpi: int = 150, layout: str | None = "constrained") -> Figure:
    """A new figure [inches]; MissingLibrary where matplotlib is not installed."""
    require("pictures", "matplotlib", "plot")
    from matplotlib import pyplot

    return pyplot.figure(figsize=(width, height), dpi=dpi, layout=layout)


def is_spatial(ax: Axes) -> bool:
    """True if axes are three-dimensional."""
    return hasattr(ax, "get_zlim")


def require_spatial(ax: Axes, what: str) -> None:
    """Refuse two-dimensional axes for what is drawn in space."""
    if not is_spatial(ax):
        expected = "three-dimensional ones, as of figure.add_subplot(projection='3d')"
        raise InvalidArgument("ax", f"two-dimensional axes for {what}", expected)
