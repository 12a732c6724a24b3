"""A picture of the torques that actuators give two joints, over their range."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...common.arrays import Floats, Mask
from ...common.drawing import ACHIEVED, SHADE, SMALL, new_figure, round_length
from ...errors import InvalidArgument
from ...tolerances import TOLERANCES
from .drive_limits import HalfSpaces, clipped, image_of_box
from .named_values import box_of, per_actuator
from .placed import Placer

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PALE = (1.0, 1.0, 1.0, 0.5)
"""Colour within polygons, through which that of the map is seen."""

FINE, COARSE = 121, 7
"""Points a side at which the weakest torque is coloured, and at which a polygon is drawn."""

BELOW = 0.18
"""Distance of the scale of polygons below the map, as a share of its height."""

USUAL = 0.8
"""Share of the polygons that fit between their neighbours; larger ones, as near dead points, are cut off there."""


def plot_torque_map(placer: Placer, torque_max: Any, box: Any, ax: Axes | None = None) -> Axes:
    """Draw polygons of torques over a box of two coordinates, and the torque in the weakest direction as colours.

    Raises
    ------
    InvalidArgument : there are not two coordinates, or one is an angle and the other a length.
    """
    names, is_angle = placer.coordinates.names, placer.coordinates.is_angle
    if len(names) != 2 or is_angle[0] != is_angle[1]:
        raise InvalidArgument("joints", ", ".join(names), "two angles, or two lengths, for a torque map")
    low, high = box_of(placer.coordinates, box)
    limits = per_actuator(placer.mechanism.actuator_names, "torque_max", torque_max)
    axes = new_figure(6.4, 4.4).add_subplot() if ax is None else ax
    shown = np.degrees if is_angle[0] else np.asarray
    q = _lattice(low, high, FINE)
    feasible = _is_feasible(placer, q)
    weakest = np.full(len(q), np.nan)
    weakest[feasible] = image_of_box(placer.jacobian(q[feasible]), limits).offsets.min(axis=-1)
    edges = [shown(np.linspace(low[k], high[k], FINE)) for k in (0, 1)]
    axes.set_facecolor(SHADE)
    drawn = axes.pcolormesh(*edges, weakest.reshape(FINE, FINE).T, cmap="cividis", shading="nearest", rasterized=True)
    fits = _draw_polygons(axes, placer, limits, low, high, shown)
    unit = "Nm" if is_angle[0] else "N"
    axes.figure.colorbar(drawn, ax=axes, label=f"torque in the weakest direction [{unit}]", shrink=0.8)
    axis_unit = "deg" if is_angle[0] else placer.mechanism.length_unit
    axes.set(xlabel=f"{names[0]} [{axis_unit}]", ylabel=f"{names[1]} [{axis_unit}]")
    lost = 1.0 - feasible.mean()
    motors = ", ".join(f"{limit:g}" for limit in dict.fromkeys(limits.tolist()))
    axes.set_title(
        f"{placer.mechanism.name}: torques of joints by actuators of {motors}\nout of reach: {lost:.1%} of the range",
        fontsize=SMALL,
    )
    if fits.all():
        _draw_scale(axes, fits, np.array([edge[[0, -1]] for edge in edges]), unit)
    return axes


def _draw_scale(axes: Axes, fits: Floats, ends: Floats, unit: str) -> None:
    """Draw a corner below the map whose sides are torques as polygons have them, and say which.

    Parameters
    ----------
    fits : the torques that half the distance between two polygons is, (2,).
    ends : of the map, least and greatest of both coordinates, (2, 2).
    """
    torques = np.array([round_length(torque) for torque in fits])
    (left, right), (low, high) = ends
    across, up = 0.5 * torques / fits * np.ptp(ends, axis=1) / COARSE
    below = low - BELOW * (high - low)
    axes.plot([right - across, right, right], [below, below, below + up], color=ACHIEVED, linewidth=1.6, clip_on=False)
    alike = f"{torques[0]:g} {unit}" if torques[0] == torques[1] else f"{torques[0]:g} and {torques[1]:g} {unit}"
    beside: dict[str, Any] = {"ha": "right", "va": "center", "fontsize": SMALL}
    axes.text(right - across - 0.01 * (right - left), below + 0.5 * up, f"polygons: {alike} each way", **beside)
    axes.set(xlim=(left, right), ylim=(low, high))


def _draw_polygons(axes: Axes, placer: Placer, limits: Floats, low: Floats, high: Floats, shown: Any) -> Floats:
    """Draw a polygon at each feasible point of a coarse lattice; the torques that the distance between two is."""
    step = (high - low) / COARSE
    q = _lattice(low + 0.5 * step, high - 0.5 * step, COARSE)
    q = q[_is_feasible(placer, q)]
    if not len(q):
        return np.zeros(2)
    capacity = image_of_box(placer.jacobian(q), limits)
    fits = np.quantile(capacity.offsets[:, -2:], USUAL, axis=0)
    for row, point in enumerate(q):
        corners = HalfSpaces(*(array[row] for array in capacity)).polygon() / np.where(fits > 0.0, fits, 1.0)
        for normal in (*np.eye(2), *-np.eye(2)):
            corners = clipped(corners, normal, 1.0)
        axes.fill(*shown(point + 0.5 * step * corners).T, facecolor=PALE, edgecolor=ACHIEVED, linewidth=0.8)
    return np.asarray(fits)


def _is_feasible(placer: Placer, q: Floats) -> Mask:
    return placer.feasible_margins(q) >= -TOLERANCES.limit


def _lattice(low: Floats, high: Floats, n: int) -> Floats:
    """Points of a box of two coordinates, (n * n, 2), borders included."""
    axes = [np.linspace(low[k], high[k], n) for k in (0, 1)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
