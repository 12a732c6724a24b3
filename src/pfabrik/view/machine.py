"""`plot`: one configuration of a machine as a picture."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..answers.solution import Solution
from ..common.arrays import Floats
from ..common.checks import require_names
from ..common.drawing import SMALL, Plotted, Theme, View
from ..kinematics import plane_of
from ..machine.description.mechanism import Mechanism
from .canvas import LETTER, ON_TOP, Canvas, canvas_on, new_canvas
from .eye import Eye, eye_for, eye_of, eye_on
from .labels import place_names
from .looks import HELD, Look, look_of
from .painter import INK, draw_machine, marker_style
from .skeleton import Mark, Skeleton, checked_shown, skeleton_of

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes


def plot(
    shown: Mechanism | Solution | Plotted,
    ax: Axes | None = None,
    *,
    names: Sequence[str] | bool = (),
    view: View | None = None,
    size: tuple[float, float] | None = None,
    theme: Theme = "light",
    like: Mechanism | Solution | None = None,
) -> Axes:
    """Draw a machine at home, or one answer: in space, or a planar machine in its plane.

    Joints are markers by type, actuated ones filled; nearer links cross over farther ones, and bodies with three or
    more joints are plates. The base is the pale ground, the end effector blue, pale rails are those of slides, and a
    cross marks the reference point. What holds an answer back, or what it exceeds, is orange, and named: "B3 max".
    Links with a thickness are drawn as they are, of an answer the two that are nearest to each other darker, and orange
    where they stop it, or overlap; the key names them.

    Parameters
    ----------
    shown : Mechanism or Solution
        A Mechanism, or one Solution; a result that has a `plot` of its own is drawn by that.
    ax : Axes, optional
        Two-dimensional Matplotlib axes to draw on. Default: those of a new figure, which is `ax.figure`; its `savefig`
        writes PNG, SVG and PDF.
    names : sequence of str or bool, optional
        Joints whose names are written beside them, such as `mechanism.actuator_names`; True for all joints.
    view : str or (float, float), optional
        "top", "front", "side" or "iso", or elevation and azimuth [deg]; from -y at (0, -90), from x at (0, 0). Default:
        where joints are seen best apart; of a planar machine its plane.
    size : (float, float), optional
        Width and height of a new figure [inches]. Default: the machine's shape.
    theme : {"light", "dark"}, optional
        Colours for a light or a dark ground.
    like : Mechanism or Solution, optional
        What is drawn beside it on axes of the same size: both are at one scale if each is drawn like the other.

    Returns
    -------
    Axes
        What was drawn on; lengths in it are in the mechanism's unit.

    Raises
    ------
    InvalidArgument
        A batch, three-dimensional axes, or no such view, size or theme.
    UnknownName
        No joint of such a name.
    MissingLibrary
        Matplotlib is not installed.
    """
    if isinstance(shown, Plotted):
        return plot_result(shown, ax=ax, names=names, view=view, size=size, theme=theme, like=like)
    mechanism, _ = checked_shown(shown)
    if isinstance(names, bool):
        names = [joint.name for joint in mechanism.joints] if names else ()
    owners = {each.name: each.joint.name for each in mechanism.coordinates}
    named = {mechanism.joint(owners.get(name, name)).name for name in require_names("names", names)}
    look, skeleton = look_of(theme), skeleton_of(shown)
    eye, is_plane = machine_eye(mechanism, view)
    beside = _beside(skeleton, named)
    if ax is None:
        canvas = new_canvas(
            skeleton.points, eye, look, is_plane=is_plane, title=mechanism.name, size=size, beside=beside
        )
    else:
        canvas = canvas_on(ax, eye, look, is_plane=is_plane)
    spans = 0.0 if like is None else np.ptp(_seen(like, view), axis=0)
    canvas.frame(skeleton.points, mechanism.length_unit, key_of(skeleton, look), beside, spans)
    draw_machine(canvas, skeleton)
    write_names(canvas, skeleton, named)
    axes: Axes = canvas.axes
    return axes


def plot_result(result: Plotted, **options: Any) -> Axes:
    """Draw a result by its own `plot`, with what was asked for beside what `plot` does by itself."""
    usual = {name: each.default for name, each in inspect.signature(plot).parameters.items()}
    axes: Axes = result.plot(**{name: value for name, value in options.items() if value is not usual[name]})
    return axes


def machine_eye(mechanism: Mechanism, view: View | None = None) -> tuple[Eye, bool]:
    """The eye that a machine is drawn for, and True if it is seen in its plane; of all its answers the same."""
    if view is not None:
        return eye_of(view), False
    plane = plane_of(mechanism)
    if plane is not None:
        return eye_on(plane), True
    home = skeleton_of(mechanism)
    return eye_for(home.joints_and_reference, home.lines), False


def _seen(shown: Mechanism | Solution, view: View | None) -> Floats:
    """What is drawn of a machine or an answer, as its own eye sees it, (n, 2) [length]."""
    eye, _ = machine_eye(checked_shown(shown)[0], view)
    return np.asarray(eye.seen(skeleton_of(shown).points)[:, :2])


def _beside(skeleton: Skeleton, named: set[str]) -> float:
    """Room for the longest name on both sides [points]."""
    words = [_words(mark) for mark in skeleton.marks if mark.held_by or mark.joint.name in named]
    return max(map(len, words), default=0) * LETTER * SMALL


def _words(mark: Mark) -> str:
    """The name of a joint, with the limits that are active there."""
    return " ".join([mark.joint.name, *mark.held_by])


def key_of(skeleton: Skeleton, look: Look) -> list[Artist]:
    """A marker and a word for each kind of joint that occurs, for limits if there is one that holds, and for links."""
    from matplotlib.lines import Line2D

    kinds = sorted({(mark.joint.type, bool(mark.joint.actuated)) for mark in skeleton.marks})
    looks = [(kind + ", actuated" * actuated, marker_style(kind, actuated, False, look)) for kind, actuated in kinds]
    if skeleton.held:
        looks.append(("at a limit", marker_style("revolute", True, True, look)))
    key: list[Artist] = [Line2D([], [], linestyle="", label=label, **style) for label, style in looks]
    near = [solid for solid in skeleton.solids if solid.is_nearest]
    if near:
        pair, is_stopped = "–".join(dict.fromkeys(solid.body for solid in near)), near[0].is_stopped
        words = f"{'too near' if is_stopped else 'nearest'}: {pair}"
        key.append(Line2D([], [], label=words, color=HELD if is_stopped else look.soft, linewidth=INK))
    return key


def write_names(canvas: Canvas, skeleton: Skeleton, named: set[str]) -> None:
    """Write active limits at their joints, and the names of chosen joints."""
    texts = []
    for mark in skeleton.marks:
        if mark.held_by or mark.joint.name in named:
            style: dict[str, Any] = {"color": HELD if mark.held_by else canvas.look.ink, "zorder": ON_TOP}
            texts.append(canvas.words(mark.place, _words(mark), **style))
    place_names(canvas, texts, skeleton.joints_and_reference, skeleton.lines)
