"""A machine as matplotlib artists, and `plot`: one configuration as a picture."""

from __future__ import annotations

from collections.abc import Sequence, Set
from typing import TYPE_CHECKING, Any

import numpy as np

from ..answers.solution import Solution
from ..checks import require_names
from ..description.joints import JointType
from ..description.mechanism import Mechanism
from ..drawing import SMALL
from ..kinematics import plane_of
from ..skeleton import Line, Mark, Skeleton, checked_shown, skeleton_of
from ..tolerances import TOLERANCES
from .canvas import Canvas, canvas_on
from .labels import place_names
from .looks import ACTUATED, EDGE, HELD, LINK, MARKERS, PASSIVE, of_a_body

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

SIZE, SLIDE_SIZE = 20.0, 44.0
"""Areas of markers [points²]: that of a slide is larger, so that it shows behind a joint in the same place."""

USUAL_SIDE = 290.0
"""Shorter side of axes in which lines and markers have their usual size [points]."""

MARKS_APART = 16.0
"""Distance between neighbouring joints from which on markers have their usual size [points]."""

PENS = (0.45, 1.5)
"""Least and greatest size of lines and markers, against the usual."""

SOLID_ALPHA, NEAREST_ALPHA = 0.06, 0.16
"""How opaque each of both sides of a thick link is, and of the two that are nearest to each other."""

WIDTH = 2.0
"""Width of the line of a usual bar [points]."""

RAIL_DASHES = (0, (4, 2))


def plot(shown: Mechanism | Solution, ax: Axes | None = None, *, names: Sequence[str] | bool = ()) -> Axes:
    """Draw a machine at home, or one answer: in space, or a planar machine in its plane.

    Joints are markers by type, actuated ones filled; links are lines, and bodies with three or more joints faces. The
    base is grey, the end effector blue, dashed lines are rails, and a cross marks the reference point. What holds an
    answer back, or what it exceeds, is orange, and named: "B3 max". Links with a thickness are drawn as they are, of an
    answer the two that are nearest to each other darker, and orange where they stop it, or overlap.

    Parameters
    ----------
    shown : a Mechanism, or one Solution.
    ax : matplotlib axes to draw on: three-dimensional ones, or any for a planar machine. Default: those of a new
        figure, which is `ax.figure`; its `savefig` writes PNG, SVG and PDF.
    names : joints whose names are written beside them, such as `mechanism.actuator_names`; True for all joints.

    Returns
    -------
    Axes : what was drawn on, in the mechanism's unit of length.

    Raises
    ------
    InvalidArgument : a batch, or two-dimensional axes for a machine in space.
    UnknownName : no joint of such a name.
    MissingLibrary : matplotlib is not installed.
    """
    mechanism, _ = checked_shown(shown)
    if isinstance(names, bool):
        names = [joint.name for joint in mechanism.joints] if names else ()
    owners = {each.name: each.joint.name for each in mechanism.coordinates}
    named = {mechanism.joint(owners.get(name, name)).name for name in require_names("names", names)}
    skeleton = skeleton_of(shown)
    canvas = canvas_on(ax, plane_of(mechanism))
    draw_machine(canvas, skeleton)
    draw_key(canvas, skeleton)
    canvas.frame(skeleton.points, mechanism.length_unit)
    write_names(canvas, skeleton, named)
    axes: Axes = canvas.axes
    return axes


def draw_machine(canvas: Canvas, skeleton: Skeleton) -> list[Artist]:
    """Bodies, rails, reference point and joints, as artists that can be removed again."""
    pen = pen_of(canvas, skeleton.mechanism)
    artists: list[Artist] = [each for line in skeleton.parts for each in _part(canvas, line, skeleton.held, pen)]
    for solid in skeleton.solids:
        colour = HELD if solid.is_stopped else LINK
        alpha = NEAREST_ALPHA if solid.is_nearest else SOLID_ALPHA
        artists.append(canvas.solid(solid.vertices[solid.faces], facecolor=colour, alpha=alpha, zorder=0))
    for rail in skeleton.rails:
        artists.append(canvas.line(rail, color=EDGE, linewidth=0.9, linestyle=RAIL_DASHES, zorder=1))
    artists.append(canvas.line(skeleton.reference[None], marker="+", color=EDGE, markersize=9, zorder=4))
    return artists + _joints(canvas, skeleton.marks, pen)


def pen_of(canvas: Canvas, mechanism: Mechanism) -> float:
    """The thickness of lines and size of markers, against that of a picture of usual size with few joints.

    It grows with the axes, and shrinks where joints at home are so close together that their markers would meet.
    """
    home = skeleton_of(mechanism)
    places = np.array([mark.place for mark in home.marks])
    extent = float(np.ptp(home.points, axis=0).max())
    box = canvas.axes.get_window_extent()
    side = min(box.width, box.height) * 72.0 / canvas.axes.get_figure(root=True).dpi
    apart = np.linalg.norm(places[:, None] - places, axis=2)
    nearest = np.where(apart > TOLERANCES.alignment * extent, apart, np.inf).min(axis=1)
    nearest = nearest[np.isfinite(nearest)]
    between = side * float(np.median(nearest)) / extent if len(nearest) and extent > 0.0 else side
    return float(np.clip(min(side / USUAL_SIDE, between / MARKS_APART), *PENS))


def _part(canvas: Canvas, line: Line, held: Set[str], pen: float) -> list[Artist]:
    """A part of a body: base and end effector light and broad, links dark and narrow; those of a joint at its limit
    orange.
    """
    part = line.part
    colour = HELD if held & set(part.joints) else of_a_body(part.role)
    artists: list[Artist] = []
    if part.kind == "plate":
        artists.append(canvas.face(line.corners, facecolor=colour, alpha=0.55, zorder=0))
    width = WIDTH * (0.8 if part.kind == "plate" else part.radius) * pen
    artists.append(canvas.line(line.outline, color=colour, linewidth=width, solid_capstyle="round", zorder=1))
    return artists


def _joints(canvas: Canvas, marks: Sequence[Mark], pen: float) -> list[Artist]:
    """A marker for every joint, those of a kind together, slides behind the others."""
    kinds: dict[tuple[JointType, bool, bool], list[Mark]] = {}
    for mark in marks:
        kinds.setdefault((mark.joint.type, bool(mark.joint.actuated), bool(mark.held_by)), []).append(mark)
    return [
        canvas.marks(
            np.array([mark.place for mark in marks_of_kind]),
            zorder=2 if kind == "prismatic" else 3,
            **marker_style(*key, pen),
        )
        for key, marks_of_kind in sorted(kinds.items())
        for kind in key[:1]
    ]


def marker_style(kind: JointType, actuated: bool, held: bool, pen: float = 1.0) -> dict[str, Any]:
    """The style of a joint's marker: shape by type, filled if it is actuated, orange at a limit."""
    return {
        "marker": MARKERS[kind],
        "s": pen**2 * (SLIDE_SIZE if kind == "prismatic" else SIZE),
        "facecolor": (HELD if held else ACTUATED) if actuated else PASSIVE,
        "edgecolor": HELD if held else EDGE,
        "linewidths": 1.8 if held else 0.8,
    }


def draw_key(canvas: Canvas, skeleton: Skeleton) -> None:
    """Draw the key of markers above the axes."""
    handles = key_of(skeleton)
    canvas.axes.legend(handles=handles, **KEY, ncols=min(len(handles), 3))


KEY: dict[str, Any] = {
    "loc": "lower center",
    "bbox_to_anchor": (0.5, 1.0),
    "frameon": False,
    "fontsize": SMALL,
    "handletextpad": 0.2,
    "columnspacing": 1.2,
    "borderaxespad": 0.0,
}
"""Settings of a key above axes."""


def key_of(skeleton: Skeleton) -> list[Artist]:
    """A marker and a word for each kind of joint that occurs, and for limits if there is one that holds."""
    from matplotlib.lines import Line2D

    kinds = sorted({(mark.joint.type, bool(mark.joint.actuated)) for mark in skeleton.marks})
    looks = [(kind + ", actuated" * actuated, marker_style(kind, actuated, False)) for kind, actuated in kinds]
    if skeleton.held:
        looks.append(("at a limit", marker_style("fixed", False, True) | {"marker": "o", "facecolor": HELD}))
    return [
        Line2D(
            [],
            [],
            linestyle="",
            marker=each["marker"],
            markersize=np.sqrt(each["s"]),
            markerfacecolor=each["facecolor"],
            markeredgecolor=each["edgecolor"],
            markeredgewidth=each["linewidths"],
            label=label,
        )
        for label, each in looks
    ]


def write_names(canvas: Canvas, skeleton: Skeleton, named: set[str]) -> None:
    """Write active limits at their joints, and the names of chosen joints."""
    texts = []
    for mark in skeleton.marks:
        if mark.held_by or mark.joint.name in named:
            words = " ".join([mark.joint.name, *mark.held_by])
            colour = HELD if mark.held_by else LINK
            texts.append(canvas.words(mark.place, words, color=colour, zorder=30))
    place_names(canvas, texts, np.array([mark.place for mark in skeleton.marks]), skeleton.lines)
