"""`view`: a machine in the browser, to drag, to drive, and to see what stops it."""

from __future__ import annotations

import atexit
import os
import threading
from html import escape
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from ...answers.solution import Solution, Status, checked_solution
from ...answers.tracked import Track
from ...answers.words import by_bound, exceeded
from ...arrays import Floats
from ...description.mechanism import Mechanism
from ...errors import InvalidArgument, PfabrikError
from ...extras import require
from ...files import load
from ...modes.assembly import assembly_modes
from ...modes.working import working_modes
from ...warm_up import warm_up
from ...writing import whole_path
from ..saving import checked_ending
from ..skeleton import checked_shown, skeleton_of
from ..track import checked_track
from .handles import Handles
from .newest import Newest
from .panel import Actions, Panel
from .player import Player, due_after
from .scene import Scene
from .serving import aim_camera, quietly, serve
from .session import Session, moved
from .watching import Watch

Shown: TypeAlias = tuple[Mechanism, Solution | None, Track | None]
"""A machine, the configuration that it is first shown in (default: home), and the path that can be played."""

LOOPBACK, PORT = "127.0.0.1", 8080


def view(shown: Mechanism | Solution | str | os.PathLike[str], *, port: int = PORT, host: str = LOOPBACK) -> Viewer:
    """Show a machine in the browser: drag its target, drive its actuators, see what stops it.

    The page is served from this computer, and to this computer alone unless `host` says otherwise; it asks nothing of
    any other. Answers come from this process: only the newest motion of the mouse is answered.

    Parameters
    ----------
    shown : a Mechanism; one Solution; a Track, which can then be played; or the path of a file or a name of the
        catalogue. A file is read again whenever it changes.
    port : where the page is served; the next free one where it is taken.
    host : address that is listened on; "0.0.0.0" lets other computers in, and whoever reaches the port move the
        machine that is shown.

    Returns
    -------
    Viewer : open `url`; in a notebook it shows itself. It ends with `close()`, or with the process.

    Raises
    ------
    InvalidArgument : a batch that is no Track, or no port.
    MissingLibrary : viser is not installed.
    """
    require("the viewer", "viser", "view")
    if isinstance(port, bool) or not isinstance(port, int) or not 0 < port < 65536:
        raise InvalidArgument("port", repr(port), "a number from 1 to 65535")
    return Viewer(shown, port, host)


class Viewer:
    """A machine in the browser; `view` makes one.

    Attributes
    ----------
    url : where it is.
    """

    def __init__(self, shown: Mechanism | Solution | str | os.PathLike[str], port: int, host: str) -> None:
        path = Path(shown) if isinstance(shown, str | os.PathLike) else None
        what = _shown(load(shown) if isinstance(shown, str | os.PathLike) else shown)
        self._lock = threading.RLock()
        self._closed = threading.Event()
        self._server = serve(host, port)
        shown_host = "localhost" if host in ("0.0.0.0", "::") else host
        self.url = f"http://{shown_host}:{self._server.get_port()}"
        self._newest, self._search = Newest(self._complain), Newest(self._complain)
        self._modes: tuple[Solution, ...] = ()
        self._player: Player | None = None
        self._ready: Mechanism | None = None
        self._build(what)
        self._server.on_client_connect(lambda _: self._newest.post(self._prepare))
        atexit.register(self.close)
        self._watch = Watch(path, self._changed) if path is not None and path.is_file() else None

    # What a program does with it.

    @property
    def mechanism(self) -> Mechanism:
        """The machine that is shown."""
        return self._session.mechanism

    @property
    def solution(self) -> Solution:
        """The answer that is shown."""
        return self._session.solution

    @property
    def target(self) -> Floats:
        """The pose that is asked for, (4, 4) [length]."""
        return self._session.target.copy()

    def show(self, solution: Solution) -> None:
        """Show a configuration of this machine."""
        if checked_solution(solution).mechanism != self.mechanism or solution.shape != ():
            raise InvalidArgument("solution", repr(solution), f"one Solution of '{self.mechanism.name}'")
        with self._lock:
            self._session.show(solution)
            self._refresh()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write what is shown as a page of its own, which opens without this program and without a network.

        A Track is in it as a film. The file appears when it is complete, or not at all.
        """
        checked_ending(path, (".html", ".htm"))
        page = self._page()
        with whole_path(path) as part:
            part.write_text(page, encoding="utf-8")

    def wait(self) -> None:
        """Wait until it is closed."""
        while not self._closed.wait(0.2):
            pass

    def close(self) -> None:
        """End it: its page stays as it is, and answers no more."""
        if self._closed.is_set():
            return
        self._closed.set()
        if self._player is not None:
            self._player.stop()
        if self._watch is not None:
            self._watch.end()
        for worker in (self._newest, self._search):
            worker.end()
        with quietly():
            self._server.stop()
        atexit.unregister(self.close)

    def __enter__(self) -> Viewer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Viewer of '{self.mechanism.name}' at {self.url}>"

    def _repr_html_(self) -> str:
        """The viewer itself, in a frame, for notebooks on this computer."""
        url = escape(self.url, quote=True)
        return f'<iframe src="{url}" width="100%" height="600" style="border:1px solid #ddd"></iframe>'

    # What the user does in the page. All of it only posts a job; jobs run one after the other.

    def _drag(self, target: Floats) -> None:
        self._panel.release()
        self._wanted = target
        self._newest.post(lambda: self._answer(lambda: self._session.go_to(target)))

    def _change_target(self, name: str, value: float) -> None:
        self._wanted = target = moved(self._wanted, name, value)
        self._newest.post(lambda: self._answer(lambda: self._session.go_to(target)))

    def _change_actuator(self, place: int, value: float) -> None:
        self._actuators[place] = value
        values = self._actuators.copy()
        self._newest.post(lambda: self._answer(lambda: self._session.drive(values)))

    def _go_home(self) -> None:
        self._panel.release()
        home = Session(self.mechanism).solution
        self._newest.post(lambda: self._answer(lambda: self._session.show(home)))

    def _answer(self, ask: Any) -> None:
        with self._lock:
            ask()
            self._refresh()

    def _refresh(self) -> None:
        """Everything that is shown, from the session."""
        session = self._session
        self._wanted, self._actuators = session.target.copy(), session.actuators.copy()
        with self._server.atomic():
            if session.solution.status < Status.INVALID:
                self._scene.show(skeleton_of(session.solution), session.solution.pose)
            self._handles.show(session.target)
            self._panel.show(session)
        self._server.flush()

    # Modes, a path, the workspace.

    def _find_modes(self, kind: str) -> None:
        self._panel.release()
        self._panel.tell(f"looking for {kind} modes …")
        session = self._session
        mechanism, target, actuators = session.mechanism, session.target.copy(), session.actuators.copy()

        def search() -> None:
            found = working_modes(mechanism, target) if kind == "working" else assembly_modes(mechanism, actuators)
            words = [f"{number}: {_kept(mode)}" for number, mode in enumerate(found, 1)]
            with self._lock:
                if self._session is session:
                    self._modes = tuple(found)
                    self._panel.list_modes(kind, self._modes, words)
                    self._panel.tell("" if found else f"no {kind} mode was found")

        self._search.post(search)

    def _take_mode(self, place: int) -> None:
        if place < len(self._modes):
            mode = self._modes[place]
            self._newest.post(lambda: self._answer(lambda: self._session.show(mode)))

    def _take_step(self, step: int) -> None:
        track = self._track
        if track is not None:
            self._newest.post(lambda: self._answer(lambda: self._session.show(track[step - 1])))

    def _play(self, playing: bool) -> None:
        self._panel.release()
        if self._player is not None:
            self._player.stop()
        self._player = Player(self._track, self._play_step) if playing and self._track is not None else None

    def _play_step(self, step: int) -> None:
        self._take_step(step)
        self._panel.show_step(step)

    def _show_workspace(self, wanted: bool) -> None:
        session, scene, panel = self._session, self._scene, self._panel
        if not wanted:
            self._search.post(lambda: None)
            scene.hide_border()
            panel.tell_border([])
            return
        panel.tell("looking for the workspace …")

        def progress(done: int, total: int) -> None:
            panel.tell(f"looking for the workspace: {100 * done // max(total, 1)} %")

        def search() -> None:
            from .workspace import border_of

            patches, size = border_of(session.start, progress)
            with self._lock:
                if self._session is session and panel.wants_workspace:
                    scene.show_border(patches)
                    panel.tell_border(patches)
                    panel.tell(size)

        self._search.post(search)

    # The machine, and its file.

    def _build(self, shown: Shown) -> None:
        """Show a machine in place of what was shown."""
        mechanism, first, track = shown
        skeleton = skeleton_of(mechanism if first is None else first)
        actions = Actions(
            self._change_target,
            self._change_actuator,
            self._go_home,
            self._find_modes,
            self._take_mode,
            self._take_step,
            self._play,
            self._show_workspace,
            self._send,
        )
        with self._lock:
            if self._player is not None:
                self._player.stop()
            self._session, self._track, self._modes = Session(mechanism, first), track, ()
            self._server.gui.reset()
            self._server.scene.reset()
            self._server.scene.configure_default_lights(cast_shadow=False)
            self._server.gui.set_panel_label(mechanism.name)
            self._server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium")
            self._server.gui.main_panel.dock_right()
            self._scene = Scene(self._server, mechanism, skeleton)
            if track is not None:
                self._scene.show_path(track)
            self._handles = Handles(self._server, mechanism, self._drag)
            steps = 0 if track is None else len(track)
            self._panel = Panel(self._server.gui, mechanism, self._session, actions, steps)
            aim_camera(self._server, mechanism, skeleton.points)
            self._refresh()
        if self._server.get_clients():
            self._prepare()

    def _prepare(self) -> None:
        """Compile what answers need before the first is asked for: for once, that takes longer than a motion."""
        mechanism, panel = self.mechanism, self._panel
        if mechanism != self._ready:
            panel.tell("getting ready; a new version compiles what answers need, once …")
            warm_up(mechanism)
            self._ready = mechanism
            panel.tell("")

    def _changed(self, path: Path) -> None:
        """The file was written: show what is in it now, or say what is wrong with it."""
        try:
            mechanism = load(path)
        except (PfabrikError, OSError) as error:
            self._panel.tell(str(error), alarming=True)
            return
        self._newest.post(lambda: self._build(_shown(mechanism)))

    def _complain(self, error: Exception) -> None:
        self._panel.tell(str(error), alarming=True)

    # A page of its own.

    def _page(self) -> str:
        """What is shown as HTML: the machine as it is, or on its way along a path."""
        with self._lock:
            self._handles.show_all(False)
            serializer = self._server.get_scene_serializer()
            if self._track is not None:
                for step in self._track:
                    if np.isfinite(step.pose).all():
                        self._scene.show(skeleton_of(step), step.pose)
                        serializer.insert_sleep(due_after(self._track))
                self._scene.show(skeleton_of(self._session.solution), self._session.solution.pose)
            page = str(serializer.as_html())
            self._handles.show_all(True)
            return page

    def _send(self, client: Any) -> None:
        """The page as a download."""
        if client is not None:
            client.send_file_download(f"{self.mechanism.name}.html", self._page().encode())


def _shown(what: object) -> Shown:
    """What is to be shown, checked before anything is served."""
    if isinstance(what, Track):
        return what.mechanism, what[int(checked_track(what)[0])], what
    mechanism, solution = checked_shown(what)
    return mechanism, solution, None


def _kept(mode: Solution) -> str:
    """Whether a mode keeps the limits, and which it does not."""
    beyond = by_bound(exceeded(mode))
    return f"beyond {beyond}" if beyond else "within limits"
