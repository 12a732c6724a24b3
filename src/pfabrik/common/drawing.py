"""Figures, and the size of their letters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypeAlias, runtime_checkable

import numpy as np

from ..errors import InvalidArgument
from .above import above
from .arrays import Floats
from .extras import require

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Size: TypeAlias = tuple[float, float]
Theme: TypeAlias = Literal["light", "dark"]
View: TypeAlias = Literal["top", "front", "side", "iso"] | tuple[float, float]

ACHIEVED, SHADE = "#00204d", "#ececec"
"""Colours of what is achieved, and of the ground where nothing is."""

SMALL = 8.0
"""Size of letters [points]."""


@runtime_checkable
class Plotted(Protocol):
    """A result that draws itself."""

    def plot(self, *args: Any, **options: Any) -> Any: ...


def drawn(result: object, *args: Any, **options: Any) -> Any:
    """Draw a result by the function that `pfabrik.view`, above it, has for its class."""
    return above("view.picture_of")(type(result).__name__)(result, *args, **options)


def new_figure(
    width: float, height: float, paper: str | None = None, *, dpi: int = 150, layout: str | None = "constrained"
) -> Figure:
    """A new figure [inches] on a ground of a colour; MissingLibrary where matplotlib is not installed."""
    require("pictures", "matplotlib", "plot")
    from matplotlib import pyplot

    return pyplot.figure(figsize=(width, height), dpi=dpi, layout=layout, facecolor=paper)


def dotted_where_alone(values: Floats) -> dict[str, Any]:
    """Style of a curve of values (n,), NaN where it has gaps, that shows those without neighbours too: no line does."""
    known = np.isfinite(values)
    beside = np.concatenate([[False], known, [False]])
    alone = np.flatnonzero(known & ~beside[:-2] & ~beside[2:]).tolist()
    return {"marker": "o", "markersize": 3.0, "markevery": alone} if alone else {}


def curves_over_time(times: Floats, names: Sequence[str], panels: Mapping[str, Floats]) -> Figure:
    """Columns of arrays (n, k) over times (n,) [s], a panel for each array by its label, a name for each column."""
    figure = new_figure(8.0, 7.0)
    for axes, (label, values) in zip(figure.subplots(len(panels), 1, sharex=True), panels.items(), strict=True):
        for name, column in zip(names, values.T, strict=True):
            axes.plot(times, column, label=name, **dotted_where_alone(column))
        axes.set_ylabel(label)
    axes.set_xlabel("time [s]")
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=6, fontsize="small", frameon=False)
    return figure


def require_flat(ax: Axes) -> None:
    """Refuse three-dimensional axes: what is in space is drawn as an eye sees it."""
    if hasattr(ax, "get_zlim"):
        raise InvalidArgument("ax", "three-dimensional axes", "two-dimensional ones, as of figure.add_subplot()")


def round_length(most: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is not above `most`."""
    power = 10.0 ** np.floor(np.log10(most))
    steps = np.array([0.5, 1.0, 2.0, 5.0, 10.0]) * power  # the first and the last where the logarithm was rounded
    return float(steps[steps <= most].max())
