"""One machine as it is shown: its session, and all elements of the page that show the answer."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from ...answers.solution import Solution
from ...answers.status import Status
from ...answers.tracked import Track
from ...arrays import Floats
from ...description.mechanism import Mechanism
from ...skeleton import checked_shown, skeleton_of
from ..plot_track import checked_track
from .handles import Handles
from .panel import Actions, Panel
from .player import due_after
from .scene import Scene
from .serving import aim_camera
from .session import Session

if TYPE_CHECKING:
    import viser

Shown: TypeAlias = tuple[Mechanism, Solution | None, Track | None]
"""A machine, the configuration that it is first shown in (default: home), and the path that can be played."""


class LiveMachine:
    """A machine in the page, in place of what was there before.

    Attributes
    ----------
    session : its target and its answer.
    track : the path that can be played, or None.
    modes : those that were found last.
    wanted, actuators, joints : targets of the user, which run ahead of the answers: a pose (4, 4) [length], and values
        of actuators, and of joints in series (k,) [length or rad].
    """

    def __init__(
        self, server: viser.ViserServer, shown: Shown, drag: Callable[[Floats], None], actions: Actions
    ) -> None:
        mechanism, first, self.track = shown
        skeleton = skeleton_of(mechanism if first is None else first)
        self._server, self.session = server, Session(mechanism, first)
        self.modes: tuple[Solution, ...] = ()
        server.gui.reset()
        server.scene.reset()
        server.scene.configure_default_lights(cast_shadow=False)
        server.gui.set_panel_label(mechanism.name)
        server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium")
        server.gui.main_panel.dock_right()
        self.scene = Scene(server, mechanism, skeleton)
        if self.track is not None:
            self.scene.show_path(self.track)
        self._handles = Handles(server, mechanism, drag)
        steps = 0 if self.track is None else len(self.track)
        self.panel = Panel(server.gui, mechanism, self.session, actions, steps)
        aim_camera(server, mechanism, skeleton.points)
        self.refresh()

    def refresh(self) -> None:
        """Show the answer of the session."""
        session = self.session
        self.wanted, self.actuators, self.joints = session.target.copy(), session.actuators.copy(), session.joints
        with self._server.atomic():
            if session.solution.status < Status.INVALID:
                self.scene.show(skeleton_of(session.solution), session.solution.pose)
            self._handles.show(session.target)
            self.panel.show(session)
        self._server.flush()

    def release(self) -> None:
        """Let handles and sliders follow the answers again."""
        self._handles.release()
        self.panel.release()

    def page(self) -> str:
        """The scene as a page of its own, HTML: the machine as it is, or moving along its path."""
        self._handles.show_all(False)
        serializer = self._server.get_scene_serializer()
        if self.track is not None:
            for step in self.track:
                if np.isfinite(step.pose).all():
                    self.scene.show(skeleton_of(step), step.pose)
                    serializer.insert_sleep(due_after(self.track))
            self.scene.show(skeleton_of(self.session.solution), self.session.solution.pose)
        page = str(serializer.as_html())
        self._handles.show_all(True)
        return page


def checked(what: object) -> Shown:
    """The machine, configuration and path to show, checked before anything is served."""
    if isinstance(what, Track):
        return what.mechanism, what[int(checked_track(what)[0])], what
    mechanism, solution = checked_shown(what)
    return mechanism, solution, None
