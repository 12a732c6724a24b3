"""How long something takes on one core."""

from __future__ import annotations

import os
import platform
import statistics
import time
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

Key = TypeVar("Key", bound=Hashable)

HAS_CORES = hasattr(os, "sched_setaffinity")
"""Whether this system can keep a thread on one core."""

clock = time.thread_time if HAS_CORES else time.perf_counter
"""Seconds; where nothing runs in other threads, those of the processor, which other programs do not add to."""

LEAST = 3e-3
"""A call is repeated until it has taken this long [s], so that the clock does not count."""

LONG = 0.2
"""What takes longer [s] is timed three times at most."""


@contextmanager
def one_core() -> Iterator[None]:
    """Keep this thread, and with it a batch, on one core, where the system can."""
    if not HAS_CORES:
        yield
        return
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, cores)


def median_times(calls: Mapping[Key, Callable[[], object]], repeats: int) -> dict[Key, float]:
    """Median time of each call [s]; taken by turns, after one call each to warm up, so that noise hits all alike."""
    first = {}
    for name, call in calls.items():
        call()
        first[name] = max(_once(call, 1), 1e-9)
    taken: dict[Key, list[float]] = {name: [] for name in calls}
    for turn in range(repeats):
        for name, call in calls.items():
            if turn < 3 or first[name] < LONG:
                taken[name].append(_once(call, max(1, round(LEAST / first[name]))))
    return {name: statistics.median(times) for name, times in taken.items()}


def _once(call: Callable[[], object], count: int) -> float:
    start = clock()
    for _ in range(count):
        call()
    return (clock() - start) / count


def machine() -> str:
    """What this runs on."""
    import numpy

    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    processor = names[0] if names else platform.processor() or platform.machine()
    versions = f"Python {platform.python_version()}, NumPy {numpy.__version__}"
    return f"{processor}, {'one core' if HAS_CORES else 'all cores'}; {versions}"
