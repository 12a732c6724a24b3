"""The table of docs/cluster.md: verbs on one process and on two, each bound to a core of its own.

python benchmarks/on_processes.py
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from typing import Any

import numpy as np

import pfabrik as pf
from timing import best_times, draw

RUNS = 5


def bind(next_core: Any) -> None:
    """Bind this process to a core that no other worker has."""
    with next_core.get_lock():
        cores = sorted(os.sched_getaffinity(0))
        os.sched_setaffinity(0, {cores[next_core.value % len(cores)]})
        next_core.value += 1


def processes(n: int) -> ProcessPoolExecutor:
    """An executor of n processes, each on one core."""
    return ProcessPoolExecutor(n, initializer=bind, initargs=(multiprocessing.Value("i", 0),))


def drawn(seed: int) -> int:
    """How many of 250,000 poses, drawn here, are within the limits of the hexapod."""
    hexapod, rng = pf.load("stewart"), np.random.default_rng(seed)
    low, high = np.array([[-60, -60, 150, -0.35, -0.35, -0.35], [60, 60, 270, 0.35, 0.35, 0.35]])
    rows = low + (high - low) * rng.random((250_000, 6))
    return int(np.count_nonzero(pf.feasibility(hexapod, pf.pose(rows[:, :3], rpy=rows[:, 3:])).margin >= 0.0))


def asked() -> Iterator[tuple[str, int, Callable[[Executor], object]]]:
    """What is asked, the number of poses in it (0 if that is part of the answer), and how."""
    rng = np.random.default_rng(0)
    hexapod = pf.load("stewart")
    many, some = draw(hexapod, rng, 1_000_000, 0.25, 0.2), draw(hexapod, rng, 100_000, 0.6, 0.3)
    yield "`feasibility`, poses drawn by the workers", 4_000_000, lambda workers: list(workers.map(drawn, range(16)))
    yield (
        "`feasibility`, poses sent to the workers",
        len(many),
        lambda workers: pf.feasibility(hexapod, many, executor=workers),
    )
    yield "`solve_ik`, hexapod, far targets", len(some), lambda workers: pf.solve_ik(hexapod, some, executor=workers)
    yield (
        "`workspace`, hexapod, any orientation, 4 mm",
        0,
        lambda workers: pf.workspace(hexapod, orientation="any", resolution=4.0, executor=workers),
    )


def main() -> None:
    print("| | poses | one process [s] | two [s] | a pose and core [µs] |")
    print("|---|--:|--:|--:|--:|")
    with processes(1) as one, processes(2) as two:
        for name, n, ask in asked():
            alone, together = best_times(RUNS if n else 1, lambda ask=ask: ask(one), lambda ask=ask: ask(two))
            a_pose = f"{1e6 * alone / n:.2g}" if n else "–"
            print(f"| {name} | {f'{n:,}' if n else '–'} | {alone:.2f} | {together:.2f} | {a_pose} |", flush=True)


if __name__ == "__main__":
    main()
