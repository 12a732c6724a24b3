"""Progress of long computations: a bar on a terminal, once they have taken a while."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeAlias

from .checks import require_callable

OnProgress: TypeAlias = Callable[[int, int], None]
"""Called with the amount done and the approximate total."""

PATIENCE = 2.0
"""Seconds before a bar appears."""


@contextmanager
def telling(label: str, on_progress: OnProgress | None = None) -> Iterator[OnProgress | None]:
    """The function to call with (done, total): the caller's, else one that draws a bar on a terminal; else None.

    For a bar, a total of 0 means that it is not known.
    """
    require_callable("on_progress", on_progress)
    if on_progress is not None or sys.stderr is None or not sys.stderr.isatty():
        yield on_progress
        return
    from rich.console import Console
    from rich.progress import Progress, TaskID

    began, task = time.monotonic(), TaskID(0)
    bar = Progress(console=Console(stderr=True), transient=True)

    def tell(done: int, total: int) -> None:
        if not bar.tasks and time.monotonic() - began > PATIENCE:
            bar.add_task(label, total=None)
            bar.start()
        if bar.tasks:
            bar.update(task, completed=done, total=total or None)

    try:
        yield tell
    finally:
        bar.stop()
