"""The border of the workspace at an orientation, and the singularities in it, as a page draws them."""

from __future__ import annotations

import base64
from typing import TYPE_CHECKING, Any

import numpy as np

from ...answers.solution import Solution
from ...capabilities.workspace.space import POSITIONS
from ...common.arrays import Floats, Ints
from ...common.telling import OnProgress
from ...kinematics import plane_of
from ...machine.description.mechanism import Mechanism
from ..drawn_parts import free_axes
from ..looks import SINGULAR
from .server import Send

if TYPE_CHECKING:
    from ...capabilities.workspace.result import Workspace

FAR = 2.0
"""Ends of a workspace on each side of home, where nothing else ends it [L]."""

WORKSPACE, LOCUS = "workspace", "locus"
"""Borders that can be shown, by their names."""


class Borders:
    """The borders at one start, found as they are asked for."""

    def __init__(self, start: Solution) -> None:
        self.start = start
        self._space: Workspace | None = None
        self._found: dict[str, tuple[list[dict[str, Any]], str]] = {}

    def send(self, names: list[str], send: Send) -> None:
        """Send notes on progress, then the patches of each border; singularities are looked for in a workspace."""
        from ...capabilities.workspace.ask import workspace
        from ...capabilities.workspace.workspace_table import in_words

        start = self.start
        if self._space is None:
            progress = _progress("the workspace", send)
            self._space = workspace(start.mechanism, start=start, within=_ends(start.mechanism), on_progress=progress)
        notes = [f"workspace: {in_words(self._space)}"]
        for name, find in ((WORKSPACE, border_of), (LOCUS, locus_of)):
            if name in names:
                if name not in self._found:
                    self._found[name] = find(self._space, start, _progress("singularities", send))
                patches, note = self._found[name]
                send({"border": name, "patches": patches})
                notes.append(note)
        send({"note": "\n".join(filter(None, notes))})


def _progress(what: str, send: Send) -> OnProgress:
    """A callback that sends how much of a search is done, which ends it where nobody reads that any more."""
    send({"note": f"looking for {what} …"})
    return lambda done, total: send({"note": f"looking for {what}: {100 * done // max(total, 1)} %"})


def _patch(words: str, colour: str, corners: Floats, length: float) -> dict[str, Any]:
    """A part of a border: its colour, and corners of triangles or ends of segments, as numbers of 32 bits [L]."""
    numbers = np.ascontiguousarray(corners / length, "<f4")
    return {
        "words": words,
        "colour": colour,
        "sides": corners.shape[1],
        "corners": base64.b64encode(numbers.tobytes()).decode(),
    }


def _ends(mechanism: Mechanism) -> dict[str, tuple[float, float]] | None:
    """Ends of positions for a machine in space without limits, whose workspace may have none: those of its sliders."""
    if plane_of(mechanism) is not None or mechanism.without_limits() != mechanism:
        return None
    far, home = FAR * mechanism.characteristic_length, mechanism.home_pose[:3, 3].tolist()
    return {POSITIONS[k]: (home[k] - far, home[k] + far) for k in free_axes(mechanism)[0]}


def border_of(space: Workspace, start: Solution, _: OnProgress) -> tuple[list[dict[str, Any]], str]:
    """The border of a workspace, each face in the colour of the limit that forms it, and a remark.

    Coordinates that it does not span are as at the start. One over angles has no place in the scene.
    """
    from ...capabilities.workspace.border import groups_of

    corners, limits = _in_the_scene(space, start, space.vertices, space.faces), np.asarray(space.face_limit)
    if corners is None:
        return [], f"over {', '.join(space.names)}: it has no place in the scene"
    return [
        _patch(
            f"{group.label}: {group.share:.0%}",
            group.colour,
            corners[np.isin(limits, group.limits)],
            start.mechanism.characteristic_length,
        )
        for group in groups_of(space)
    ], ""


def locus_of(space: Workspace, start: Solution, on_progress: OnProgress) -> tuple[list[dict[str, Any]], str]:
    """Where the parallel measure changes its sign in a workspace, and a remark."""
    from ...capabilities.workspace.singular import singularity_map

    if not set(space.names) <= set(POSITIONS):
        return [], f"singularities over {', '.join(space.names)} have no place in the scene"
    found = singularity_map(space.mechanism, space, on_progress=on_progress)
    corners = _in_the_scene(space, start, found.locus_vertices, found.locus_faces)
    if corners is None or not len(corners):
        return [], "no parallel singularity in it"
    return [_patch("parallel singularities", SINGULAR, corners, start.mechanism.characteristic_length)], ""


def _in_the_scene(space: Workspace, start: Solution, vertices: Floats, faces: Ints) -> Floats | None:
    """Corners (k, d, 3) of a mesh in a workspace over positions, [length]; None over angles."""
    if not set(space.names) <= set(POSITIONS):
        return None
    points = np.repeat(start.pose[None, :3, 3], len(vertices), axis=0)
    points[:, [POSITIONS.index(name) for name in space.names]] = vertices
    return np.asarray(points[faces])
