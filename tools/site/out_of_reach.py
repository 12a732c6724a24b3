"""Draw docs/figures/out_of_reach.png and stream.png: targets out of reach and their answers, alone and in a stream.

Run it from anywhere.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

import pfabrik as pf

FIGURES = Path(__file__).resolve().parents[2] / "docs" / "figures"
FINENESS, TICKS = 300, 600
COLOURS = 64  # enough for smooth edges, and a third of the file
NEAREST, CENTROID, TARGET = "#0072b2", "#d55e00", "#333333"
FIVE_BAR = [(-190, 60), (-150, 230), (-60, 290), (20, 30), (110, 280), (200, 150)]
STEWART = [(-190, 150), (-130, 290), (-40, 105), (60, 330), (150, 110), (200, 230)]

Floats = NDArray[np.float64]


def main() -> None:
    """Write the pictures, each of two panels side by side."""
    draw_places()
    draw_stream()


def draw_places() -> None:
    """Targets of two machines, and their answers."""
    figure = new_figure(5.0)
    left, right = figure.subplots(1, 2)
    draw(left, "five_bar", (-220, 220, 0, 320), FIVE_BAR)
    draw(right, "stewart", (-220, 220, 80, 350), STEWART)
    handles, labels = right.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    save(figure, "out_of_reach.png")


def draw_stream() -> None:
    """Struts of a Stewart platform whose target goes out of reach and back, turning on its way, for three prices."""
    mechanism, share = pf.load("stewart"), np.linspace(0.0, 1.0, TICKS)
    away = np.sin(np.pi * share) ** 2
    places = mechanism.home_pose[:3, 3] + np.stack([180.0 * away, -60.0 * away, 70.0 * away], axis=1)
    turns = np.stack([np.zeros(TICKS), 0.7 * np.sin(2.0 * np.pi * share), 0.5 * away], axis=1)
    targets = np.asarray(pf.pose(places, rotvec=turns))
    figure = new_figure(3.6)
    left, right = figure.subplots(1, 2)
    for hold_price, colour in ((10.0, NEAREST), (1.0, CENTROID), (0.1, "#009e73")):
        answers = pf.track(mechanism, targets, options=pf.Options(hold_price=hold_price))
        left.plot(share, answers.actuators, color=colour, linewidth=1)
        right.plot(share, np.degrees(answers.rotation_error), color=colour, label=f"hold_price={hold_price:g}")
    left.set(title="struts", xlabel="share of the path", ylabel=f"length [{mechanism.length_unit}]")
    right.set(title="what the answers give way of the orientation", xlabel="share of the path", ylabel="angle [deg]")
    right.legend(frameon=False)
    save(figure, "stream.png")


def new_figure(height: float) -> Figure:
    """An empty figure of so many inches."""
    figure = Figure(figsize=(11, height), layout="constrained", dpi=100)
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, name: str) -> None:
    """Write a figure in few colours."""
    path = FIGURES / name
    path.parent.mkdir(exist_ok=True)
    figure.savefig(path)
    Image.open(path).convert("RGB").quantize(COLOURS).save(path, optimize=True)


def draw(axes: Axes, name: str, box: tuple[float, float, float, float], targets: list[tuple[float, float]]) -> None:
    """The section x = 0 of a machine's workspace at home orientation, targets outside it and their answers."""
    mechanism = pf.load(name)
    y, z = np.linspace(*box[:2], FINENESS), np.linspace(*box[2:], FINENESS)
    section = in_the_section(*np.meshgrid(y, z))
    reached = pf.solve_ik(mechanism, section).status == pf.Status.REACHED
    axes.contourf(y, z, reached, levels=[0.5, 1.5], colors=["#e3ecf3"])
    axes.contour(y, z, reached, levels=[0.5], colors=["#7f9db5"], linewidths=1)
    wanted = in_the_section(*np.transpose(targets))
    centroids = pf.passes.solve(mechanism, wanted, pf.passes.Options.centroid())
    answers = ("centroid", centroids, CENTROID, "s"), ("nearest", pf.solve_ik(mechanism, wanted), NEAREST, "o")
    for projection, solution, colour, mark in answers:
        places = solution.pose[:, :3, 3]
        for target, place in zip(wanted, places, strict=True):
            axes.plot(*np.transpose([target, place])[1:], color=colour, linewidth=1)
        axes.plot(*places.T[1:], mark, color=colour, markersize=6 if mark == "s" else 4, label=projection)
    axes.plot(*wanted.T[1:], "x", color=TARGET, label="target")
    axes.plot([], [], color="#e3ecf3", linewidth=8, label="within reach")
    axes.set(title=mechanism.name, xlabel=f"y [{mechanism.length_unit}]", ylabel=f"z [{mechanism.length_unit}]")
    axes.set_aspect("equal")


def in_the_section(y: Floats, z: Floats) -> Floats:
    """Positions (..., 3) in the plane x = 0."""
    return np.stack([np.zeros(np.shape(y)), y, z], axis=-1)


if __name__ == "__main__":
    main()
