"""Pictures and films of passes: what each half of a pass moves, before and after."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..common.arrays import Floats
from ..common.checks import require_count, require_ending, require_positive
from ..common.drawing import Size, View
from ..common.whole_files import whole_path
from ..kernels.passes.plan import Plan
from ..passes.joint_positions import carriers_of
from ..passes.plan import compile_plan
from ..passes.trace import PassTrace, Stage
from .animation import DPI, FRAMES_A_SECOND, film_writer
from .canvas import checked_size
from .eye import Eye
from .looks import HELD, Look, look_of
from .machine import machine_eye
from .save_picture import FILMS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ONE_BY_ONE, COLUMNS, PANEL = 3, 3, (3.1, 2.7)
"""Most chains that have pictures of their own; pictures in a row, and the size of one [inches]."""

MOST_STAGES, MARGIN = 400, 0.06
"""Most stages of a film; room about all that is drawn, as a share of it."""

WORDS = {
    "start": "start",
    "inward": "inward from the target",
    "trunk": "trunk to the branches",
    "outward": "outward from the base",
    "revised": "target to the ends",
}


@dataclass(frozen=True)
class PassPanel:
    """One picture: what moved, drawn before and after."""

    title: str
    before: Stage
    after: Stage
    moved: frozenset[int]


def plot_trace(
    trace: PassTrace,
    passes: int,
    path: str | os.PathLike[str] | None = None,
    seconds: float = 0.4,
    *,
    view: View | None = None,
    size: Size | None = None,
) -> Figure | None:
    """Draw the first passes of a trace, or write a film of it to a path."""
    picture = _Picture(trace, view)
    if path is not None:
        _film(picture, path, require_positive("seconds", seconds), size)
        return None
    from matplotlib.figure import Figure

    panels = list(_panels(trace, picture.plan, require_count("passes", passes)))
    rows = -(-len(panels) // COLUMNS)
    usual = PANEL[0] * min(COLUMNS, len(panels)), PANEL[1] * rows
    figure = Figure(usual if size is None else checked_size(size), layout="constrained", facecolor=picture.look.paper)
    axes = figure.subplots(rows, min(COLUMNS, len(panels)), squeeze=False).ravel()
    for letter, panel, part in zip("abcdefghijklmnopqrstuvwxyz" * len(panels), panels, axes, strict=False):
        picture.draw(part, panel, f"({letter}) {panel.title}")
    for part in axes[len(panels) :]:
        part.set_axis_off()
    return figure


def _panels(trace: PassTrace, plan: Plan, passes: int) -> Iterator[PassPanel]:
    """The start, the halves of the first passes, chain by chain if there are few, and the end."""
    chains, everything = len(plan.chains), frozenset(range(len(plan.chains)))
    first = [stage for stage in trace if stage.round == 0 and stage.iteration <= passes]
    yield PassPanel("start", first[0], first[0], frozenset())
    before = first[0]
    if chains <= ONE_BY_ONE:
        for stage in first[1:]:
            name = f"{WORDS[stage.kind]}, {stage.chain + 1}" if chains > 1 else WORDS[stage.kind]
            name += f" (pass {stage.iteration})" if passes > 1 else ""
            yield PassPanel(name, before, stage, frozenset([stage.chain]))
            before = stage
    else:
        for number in range(1, max(stage.iteration for stage in first) + 1):
            ones = [stage for stage in first if stage.iteration == number]
            for kind in ("inward", "trunk", "outward"):
                alike = [stage for stage in ones if stage.kind == kind]
                if alike:
                    together = _together(plan, before, alike)
                    name = WORDS[kind] + (f" (pass {number})" if passes > 1 else "")
                    yield PassPanel(name, before, together, everything)
                    before = together
    last = trace.stages[-1]
    told = f"{trace.passes} passes" if trace.passes != 1 else "1 pass"
    revised = f", {trace.rounds} revisions" if trace.rounds else ""
    yield PassPanel(f"after {told}{revised}", last, last, everything)


def _together(plan: Plan, before: Stage, stages: list[Stage]) -> Stage:
    """One stage in which each chain is as in its own."""
    nodes, trunks = before.nodes.copy(), before.trunks.copy()
    for stage in stages:
        chain = plan.chains[stage.chain]
        for branch in plan.branches[chain["first"] : chain["last"]]:
            block = slice(branch["first"], branch["last"] + 1)
            nodes[block] = stage.nodes[block]
        if chain["trunk"] >= 0:
            trunk = plan.trunks[chain["trunk"]]
            trunks[trunk["first"] : trunk["last"]] = stage.trunks[trunk["first"] : trunk["last"]]
    last = stages[-1]
    return Stage(last.kind, -1, last.round, last.iteration, nodes, last.pose, trunks, last.gap)


class _Picture:
    """Eye, colours and frame that all pictures of a trace share."""

    def __init__(self, trace: PassTrace, view: View | None) -> None:
        self.trace, self.plan, self.look = trace, compile_plan(trace.mechanism).plan, look_of("light")
        self.eye, _ = machine_eye(trace.mechanism, view)
        shown = [self._all(stage) for stage in (trace.stages[:60] + trace.stages[-1:])]
        points = self.eye.seen(np.vstack([*shown, trace.target[None, :3, 3]]))[:, :2]
        self.low, self.high = points.min(axis=0), points.max(axis=0)

    def _all(self, stage: Stage) -> Floats:
        return np.vstack([stage.nodes, self._ends(stage), *self._trunk_lines(stage)])

    def _ends(self, stage: Stage) -> Floats:
        """Targets of the chains' ends (n_branches, 3)."""
        return np.asarray(self.plan.branches["end"] @ stage.pose[:3, :3].T + stage.pose[:3, 3])

    def _trunk_lines(self, stage: Stage) -> list[Floats]:
        """Each trunk as a line over its joints to each of the nodes that it carries."""
        plan = self.plan
        carriers, centres = carriers_of(plan, stage.trunks[None])
        lines = []
        for chain in plan.chains:
            if chain["trunk"] < 0:
                continue
            trunk = plan.trunks[chain["trunk"]]
            turns = plan.trunk_joints["turns"] == 1  # a slide has no centre
            joints = [centres[j][0] for j in range(trunk["first"], trunk["last"]) if turns[j]]
            T = carriers[chain["trunk"] + 1][0]
            firsts = plan.nodes["home"][plan.branches["first"][chain["first"] : chain["last"]]]
            bar = firsts @ T[:3, :3].T + T[:3, 3]
            lines += [np.vstack([*joints, bar.mean(axis=0)]), bar]
        return lines

    def draw(self, axes: Axes, panel: PassPanel, title: str) -> None:
        """Draw one panel: chains before (grey, dashed where they moved) and after, targets as crosses."""
        look, trace, eye = self.look, self.trace, self.eye
        chain_of = np.repeat(np.arange(len(self.plan.chains)), self.plan.chains["last"] - self.plan.chains["first"])
        for b, branch in enumerate(self.plan.branches):
            block, is_moved = slice(branch["first"], branch["last"] + 1), int(chain_of[b]) in panel.moved
            if panel.before is not panel.after and is_moved:
                _line(axes, eye, panel.before.nodes[block], look, color=look.soft, linestyle="--", linewidth=1.0)
            colour = look.achieved if is_moved or not panel.moved else look.soft
            _line(axes, eye, panel.after.nodes[block], look, color=colour, linewidth=1.8, marker="o", markersize=4.0)
        for line in self._trunk_lines(panel.after):
            _line(axes, eye, line, look, color=look.ink, linewidth=2.4, marker="s", markersize=3.5)
        goals = self._ends(panel.after)
        _line(axes, eye, np.vstack([goals, goals[:1]]), look, color=HELD, linewidth=0.9, linestyle=":")
        _line(axes, eye, goals, look, color=HELD, linestyle="none", marker="x", markersize=7.0, markeredgewidth=1.6)
        if panel.after.round:
            at = trace.target[None, :3, 3]
            _line(axes, eye, at, look, color=look.asked, linestyle="none", marker="+", markersize=9.0)
        room = MARGIN * float((self.high - self.low).max())
        axes.set(xlim=(self.low[0] - room, self.high[0] + room), ylim=(self.low[1] - room, self.high[1] + room))
        axes.set_aspect("equal")
        axes.set_axis_off()
        axes.set_title(title, fontsize=9, color=look.ink)


def _line(axes: Axes, eye: Eye, points: Floats, look: Look, **style: Any) -> None:
    """A line over points in space, as the eye sees it."""
    x, y, _depth = eye.seen(points).T
    axes.plot(x, y, **({"markeredgecolor": style["color"], "markerfacecolor": look.paper} | style))


def _film(picture: _Picture, path: str | os.PathLike[str], seconds: float, size: Size | None) -> None:
    """Write a film of the stages, each shown for so many seconds."""
    from matplotlib.figure import Figure

    trace = picture.trace
    writer = film_writer(require_ending(path, FILMS))
    shown = np.unique(np.linspace(0, len(trace) - 1, min(len(trace), MOST_STAGES)).astype(int)).tolist()
    usual = 2.0 * PANEL[0], 2.0 * PANEL[1]
    given = usual if size is None else checked_size(size)
    figure = Figure(given, dpi=DPI, layout="constrained", facecolor=picture.look.paper)
    axes, before = figure.subplots(), trace[0]
    with whole_path(path) as part, writer.saving(figure, str(part), DPI):
        for place in shown:
            stage = trace[place]
            axes.clear()
            chain = f", chain {stage.chain + 1}" if stage.chain >= 0 else ""
            round_ = f", revision {stage.round}" if stage.round else ""
            title = f"{WORDS[stage.kind]}{chain}; pass {stage.iteration}{round_}"
            moved = frozenset([stage.chain] if stage.chain >= 0 else [])
            picture.draw(axes, PassPanel(title, before, stage, moved), title)
            before = stage
            for _ in range(max(round(seconds * FRAMES_A_SECOND), 1)):
                writer.grab_frame()
