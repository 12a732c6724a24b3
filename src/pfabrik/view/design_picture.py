"""A design: the machine before and after, side by side at one scale, with what it is to reach."""

from __future__ import annotations

from contextlib import suppress
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from ..answers.status import Status
from ..capabilities.certify.pose_region import PoseRegion
from ..capabilities.design.found_design import Design
from ..common.arrays import Floats
from ..common.drawing import SMALL, Size, Theme, View, new_figure
from ..errors import InvalidMechanism
from ..ik import solve_ik
from ..machine.description.mechanism import Mechanism
from .canvas import TITLE, Canvas, canvas_on, checked_size, usual_size, wrapped
from .looks import HELD, look_of
from .machine import key_of, machine_eye
from .painter import draw_machine
from .skeleton import skeleton_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_NAMED = 6
"""Dimensions that a title names, at most."""

ROUND = np.linspace(0.0, 2.0 * np.pi, 49)


def plot_design(design: Design, view: View | None, size: Size | None, theme: Theme) -> Figure:
    """Draw, as `Design.plot` has it."""
    machine, look = design._machine, look_of(theme)
    machines = {"before": machine}
    with suppress(InvalidMechanism):  # where no machine has what breaks the wishes least
        machines["found" if design.mechanism else "least broken"] = machine.with_dimensions(design.dimensions)
    eye, is_plane = machine_eye(machine, view)
    shown = {name: skeleton_of(each) for name, each in machines.items()}
    outlines = {name: _outlines(design, each) for name, each in machines.items()}
    points = {name: np.concatenate([each.points, *outlines[name]]) for name, each in shown.items()}
    width, height = usual_size(np.concatenate([*points.values()]), eye, is_plane=is_plane)
    usual = (width * len(machines), height + 0.6)
    figure = new_figure(*(usual if size is None else checked_size(size)), look.paper)
    spans = np.max([np.ptp(eye.seen(each)[:, :2], axis=0) for each in points.values()], axis=0)
    panels = figure.subplots(1, len(machines), squeeze=False)[0]
    canvases = [canvas_on(axes, eye, look, is_plane=is_plane) for axes in panels]
    wide = figure.bbox.width / figure.dpi
    title = wrapped(f"{design._name}: {design.verdict}, {design.minimised} {design.aim:.5g}", wide, TITLE)
    figure.suptitle(title, fontsize=TITLE, color=look.ink)
    reached = {name: _reached(design, each) for name, each in machines.items()}
    for axes, name in zip(panels, machines, strict=True):
        sizes = [(each, machines[name].dimensions[each]) for each in list(design.dimensions)[:MOST_NAMED]]
        words = f"{name}: {reached[name].sum()} of {len(reached[name])} poses reached"
        named = ", ".join(
            [f"{each} {value:.5g}" for each, value in sizes] + ["…"] * (len(design.dimensions) > MOST_NAMED)
        )
        parts = (wrapped(line, wide / len(machines), SMALL) for line in (words, named))
        axes.set_title("\n".join(parts), fontsize=SMALL, color=look.ink)
    for canvas, name in zip(canvases, machines, strict=True):
        key = [*key_of(shown[name], look), *_draw_poses(canvas, outlines[name], reached[name])]
        canvas.frame(points[name], machine.length_unit, key, spans=spans)
        draw_machine(canvas, shown[name])
    return figure


def _reached(design: Design, machine: Mechanism) -> Any:
    """True for poses that a machine reaches, of all that are given, or the middle and corners of a region, (n,)."""
    reach = design._reach
    return np.asarray(solve_ik(machine, reach.at(machine, reach.poses)).status) == Status.REACHED


def _outlines(design: Design, machine: Mechanism) -> list[Floats]:
    """Positions of the poses that are looked at, (n, 3), then lines around a region, (k, 3) each [length]."""
    reach = design._reach
    lines = [reach.poses[:, :3, 3], *([] if reach.region is None else outlines_of(reach.region))]
    return [line + reach.moves * machine.home_pose[:3, 3] for line in lines]


def outlines_of(region: PoseRegion) -> list[Floats]:
    """Lines around the positions of a region, (k, 3) each [length]: the edges of a box, circles of what is round."""
    middle, half = region.middle[:3], region.half[:3]
    if region.shape == "box":
        corners = np.array(list(product((-1.0, 1.0), repeat=3)))
        pairs = [(a, b) for a in corners for b in corners if (a <= b).all() and (a != b).sum() == 1]
        return [middle + half * np.array(pair) for pair in pairs]
    circle = np.stack([np.cos(ROUND), np.sin(ROUND), np.zeros(len(ROUND))], axis=1)
    if region.shape == "ball":
        return [middle + half * np.roll(circle, turn, axis=1) for turn in range(3)]
    ends = [circle + [0.0, 0.0, end] for end in (-1.0, 1.0)]
    return [middle + half * line for line in (*ends, *np.stack(ends, axis=1)[:-1:12])]


def _draw_poses(canvas: Canvas, outlines: list[Floats], reached: Any) -> list[Any]:
    """Draw lines around a region, and poses, in orange where they are not reached; the key of these."""
    (places, *lines), look = outlines, canvas.look
    for line in lines:
        canvas.line(line, color=look.asked, linestyle="--", linewidth=1.2, zorder=20)
    key = []
    for mask, colour, label in ((reached, look.achieved, "reached"), (~reached, HELD, "not reached")):
        if mask.any():
            style: dict[str, Any] = {"marker": "o", "markersize": 3.0, "linestyle": "", "zorder": 21}
            key.append(canvas.line(places[mask], color=colour, label=label, **style))
    return key
