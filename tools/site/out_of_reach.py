"""Draw docs/figures/out_of_reach.png: targets outside workspaces, and their answers. Run it from anywhere."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

import pfabrik as pf

PICTURE = Path(__file__).resolve().parents[2] / "docs" / "figures" / "out_of_reach.png"
FINENESS = 300
COLOURS = 64  # enough for smooth edges, and a third of the file
NEAREST, CENTROID, TARGET = "#0072b2", "#d55e00", "#333333"
FIVE_BAR = [(-190, 60), (-150, 230), (-60, 290), (20, 30), (110, 280), (200, 150)]
STEWART = [(-190, 150), (-130, 290), (-40, 105), (60, 330), (150, 110), (200, 230)]

Floats = NDArray[np.float64]


def main() -> None:
    """Write the picture: two machines side by side."""
    figure = Figure(figsize=(11, 5), layout="constrained", dpi=100)
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    draw(left, "five_bar", (-220, 220, 0, 320), FIVE_BAR)
    draw(right, "stewart", (-220, 220, 80, 350), STEWART)
    handles, labels = right.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    PICTURE.parent.mkdir(exist_ok=True)
    figure.savefig(PICTURE)
    Image.open(PICTURE).convert("RGB").quantize(COLOURS).save(PICTURE, optimize=True)


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
