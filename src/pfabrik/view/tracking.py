"""A picture of a tracked path: where the machine went, and what its actuators did."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from ..description.readouts import Readout, readouts

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

    from ..answers.solution import Solution
    from ..description.mechanism import Mechanism

Floats = NDArray[np.float64]

REACHED = 0
# Neighbours differ in dashes, and lines with the same dashes in lightness: they stay apart without any colour.
COLOURS = ("#00204d", "#0072b2", "#009e73", "#d55e00", "#e69f00", "#999999")
DASHES = ("-", (0, (6, 2)), (0, (1.5, 1.5)))
TARGET, ACHIEVED, OFF_TARGET, SHADE = "#8c8c8c", "#00204d", "#d55e00", "#ececec"
NAMES_PER_COLUMN = 8
MOST_PANELS = 3
LIMIT_DASHES = (0, (8, 3, 1, 3))


def draw_tracking(targets: Floats, solution: Solution, path: Path) -> None:
    """Write a picture: left the path in the plane it spans most of, right the actuators over the steps.

    Parameters
    ----------
    targets : (n, 4, 4), what was asked for.
    solution : what ``track`` answered, n steps.
    path : of the picture; its suffix chooses the format.
    """
    mechanism = solution.mechanism
    groups = grouped(mechanism)
    figure = Figure(figsize=(12, 5.4), layout="constrained", dpi=130)
    figure.suptitle(mechanism.name)
    left, right = np.ravel(figure.subfigures(1, 2, width_ratios=(1, 1.25), squeeze=False))
    draw_path(left.subplots(), targets[:, :3, 3], solution, mechanism.length_unit)
    panels = right.subplots(len(groups), 1, sharex=True, squeeze=False)[:, 0]
    for axes, group in zip(panels, groups, strict=True):
        draw_actuators(axes, group, solution, extra_keys=common_keys() if axes is panels[0] else [])
    panels[-1].set_xlabel("step")
    figure.savefig(path)


def grouped(mechanism: Mechanism) -> list[list[tuple[int, Readout]]]:
    """Actuators with their index, one group for each panel: equal limits together; if that makes many, equal units."""
    numbered = list(enumerate(readouts(mechanism)))
    by_limits, by_unit = defaultdict(list), defaultdict(list)
    for index, readout in numbered:
        by_limits[readout.unit, readout.limits].append((index, readout))
        by_unit[readout.unit].append((index, readout))
    return list((by_limits if len(by_limits) <= MOST_PANELS else by_unit).values())


def draw_path(axes: Axes, targets: Floats, solution: Solution, unit: str) -> None:
    """The path asked for and the path taken; steps off their target are marked and tied to it."""
    achieved = solution.pose[:, :3, 3]
    first, second = widest_plane(targets)
    off = np.asarray(solution.status) != REACHED
    axes.plot(targets[:, first], targets[:, second], color=TARGET, linestyle="--", linewidth=1.6, label="target")
    axes.plot(achieved[:, first], achieved[:, second], color=ACHIEVED, linewidth=1.8, label="achieved")
    axes.plot(
        achieved[off, first], achieved[off, second], "o", color=OFF_TARGET, markersize=3.5, label="projected step"
    )
    axes.set(xlabel=f"{'xyz'[first]} [{unit}]", ylabel=f"{'xyz'[second]} [{unit}]", title="path of the reference point")
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(alpha=0.3)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=3, frameon=False)


def widest_plane(points: Floats) -> tuple[int, int]:
    """The two coordinates, in order, over which the points spread most."""
    spread = np.ptp(points, axis=0)
    first, second = sorted(np.argsort(-spread, kind="stable")[:2].tolist())
    return first, second


def draw_actuators(axes: Axes, group: list[tuple[int, Readout]], solution: Solution, extra_keys: list[Artist]) -> None:
    """Values of actuators that share a unit, and their limits; steps off their target are shaded."""
    shade_steps(axes, np.asarray(solution.status) != REACHED)
    for place, (index, readout) in enumerate(group):
        values = readout.display(solution.actuators[:, index])
        axes.plot(values, linewidth=1.5, label=readout.name, **line_style(place))
    draw_limits(axes, group)
    unit = group[0][1].unit
    axes.set(ylabel=f"{'angle' if group[0][1].is_angle else 'length'} [{unit}]", xlim=(0, len(solution) - 1))
    axes.grid(alpha=0.3)
    handles = [line for line in axes.get_lines() if not str(line.get_label()).startswith("_")] + extra_keys
    columns = -(-len(handles) // NAMES_PER_COLUMN)
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1), ncols=columns, frameon=False, handles=handles)


def line_style(place: int) -> dict[str, Any]:
    """Colour and dashes of the line at a place: 18 that differ."""
    colour = COLOURS[place % len(COLOURS)]
    return {"color": colour, "linestyle": DASHES[(place + place // len(COLOURS)) % len(DASHES)]}


def draw_limits(axes: Axes, group: list[tuple[int, Readout]]) -> None:
    """One line for every distinct finite limit."""
    for bound in sorted({bound for _, readout in group for bound in readout.limits if np.isfinite(bound)}):
        axes.axhline(bound, color="black", linewidth=1, linestyle=LIMIT_DASHES, zorder=1)


def shade_steps(axes: Axes, marked: NDArray[np.bool_]) -> None:
    """A grey band behind every run of marked steps."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(int)))
    for start, stop in edges.reshape(-1, 2):
        axes.axvspan(start - 0.5, stop - 0.5, color=SHADE, linewidth=0, zorder=0)


def common_keys() -> list[Artist]:
    """What the legend explains once for all panels."""
    return [
        Line2D([], [], color="black", linewidth=1, linestyle=LIMIT_DASHES, label="limit"),
        Line2D([], [], color=SHADE, linewidth=7, label="projected"),
    ]
