"""Forces of the actuators in motion: over time and over rates, between their limits, and their power."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..capabilities.dynamics.efforts import Efforts
from ..common.arrays import Floats, Mask
from ..common.drawing import SMALL, Size, Theme, dotted_where_alone, new_figure
from ..common.printed import plain
from ..kinematics import drive_limits, readouts
from .canvas import TITLE, checked_size, wrapped
from .looks import HELD, Look, dress, look_of
from .plot_track import HELD_BY, LIMIT_DASHES, ROOM, line_style

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH, ROW, AROUND = 8.0, 0.95, 2.9
"""Width of a column of actuators, height of each of its rows, and of power, title and key together [inches]."""

MOST_ROWS = 8
"""Actuators one below the other; further ones make another column."""

MANY = 5000
"""Points of a cloud beyond which an SVG or PDF has them as pixels."""

LEAST = (5.0, 4.0)
"""The least width and height of a figure that has room for all of it [inches]."""


def plot_efforts(efforts: Efforts, size: Size | None, theme: Theme) -> Figure:
    """Draw, as `Efforts.plot` has it."""
    look, times, mechanism = look_of(theme), efforts._require_times(), efforts._mechanism
    shown, sizing = readouts(mechanism), efforts.sizing
    columns = -(-len(shown) // MOST_ROWS)
    rows = -(-len(shown) // columns)
    usual = (WIDTH * columns, ROW * rows + AROUND)
    figure = new_figure(*(usual if size is None else checked_size(size, LEAST)), look.paper)
    grid = figure.add_gridspec(
        rows + 1, 2 * columns, width_ratios=[2.6, 1.0] * columns, height_ratios=[1.0] * rows + [1.6]
    )
    first: dict[str, Any] = {"time": None}
    for place, each in enumerate(shown):
        column, row = divmod(place, rows)
        unit = efforts._drives.forces[place]
        over_time = figure.add_subplot(grid[row, 2 * column], sharex=first["time"])
        over_rates = figure.add_subplot(grid[row, 2 * column + 1], sharex=first.get(each.unit), sharey=over_time)
        first = {each.unit: over_rates, **first, "time": over_time}
        exerted, rates = efforts.actuators[:, place], np.asarray(each.display(efforts.rates[:, place]))
        fastest = float(each.display(drive_limits(mechanism, "speed", None)[place]))
        limits = (efforts._drives.limits[place], fastest)
        sizes = float(sizing.rms[place]), float(sizing.peak[place])
        _draw_forces(over_time, over_rates, times, exerted, rates, limits, sizes, look)
        _shade(over_time, times, efforts.projected, look)
        numbers = ", ".join(
            f"{name} {plain(float(value), 0.0, '.4g')} {unit}"
            for name, value in (("rms", sizing.rms[place]), ("peak", sizing.peak[place]), ("limit", limits[0]))
            if np.isfinite(value)
        )
        over_time.set_title(f"{each.name}: {numbers}", loc="left", fontsize=SMALL, color=look.ink, pad=2.0)
        over_time.set_ylabel(unit, fontsize=SMALL)
        is_last = row == rows - 1 or place == len(shown) - 1 or shown[place + 1].unit != each.unit
        over_rates.set_xlabel(f"rate [{each.unit}/s]" if is_last else "", fontsize=SMALL)
        over_time.tick_params(labelbottom=False)
        over_rates.tick_params(labelleft=False, labelbottom=is_last)
    below = figure.add_subplot(grid[rows, : 2 * columns - 1], sharex=first["time"])
    _draw_power(below, figure.add_subplot(grid[rows, 2 * columns - 1]), times, efforts, look)
    title = wrapped(f"{mechanism.name}: what actuators exert", figure.bbox.width / figure.dpi, TITLE)
    figure.suptitle(title, fontsize=TITLE, color=look.ink)
    key: dict[str, Any] = {"loc": "outside lower center", "frameon": False, "fontsize": SMALL, "labelcolor": look.ink}
    figure.legend(handles=_keys(look, is_off=bool(efforts.projected.any())), ncols=5, **key)
    return figure


def _draw_forces(
    over_time: Axes,
    over_rates: Axes,
    times: Floats,
    exerted: Floats,
    rates: Floats,
    limits: tuple[float, float],
    sizes: tuple[float, float],
    look: Look,
) -> None:
    """Draw the forces of one actuator over time (n,) and over its rates, in orange from its limits on."""
    (most, fastest), (rms, highest) = limits, sizes
    is_held = np.abs(exerted) >= most * (1.0 - HELD_BY)
    held = np.where(is_held, exerted, np.nan)
    over_time.plot(times, exerted, color=look.achieved, linewidth=1.2, **dotted_where_alone(exerted))
    over_time.plot(times, held, color=HELD, linewidth=2.6, **dotted_where_alone(held))
    over_time.axhline(rms, color=look.asked, linewidth=0.9, linestyle="--", zorder=1)
    is_beyond = is_held | (np.abs(rates) >= fastest * (1.0 - HELD_BY))
    for mask, colour in ((~is_beyond, look.achieved), (is_beyond, HELD)):
        over_rates.scatter(
            rates[mask], exerted[mask], s=3.0, color=colour, linewidths=0.0, rasterized=len(exerted) > MANY
        )
    peak = int(np.nanargmin(np.append(np.abs(exerted - highest), np.inf)))
    for axes, where in ((over_time, times), (over_rates, rates)):
        dress(axes, look)
        axes.tick_params(labelsize=SMALL)
        axes.axhline(0.0, color=look.faint, linewidth=0.8, zorder=0)
        for end in (-most, most):
            if np.isfinite(end):
                axes.axhline(end, color=look.ink, linewidth=0.9, linestyle=LIMIT_DASHES, zorder=1)
        if peak < len(exerted):
            axes.plot(where[peak], exerted[peak], "o", color=look.ink, markersize=3.5, zorder=3)
    over_rates.axvline(0.0, color=look.faint, linewidth=0.8, zorder=0)
    for end in (-fastest, fastest):
        if np.isfinite(end):
            over_rates.axvline(end, color=look.ink, linewidth=0.9, linestyle=LIMIT_DASHES, zorder=1)
    sides = [end for end, is_there in ((-most, (exerted < 0.0).any()), (most, (exerted > 0.0).any())) if is_there]
    known = [0.0, *exerted[np.isfinite(exerted)], *(end for end in sides if np.isfinite(end))]
    room = ROOM * (max(known) - min(known)) or 1.0
    over_time.set_ylim(min(known) - room, max(known) + room)


def _draw_power(axes: Axes, beside: Axes, times: Floats, efforts: Efforts, look: Look) -> None:
    """Draw the power of every actuator over time, and that of all, with the names of curves on axes beside it."""
    dress(axes, look)
    _shade(axes, times, efforts.projected, look)
    names, total = efforts._mechanism.actuator_names, efforts.power.sum(axis=1)
    for place, (name, power) in enumerate(zip(names, efforts.power.T, strict=True)):
        style = line_style(place + 1, look) | dotted_where_alone(power)
        axes.plot(times, power, label=name, linewidth=1.0, **style)
    axes.plot(times, total, label="all", color=look.ink, linewidth=1.8, **dotted_where_alone(total))
    axes.set_xlabel("time [s]", fontsize=SMALL)
    axes.set_ylabel("power [W]", fontsize=SMALL)
    axes.tick_params(labelsize=SMALL)
    if np.isfinite(total).any():
        most = float(np.nanmax(total))
        mean = plain(float(efforts.sizing.mean_power.sum()), 1e-6 * float(np.nanmax(np.abs(total))), ".5g")
        words = f"all: mean {mean} W, at most {most:.5g} W"
        axes.set_title(words, loc="left", fontsize=SMALL, color=look.ink, pad=2.0)
    beside.set_axis_off()
    key: dict[str, Any] = {"loc": "upper left", "frameon": False, "fontsize": SMALL, "labelcolor": look.ink}
    beside.legend(*axes.get_legend_handles_labels(), ncols=1 + len(names) // MOST_ROWS, borderaxespad=0.0, **key)


def _shade(axes: Axes, times: Floats, marked: Mask, look: Look) -> None:
    """Draw a grey band behind marked times."""
    across = axes.get_xaxis_transform()
    axes.fill_between(times, 0.0, 1.0, where=marked, transform=across, color=look.faint, linewidth=0.0, zorder=0)


def _keys(look: Look, *, is_off: bool) -> list[Artist]:
    """The entries of the legend that all panels share."""
    from matplotlib.lines import Line2D

    keys: list[Artist] = [
        Line2D([], [], color=look.ink, linewidth=1, linestyle=LIMIT_DASHES, label="limit"),
        Line2D([], [], color=HELD, linewidth=3, label="at a limit, or beyond"),
        Line2D([], [], color=look.asked, linewidth=0.9, linestyle="--", label="rms"),
        Line2D([], [], color=look.ink, marker="o", markersize=3.5, linestyle="", label="peak"),
    ]
    return keys + [Line2D([], [], color=look.faint, linewidth=7, label="target out of reach")] * is_off
