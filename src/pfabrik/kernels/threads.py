"""Batches on all cores: blocks of rows, each a kernel call that has released the GIL."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import TypeVar

T = TypeVar("T")


def n_cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@lru_cache(maxsize=1)
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(n_cores(), thread_name_prefix="pfabrik")


if hasattr(os, "register_at_fork"):  # threads do not survive a fork: the child starts its own
    os.register_at_fork(after_in_child=_pool.cache_clear)


def in_blocks(run: Callable[[slice], T], n: int, rows_a_block: int) -> list[T]:
    """Results of `run` for blocks of n rows, in order, on all cores; `run` must release the GIL."""
    blocks = [slice(start, start + rows_a_block) for start in range(0, n, rows_a_block)]
    if len(blocks) <= 1 or n_cores() == 1:
        return [run(block) for block in blocks]
    return list(_pool().map(run, blocks))
