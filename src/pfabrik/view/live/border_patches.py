"""The workspace in the scene: its border, each face in the colour of the limit that forms it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...answers.solution import Solution
from ...arrays import Floats
from ...workspace.ask import workspace
from ...workspace.border import groups_of
from ...workspace.sizes import in_words

POSITIONS = ("x", "y", "z")


@dataclass(frozen=True)
class Patch:
    """A part of the border that has one colour.

    Attributes
    ----------
    corners : of its triangles, (k, 3, 3), or both ends of its segments, (k, 2, 3), in the base frame [length].
    name, share : the limits that form it, and their share of the border.
    """

    name: str
    share: float
    colour: str
    corners: Floats


def border_of(start: Solution, on_progress: Callable[[int, int], None]) -> tuple[list[Patch], str]:
    """The border of the workspace at a configuration's orientation, in its working mode, and its size in words.

    Other coordinates are as in that configuration. A workspace over angles has no patches.
    """
    space = workspace(start.mechanism, start=start, on_progress=on_progress)
    size = in_words(space)
    if not set(space.names) <= set(POSITIONS):
        return [], f"workspace over {', '.join(space.names)}: {size}; it has no place in the scene"
    corners = _in_space(start.pose[:3, 3], space.names, np.asarray(space.vertices))[space.faces]
    limits = np.asarray(space.face_limit)
    return [
        Patch(group.label, group.share, group.colour, corners[np.isin(limits, group.limits)])
        for group in groups_of(space)
    ], size


def _in_space(position: Floats, names: tuple[str, ...], vertices: Floats) -> Floats:
    """Vertices (v, d) of some coordinates as points (v, 3)."""
    points = np.repeat(position[None], len(vertices), axis=0)
    points[:, [POSITIONS.index(name) for name in names]] = vertices
    return np.asarray(points)
