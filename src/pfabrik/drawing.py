"""Figures, and the size of their letters."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .errors import InvalidArgument
from .extras import require

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


SMALL = 8.0
"""Size of letters [points]."""


def new_figure(
    width: float, height: float, paper: str | None = None, *, dpi: int = 150, layout: str | None = "constrained"
) -> Figure:
    """A new figure [inches] on a ground of a colour; MissingLibrary where matplotlib is not installed."""
    require("pictures", "matplotlib", "plot")
    from matplotlib import pyplot

    return pyplot.figure(figsize=(width, height), dpi=dpi, layout=layout, facecolor=paper)


def require_flat(ax: Axes) -> None:
    """Refuse three-dimensional axes: what is in space is drawn as an eye sees it."""
    if hasattr(ax, "get_zlim"):
        raise InvalidArgument("ax", "three-dimensional axes", "two-dimensional ones, as of figure.add_subplot()")
