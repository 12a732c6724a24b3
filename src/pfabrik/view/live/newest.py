"""A worker that runs the newest job; older jobs that still wait are dropped."""

from __future__ import annotations

import threading
from collections.abc import Callable


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
        if threading.current_thread() is not self._thread:
            self._thread.join(timeout=5.0)

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
