"""`plot_track`: a path that was followed: the machine on it, its actuators between their limits, and all margins."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..answers.margins import margins
from ..answers.solution import Solution
from ..answers.status import Status
from ..answers.tracked import Track
from ..answers.words import error_words
from ..common.arrays import Floats, Mask
from ..common.checks import require_method, require_type
from ..common.drawing import SMALL, Theme, View, dotted_where_alone, new_figure
from ..errors import InvalidArgument, counted
from ..kinematics import Readout, readouts
from .canvas import Canvas, canvas_on, checked_size, wrapped
from .looks import HELD, Look, dress, look_of
from .machine import key_of, machine_eye
from .painter import draw_machine
from .skeleton import skeleton_of

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SIZE, LEAST = (11.5, 6.2), (6.0, 4.0)
"""Width and height of a new figure, and the least that has room for all of it [inches]."""

TITLE = SMALL + 4.0
"""Size of the letters of the title [points]."""

MOST_STRIPS = 6
"""Strips of actuators one below the other; further ones make another column."""

HELD_BY = 1e-4
"""Share of the range shown within which a value is at its limit."""

ROOM = 0.14
"""Space above and below a range for the names of limits, as a share of the range."""

LIMIT_DASHES = (0, (8, 3, 1, 3))
DASHES = ("-", (0, (6, 2)), (0, (1.5, 1.5)))

MOST_MARGINS, OTHERS = 6, 0.5
"""Limits whose margins are named; how opaque the grey lines of others are."""


def plot_track(
    track: Track,
    figure: Figure | None = None,
    *,
    view: View | None = None,
    size: tuple[float, float] | None = None,
    theme: Theme = "light",
) -> dict[str, Axes]:
    """Draw a path that was followed: the machine on it, its actuators between their limits, and all margins.

    The machine is drawn where it is farthest from its target. Steps whose target is out of reach have a grey band,
    values at a limit are orange. Margins are as of `margins`: 0 on a limit; named are those that are ever the least.

    Parameters
    ----------
    track : Track
        What `track` answered.
    figure : Figure, optional
        Matplotlib figure or subfigure to draw in; default: a new one. Its `savefig` writes PNG, SVG and PDF.
    view : str or (float, float), optional
        As in `plot`.
    size : (float, float), optional
        Width and height of a new figure [inches].
    theme : {"light", "dark"}, optional
        As in `plot`.

    Returns
    -------
    dict of str to Axes
        Axes by what they show: "path", every actuator's name, and "margins" where the machine has limits.

    Raises
    ------
    InvalidArgument
        What is no Track, or one without a step that has a configuration; no such view, size or theme.
    MissingLibrary
        Matplotlib is not installed.
    """
    known, look = checked_track(track), look_of(theme)
    mechanism = track.mechanism
    eye, is_plane = machine_eye(mechanism, view)
    figure = new_figure(*checked_size(size or SIZE, LEAST), dpi=130) if figure is None else figure
    require_method("figure", figure, "subfigures", "a matplotlib figure, or None")
    figure.set_facecolor(look.paper)
    title = wrapped(f"{mechanism.name}: {reached_in_words(track)}", figure.bbox.width / figure.dpi, TITLE)
    figure.suptitle(title, fontsize=TITLE, color=look.ink)
    left, right = np.ravel(figure.subfigures(1, 2, width_ratios=(1, 1.2), squeeze=False, facecolor=look.paper))
    axes = {"path": draw_path(canvas_on(left.add_subplot(), eye, look, is_plane=is_plane), track, known)}
    strips, below = _grid(right, len(mechanism.actuator_names), has_margins := bool(limits_of(track)))
    for index, (strip, readout) in enumerate(zip(strips, readouts(mechanism), strict=True)):
        draw_actuator(strip, readout, np.asarray(readout.display(track.actuators[:, index])), track, look)
        axes[readout.name] = strip
    right.align_ylabels(strips)
    if has_margins:
        draw_margins(below, track, look)
        axes["margins"] = below
    above: dict[str, Any] = {"loc": "outside upper center", "frameon": False, "fontsize": SMALL}
    right.legend(handles=common_keys(look), ncols=3, labelcolor=look.ink, **above)
    return axes


def checked_track(track: Track) -> NDArray[np.intp]:
    """The steps of a track that have a configuration."""
    require_type("track", track, Track, "a Track, as `track` returns")
    known = np.flatnonzero(np.isfinite(track.pose).all(axis=(1, 2)))
    if not len(known):
        raise InvalidArgument("track", "no step that has a configuration", "at least one")
    return known


def reached_in_words(solution: Solution) -> str:
    """The number of steps reached, and the largest distances of the others from their targets, lengths and angles."""
    n_unreached = int((np.asarray(solution.status) != Status.REACHED).sum())
    reached = f"{len(solution) - n_unreached} of {counted(len(solution), 'step')} reached"
    position, rotation = (float(np.nanmax(each)) for each in (solution.position_error, solution.rotation_error))
    farthest = error_words(solution.mechanism, position, rotation)
    return f"{reached}, the others at most {farthest} from their targets" if n_unreached else reached


def _grid(figure: Any, actuators: int, with_margins: bool) -> tuple[list[Axes], Axes]:
    """Axes for the actuators, column by column, and axes for the margins below all of them."""
    columns = -(-actuators // MOST_STRIPS)
    rows = -(-actuators // columns)
    grid = figure.add_gridspec(rows + with_margins, columns, height_ratios=[1.0] * rows + [2.2] * with_margins)
    strips: list[Axes] = []
    for place in range(actuators):
        column, row = divmod(place, rows)
        strip = figure.add_subplot(grid[row, column], sharex=strips[0] if strips else None)
        is_last = row == rows - 1 or place == actuators - 1
        strip.tick_params(labelsize=SMALL, labelbottom=is_last and not with_margins)
        strip.set_xlabel("step" if is_last and not with_margins else "", fontsize=SMALL)
        strips.append(strip)
    return strips, figure.add_subplot(grid[rows, :], sharex=strips[0]) if with_margins else strips[0]


def draw_path(canvas: Canvas, track: Track, known: NDArray[np.intp]) -> Axes:
    """Draw the machine at the step that is farthest from its target, the target path and the achieved path."""
    shown = skeleton_of(track[int(known[np.argmax(track.position_error[known])])])
    key = [*key_of(shown, canvas.look), *draw_paths(canvas, track)]
    canvas.frame(np.vstack([shown.points, places_along(track)]), track.mechanism.length_unit, key)
    draw_machine(canvas, shown)
    axes: Axes = canvas.axes
    return axes


def places_along(track: Track) -> Floats:
    """All finite positions of targets and answers, (n, 3) [length]."""
    places = np.vstack([track.targets[:, :3, 3], track.pose[:, :3, 3]])
    return np.asarray(places[np.isfinite(places).all(axis=1)])


def draw_paths(canvas: Canvas, track: Track) -> list[Artist]:
    """Draw the target path, and the achieved path: where targets were reached, and where they were not."""
    is_unreached = track.status != Status.REACHED
    achieved = track.pose[:, :3, 3]
    on_target, projected = (
        np.where(mask[:, None], achieved, np.nan) for mask in (~is_unreached | next_to(is_unreached), is_unreached)
    )
    target_style = {"color": canvas.look.asked, "linestyle": "--", "linewidth": 1.4, "label": "asked for", "zorder": 20}
    reached_style = {"color": canvas.look.achieved, "linewidth": 2.0, **dotted_where_alone(on_target[:, 0])}
    lines = [
        canvas.line(track.targets[:, :3, 3], **target_style),
        canvas.line(on_target, label="reached", zorder=21, **reached_style),
    ]
    if is_unreached.any():
        style = {"marker": "o", "markersize": 2.6, "markeredgewidth": 0.0}  # a single step has no line
        lines.append(canvas.line(projected, color=HELD, linewidth=2.6, label="not reached", zorder=22, **style))
    return lines


def next_to(marked: Mask) -> Mask:
    """Mask of the first and last step of every run of marked steps, so that lines on both sides of an end meet."""
    padded = np.concatenate([[True], marked, [True]])
    return np.asarray(marked & ~(padded[:-2] & padded[2:]))


def draw_actuator(axes: Axes, readout: Readout, values: Floats, solution: Solution, look: Look) -> None:
    """Draw one actuator over the steps, its limits named at the axis, in orange where it is at one."""
    dress(axes, look)
    shade_steps(axes, np.asarray(solution.status) != Status.REACHED, look)
    bounds = [bound for bound in readout.limits if np.isfinite(bound)]
    for bound in bounds:
        axes.axhline(bound, color=look.ink, linewidth=0.9, linestyle=LIMIT_DASHES, zorder=1)
    axes.plot(values, color=look.achieved, linewidth=1.5, **dotted_where_alone(values))
    finite = values[np.isfinite(values)]
    if bounds:
        near = np.min([np.abs(values - bound) for bound in bounds], axis=0) <= HELD_BY * np.ptp([*finite, *bounds])
        held = np.where(near, values, np.nan)
        axes.plot(held, color=HELD, linewidth=3.0, solid_capstyle="butt", **dotted_where_alone(held))
    low, high = min([*finite, *bounds]), max([*finite, *bounds])
    room = ROOM * (high - low) or 1.0
    axes.set(xlim=(0, max(len(solution) - 1, 1)), ylim=(low - room, high + room))
    ticks = zip(readout.limits, ("min", "max"), strict=True)
    named = [(bound, f"{name} {bound:.4g}") for bound, name in ticks if np.isfinite(bound)]
    named = named or [(low, f"{low:.4g}"), (high, f"{high:.4g}")] if high > low else named
    axes.set_yticks([bound for bound, _ in named], [text for _, text in named], fontsize=SMALL)
    axes.set_ylabel(f"{readout.name}\n[{readout.unit}]", rotation=0, ha="right", va="center", fontsize=SMALL)


def limits_of(track: Track) -> dict[str, Floats]:
    """Name of a limit -> its margin at every step, limits with the smallest margin first."""
    by_name = {f"{joint} {bound}": np.asarray(margin) for (joint, bound), margin in margins(track).items()}
    return dict(sorted(by_name.items(), key=lambda item: float(np.nanmin(item[1]))))


def draw_margins(axes: Axes, track: Track, look: Look) -> None:
    """Draw the margin of every limit; those that are the smallest at some step are named."""
    dress(axes, look)
    shade_steps(axes, track.status != Status.REACHED, look)
    by_name = limits_of(track)
    values = np.array(list(by_name.values()))
    least = np.nanmin(np.where(np.isnan(values), np.inf, values), axis=0)
    tightest = [name for name, margin in by_name.items() if (margin <= least).any()][:MOST_MARGINS]
    for margin in (margin for name, margin in by_name.items() if name not in tightest):
        axes.plot(margin, color=look.asked, alpha=OTHERS, linewidth=0.7, zorder=1, **dotted_where_alone(margin))
    for place, name in enumerate(tightest):
        style = line_style(place, look) | dotted_where_alone(by_name[name])
        axes.plot(by_name[name], label=name, linewidth=1.5, zorder=2, **style)
    axes.axhline(0.0, color=look.ink, linewidth=0.9, linestyle=LIMIT_DASHES, zorder=1)
    axes.set(xlabel="step", ylabel="margin", xlim=(0, max(len(track) - 1, 1)), ylim=(min(-0.05, *least), 1.05))
    axes.tick_params(labelsize=SMALL)
    for label in (axes.xaxis.label, axes.yaxis.label):
        label.set_fontsize(SMALL)
    beside: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0), "frameon": False}
    legend = axes.legend(title="limit", title_fontsize=SMALL, fontsize=SMALL, labelcolor=look.ink, **beside)
    legend.get_title().set_color(look.ink)


def line_style(place: int, look: Look) -> dict[str, Any]:
    """Colour and dashes of the line at a place: 18 that differ, neighbours in both."""
    colour = look.lines[place % len(look.lines)]
    return {"color": colour, "linestyle": DASHES[(place + place // len(look.lines)) % len(DASHES)]}


def shade_steps(axes: Axes, marked: Mask, look: Look) -> None:
    """Draw a grey band behind every run of marked steps."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(int)))
    for start, stop in edges.reshape(-1, 2):
        axes.axvspan(start - 0.5, stop - 0.5, color=look.faint, linewidth=0, zorder=0)


def common_keys(look: Look) -> list[Artist]:
    """The entries of the legend that all panels share."""
    from matplotlib.lines import Line2D

    return [
        Line2D([], [], color=look.ink, linewidth=1, linestyle=LIMIT_DASHES, label="limit"),
        Line2D([], [], color=HELD, linewidth=3, label="at a limit"),
        Line2D([], [], color=look.faint, linewidth=7, label="target out of reach"),
    ]
