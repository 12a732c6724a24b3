"""Pictures of workspaces: the border, each face in the colour of the limit that forms it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..capabilities.workspace.space import TURNS
from ..capabilities.workspace.workspace_table import for_people
from ..common.drawing import SMALL, Size, Theme, View
from .canvas import draw_title
from .frame import PLANE_SIZE, axes_for
from .looks import Look, look_of
from .plane_picture import plot_plane
from .solid_picture import plot_solid

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..capabilities.workspace.inscribed import Inscribed
    from ..capabilities.workspace.region import Region


def plot_workspace(
    region: Region, ax: Axes | None, shape: Inscribed | None, view: View | None, size: Size | None, theme: Theme
) -> Axes:
    """As `Workspace.plot`."""
    look = look_of(theme)
    if not len(region.faces):
        return _say_nothing(region, ax, size, look)
    if len(region.names) == 3:
        return plot_solid(region, ax, shape, view, size, look)
    axes = axes_for(ax, size or PLANE_SIZE, look)
    plot_plane(region, axes, shape, look)
    return axes


def _say_nothing(region: Region, ax: Axes | None, size: Size | None, look: Look) -> Axes:
    """A picture in words: nothing is within reach, with what is fixed."""
    axes: Any = axes_for(ax, size or PLANE_SIZE, look)
    draw_title(axes, f"{region.mechanism.name}: nothing within reach", look)
    axes.axis("off")
    held = {name: value for name, value in region._question.space.held.items() if name not in region.names and value}
    factors, units = for_people(["rad" if name in TURNS else region.mechanism.length_unit for name in held])
    at = [f"{name} = {held[name] * factor:g} {unit}" for name, factor, unit in zip(held, factors, units, strict=True)]
    where = f"over {', '.join(region.names)}" + (f" at {', '.join(at)}" if at else "")
    axes.text(0.5, 0.5, where, transform=axes.transAxes, ha="center", va="center", fontsize=SMALL + 2, color=look.soft)
    return axes  # type: ignore[no-any-return]
