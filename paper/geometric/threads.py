"""Batches on all cores: blocks of rows, each a kernel call that has released the GIL."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache


def n_cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@lru_cache(maxsize=1)
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(n_cores(), thread_name_prefix="geometric")


def in_blocks(run: Callable[[slice], object], n: int, rows_a_block: int) -> None:
    """Call `run` for the blocks of n rows."""
    blocks = [slice(start, start + rows_a_block) for start in range(0, n, rows_a_block)]
    if len(blocks) <= 1 or n_cores() == 1:
        for block in blocks:
            run(block)
    else:
        list(_pool().map(run, blocks))
