"""`view`: a machine in the browser, to drag and to drive, with the limits that stop it."""

from __future__ import annotations

import atexit
import contextlib
import io
import os
import threading
import time
from collections.abc import Callable, Iterator
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import rich

from ...answers.solution import Solution, checked_solution
from ...common.arrays import Floats
from ...common.checks import require_count, require_ending
from ...common.extras import require
from ...common.whole_files import whole_path
from ...configuration import configuration
from ...errors import InvalidArgument, PfabrikError
from ...machine.description.mechanism import Mechanism
from ...machine.files import load
from ...solver import prepare
from .live_machine import LiveMachine, Shown, checked, keep_in_view
from .panel import Actions
from .searching import Searches
from .session import moved
from .workers import Newest, Player, Watch

if TYPE_CHECKING:
    import viser

LOOPBACK, PORT = "127.0.0.1", 8080

PAUSE = 1.0
"""Time without motion after which a further motion of the same slider is a step of its own [s]."""


def view(shown: Mechanism | Solution | str | os.PathLike[str], *, port: int = PORT, host: str = LOOPBACK) -> Viewer:
    """Show a machine in the browser: drag its target, drive its actuators, see what stops it.

    The page is served from this computer, and to this computer alone unless `host` says otherwise; it asks nothing of
    any other. Answers come from this process: only the newest motion of the mouse is answered.

    Parameters
    ----------
    shown : Mechanism or Solution or str or PathLike
        A Mechanism; one Solution; a Track, which can then be played; or the path of a file or a name of the catalogue.
        A file is read again whenever it changes.
    port : int, optional
        Where the page is served; the next free one where it is taken.
    host : str, optional
        Address that is listened on; "0.0.0.0" lets other computers in, and whoever reaches the port move the machine
        that is shown.

    Returns
    -------
    Viewer
        Open `url`; in a notebook it shows itself. It ends with `close()`, or with the process.

    Raises
    ------
    InvalidArgument
        A batch that is no Track, or no port.
    MissingLibrary
        Viser is not installed.
    """
    require("the viewer", "viser", "view")
    require_count("port", port, most=65535)
    return Viewer(shown, port, host)


class Viewer:
    """A machine in the browser; `view` makes one.

    Attributes
    ----------
    url : str
        Address of the page.
    port : int
        Port where it is served: another than was asked for, if that one was taken.
    """

    def __init__(self, shown: Mechanism | Solution | str | os.PathLike[str], port: int, host: str) -> None:
        path = Path(shown) if isinstance(shown, str | os.PathLike) else None
        what = checked(load(shown) if isinstance(shown, str | os.PathLike) else shown)
        self._lock = threading.RLock()
        self._closed = threading.Event()
        self._server = _serve(host, port)
        shown_host = "localhost" if host in ("0.0.0.0", "::") else host
        self.port = self._server.get_port()
        self.url = f"http://{shown_host}:{self.port}"
        self._newest = Newest(self._complain)
        self._searches = Searches(lambda: self._stage, self._lock, self._complain)
        self._player: Player | None = None
        self._ready: Mechanism | None = None
        self._gesture, self._asked_at = 0, 0.0
        self._asked_by: str | int = ""
        self._watch: Watch | None = None
        try:
            self._build(what)
            self._server.on_client_connect(self._greet)
            self._server.on_client_disconnect(lambda _: self._stage.release())
            atexit.register(self.close)
            self._watch = Watch(path, self._changed) if path is not None and path.is_file() else None
        except BaseException:  # an interruption too: nobody else knows of it yet
            self.close()
            raise

    # What a program does with it.

    @property
    def mechanism(self) -> Mechanism:
        """The machine that is shown."""
        return self._stage.session.mechanism

    @property
    def solution(self) -> Solution:
        """The answer that is shown."""
        return self._stage.session.solution

    @property
    def target(self) -> Floats:
        """The target pose, (4, 4) [length]."""
        return self._stage.session.target.copy()

    def show(self, solution: Solution) -> None:
        """Show a configuration of this machine."""
        if checked_solution(solution).mechanism == self._described != self.mechanism:
            self._build(checked(self._described))
        if solution.mechanism != self.mechanism or solution.shape != ():
            raise InvalidArgument("solution", repr(solution), f"one Solution of '{self.mechanism.name}'")
        self._answer(lambda stage: stage.session.show(solution), self._next_gesture("program"))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the scene as a page of its own, which opens without this program and without a network.

        A Track is in it as a film. The file appears when it is complete, or not at all.
        """
        require_ending(path, (".html", ".htm"))
        page = self._page()
        with whole_path(path) as part:
            part.write_text(page, encoding="utf-8")

    def wait(self) -> None:
        """Wait until it is closed."""
        while not self._closed.wait(0.2):
            pass

    def close(self) -> None:
        """Close the viewer: its page stays as it is, but no longer answers."""
        if self._closed.is_set():
            return
        self._closed.set()
        if self._player is not None:
            self._player.stop()
        if self._watch is not None:
            self._watch.end()
        self._newest.end()
        self._searches.end()
        with _quietly():
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

    def _drag(self, target: Floats, grasp: int) -> None:
        self._stage.panel.release()
        with self._stage.wish:
            self._stage.wanted = target
            self._ask(grasp, lambda stage: stage.session.go_to(target))

    def _change_target(self, name: str, value: float) -> None:
        with self._stage.wish:
            self._stage.wanted = target = moved(self._stage.wanted, name, value)
            self._ask(name, lambda stage: stage.session.go_to(target))
        keep_in_view(self._server, target[:3, 3] / self.mechanism.characteristic_length)

    def _change_actuator(self, place: int, value: float) -> None:
        with self._stage.wish:
            self._stage.actuators[place] = value
            values = self._stage.actuators.copy()
            self._ask(f"actuator {place}", lambda stage: stage.session.drive(values))

    def _change_joint(self, place: int, value: float) -> None:
        stage = self._stage
        assert stage.session.path is not None
        with stage.wish:
            stage.joints[place] = value
            stage.wanted = target = stage.session.path.poses(stage.joints[None])[0]
            self._ask(f"joint {place}", lambda stage: stage.session.go_to(target))

    def _go_home(self) -> None:
        self._stage.panel.release()
        self._ask("home", lambda stage: stage.session.show(stage.session.home))

    def _undo(self) -> None:
        self._stage.panel.release()
        self._asked_by = ""
        self._post(lambda stage: stage.session.undo())

    def _take_mode(self, place: int) -> None:
        modes = self._stage.modes
        if place < len(modes):
            self._ask(f"mode {place}", lambda stage: stage.session.show(modes[place]))

    def _take_step(self, step: int) -> None:
        track = self._stage.track
        if track is not None:
            self._ask("path", lambda stage: stage.session.show(track[step - 1]))

    def _play(self, playing: bool) -> None:
        self._stage.panel.release()
        if self._player is not None:
            self._player.stop()
        track = self._stage.track
        self._player = Player(track, self._play_step) if playing and track is not None else None

    def _play_step(self, step: int) -> None:
        self._take_step(step)
        self._stage.panel.show_step(step)

    def _look_from(self, client: Any, view: str | None = None) -> None:
        if client is not None:
            self._stage.look_from(client.camera, client.camera.aspect, view)

    def _show_solids(self, visible: bool) -> None:
        with self._lock:
            self._stage.scene.show_solids(visible)

    def _keep_limits(self, kept: bool) -> None:
        """Go on from the same configuration with the limits of the machine, or without."""
        self._newest.post(lambda: self._build_from(self._described if kept else self._described.without_limits()))

    def _build_from(self, mechanism: Mechanism) -> None:
        with self._lock:
            q, described = self._stage.session.solution.q, self._described
            self._build((mechanism, configuration(mechanism, q), self._stage.track), described)

    def _ask(self, by: str | int, question: Callable[[LiveMachine], None]) -> None:
        """Post what the user asks for by one grasp of a handle, or by a slider or a button of a name."""
        self._post(question, self._next_gesture(by))

    def _next_gesture(self, by: str | int) -> int:
        """The number of a gesture: the same as before for the same grasp, or a slider that goes on without a pause."""
        now = time.monotonic()
        if by != self._asked_by or (isinstance(by, str) and now - self._asked_at > PAUSE):
            self._gesture += 1
        self._asked_by, self._asked_at = by, now
        return self._gesture

    def _post(self, question: Callable[[LiveMachine], None], gesture: int | None = None) -> None:
        stage = self._stage
        with stage.wish:
            stage.asked += 1
            number = stage.asked
            self._newest.post(lambda: self._answer(question, gesture, number) if self._stage is stage else None)

    def _answer(
        self, question: Callable[[LiveMachine], None], gesture: int | None = None, number: int | None = None
    ) -> None:
        with self._lock:
            if gesture is not None:
                self._stage.session.remember(gesture)
            question(self._stage)
            if gesture is not None:
                self._stage.session.forget_nothing_new()
            self._stage.refresh(number)

    # The machine, and its file.

    def _build(self, shown: Shown, described: Mechanism | None = None) -> None:
        """Show a machine in place of the one shown before; `described` is the one with its limits."""
        mechanism = shown[0]
        self._described = described or mechanism
        has_choice = shown[2] is None and self._described.without_limits() != self._described
        actions = Actions(
            change_target=self._change_target,
            change_actuator=self._change_actuator,
            change_joint=self._change_joint,
            go_home=self._go_home,
            undo=self._undo,
            find_modes=self._searches.find_modes,
            take_mode=self._take_mode,
            take_step=self._take_step,
            play=self._play,
            look_from=self._look_from,
            show_border=self._searches.show_border,
            show_solids=self._show_solids,
            keep_limits=self._keep_limits,
            save=self._send,
        )
        with self._lock:
            if self._player is not None:
                self._player.stop()
            limits = mechanism == self._described if has_choice else None
            self._stage = LiveMachine(self._server, shown, self._drag, actions, limits)
        if self._server.get_clients():
            self._prepare()

    def _greet(self, client: Any) -> None:
        """Prepare answers, and fit the machine into the page if it is narrow, once it has the first view."""
        client.camera.on_update(self._fit)
        self._newest.post(self._prepare)

    def _fit(self, camera: Any) -> None:
        if camera.aspect < 1.0 and np.allclose(camera.position, self._server.initial_camera.position):
            self._look_from(camera.client)

    def _prepare(self) -> None:
        """Do ahead what first answers prepare, since that takes longer than a motion of the mouse."""
        mechanism, panel = self.mechanism, self._stage.panel
        if mechanism != self._ready:
            panel.tell("getting ready …")
            prepare(mechanism)
            self._ready = mechanism
            panel.tell("")
        with self._lock:
            self._stage.refresh()  # a page that comes back shows the target as it is

    def _changed(self, path: Path) -> None:
        """Show the new content of the watched file, or its fault."""
        try:
            mechanism = load(path)
        except (PfabrikError, OSError) as error:
            self._stage.panel.tell(str(error), alarming=True)
            return
        self._newest.post(lambda: self._rebuild(mechanism))

    def _rebuild(self, mechanism: Mechanism) -> None:
        """Show another version of the machine, with the target that the user gave the one before."""
        before = self._stage.session
        keeps_limits = self.mechanism == self._described
        self._build(checked(mechanism if keeps_limits else mechanism.without_limits()), mechanism)
        if before.asked == "pose":
            self._answer(lambda stage: stage.session.go_to(before.target))

    def _complain(self, error: Exception) -> None:
        self._stage.panel.tell(str(error), alarming=True)

    # A page of its own.

    def _page(self) -> str:
        with self._lock:
            return self._stage.page()

    def _send(self, client: Any) -> None:
        """Send the page as a download."""
        if client is not None:
            client.send_file_download(f"{self.mechanism.name}.html", self._page().encode())


def _serve(host: str, port: int) -> viser.ViserServer:
    """A server at an address, and at the next free port; it opens no way in from elsewhere."""
    import viser

    class Local(viser.ViserServer):
        def request_share_url(self, verbose: bool = True) -> None:
            """A page could ask for a tunnel to the outside; this one is of this computer alone."""

    with _quietly():
        return Local(host=host, port=port, verbose=False)


@contextlib.contextmanager
def _quietly() -> Iterator[None]:
    """Keep what the server says of itself off standard output, and out of the cells of a notebook.

    It prints by rich, whose console writes into a notebook's cell by itself, not on standard output.
    """
    console = rich.get_console()
    was_quiet, console.quiet = console.quiet, True
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            yield
    finally:
        console.quiet = was_quiet
