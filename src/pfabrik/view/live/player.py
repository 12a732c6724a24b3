"""Plays a path: its steps, each at its time."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from ...answers.tracked import Track

FRAMES_A_SECOND = 20


def due_after(track: Track) -> float:
    """Time from one step to the next [s]."""
    return track.sample_time or 1.0 / FRAMES_A_SECOND


class Player:
    """Plays one path over and over, in a thread of its own, until it is stopped.

    Parameters
    ----------
    take_step : called with the number of the step that is due, from 1.
    """

    def __init__(self, track: Track, take_step: Callable[[int], None]) -> None:
        self._track, self._take_step = track, take_step
        self._stopped = threading.Event()
        threading.Thread(target=self._run, daemon=True).start()

    def stop(self) -> None:
        """Stop playing."""
        self._stopped.set()

    def _run(self) -> None:
        due = due_after(self._track)
        start = time.perf_counter()
        while not self._stopped.wait(max(due, 1.0 / FRAMES_A_SECOND)):
            self._take_step(1 + int((time.perf_counter() - start) / due) % len(self._track))
