"""Places names so that they hide neither each other nor joints: the best of several places around each joint."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..common.arrays import Floats
from .canvas import Canvas

DIRECTIONS = np.stack([np.cos(np.radians(range(0, 360, 30))), np.sin(np.radians(range(0, 360, 30)))], axis=1)
"""Directions from its joint in which a name is tried, to the right first."""

DISTANCES = (9.0, 16.0, 27.0, 40.0)
"""Distances at which it is tried, one after the other [points]."""

OFF = 6.0
"""Area [points²] that a name may rather cover than be a point farther from its joint."""

JOINT, LINE = 7.5, 3.5
"""Half the sides of the squares kept free around a joint's marker, and around a dot of a line, which may be a rail
[points]."""

DOTS = 32
"""Dots that represent a line."""

APART = 1.0
"""Least distance between two names [points]."""

WORDS, OUTSIDE = 60.0, 4.0
"""Weight of the area of other words, and of that beyond the axes, against an area of lines."""


def place_names(canvas: Canvas, texts: Sequence[Any], joints: Floats, lines: Floats) -> None:
    """Move texts, each of which is an annotation of its joint, to free places nearby.

    Parameters
    ----------
    joints, lines : not to be covered: points (n, 3), and both ends of lines (k, 2, 3) [length].
    """
    if not texts:
        return
    axes = canvas.axes
    root = axes.get_figure(root=True)
    point = root.dpi / 72.0
    shares = np.linspace(0.0, 1.0, DOTS)[:, None, None]
    dots = (lines[:, 0] + shares * (lines[:, 1] - lines[:, 0])).reshape(-1, 3)
    pixels = axes.transData.transform
    squares = [(place, JOINT) for place in pixels(canvas.seen(joints))]
    squares += [(place, LINE) for place in pixels(canvas.seen(dots))]
    taken = [np.concatenate([place - half * point, place + half * point]) for place, half in squares]
    others = [*([axes.get_legend()] if axes.get_legend() else []), *(text for text in axes.texts if text.get_text())]
    words = {other: other.get_window_extent().extents for other in others if other not in texts}
    box = axes.get_window_extent().extents
    for text in [*texts] * 2:  # among those before it, then among all others
        at = pixels(text.xy)
        extent = text.get_window_extent()
        size = np.array([extent.width, extent.height])
        offsets = np.array([way * off * point + way * size / 2.0 for off in DISTANCES for way in DIRECTIONS])
        boxes = np.concatenate([at + offsets - size / 2.0, at + offsets + size / 2.0], axis=1)
        far = np.repeat(DISTANCES, len(DIRECTIONS)) * OFF * point**2
        written = [place for other, place in words.items() if other is not text]
        covered = _overlaps(boxes, taken, APART * point) + WORDS * _overlaps(boxes, written, APART * point)
        outside = np.prod(size) - _overlaps(boxes, [box], 0.0)
        best = int(np.argmin(covered + OUTSIDE * outside + far))
        words[text] = boxes[best]
        text.set_position(offsets[best] / point)


def _overlaps(boxes: Floats, taken: Sequence[Floats], apart: float) -> Floats:
    """The areas that boxes (n, 4: left, bottom, right, top), widened, share with others (k, 4), (n,) [pixels²]."""
    others = np.reshape(taken, (-1, 4))
    low = np.maximum(boxes[:, None, :2] - apart, others[:, :2])
    high = np.minimum(boxes[:, None, 2:] + apart, others[:, 2:])
    return np.asarray(np.prod(np.maximum(high - low, 0.0), axis=2).sum(axis=1))
