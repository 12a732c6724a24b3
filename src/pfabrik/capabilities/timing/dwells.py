"""Timings with times at rest between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...common.arrays import Floats, Ints
from .timed import Timed

AT_ONCE = 1e-9
"""Share of the time from sample to sample by which a sample is no other."""


def pieces_of(dwells: Floats) -> list[tuple[float, slice]]:
    """The rows of a path from one place of rest to the next, each with the time before it; some may have one row.

    A path rests where the row before a time at rest is, and goes on from there.

    Parameters
    ----------
    dwells : time at rest before each row [s].
    """
    ends = [0, *np.flatnonzero(dwells > 0.0).tolist(), len(dwells)]
    before = [0.0, *dwells[dwells > 0.0].tolist()]
    return [(time, slice(max(a - 1, 0), b)) for time, a, b in zip(before, ends[:-1], ends[1:], strict=True)]


def with_pauses(parts: Sequence[tuple[float, Timed]], last: float, every: float) -> Timed:
    """Timings one after the other, each behind a time at rest [s], and one at the end.

    Parameters
    ----------
    last : time at rest behind all of them [s].
    every : from sample to sample [s].
    """
    if len(parts) == 1 and parts[0][0] == last == 0.0:
        return parts[0][1]
    begin, exceeded = 0.0, []
    times: list[Floats] = []
    chosen: list[Ints] = []
    still: list[Floats] = []
    n_before = 0
    for pause, timed in parts:
        rest = np.arange(every if times else 0.0, pause - AT_ONCE * every, every)
        held = n_before - 1 if times else 0
        times += [begin + rest, begin + pause + timed.times]
        chosen += [np.full(len(rest), held), n_before + np.arange(len(timed.times))]
        still += [np.zeros(len(rest)), np.ones(len(timed.times))]
        exceeded += [each._replace(time=each.time + begin + pause) for each in timed.exceeded]
        begin, n_before = begin + pause + timed.duration, n_before + len(timed.times)
    if last > 0.0:
        rest = np.append(np.arange(every, last - AT_ONCE * every, every), last)
        times.append(begin + rest)
        chosen.append(np.full(len(rest), n_before - 1))
        still.append(np.zeros(len(rest)))
    rows, moving = np.concatenate(chosen), np.concatenate(still)

    def of(name: str) -> Floats:
        return np.asarray(np.concatenate([getattr(timed, name) for _, timed in parts])[rows])

    return replace(
        parts[0][1],
        times=np.concatenate(times),
        steps=of("steps").astype(np.int64),
        poses=of("poses"),
        actuators=of("actuators"),
        rates=of("rates") * moving[:, None],
        accelerations=of("accelerations") * moving[:, None],
        platform_speeds=of("platform_speeds") * moving,
        used=of("used") * moving,
        binding=of("binding").astype(np.int64),
        exceeded=tuple(sorted(exceeded, key=lambda each: -each.share)),
    )
