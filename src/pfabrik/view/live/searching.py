"""Searches that take longer than a motion of the mouse: for modes, and for the border of the workspace."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager

import numpy as np

from ...answers.solution import Solution
from ...answers.words import by_bound, exceeded
from ...modes.assembly import assembly_modes
from ...modes.working import working_modes
from .live_machine import LiveMachine
from .scene import Patch
from .workers import Newest

POSITIONS = ("x", "y", "z")


class Searches:
    """One search at a time, beside the answers; results for a machine that is no longer shown are dropped.

    Parameters
    ----------
    shown : returns the machine that is shown now.
    lock : held while the machine shown is changed.
    """

    def __init__(
        self,
        shown: Callable[[], LiveMachine],
        lock: AbstractContextManager[object],
        on_error: Callable[[Exception], None],
    ) -> None:
        self._shown, self._lock, self._newest = shown, lock, Newest(on_error)

    def find_modes(self, kind: str) -> None:
        """List the "working" modes of the pose, or the "assembly" modes of the actuator values."""
        machine = self._shown()
        machine.panel.release()
        machine.panel.tell(f"looking for {kind} modes …")
        session = machine.session
        mechanism, target, actuators = session.mechanism, session.target.copy(), session.actuators.copy()

        def search() -> None:
            modes = working_modes(mechanism, target) if kind == "working" else assembly_modes(mechanism, actuators)
            words = [f"{number}: {_kept(mode)}" for number, mode in enumerate(modes, 1)]
            with self._lock:
                if self._shown() is machine:
                    machine.modes = tuple(modes)
                    machine.panel.list_modes(kind, machine.modes, words)
                    machine.panel.tell("" if modes else f"no {kind} mode was found")

        self._newest.post(search)

    def show_workspace(self, wanted: bool) -> None:
        """Show the border of the workspace at this orientation, or hide it."""
        machine = self._shown()
        scene, panel, start = machine.scene, machine.panel, machine.session.start
        if not wanted:
            self._newest.post(lambda: None)
            scene.hide_border()
            panel.tell_border([])
            return
        panel.tell("looking for the workspace …")

        def progress(done: int, total: int) -> None:
            panel.tell(f"looking for the workspace: {100 * done // max(total, 1)} %")

        def search() -> None:
            patches, size = border_of(start, progress)
            with self._lock:
                if self._shown() is machine and panel.wants_workspace:
                    scene.show_border(patches)
                    panel.tell_border(patches)
                    panel.tell(size)

        self._newest.post(search)

    def end(self) -> None:
        """Let the thread end."""
        self._newest.end()


def _kept(mode: Solution) -> str:
    """The limits that a mode exceeds, in words; "within limits" if there are none."""
    beyond = by_bound(exceeded(mode))
    return f"beyond {beyond}" if beyond else "within limits"


def border_of(start: Solution, on_progress: Callable[[int, int], None]) -> tuple[list[Patch], str]:
    """The border of the workspace at a configuration's orientation, in its working mode, and its size in words.

    Each face has the colour of the limit that forms it. Other coordinates are as in that configuration. A workspace
    over angles has no patches.
    """
    from ...workspace.ask import workspace
    from ...workspace.border import groups_of
    from ...workspace.workspace_table import in_words

    space = workspace(start.mechanism, start=start, on_progress=on_progress)
    size = in_words(space)
    if not set(space.names) <= set(POSITIONS):
        return [], f"workspace over {', '.join(space.names)}: {size}; it has no place in the scene"
    vertices = np.repeat(start.pose[None, :3, 3], len(space.vertices), axis=0)
    vertices[:, [POSITIONS.index(name) for name in space.names]] = space.vertices
    corners, limits = np.asarray(vertices[space.faces]), np.asarray(space.face_limit)
    return [
        Patch(group.label, group.share, group.colour, corners[np.isin(limits, group.limits)])
        for group in groups_of(space)
    ], size
