"""Paths followed part by part, so that only one part is in memory at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from ...answers.solution import Solution
from ...answers.status import Status
from ...answers.tracked import Track
from ...common.arrays import Ints
from ...live import Live
from ...machine.description.mechanism import Mechanism
from ...options import Options
from ...track import track
from .path import BLOCK, Path, joined

BACK = BLOCK // 4
"""Largest number of steps by which a part overlaps the one before it."""


class TrackPart(NamedTuple):
    """A part of a path and its answers; the rows before `first` were in the part before it too."""

    path: Path
    track: Track
    first: int


def follow_parts(
    mechanism: Mechanism,
    blocks: Iterable[Path],
    *,
    options: Options | None = None,
    speed_limits: Mapping[str, float] | None = None,
    on_progress: Callable[[int], None] | None = None,
) -> Iterator[TrackPart]:
    """Answers along a path a part at a time; see `track`.

    Each part overlaps the one before it: by two steps, for accelerations, or back to the last target that was reached,
    because answers with stretched links depend on the steps before them.

    Parameters
    ----------
    on_progress : called with the steps done every few steps.
    """
    start: Solution | None = None
    kept: Path | None = None
    done = 0
    for block in blocks:
        path = block if kept is None else joined([kept, block])
        first, before = len(path.lines) - len(block.lines), done

        def report(steps: int, _: int, before: int = before - first) -> None:
            if on_progress is not None:
                on_progress(before + steps)

        answers = track(
            mechanism,
            path.targets,
            start=start,
            options=options,
            times=path.times,
            speed_limits=None if path.times is None else speed_limits,
            on_progress=report,
        )
        yield TrackPart(path, answers, first)
        done += len(block.lines)
        place = _last_feasible(answers.status)
        if place is not None:
            start = answers[place]
        kept = path.after(max(len(path.lines) - 2, 0) if place is None else place)


def drive_parts(
    live: Live, blocks: Iterable[Path], *, on_progress: Callable[[int], None] | None = None
) -> Iterator[TrackPart]:
    """The answers of ticks along a path, a part at a time; see `Live.follow`.

    Parameters
    ----------
    on_progress : called with the steps done after every part.
    """
    done = 0
    for block in blocks:
        yield TrackPart(block, live.follow(block.targets, times=block.times), 0)
        done += len(block.lines)
        if on_progress is not None:
            on_progress(done)


def _last_feasible(status: Ints) -> int | None:
    """The row of the last answer but one, or of one before it that was reached; None if none of them is feasible."""
    end = max(len(status) - 1, 1)
    begin = max(end - BACK, 0)
    for most in (Status.REACHED, Status.PROJECTED):
        rows = np.flatnonzero(status[begin:end] <= most)
        if len(rows):
            return begin + int(rows[-1])
    return None
