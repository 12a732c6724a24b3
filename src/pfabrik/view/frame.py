"""The box around what is drawn in space: its floor and far edges, few numbers at its outer edges, and names beyond."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..capabilities.workspace.space import POSITIONS
from ..capabilities.workspace.workspace_table import for_people, in_words, labels
from ..common.arrays import Floats, Ints
from ..common.checks import require_method
from ..common.drawing import SMALL, Size, new_figure, require_flat
from .canvas import LETTER, checked_size, fit
from .eye import Eye
from .looks import Look, dress
from .raster import Raster
from .skeleton import Skeleton, skeleton_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..capabilities.workspace.region import Region

TICKS, ROOM = 5, 26.0
"""Numbers of an axis at most, and the room of each along an edge in space [points]."""

TICK, NUMBER_OFF, NAME_OFF = 3.5, 5.5, 9.0
"""Length of a tick, and the distances of numbers and of names beyond them from an edge [points]."""

POINT = 4.0
"""Length of an edge below which it is seen as a point, and has no numbers [points]."""

LINE, FAINT = 0.6, 0.55
"""Width of edges [points], and the opacity of those that are farthest."""

DOTS = 160
"""Points of a straight line that hide a name, or are hidden."""

ALONG = (0.5, 0.36, 0.64, 0.22, 0.78)
"""Where on its edge the name of an axis may stand, the best first."""

PADS = (46.0, 34.0, 40.0, 10.0)
"""Room for numbers and names to the left, to the right, below and above [points]."""


PLANE_SIZE = (6.4, 4.8)
"""Of a new figure of a workspace in a plane [inches]."""

FREE_EDGE = 0.1
"""Around axes [inches]: those of one scale are shrunk after their place was found."""


def axes_for(ax: Axes | None, size: Size, look: Look) -> Axes:
    """Axes that were given, or those of a new figure of a size [inches]; their letters small.

    Raises
    ------
    InvalidArgument : three-dimensional axes.
    MissingLibrary : matplotlib is not installed.
    """
    if ax is None:
        figure = new_figure(*checked_size(size), look.paper)
        figure.set_layout_engine("constrained", w_pad=FREE_EDGE, h_pad=FREE_EDGE)
        ax = figure.add_subplot()
    require_method("ax", ax, "tick_params", "matplotlib axes, or None")
    require_flat(ax)
    dress(ax, look)
    ax.tick_params(labelsize=SMALL)
    return ax


SMALLEST_WITH_MACHINE = 0.1
"""Least size of a workspace that its machine is drawn with, as a share of the machine's: else it would be a dot."""


def title_of(region: Region) -> str:
    """The machine and the size of its workspace."""
    return f"{region.mechanism.name}: {in_words(region)}"


def machine_of(region: Region) -> Skeleton | None:
    """The machine where the workspace starts; None where a coordinate is an angle, or where it would hide all."""
    if not set(region.names) <= set(POSITIONS):
        return None
    start = region._question.start
    skeleton = skeleton_of(region.mechanism if start is None else start)
    is_small = np.ptp(region.bounds, axis=0).max() < SMALLEST_WITH_MACHINE * np.ptp(skeleton.points, axis=0).max()
    return None if is_small else skeleton


def machine_lines(region: Region) -> list[Floats]:
    """The lines (n, 3) of the machine that a workspace is drawn with [length]; none where it is drawn alone."""
    skeleton = machine_of(region)
    lines = [] if skeleton is None else [*(line.outline for line in skeleton.parts), *skeleton.rails]
    return [line for line in lines if len(line) > 1]


class Box(NamedTuple):
    """The ends of a box in space.

    Attributes
    ----------
    low, high : its ends, (3,).
    factors : from space to the numbers that people read, (3,).
    names : of the coordinates, with units.
    """

    low: Floats
    high: Floats
    factors: Floats
    names: list[str]

    @property
    def corners(self) -> Floats:
        """(8, 3)."""
        return np.array([self.corner(pick) for pick in np.ndindex(2, 2, 2)])

    def corner(self, pick: Any) -> Floats:
        """A corner (3,): 0 for the lower, 1 for the upper end of each coordinate."""
        return np.asarray(np.array([self.low, self.high])[np.asarray(pick), np.arange(3)])


def box_of(region: Region, scale: Floats) -> Box:
    """The box around a region whose coordinates are scaled in space."""
    low, high = region.bounds * scale
    return Box(low, high, np.array(for_people(region.units)[0]) / scale, labels(region))


def fit_bare(axes: Any, points: Floats, pads: tuple[float, float, float, float] = PADS) -> None:
    """Show points (n, 2) in the middle of axes without lines and numbers, with room around [points]."""
    fit(axes, points.min(axis=0), points.max(axis=0), pads)
    axes.set_aspect("equal", adjustable="datalim")
    axes.axis("off")


def draw_image(axes: Any, raster: Raster, rgb: Any, alpha: Any, zorder: float) -> None:
    """Draw pixels in colours (rows, columns, 3), as opaque as `alpha` says, (rows, columns); axes keep their ends."""
    ends = axes.get_xlim(), axes.get_ylim()
    image = np.dstack([np.broadcast_to(rgb, (*alpha.shape, 3)), alpha])
    axes.imshow(image, origin="lower", extent=raster.extent, interpolation="antialiased", zorder=zorder)
    axes.set(xlim=ends[0], ylim=ends[1], aspect="equal")


def draw_lines(axes: Any, lines: Sequence[Floats], colour: str, width: float, zorder: float, **style: Any) -> Any:
    """Draw lines (n, 2) each, so wide [points]."""
    from matplotlib.collections import LineCollection

    style = {"colors": colour, "linewidths": width, "capstyle": "round", "zorder": zorder, **style}
    return axes.add_collection(LineCollection(lines, **style), autolim=False)


def dense(line: Floats) -> Floats:
    """Points along a line of corners (n, 3)."""
    share = np.linspace(0.0, 1.0, DOTS)[:, None]
    return np.asarray(np.concatenate([a + share * (b - a) for a, b in pairwise(line)]))


def round_ticks(ends: tuple[float, float], length: float, room: float) -> list[float]:
    """Round numbers between two, along an axis of a length, each with so much room [points]; two at least if it can."""
    from matplotlib.ticker import MaxNLocator

    (low, high), ticks = ends, list[float]()
    for most in range(TICKS + 1, 0, -1):
        every = np.asarray(MaxNLocator(most, steps=[1, 2, 5, 10], min_n_ticks=1).tick_values(low, high))
        fewer = every[(every >= low) & (every <= high)].tolist()
        if len(fewer) < min(len(ticks), 2):
            break
        ticks = fewer
        if len(ticks) <= TICKS and (len(ticks) < 2 or (ticks[1] - ticks[0]) / (high - low) * length >= room):
            break
    return ticks


def draw_box(axes: Any, eye: Eye, box: Box, look: Look, crossing: list[Floats]) -> None:
    """Draw a box that axes show whole, and number its edges.

    Parameters
    ----------
    crossing : lines (n, 2) of the axes that names keep out of, if they can.
    """
    near = (eye.axes[2] > 0.0).astype(np.int64)
    for pick, axis, is_far in _edges(near):
        line = eye.seen(_ends(box, pick, axis))[:, :2]
        axes.plot(*line.T, color=look.soft, linewidth=LINE, alpha=FAINT if is_far else 1.0, zorder=1)
    lines = [axes.transData.transform(line) for line in crossing if len(line)]
    crossed, taken = np.concatenate([*lines, np.zeros((0, 2))]), list[Any]()
    middle = eye.seen(box.corners)[:, :2].mean(axis=0)
    for axis in range(3):
        ends = eye.seen(_ends(box, _numbered(box, eye, near, axis), axis))[:, :2]
        if np.linalg.norm(np.diff(_in_points(axes, ends), axis=0)) > POINT:
            _number(axes, box, axis, ends, middle, look, crossed, taken)


def _in_points(axes: Any, places: Floats) -> Floats:
    """Places (n, 2) of axes on the screen [points]."""
    return np.asarray(axes.transData.transform(places) * 72.0 / axes.get_figure(root=True).dpi)


def _ends(box: Box, pick: Ints, axis: int) -> Floats:
    """Both ends (2, 3) of the edge along an axis through a corner."""
    first, last = pick.copy(), pick.copy()
    first[axis], last[axis] = 0, 1
    return np.array([box.corner(first), box.corner(last)])


def _edges(near: Ints) -> Iterator[tuple[Ints, int, bool]]:
    """The edges that nothing hides: a corner and the axis, and True for those at the farthest corner."""
    for axis in range(3):
        others = [k for k in range(3) if k != axis]
        for a, b in ((0, 0), (0, 1), (1, 0), (1, 1)):
            pick = np.zeros(3, np.int64)
            pick[others] = a, b
            is_near = pick[others] == near[others]
            if not is_near.all():
                yield pick, axis, not is_near.any()


def _numbered(box: Box, eye: Eye, near: Ints, axis: int) -> Ints:
    """A corner of the outer edge along an axis: on the floor, or the left one of those that stand upright."""
    first, second, upright = eye.order
    pick = near.copy()
    if axis != upright:
        pick[upright] = 0 if eye.elevation >= 0.0 else 1
        return pick
    sides = []
    for far in (first, second):
        side = near.copy()
        side[far] = 1 - near[far]
        sides.append(side)
    return min(sides, key=lambda side: float(eye.seen(box.corner(side))[0]))


def _number(
    axes: Any, box: Box, axis: int, ends: Floats, middle: Floats, look: Look, crossing: Floats, taken: list[Any]
) -> None:
    """Numbers and the name along one edge, on the side away from the middle; `taken` is where words are."""
    from matplotlib.patheffects import withStroke

    along = ends[1] - ends[0]
    out = np.array([along[1], -along[0]]) / np.linalg.norm(along)
    out *= 1.0 if out @ (ends.mean(axis=0) - middle) >= 0.0 else -1.0
    low, high = (box.low[axis] * box.factors[axis], box.high[axis] * box.factors[axis])
    style: dict[str, Any] = {
        "ha": "left" if out[0] > 0.4 else "right" if out[0] < -0.4 else "center",
        "va": "bottom" if out[1] > 0.8 else "top" if out[1] < -0.4 else "center",
        "textcoords": "offset points",
        "zorder": 9,
        "path_effects": [withStroke(linewidth=2.0, foreground=look.paper)],
        "annotation_clip": False,
    }
    bare = {"arrowstyle": "-", "color": look.soft, "linewidth": LINE, "shrinkA": 0.0, "shrinkB": 0.0}
    widest = 1
    for tick in round_ticks((low, high), float(np.linalg.norm(np.diff(_in_points(axes, ends), axis=0))), ROOM):
        at, word = ends[0] + (tick - low) / (high - low) * along, f"{tick:g}".replace("-", "\N{MINUS SIGN}")
        text = axes.annotate(word, at, xytext=NUMBER_OFF * out, fontsize=SMALL - 1.0, color=look.soft, **style)
        if any(text.get_window_extent().overlaps(other) for other in taken):
            text.remove()
            continue
        taken.append(text.get_window_extent().padded(1.0))
        widest = max(widest, len(word))
        axes.annotate("", at, xytext=TICK * out, textcoords="offset points", arrowprops=bare, annotation_clip=False)
    off = NAME_OFF + (LETTER * widest * abs(out[0]) + 1.15 * abs(out[1])) * (SMALL - 1.0)
    name = axes.annotate(box.names[axis], ends[0], xytext=off * out, fontsize=SMALL, color=look.ink, **style)

    def crossed(share: float) -> tuple[int, int]:
        name.xy = ends[0] + share * along
        area = name.get_window_extent()
        on_lines = ((crossing > area.min) & (crossing < area.max)).all(axis=1)
        return sum(area.overlaps(other) for other in taken), int(on_lines.sum())

    name.xy = ends[0] + min(ALONG, key=crossed) * along
    taken.append(name.get_window_extent().padded(1.0))
