"""Figures, the size of their letters, and names of axes that keep apart."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from .errors import InvalidArgument
from .extras import require

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


SMALL = 8.0
"""Size of letters [points]."""

TICKS_APART = 1.0
"""Least distance of the numbers at ticks [points]."""

NAME_STEP, MOST_STEPS = 2.0, 14
"""Distance by which the name of an axis moves off the numbers at ticks [points], and how often at most."""


def new_figure(width: float, height: float, *, dpi: int = 150, layout: str | None = "constrained") -> Figure:
    """A new figure [inches]; MissingLibrary where matplotlib is not installed."""
    require("pictures", "matplotlib", "plot")
    from matplotlib import pyplot

    return pyplot.figure(figsize=(width, height), dpi=dpi, layout=layout)


def is_spatial(ax: Axes) -> bool:
    """True if axes are three-dimensional."""
    return hasattr(ax, "get_zlim")


def require_flat(ax: Axes) -> None:
    """Refuse three-dimensional axes: what is in space is drawn as an eye sees it."""
    if is_spatial(ax):
        raise InvalidArgument("ax", "three-dimensional axes", "two-dimensional ones, as of figure.add_subplot()")


def require_spatial(ax: Axes, what: str) -> None:
    """Refuse two-dimensional axes for what is drawn in space."""
    if not is_spatial(ax):
        expected = "three-dimensional ones, as of figure.add_subplot(projection='3d')"
        raise InvalidArgument("ax", f"two-dimensional axes for {what}", expected)


def axes_of(ax: Axes) -> list[Any]:
    """The two or three axes, x first."""
    every: Any = ax
    return [getattr(every, f"{name}axis") for name in ("xyz" if is_spatial(ax) else "xy")]


def numbers_at(axis: Any) -> list[tuple[float, Any]]:
    """The ticks of an axis that have a number, where it was drawn last: value and text."""
    return [(tick.get_loc(), tick.label1) for tick in axis.majorTicks if tick.label1.get_text()]


def hidden_names(ax: Axes) -> list[Any]:
    """The axes whose name meets a number at a tick, where they were drawn last."""
    edge = 2.0 * TICKS_APART * ax.get_figure(root=True).dpi / 72.0  # type: ignore[union-attr]
    numbers = [text.get_window_extent() for axis in axes_of(ax) for _, text in numbers_at(axis)]
    names = [(axis, axis.label.get_window_extent().padded(edge)) for axis in axes_of(ax)]
    return [axis for axis, name in names if any(name.overlaps(number) for number in numbers)]


def keep_apart(ax: Axes) -> None:
    """Move the names of axes in space off the numbers at ticks, and take numbers away that would meet others."""
    root: Any = ax.get_figure(root=True)
    with without_faces(ax):
        for _ in range(MOST_STEPS):
            root.draw_without_rendering()
            hidden = hidden_names(ax)
            for axis in hidden:
                axis.labelpad += NAME_STEP
            if not hidden and not part_ticks(ax):
                break


@contextmanager
def without_faces(ax: Axes) -> Iterator[None]:
    """Hide meshes while names are placed: drawing is to find where numbers are, and thousands of faces take long."""
    meshes = [each for each in ax.collections if each.get_visible()]
    for mesh in meshes:
        mesh.set_visible(False)
    try:
        yield
    finally:
        for mesh in meshes:
            mesh.set_visible(True)


def part_ticks(ax: Axes) -> bool:
    """Take ticks away whose numbers would meet those of an axis before, or a name; True if there was one."""
    root: Any = ax.get_figure(root=True)
    root.draw_without_rendering()
    taken = [axis.label.get_window_extent() for axis in axes_of(ax)]
    parted = False
    for axis in axes_of(ax):
        kept, ticks = [], numbers_at(axis)
        for place, text in ticks:
            box = text.get_window_extent()
            if not any(box.padded(TICKS_APART * root.dpi / 72.0).overlaps(other) for other in taken):
                kept.append(place)
                taken.append(box)
        if kept and len(kept) < len(ticks):
            axis.set_ticks(kept)
            parted = True
    return parted
