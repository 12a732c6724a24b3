"""Draw the pictures of docs/p-fabrik.md, and print its table of rates. Run it as `python tools/site/p_fabrik.py`.

The first picture, that of the passes that stall, and the last ask the library; others are a few lines of NumPy here.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

import pfabrik as pf

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "figures"
CRANK, ROD = 1.0, 1.3
BASE = np.zeros(2)
OLD, NEW, GOAL = "#9aa5b1", "#1f5fa8", "#c2410c"
BENDS = (80, 70, 60, 50, 40, 30, 20)
"""Bends of the elbow at the solution [deg]."""


def main() -> None:
    """Write the pictures as SVG, the same in every run."""
    mpl.rcParams.update({"svg.hashsalt": "p-fabrik", "svg.fonttype": "none", "font.size": 9})
    trace = pf.passes.trace(pf.load("five_bar"), [0, 30, 150])
    trace.plot(size=(8.5, 4.6)).savefig(FOLDER / "p-fabrik-pass.svg", metadata={"Date": None})
    drawn = {"stall": stall, "rate": rate, "meeting": a_meeting, "half-space": half_space, "count": count}
    for name, draw in drawn.items():
        figure = Figure(figsize=(8.5, 3.1), layout="constrained")
        draw(figure)
        figure.savefig(FOLDER / f"p-fabrik-{name}.svg", metadata={"Date": None})


def towards(start: np.ndarray, goal: np.ndarray, length: float) -> np.ndarray:
    """The point at a distance from `start`, on the line to `goal`."""
    return start + length * (goal - start) / np.linalg.norm(goal - start)


def inward(elbow: np.ndarray, target: np.ndarray) -> np.ndarray:
    return towards(target, elbow, ROD)


def outward(elbow: np.ndarray) -> np.ndarray:
    return towards(BASE, elbow, CRANK)


def meeting(target: np.ndarray) -> np.ndarray:
    """Where the crank's circle meets the circle about the target, the upper one."""
    d = np.linalg.norm(target)
    along = (CRANK**2 - ROD**2 + d**2) / (2 * d)
    u = target / d
    return along * u + np.sqrt(CRANK**2 - along**2) * np.array([-u[1], u[0]])


def a_meeting(figure: Figure) -> None:
    """Where the crank's circle meets the rod's about the target, which passes tend to."""
    target, elbow = np.array([1.75, 0.35]), CRANK * np.array([np.cos(2.0), np.sin(2.0)])
    axes = figure.subplots()
    frame(axes, "meeting: both circles at once")
    axes.add_patch(Circle(BASE, CRANK, fill=False, color=OLD, linestyle=":"))
    axes.add_patch(Circle(target, ROD, fill=False, color=GOAL, linestyle=":", alpha=0.6))
    axes.plot(*np.array([BASE, elbow]).T, "o-", color=OLD)
    axes.plot(*np.array([BASE, meeting(target), target]).T, "o-", color=NEW)
    axes.plot(*target, "x", color=GOAL, markersize=9, markeredgewidth=2)
    axes.set(xlim=(-1.2, 3.2), ylim=(-1.2, 1.8))


def stall(figure: Figure) -> None:
    """A step of the 5-bar's circle out of reach: the targets of all rounds, and the gap after each pass."""
    machine, turn = pf.load("five_bar"), np.linspace(0, 2 * np.pi, 361)[:134]
    circle = np.stack([0 * turn, 60 * np.sin(turn), 200 - 60 * np.cos(turn)], axis=1)
    before = pf.passes.track(machine, circle[:-1])
    trace = pf.passes.trace(machine, circle[-1], start=before[-1])
    nearest = pf.solve_ik(machine, circle[-1]).pose[1:3, 3]
    left, right = figure.subplots(1, 2)
    starts = [stage for stage in trace if stage.kind in ("start", "revised")]
    goals = np.array([stage.pose[1:3, 3] for stage in starts])
    for first, colour in ((trace[0], OLD), (trace[-1], NEW)):
        for branch in (slice(0, 3), slice(3, 6)):
            left.plot(*first.nodes[branch, 1:].T, "o-", color=colour)
    left.plot(*goals.T, ".-", color=GOAL, linewidth=0.8, label="targets of the rounds")
    left.plot(*goals[0], "x", color=GOAL, markersize=9, markeredgewidth=2, label="asked for")
    left.plot(*nearest, "*", color="black", markersize=9, label="nearest pose")
    left.set_aspect("equal")
    left.set_axis_off()
    left.legend(fontsize=7, loc="upper right", bbox_to_anchor=(-0.2, 1.0), frameon=False)
    right.semilogy(trace.gaps, color=NEW, linewidth=0.8)
    right.set(xlabel="passes", ylabel="largest gap of a chain's end [mm]", title=f"{trace.rounds} rounds")
    away = [float(np.linalg.norm(each - goals[0])) for each in (goals[-1], nearest)]
    sys.stdout.write(f"{trace}; {away[0]:.1f} mm away, where the nearest pose is {away[1]:.1f} mm away\n")


def frame(axes: Axes, title: str) -> None:
    axes.set_title(title)
    axes.set_aspect("equal")
    axes.set_axis_off()


def rate(figure: Figure) -> None:
    """Passes from beside the solution: what one leaves of the elbow's error, next to cos^2 of the bend."""
    left, right = figure.subplots(1, 2)
    measured = []
    for bend in BENDS:
        solution, target = at_bend(np.radians(bend))
        elbow, errors = outward(solution + [1e-3, 2e-3]), []
        for _ in range(60):
            errors.append(float(np.linalg.norm(elbow - solution)))
            elbow = outward(inward(elbow, target))
        errors = [error for error in errors if error > 1e-12]
        measured.append(errors[-1] / errors[-2])
        left.semilogy(errors, label=f"{bend}°")
    left.set(xlabel="passes", ylabel="error of the elbow", xlim=(0, 40), title="error by the elbow's bend")
    left.legend(ncols=2, fontsize=7)
    bends = np.linspace(0, 90, 200)
    right.plot(bends, np.cos(np.radians(bends)) ** 2, color=OLD, label="cos² of the bend")
    right.plot(BENDS, measured, "o", color=NEW, label="measured")
    right.set(xlabel="bend at the solution [deg]", ylabel="error left by one pass")
    right.legend()
    for bend, factor in zip(BENDS, measured, strict=True):
        sys.stdout.write(
            f"{bend:3d} deg: a pass leaves {factor:.4f} of the error; cos^2 is {np.cos(np.radians(bend)) ** 2:.4f}\n"
        )


def at_bend(bend: float) -> tuple[np.ndarray, np.ndarray]:
    """The elbow and the end of a dyad, at a bend."""
    elbow = CRANK * np.array([np.cos(0.8), np.sin(0.8)])
    return elbow, elbow + ROD * np.array([np.cos(0.8 - bend), np.sin(0.8 - bend)])


def half_space(figure: Figure) -> None:
    """Two struts of one foot: the points that they wish for and their mean; half-spaces, and the least step."""
    foot, heads, longest = np.array([0.2, 0.0]), (np.array([2.1, 0.9]), np.array([0.4, 2.35])), 1.75
    nearest = [towards(head, foot, longest) for head in heads]
    for axes, asks_points in zip(figure.subplots(1, 2), (True, False), strict=True):
        frame(axes, "wishes are points: the mean" if asks_points else "wishes are half-spaces: the least step")
        for head, wish in zip(heads, nearest, strict=True):
            axes.add_patch(Circle(head, longest, color=OLD, alpha=0.2))
            axes.plot(*head, "s", color=OLD)
            normal = (head - wish) / longest
            side = np.array([-normal[1], normal[0]])
            if asks_points:
                axes.plot(*np.array([foot, wish]).T, "--", color=GOAL)
                axes.plot(*wish, "o", color=GOAL)
            else:
                axes.plot(*np.array([wish - 1.2 * side, wish + 1.2 * side]).T, color=GOAL)
        if asks_points:
            end = np.mean(nearest, axis=0)
        else:
            normals = np.array([(head - wish) / longest for head, wish in zip(heads, nearest, strict=True)])
            end = np.linalg.solve(normals, [n @ wish for n, wish in zip(normals, nearest, strict=True)])
        axes.annotate("", end, foot, arrowprops={"arrowstyle": "->", "color": NEW, "lw": 2})
        axes.plot(*foot, "o", color=NEW)
        axes.set(xlim=(-1.4, 3.0), ylim=(-0.8, 2.6))


def count(figure: Figure) -> None:
    """How many passes the arms of the redundant machine take, whole workspace, from home."""
    mechanism, rng = pf.load("nrpm"), np.random.default_rng(4)
    drawn = np.array(
        [
            pf.pose(mechanism.reference_point + rng.uniform(-1, 1, 3) * mechanism.characteristic_length, rotvec=turn)
            for turn in rng.uniform(-0.26, 0.26, (3000, 3))
        ]
    )
    targets = drawn[pf.solve_ik(mechanism, drawn).status == pf.Status.REACHED]
    options = {"the paper's passes": pf.passes.Options.paper(), "half-spaces": pf.passes.Options.accelerated()}
    axes, edges = figure.subplots(), np.append(np.arange(1, 13), 101)
    for place, (label, each) in enumerate(options.items()):
        answers = pf.passes.solve(mechanism, targets, replace(each, working_mode="any"))
        reached = answers.status == pf.Status.REACHED
        bars = np.append(np.histogram(answers.iterations[reached], edges)[0], np.sum(~reached)) / len(targets)
        text = f"{label}: {100 * np.mean(reached):.1f} % reached, {np.mean(answers.iterations[reached]):.2f} passes"
        axes.bar(np.arange(len(bars)) + 0.4 * place - 0.2, bars, 0.4, label=text, color=(OLD, NEW)[place])
    axes.set_xticks(range(len(bars)), [*map(str, range(1, 12)), "12 +", "not\nreached"])
    axes.set(
        xlabel="passes", ylabel="share of targets", title=f"NRPM, {len(targets)} targets in its workspace, from home"
    )
    axes.legend()


if __name__ == "__main__":
    main()
