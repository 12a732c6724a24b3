"""A thread that watches a file."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

INTERVAL = 0.25
"""Time between two checks of a file [s]."""

PATIENCE = 5.0
"""Time that an end waits for a check that is on its way [s]."""


class Watch:
    """Calls back each time a file has been written, until it is ended.

    Editors write in several ways: what counts is that its time, size or place on the disk is another, and that it is
    the same in two checks one after the other, so that a file half written is not read.
    """

    def __init__(self, path: Path, changed: Callable[[Path], None]) -> None:
        self._path, self._changed = path, changed
        self._known = self._before = self._state()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Stop, and wait for the present call."""
        self._ended.set()
        if threading.current_thread() is not self._thread:
            self._thread.join(PATIENCE)

    def _run(self) -> None:
        while not self._ended.wait(INTERVAL):
            now = self._state()
            if now is not None and now == self._before and now != self._known:
                self._known = now
                self._changed(self._path)
            self._before = now

    def _state(self) -> tuple[int, int, int] | None:
        """Time, size and place on the disk of the file; None while there is no file."""
        try:
            stat = self._path.stat()
        except OSError:
            return None
        return stat.st_mtime_ns, stat.st_size, stat.st_ino
