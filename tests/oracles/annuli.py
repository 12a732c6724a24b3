"""What lies in several rings of a plane at once: by lines across, on each of which the ends are known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ring = tuple[float, float, float, float]
"""Centre (two numbers), inner radius and outer radius."""

LINES = 20_000


def within(rings: Sequence[Ring], points: Array) -> NDArray[np.bool_]:
    """Which of points (..., 2) lie in all rings."""
    inside = np.ones(points.shape[:-1], bool)
    for x, y, inner, outer in rings:
        distance = np.hypot(points[..., 0] - x, points[..., 1] - y)
        inside &= (inner <= distance) & (distance <= outer)
    return inside


def area(rings: Sequence[Ring], lines: int = LINES) -> float:
    """The area that is in all of them, to about a millionth with so many lines across, or as exactly as with fewer."""
    low = max(x - outer for x, _, _, outer in rings)
    high = min(x + outer for x, _, _, outer in rings)
    if high <= low:
        return 0.0
    # nodes crowd at both ends, where lines across circles grow with a square root
    angle = np.pi * (np.arange(lines) + 0.5) / lines
    x = 0.5 * (low + high) - 0.5 * (high - low) * np.cos(angle)
    weight = 0.5 * (high - low) * np.sin(angle) * np.pi / lines
    ends = []
    for cx, cy, inner, outer in rings:
        for radius in (inner, outer):
            half = np.sqrt(np.maximum(radius**2 - (x - cx) ** 2, 0.0))
            ends += [cy - half, cy + half]
    y = np.sort(np.stack(ends, axis=1), axis=1)
    middles = np.stack([np.broadcast_to(x[:, None], y[:, 1:].shape), 0.5 * (y[:, 1:] + y[:, :-1])], axis=-1)
    return float((np.diff(y, axis=1) * within(rings, middles)).sum(axis=1) @ weight)
