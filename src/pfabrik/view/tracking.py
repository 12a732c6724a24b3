"""A picture of a tracked path: where the machine went, and what its actuators did."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from ..description.readouts import Readout, readouts
from .drawing import draw

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

    from ..answers.solution import Solution

Floats = NDArray[np.float64]

REACHED = 0
# Neighbours differ in dashes, and lines with the same dashes in lightness: they stay apart without any colour.
COLOURS = ("#00204d", "#0072b2", "#009e73", "#d55e00", "#e69f00", "#999999")
DASHES = ("-", (0, (6, 2)), (0, (1.5, 1.5)))
TARGET, ACHIEVED, OFF_TARGET, SHADE = "#8c8c8c", "#00204d", "#d55e00", "#ececec"
MOST_STRIPS = 6
HELD_BY = 1e-4  # share of what is shown within which a value is at its limit
ROOM = 0.12  # share of the range above and below it
LIMIT_DASHES = (0, (8, 3, 1, 3))


def draw_tracking(targets: Floats, solution: Solution, path: Path) -> None:
    """Write a picture: left the machine and its path, right every actuator over the steps, between its limits.

    The machine is drawn where it is farthest from its target.

    Parameters
    ----------
    targets : (n, 4, 4), what was asked for.
    solution : what ``track`` answered, n steps.
    path : of the picture; its suffix chooses the format.
    """
    mechanism = solution.mechanism
    figure = Figure(figsize=(13, 6.2), layout="constrained", dpi=130)
    figure.suptitle(f"{mechanism.name}: {told(solution)}", fontsize=13)
    left, right = np.ravel(figure.subfigures(1, 2, width_ratios=(1, 1.15), squeeze=False))
    draw_path(left.add_subplot(projection="3d"), targets[:, :3, 3], solution)
    shown = readouts(mechanism)
    columns = -(-len(shown) // MOST_STRIPS)
    strips = np.ravel(right.subplots(-(-len(shown) // columns), columns, sharex=True, squeeze=False), order="F")
    for index, (axes, readout) in enumerate(zip(strips, shown, strict=False)):
        draw_actuator(axes, readout, readout.display(solution.actuators[:, index]), solution)
    for axes in strips[len(shown) :]:
        axes.set_visible(False)
    right.supxlabel("step")
    right.legend(handles=common_keys(), loc="outside upper center", ncols=3, frameon=False)
    figure.savefig(path)


def told(solution: Solution) -> str:
    """How many steps were reached, and how far the others stay from their targets."""
    off = int((np.asarray(solution.status) != REACHED).sum())
    reached = f"{len(solution) - off} of {len(solution)} steps reached"
    farthest = f"{float(np.max(solution.position_error)):.3g} {solution.mechanism.length_unit}"
    return f"{reached}, the others projected, at most {farthest} from the target" if off else reached


def draw_path(axes: Any, targets: Floats, solution: Solution) -> None:
    """The machine at the step that is farthest from its target, the path asked for and the path taken."""
    achieved, off = solution.pose[:, :3, 3], np.asarray(solution.status) != REACHED
    draw(solution.mechanism, solution[int(np.argmax(solution.position_error))], axes, np.vstack([targets, achieved]))
    axes.plot(*targets.T, color=TARGET, linestyle="--", linewidth=1.4, label="asked for", zorder=20)
    on_target, projected = (np.where(mask[:, None], achieved, np.nan) for mask in (~off | next_to(off), off))
    axes.plot(*on_target.T, color=ACHIEVED, linewidth=2.0, label="reached", zorder=21)
    if off.any():
        axes.plot(*projected.T, color=OFF_TARGET, linewidth=2.6, label="projected", zorder=22)
    if axes.get_legend() is not None:
        axes.get_legend().remove()
    axes.figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=4, frameon=False)


def next_to(marked: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The first and last step of every run of marked ones, so that lines on both sides of an end meet."""
    padded = np.concatenate([[True], marked, [True]])
    return np.asarray(marked & ~(padded[:-2] & padded[2:]))


def draw_actuator(axes: Axes, readout: Readout, values: Floats, solution: Solution) -> None:
    """One actuator over the steps, its limits named at the axis, and where it is held by one."""
    shade_steps(axes, np.asarray(solution.status) != REACHED)
    bounds = [bound for bound in readout.limits if np.isfinite(bound)]
    for bound in bounds:
        axes.axhline(bound, color="black", linewidth=1, linestyle=LIMIT_DASHES, zorder=1)
    axes.plot(values, color=ACHIEVED, linewidth=1.5)
    if bounds:
        near = np.min([np.abs(values - bound) for bound in bounds], axis=0) <= HELD_BY * np.ptp([*values, *bounds])
        axes.plot(np.where(near, values, np.nan), color=OFF_TARGET, linewidth=3.0, solid_capstyle="butt")
    low, high = min([*values, *bounds]), max([*values, *bounds])
    room = ROOM * (high - low) or 1.0
    axes.set(xlim=(0, max(len(solution) - 1, 1)), ylim=(low - room, high + room))
    axes.set_yticks(bounds or [low, high], [f"{tick:.4g}" for tick in bounds or [low, high]])
    axes.set_ylabel(f"{readout.name}\n[{readout.unit}]", rotation=0, ha="right", va="center")


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
        Line2D([], [], color=OFF_TARGET, linewidth=3, label="at a limit"),
        Line2D([], [], color=SHADE, linewidth=7, label="target out of reach"),
    ]
