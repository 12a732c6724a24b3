"""`view`: a machine in the browser, to drag and to drive, with the limits that stop it."""

from __future__ import annotations

import atexit
import os
import threading
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...answers.solution import Solution, checked_solution
from ...answers.tracked import Track
from ...common.arrays import Floats
from ...common.checks import require_count, require_ending
from ...common.whole_files import whole_path
from ...configuration import configuration
from ...errors import InvalidArgument, PfabrikError
from ...kinematics import home_coordinates
from ...machine.description.mechanism import Mechanism
from ...machine.files import load
from ..plot_track import checked_track
from ..skeleton import checked_shown
from .export_web import web_page
from .live_questions import LiveQuestions, answered
from .page_answers import page_answer
from .server import PageServer, SentFile
from .watch import Watch

LOOPBACK, PORT = "127.0.0.1", 8080

WITHOUT_LIMITS, SAVED = "?limits=no", "saved"
"""Addresses of the page for a machine without its limits, and of a page to keep; that of the page is empty."""


def view(shown: Mechanism | Solution | str | os.PathLike[str], *, port: int = PORT, host: str = LOOPBACK) -> Viewer:
    """Show a machine in the browser: drag it, drive its actuators, see what stops it.

    It is the page that `export_web` writes, served from this computer, and to this computer alone unless `host` says
    otherwise; it asks nothing of any other. The page answers by itself; this process answers for machines that it
    cannot, and looks for workspaces, singularities, modes and distances.

    Parameters
    ----------
    shown : Mechanism or Solution or str or PathLike
        A Mechanism; one Solution; a Track, which can then be played; or the path of a file or a name of the catalogue.
        A file is read again whenever it changes.
    port : int, optional
        Where the page is served; the next free one where it is taken.
    host : str, optional
        Address that is listened on; "0.0.0.0" lets other computers in that know the whole address.

    Returns
    -------
    Viewer
        Open `url`; in a notebook it shows itself. It ends with `close()`, or with the process.

    Raises
    ------
    InvalidArgument
        A batch that is no Track, or an address or a port where nothing can be served.
    """
    require_count("port", port, most=65535)
    return Viewer(shown, port, host)


class _Shown(NamedTuple):
    """A machine, the configuration that pages open in (None for home), and the path that can be played."""

    mechanism: Mechanism
    first: Solution | None
    track: Track | None


class Viewer:
    """A machine in the browser; `view` makes one.

    Each page that is open has a pose of its own; `solution` and `target` are those of the page that was moved last.

    Attributes
    ----------
    url : str
        Address of the page, with a token that lets nobody in who was not told.
    port : int
        Port where it is served: another than was asked for, if that one was taken.
    """

    def __init__(self, shown: Mechanism | Solution | str | os.PathLike[str], port: int, host: str) -> None:
        path = Path(shown) if isinstance(shown, str | os.PathLike) else None
        self._lock, self._closed = threading.RLock(), threading.Event()
        self._fault = ""
        self._shown = _checked(load(shown) if isinstance(shown, str | os.PathLike) else shown)
        self._mechanism, self._solution, self._state = self._opened()
        questions = LiveQuestions(self._machine, self._note)
        self._server = PageServer(host, port, self._file, questions.answer)
        self.port, self.url = self._server.port, self._server.url
        self._watch = Watch(path, self._changed) if path is not None and path.is_file() else None
        atexit.register(self.close)

    # What a program does with it.

    @property
    def mechanism(self) -> Mechanism:
        """The machine that is shown."""
        return self._mechanism

    @property
    def solution(self) -> Solution:
        """The answer that is shown."""
        with self._lock:
            if self._solution is None:
                self._solution = answered(self._mechanism, self._state)
            return self._solution

    @property
    def target(self) -> Floats:
        """The target pose, (4, 4) [length]."""
        return np.array(self._state["target"])

    def show(self, solution: Solution) -> None:
        """Show a configuration of this machine, in all pages."""
        machines = [self._shown.mechanism, self._mechanism]
        if checked_solution(solution).mechanism not in machines or solution.shape != ():
            raise InvalidArgument("solution", repr(solution), f"one Solution of '{self.mechanism.name}'")
        with self._lock:
            self._shown = self._shown._replace(first=solution)
            self._mechanism, self._solution, self._state = self._opened()
        self._server.push("show", self._first())

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a page of its own, as `export_web` does, which opens as the machine is shown, and plays a Track.

        Where a page cannot answer by itself, it shows the machine as it is, and plays the Track. The file appears when
        it is complete, or not at all.
        """
        require_ending(path, (".html", ".htm"))
        page = self._saved()
        with whole_path(path) as part:
            part.write_text(page, encoding="utf-8")

    def wait(self) -> None:
        """Wait until it is closed."""
        while not self._closed.wait(0.2):
            pass

    def close(self) -> None:
        """Close the viewer: its page stays as it is, and says that nobody answers any more."""
        if self._closed.is_set():
            return
        self._closed.set()
        if self._watch is not None:
            self._watch.end()
        self._server.end()
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

    # What pages ask.

    def _file(self, place: str) -> SentFile | None:
        if place == SAVED:
            return SentFile("text/html", self._saved(), f"{_plain(self.mechanism.name)}.html")
        if place not in ("", WITHOUT_LIMITS):
            return None
        is_free = place == WITHOUT_LIMITS
        with self._lock:
            live = {"version": self._server.version, "free": is_free, "fault": self._fault}
            _, first, track = self._shown
            if first is not None and first.mechanism != self._machine(is_free):
                first = None
            return SentFile(
                "text/html", web_page(self._machine(is_free), first=first, track=None if is_free else track, live=live)
            )

    def _saved(self) -> str:
        return web_page(self.mechanism, first=self.solution, track=self._shown.track)

    def _machine(self, is_free: bool) -> Mechanism:
        mechanism = self._shown.mechanism
        return mechanism.without_limits() if is_free else mechanism

    def _note(self, mechanism: Mechanism, state: dict[str, Any]) -> None:
        """Keep what a page says of itself; the answer is computed when a program asks for it."""
        target = np.reshape(np.array(state["target"], float), (4, 4))
        with self._lock:
            self._mechanism, self._state, self._solution = mechanism, state | {"target": target}, None

    def _first(self) -> dict[str, Any]:
        """The configuration that pages open in, as they take it, and if it is without limits."""
        first = self._shown.first
        assert first is not None
        return page_answer(first) | {"free": first.mechanism != self._shown.mechanism}

    # The machine, and its file.

    def _opened(self) -> tuple[Mechanism, Solution | None, dict[str, Any]]:
        """The machine, the answer and the state of a page that was just opened."""
        mechanism, first, _ = self._shown
        solution = configuration(mechanism, home_coordinates(mechanism)) if first is None else first
        return solution.mechanism, solution, {"asked": "configuration", "target": solution.pose}

    def _changed(self, path: Path) -> None:
        """Show the new content of the watched file, or its fault."""
        try:
            mechanism, self._fault = load(path), ""
        except (PfabrikError, OSError) as error:
            self._fault = str(error)
            self._server.push("fault", self._fault)
            return
        with self._lock:
            self._server.version += 1
            self._shown = _Shown(mechanism, None, None)
            self._mechanism, self._solution, self._state = self._opened()
        self._server.push("version", self._server.version)


def _checked(what: object) -> _Shown:
    """The machine, configuration and path to show, checked before anything is served."""
    if isinstance(what, Track):
        return _Shown(what.mechanism, what[int(checked_track(what)[0])], what)
    return _Shown(*checked_shown(what), None)


def _plain(name: str) -> str:
    """A name that a file can have anywhere."""
    return "".join(letter if letter.isascii() and (letter.isalnum() or letter in "-_") else "_" for letter in name)
