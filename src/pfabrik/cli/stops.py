"""Signals that end a command: no half-written file stays behind, and the exit code is the one that shells know."""

from __future__ import annotations

import _thread
import signal
import sys
import threading
import time
from types import FrameType, TracebackType
from typing import Any

SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]

AGAIN = 0.2
"""Seconds after which an interruption is raised again: one that arrives in a callback of compiled code is lost."""

GRACE = 5.0
"""Seconds in which further signals of the user do not disturb what cleans up."""


class Stops:
    """While it is entered, a signal to end is a KeyboardInterrupt in the main thread, until the block has ended.

    Whoever swallows the exception gets it again; who cleans up because of it is not disturbed. Signals that are
    ignored, as in the background of a shell or under `nohup`, stay ignored.

    Attributes
    ----------
    number : of the first signal; None before.
    """

    def __init__(self) -> None:
        self.number: int | None = None
        self._since, self._is_again = 0.0, False
        self._over = threading.Event()
        self._insisting: threading.Thread | None = None
        self._before: dict[int, Any] = {}

    @property
    def code(self) -> int:
        """The exit code."""
        return 128 + (signal.SIGINT if self.number is None else self.number)

    @property
    def word(self) -> str:
        """The end of the command in one word."""
        return "interrupted" if self.number in (None, signal.SIGINT) else "terminated"

    def __enter__(self) -> Stops:
        if threading.current_thread() is threading.main_thread():  # others can have no handlers
            for number in SIGNALS:
                if signal.getsignal(number) != signal.SIG_IGN:
                    self._before[number] = signal.signal(number, self._handle)
        self._unraisable, sys.unraisablehook = sys.unraisablehook, self._drop
        return self

    def end(self) -> None:
        """Raise no more interruptions: only the end of the command is still to be reported."""
        self._over.set()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.end()
        if self._insisting is not None:
            self._insisting.join()
        for number, handler in self._before.items():
            signal.signal(number, handler)
        sys.unraisablehook = self._unraisable
        if self.number is not None:
            exec("")  # else Python ends by SIGINT where the interruption came in code that it had just generated

    def _handle(self, number: int, frame: FrameType | None) -> None:
        is_again, self._is_again = self._is_again, False
        if self._over.is_set():
            return
        if self.number is None:
            self.number, self._since = number, time.monotonic()
            self._insisting = threading.Thread(target=self._insist, daemon=True)
            self._insisting.start()
        elif _is_cleaning_up() and (is_again or time.monotonic() - self._since < GRACE):
            return
        raise KeyboardInterrupt

    def _insist(self) -> None:
        while not self._over.wait(AGAIN):
            self._is_again = True
            _thread.interrupt_main(signal.Signals(self.number or signal.SIGINT))

    def _drop(self, unraisable: Any) -> None:
        """An interruption that a callback could not raise is no message: it is raised again."""
        if not issubclass(unraisable.exc_type, KeyboardInterrupt):
            self._unraisable(unraisable)


def _is_cleaning_up() -> bool:
    """True if the running code handles an interruption."""
    error = sys.exception()
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__context__
    return error is not None
