"""Progress of long computations, said in one way: a share that never falls, the time taken and the time left."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TextIO, TypeAlias

from .checks import require_callable

OnProgress: TypeAlias = Callable[[int, int], None]
"""Called with the amount done and the approximate total, whose ratio never falls; a total of 0 is unknown."""

PATIENCE = 2.0
"""Seconds before anything is said."""

SECONDS_A_LINE = 0.2
"""Least time from one change of a line on a terminal to the next."""

_steps = 0  # shares of a whole at which lines are printed where stderr is no terminal; 0 for none


@contextmanager
def lines_on_pipes(steps: int = 10) -> Iterator[None]:
    """Within this context, progress is printed in so many steps where stderr is no terminal."""
    global _steps
    before, _steps = _steps, steps
    try:
        yield
    finally:
        _steps = before


@contextmanager
def telling(label: str, on_progress: OnProgress | None = None) -> Iterator[OnProgress | None]:
    """The function to call with (done, total), which keeps their ratio from falling.

    It goes on to the caller's; without one, to a line on a terminal, or lines in a command. None where nobody listens.
    """
    require_callable("on_progress", on_progress)
    stream = sys.stderr
    if on_progress is not None:
        yield _rising(on_progress)
    elif stream is None or not (stream.isatty() or _steps):
        yield None
    else:
        said = _Said(label, stream)
        try:
            yield _rising(said)
        finally:
            said.end()


def _rising(on_progress: OnProgress) -> OnProgress:
    """Lower totals so that the share done never falls: an estimate that grows is made up for in time."""
    known = (0, 1)

    def tell(done: int, total: int) -> None:
        nonlocal known
        if total > 0:
            total = max(total, done)
            if known[0] > 0:
                total = min(total, done * known[1] // known[0])
            known = (done, total)
        on_progress(done, total)

    return tell


class _Said:
    """Progress as a line on a terminal that is written over, or as lines, one for each step."""

    def __init__(self, label: str, stream: TextIO) -> None:
        self._label, self._stream, self._is_terminal = label, stream, stream.isatty()
        self._began = self._latest = time.monotonic()
        self._step, self._width = 0, 0

    def __call__(self, done: int, total: int) -> None:
        now = time.monotonic()
        taken = now - self._began
        if taken < PATIENCE:
            return
        words = f"{self._label}: {in_words(done, total, taken)}"
        if self._is_terminal:
            if now - self._latest >= SECONDS_A_LINE:
                self._latest = now
                self._write_over(words[: shutil.get_terminal_size().columns - 1])
            return
        step = _steps * done // total if total else int(taken / PATIENCE).bit_length()
        if step > self._step and (not total or done < total):
            self._stream.write(f"pfabrik: {words}\n")
        self._step = max(step, self._step)

    def end(self) -> None:
        """Leave no line on a terminal."""
        if self._width:
            self._write_over("")
            self._stream.write("\r")
            self._stream.flush()

    def _write_over(self, words: str) -> None:
        self._stream.write("\r" + words.ljust(self._width))
        self._stream.flush()
        self._width = len(words)


def in_words(done: int, total: int, taken: float) -> str:
    """How much is done, in what time, and about what time is left: "40%, 8 s, about 12 s left"."""
    if not total:
        return f"{done} done, {_duration(taken)}"
    left = f", about {_duration(taken * (total - done) / done)} left" if done > 0 else ""
    return f"{100 * done // total}%, {_duration(taken)}{left}"


def _duration(seconds: float) -> str:
    whole = round(seconds)
    minutes, rest = divmod(whole, 60)
    if minutes >= 60:
        return f"{minutes // 60} h {minutes % 60:02d} min"
    return f"{minutes} min {rest:02d} s" if minutes else f"{rest} s"
