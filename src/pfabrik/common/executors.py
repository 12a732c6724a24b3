"""Blocks of rows, here or on the workers of an executor: one contract for every verb that can be split."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Executor, Future
from functools import lru_cache
from typing import Any, TypeVar

from ..errors import InvalidArgument
from .batch import aligned
from .checks import require_method

POSES_A_BLOCK = 1 << 14
"""Poses of a block: enough to be worth sending to another process."""

SLOWER = 64
"""Factor by which a pose takes longer without closed forms, at least."""

Result = TypeVar("Result")
"""What a function gives for a block."""


def slices(n: int, cost: int = 1) -> list[slice]:
    """Slices of n rows, one at least, each worth sending to another process.

    Parameters
    ----------
    cost : int
        Poses by closed forms that take as long as a row.
    """
    rows = max(1, POSES_A_BLOCK // cost)
    return [slice(first, first + rows) for first in range(0, max(n, 1), rows)]


def told(
    results: Iterable[Result], blocks: Iterable[slice], n: int, tell: Callable[[int, int], None] | None
) -> Iterator[Result]:
    """Results of blocks of n rows, with the rows that are done told behind each."""
    for result, block in zip(results, blocks, strict=True):
        if tell is not None and n:
            tell(min(block.stop, n), n)
        yield result


class Workers:
    """Those that answer blocks about one object, a mechanism say: the workers of an executor, or this process.

    Parameters
    ----------
    executor : Executor or None
        Of `concurrent.futures`, or one like it, such as Dask's or loky's; None answers here.
    shared : object
        The first argument of every call; pickled once here, sent with every block, unpacked once on each worker.
    """

    def __init__(self, executor: Executor | None, shared: Any) -> None:
        if executor is not None:
            expected = "an executor of concurrent.futures, or None"
            require_method("executor", executor, "submit", expected)
            if isinstance(executor, type):
                raise InvalidArgument("executor", f"the class {executor.__name__}", f"{expected}: make one of it")
        self._executor, self._shared = executor, shared
        self._sent = b"" if executor is None else pickle.dumps(shared)

    def results(self, function: Callable[..., Result], blocks: Iterable[tuple[Any, ...]]) -> Generator[Result]:
        """What a function of a module gives for the shared object and each block, in the order of the blocks.

        Once the iterator is closed, by a failure or interruption too, blocks that have not begun are dropped.
        """
        if self._executor is None:
            for block in blocks:
                yield function(self._shared, *block)
            return
        futures: list[Future[Result]] = []
        try:
            for block in blocks:
                futures.append(self._executor.submit(_on_a_worker, self._sent, function, *block))
            for future in futures:
                yield future.result()
        finally:
            for future in futures:
                future.cancel()


def _on_a_worker(sent: bytes, function: Callable[..., Result], *block: Any) -> Result:
    """Answer a block on a worker."""
    return function(_unpacked(sent), *map(aligned, block))


@lru_cache(maxsize=4)
def _unpacked(sent: bytes) -> Any:
    return pickle.loads(sent)
