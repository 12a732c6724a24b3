"""The pictures of the three experiments: lines differ in dashes and lightness, so they stay apart without colour."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from .efficacy import Efficacy, is_point
from .efficiency import Efficiency
from .panels import ACHIEVED, ASKED, HELD, SHADE, common_keys, draw_joint, line_style, shade_steps
from .robustness import Robustness

if TYPE_CHECKING:
    from matplotlib.axes import Axes


DPI = 130
EDGE = "black"
LIGHT, MIDDLE, DARK = "#d9d9d9", "#d55e00", "#00204d"
BELOW: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.16), "frameon": False, "fontsize": 9}


def letters(axes: Sequence[Axes]) -> None:
    """Name panels (a), (b), … in their titles."""
    for letter, panel in zip("abcdefghijkl", axes, strict=False):
        panel.set_title(f"({letter}) {panel.get_title()}", fontsize=10.5)


# --- accuracy --------------------------------------------------------------------------------------------------------


def draw_efficacy(found: Sequence[Efficacy], path: Path) -> None:
    """One column a machine: errors of the round trip over the steps, with the paper's E and by default."""
    figure = Figure(figsize=(13, 7), layout="constrained", dpi=DPI)
    panels = figure.subplots(2, len(found), squeeze=False, sharex="col")
    for column, each in zip(panels.T, found, strict=True):
        unit, printed = each.case.mechanism.length_unit, each.case.printed
        draw_errors(column[0], each, "position_errors", unit, printed.position_rmse)
        column[0].set_title(f"{each.case.label}: position")
        if is_point(each.case):
            column[1].set_axis_off()
            column[0].tick_params(labelbottom=True)
            column[0].set_xlabel("step")
            continue
        draw_errors(column[1], each, "orientation_errors", "deg", printed.orientation_rmse)
        column[1].set(title=f"{each.case.label}: orientation", xlabel="step")
    letters([panel for panel in panels.ravel() if panel.axison])
    figure.suptitle("Inside the workspace: error of the pose that forward kinematics finds from the actuators")
    figure.legend(*panels[0, -1].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    figure.savefig(path)


def draw_errors(axes: Axes, found: Efficacy, what: str, unit: str, printed: float | None) -> None:
    """Errors over the steps on a logarithmic axis; what is exactly 0 is drawn at its lower end."""
    least = 1e-17
    names = {"paper": ("by the paper's passes", 0), "default": ("by default", 1)}
    for name, (label, place) in names.items():
        values = np.maximum(getattr(found.runs[name], what), least)
        axes.plot(values, label=label, linewidth=1.4, **line_style(place))
    if printed is not None:
        axes.axhline(printed, color=EDGE, linewidth=1.2, linestyle=(0, (8, 3, 1, 3)), label="RMSE printed in the paper")
    axes.set(yscale="log", ylim=(least / 2, 1), xlim=(0, len(found.targets) - 1), ylabel=f"error [{unit}]")
    axes.grid(alpha=0.3)


# --- cost ------------------------------------------------------------------------------------------------------------


def draw_efficiency(found: Sequence[Efficiency], path: Path) -> None:
    """Left the time over that of the geometric approach, right the passes; a group of bars for each machine."""
    figure = Figure(figsize=(13, 5), layout="constrained", dpi=DPI)
    left, right = figure.subplots(1, 2)
    ratios = {
        "printed": [each.case.printed.ratio for each in found],
        "paper's passes, single": [each.ratio_of_passes("cold") for each in found],
        "default, batch": [each.ratio("cold") for each in found],
    }
    draw_bars(left, [each.case.label for each in found], ratios)
    left.axhline(1.0, color=EDGE, linewidth=1)
    left.set(yscale="log", ylabel="time ÷ geometric approach", title="time, one core")
    passes = {
        "printed": [each.case.printed.iterations for each in found],
        "paper's passes, cold start": [each.answers["paper", "cold"].iterations for each in found],
        "paper's passes, warm start": [each.answers["paper", "warm"].iterations for each in found],
        "accelerated, cold start": [each.answers["accelerated", "cold"].iterations for each in found],
    }
    draw_bars(right, [each.case.label for each in found], passes)
    right.set(yscale="log", ylabel="passes, average over targets reached", title="iterations")
    letters([left, right])
    figure.suptitle(f"{len(found[0].targets)} random targets in the workspace of each machine")
    figure.savefig(path)


def draw_bars(axes: Axes, groups: Sequence[str], series: dict[str, list[float]]) -> None:
    """Bars side by side, hatched so that they differ in grey, each with its number."""
    looks = [(LIGHT, ""), (DARK, ""), (MIDDLE, "//"), ("white", ".."), ("#8c8c8c", "xx")]
    width = 0.85 / len(series)
    for place, ((name, values), (colour, hatch)) in enumerate(zip(series.items(), looks, strict=False)):
        at = np.arange(len(groups)) + (place - (len(series) - 1) / 2) * width
        bars = axes.bar(at, values, width, label=name, color=colour, hatch=hatch, edgecolor=EDGE, linewidth=0.8)
        axes.bar_label(bars, fmt=lambda value: "" if np.isnan(value) else f"{value:.2g}", fontsize=8, padding=1)
    axes.set_xticks(np.arange(len(groups)), groups)
    axes.grid(axis="y", alpha=0.3)
    axes.set_axisbelow(True)
    axes.margins(y=0.12)
    axes.legend(**(BELOW | {"bbox_to_anchor": (0.5, -0.07)}), ncols=3)


# --- targets out of reach --------------------------------------------------------------------------------------------


def draw_robustness(found: Sequence[Robustness], path: Path) -> None:
    """Nine panels, a row for each machine, by the paper's passes: the path, joint values, the cost of each step."""
    figure = Figure(figsize=(15.5, 4.8 * len(found)), layout="constrained", dpi=DPI)
    grid = figure.add_gridspec(len(found), 3, width_ratios=(1, 1.25, 1))
    titled = []
    for row, each in enumerate(found):
        parts = grid[row, 1].subgridspec(len(each.case.shown), 1).subplots(sharex=True, squeeze=False)[:, 0]
        path_panel, cost_panel = figure.add_subplot(grid[row, 0]), figure.add_subplot(grid[row, 2])
        draw_path(path_panel, each)
        draw_joints(parts.tolist(), each)
        draw_cost(cost_panel, each)
        titled += [path_panel, parts[0], cost_panel]
    letters(titled)
    figure.suptitle("Circles that leave the workspace, by the paper's passes (grey bands: steps that are projected)")
    figure.savefig(path)


def draw_path(axes: Axes, found: Robustness) -> None:
    """What was asked for, what was taken, and the edge of the workspace."""
    unit, edges = found.case.mechanism.length_unit, found.workspace.vertices[found.workspace.faces]
    asked, taken, off = found.targets[:, 1:3, 3], found.paper.solution.pose[:, 1:3, 3], found.paper.projected
    axes.plot(*edges.T, color=EDGE, linewidth=1)
    axes.plot(*asked.T, color=ASKED, linestyle="--", linewidth=1.6, label="asked for")
    axes.plot(*taken.T, color=ACHIEVED, linewidth=1.8, label="achieved")
    axes.plot(*found.runs["default"].solution.pose[:, 1:3, 3].T, label="by default", **line_style(2))
    axes.plot(*taken[off].T, "o", color=HELD, markersize=2.5, label="projected step")
    axes.set(xlabel=f"y [{unit}]", ylabel=f"z [{unit}]", title=f"{found.case.label}: path")
    axes.set_aspect("equal", adjustable="datalim")
    handles = [*axes.get_legend_handles_labels()[0], Line2D([], [], color=EDGE, linewidth=1, label="workspace's edge")]
    axes.legend(handles=handles, **BELOW, ncols=2)


def draw_joints(panels: Sequence[Axes], found: Robustness) -> None:
    """Values of the joints that are shown, with their limits; a panel for each."""
    for axes, name in zip(panels, found.case.shown, strict=True):
        draw_joint(axes, found.paper.solution, name)
    panels[0].set_title(f"{found.case.label}: joint values and limits")
    panels[-1].set_xlabel("step")
    below = BELOW | {"bbox_to_anchor": (0.5, -0.16 * len(panels))}
    panels[-1].legend(handles=common_keys(), **below, ncols=3)


def draw_cost(axes: Axes, found: Robustness) -> None:
    """Passes and time of each step, on logarithmic axes: out of reach they are hundreds of times those within."""
    shade_steps(axes, found.paper.projected)
    passes = axes.plot(found.paper.solution.iterations, label="passes", linewidth=1.4, **line_style(0))
    axes.set(xlim=(0, len(found.targets) - 1), xlabel="step", ylabel="passes", title=f"{found.case.label}: cost")
    axes.set(yscale="log", ylim=(0.8, None))
    axes.grid(alpha=0.3)
    clock = axes.twinx()
    times = clock.plot(1e6 * found.seconds, label="time of one call from Python", linewidth=1.2, **line_style(4))
    clock.set(ylabel="time [µs]", yscale="log")
    band = Line2D([], [], color=SHADE, linewidth=7, label="projected")
    axes.legend(handles=[*passes, *times, band], **BELOW, ncols=3)
