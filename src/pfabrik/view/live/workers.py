"""Threads beside the page: one that answers, one that plays a path, one that watches a file."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from pathlib import Path

from ...answers.tracked import Track

FRAMES_A_SECOND = 20

INTERVAL = 0.25
"""Time between two checks of a file [s]."""


class Newest:
    """One thread that runs what was posted last.

    Dragging asks faster than a slow machine answers: whatever waits behind the newest is out of date.

    Parameters
    ----------
    on_error : called with what a job raised; the thread goes on.
    """

    def __init__(self, on_error: Callable[[Exception], None]) -> None:
        self._on_error = on_error
        self._condition = threading.Condition()
        self._waiting: Callable[[], object] | None = None
        self._ended = False
        self.answered = 0
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def post(self, job: Callable[[], object]) -> None:
        """Post a job, in place of the one that waits."""
        with self._condition:
            self._waiting = job
            self._condition.notify()

    def end(self) -> None:
        """Let the thread end; a waiting job is dropped."""
        with self._condition:
            self._waiting, self._ended = None, True
            self._condition.notify()
        _join(self._thread)

    def _run(self) -> None:
        while (job := self._next()) is not None:
            try:
                job()
            except Exception as error:
                self._on_error(error)
            self.answered += 1

    def _next(self) -> Callable[[], object] | None:
        with self._condition:
            while self._waiting is None and not self._ended:
                self._condition.wait()
            job, self._waiting = self._waiting, None
            return job


class Every:
    """A thread that calls back again and again, a time after each call [s], until it is stopped."""

    def __init__(self, interval: float, call: Callable[[], None]) -> None:
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(interval, call), daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Let the present call be the last."""
        self._stopped.set()

    def end(self) -> None:
        """Stop, and wait for the present call."""
        self.stop()
        _join(self._thread)

    def _run(self, interval: float, call: Callable[[], None]) -> None:
        while not self._stopped.wait(interval):
            call()


class Player(Every):
    """Plays one path over and over, each step at its time, until it is stopped.

    Parameters
    ----------
    take_step : called with the number of the step that is due, from 1.
    """

    def __init__(self, track: Track, take_step: Callable[[int], None]) -> None:
        due, start = due_after(track), time.perf_counter()

        def play() -> None:
            take_step(1 + int((time.perf_counter() - start) / due) % len(track))

        super().__init__(max(due, 1.0 / FRAMES_A_SECOND), play)


def due_after(track: Track) -> float:
    """Time from one step to the next [s]."""
    return track.sample_time or 1.0 / FRAMES_A_SECOND


class Watch(Every):
    """Calls back each time a file has been written.

    Editors write in several ways: what counts is that its time, size or place on the disk is another, and that it is
    the same in two checks one after the other, so that a file half written is not read.
    """

    def __init__(self, path: Path, changed: Callable[[Path], None]) -> None:
        self._path, self._changed = path, changed
        self._known = self._before = self._state()
        super().__init__(INTERVAL, self._check)

    def _check(self) -> None:
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


def _join(thread: threading.Thread) -> None:
    """Wait for a thread that was told to end, unless this is it."""
    if threading.current_thread() is not thread:
        thread.join(timeout=5.0)
