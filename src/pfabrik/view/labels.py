"""Places names so that they hide neither each other nor joints: the best of several places around each joint."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arrays import Floats
from .canvas import Canvas

DIRECTIONS = np.stack([np.cos(np.radians(range(0, 360, 45))), np.sin(np.radians(range(0, 360, 45)))], axis=1)
"""Directions from its joint in which a name is tried, to the right first."""

DISTANCES = (6.0, 14.0)
"""Distances at which it is tried, one after the other [points]."""

OFF = 12.0
"""Area [points²] that a name may rather cover than be a point farther from its joint."""

JOINT, LINE = 4.0, 1.5
"""Half the sides of the squares kept free around a joint's marker, and around a dot of a line [points]."""

DOTS = 24
"""Dots that represent a line."""

APART = 1.0
"""Least distance between two names [points]."""


def place_names(canvas: Canvas, texts: Sequence[Any], joints: Floats, lines: Floats) -> None:
    """Move texts, each of which is at its joint, to free places nearby.

    A text stays where it is in space: in three-dimensional axes it turns with the machine.

    Parameters
    ----------
    joints, lines : not to be covered: points (n, 3), and both ends of lines (k, 2, 3) [length].
    """
    if not texts:
        return
    figure = canvas.axes.figure
    root = figure.get_figure(root=True)
    root.draw_without_rendering()
    point = root.dpi / 72.0
    shares = np.linspace(0.0, 1.0, DOTS)[:, None, None]
    dots = (lines[:, 0] + shares * (lines[:, 1] - lines[:, 0])).reshape(-1, 3)
    squares = [(place, JOINT) for place in canvas.on_screen(joints)] + [
        (place, LINE) for place in canvas.on_screen(dots)
    ]
    taken = [np.concatenate([place - half * point, place + half * point]) for place, half in squares]
    legend = canvas.axes.get_legend()
    words = canvas.axis_words + ([] if legend is None else [legend])
    taken += [word.get_window_extent().extents for word in words]
    for text in texts:
        place = canvas.on_screen(_place(canvas, text)[None])[0]
        extent = text.get_window_extent()
        size = np.array([extent.width, extent.height])
        boxes = [
            np.concatenate([centre - size / 2.0, centre + size / 2.0])
            for off in DISTANCES
            for direction in DIRECTIONS
            for centre in [place + direction * (off * point + np.abs(direction) @ size / 2.0)]
        ]
        far = np.repeat(DISTANCES, len(DIRECTIONS)) * OFF * point**2
        best = boxes[int(np.argmin(_overlaps(np.array(boxes), np.array(taken), APART * point) + far))]
        taken.append(best)
        _move(canvas, text, (best[:2] + best[2:]) / 2.0)


def _overlaps(boxes: Floats, taken: Floats, apart: float) -> Floats:
    """The areas that boxes (n, 4: left, bottom, right, top), widened, share with others (k, 4), (n,) [pixels²]."""
    low = np.maximum(boxes[:, None, :2] - apart, taken[:, :2])
    high = np.minimum(boxes[:, None, 2:] + apart, taken[:, 2:])
    return np.asarray(np.prod(np.maximum(high - low, 0.0), axis=2).sum(axis=1))


def _place(canvas: Canvas, text: Any) -> Floats:
    """Where a text is in the coordinates of its axes."""
    return np.array(text.get_position_3d() if canvas.plane is None else text.get_position())


def _move(canvas: Canvas, text: Any, centre: Floats) -> None:
    """Centre a text at a place of the screen [pixels], as far from the viewer as it was."""
    text.set(horizontalalignment="center", verticalalignment="center")
    flat = canvas.axes.transData.inverted().transform(centre)
    if canvas.plane is not None:
        text.set_position(flat)
        return
    from mpl_toolkits.mplot3d.proj3d import inv_transform, proj_transform

    projection = canvas.axes.get_proj()
    depth = proj_transform(*_place(canvas, text), projection)[2]
    text.set_position_3d(np.ravel(inv_transform(*flat, depth, np.linalg.inv(projection))))
