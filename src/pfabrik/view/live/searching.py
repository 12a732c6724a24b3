"""Searches that take longer than a motion of the mouse: for modes, and for the workspace."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager

from ...answers.solution import Solution
from ...answers.words import by_bound, exceeded
from ...modes.assembly import assembly_modes
from ...modes.working import working_modes
from .live_machine import LiveMachine
from .newest import Newest


class Searches:
    """One search at a time, beside the answers; what it finds for a machine that is no longer shown is dropped.

    Parameters
    ----------
    stage : what is shown now.
    lock : held by whoever changes what is shown.
    """

    def __init__(
        self,
        stage: Callable[[], LiveMachine],
        lock: AbstractContextManager[object],
        on_error: Callable[[Exception], None],
    ) -> None:
        self._stage, self._lock, self._newest = stage, lock, Newest(on_error)

    def find_modes(self, kind: str) -> None:
        """List the "working" modes of the pose, or the "assembly" modes of the actuator values."""
        stage = self._stage()
        stage.panel.release()
        stage.panel.tell(f"looking for {kind} modes …")
        session = stage.session
        mechanism, target, actuators = session.mechanism, session.target.copy(), session.actuators.copy()

        def search() -> None:
            found = working_modes(mechanism, target) if kind == "working" else assembly_modes(mechanism, actuators)
            words = [f"{number}: {_kept(mode)}" for number, mode in enumerate(found, 1)]
            with self._lock:
                if self._stage() is stage:
                    stage.modes = tuple(found)
                    stage.panel.list_modes(kind, stage.modes, words)
                    stage.panel.tell("" if found else f"no {kind} mode was found")

        self._newest.post(search)

    def show_workspace(self, wanted: bool) -> None:
        """Show the border of the workspace at this orientation, or take it away."""
        stage = self._stage()
        scene, panel, start = stage.scene, stage.panel, stage.session.start
        if not wanted:
            self._newest.post(lambda: None)
            scene.hide_border()
            panel.tell_border([])
            return
        panel.tell("looking for the workspace …")

        def progress(done: int, total: int) -> None:
            panel.tell(f"looking for the workspace: {100 * done // max(total, 1)} %")

        def search() -> None:
            from .border_patches import border_of

            patches, size = border_of(start, progress)
            with self._lock:
                if self._stage() is stage and panel.wants_workspace:
                    scene.show_border(patches)
                    panel.tell_border(patches)
                    panel.tell(size)

        self._newest.post(search)

    def end(self) -> None:
        """Let the thread end."""
        self._newest.end()


def _kept(mode: Solution) -> str:
    """Whether a mode keeps the limits, and which it does not."""
    beyond = by_bound(exceeded(mode))
    return f"beyond {beyond}" if beyond else "within limits"
