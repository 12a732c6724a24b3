"""A file that is watched for changes."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

INTERVAL = 0.25
"""Time between two checks [s]."""


class Watch:
    """Calls back, from a thread of its own, each time a file has been written.

    Editors write in several ways: what counts is that its time, size or place on the disk is another, and that it is
    the same in two checks one after the other, so that a file half written is not read.
    """

    def __init__(self, path: Path, changed: Callable[[Path], None]) -> None:
        self._path, self._changed = path, changed
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._known = self._state()
        self._thread.start()

    def end(self) -> None:
        """Stop watching."""
        self._ended.set()
        if threading.current_thread() is not self._thread:
            self._thread.join(timeout=5.0)

    def _run(self) -> None:
        before = self._known
        while not self._ended.wait(INTERVAL):
            now = self._state()
            if now is not None and now == before and now != self._known:
                self._known = now
                self._changed(self._path)
            before = now

    def _state(self) -> tuple[int, int, int] | None:
        """Time, size and place on the disk of the file; None while there is no file."""
        try:
            stat = self._path.stat()
        except OSError:
            return None
        return stat.st_mtime_ns, stat.st_size, stat.st_ino
