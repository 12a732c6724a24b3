"""Measures many points in blocks, here or on the workers of an executor, and reports progress."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from concurrent.futures import Executor
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np

from ..arrays import Floats, Ints
from ..batch import joined, take, take_each
from ..checks import require_method
from ..kernels.platform.search_records import Starts
from ..telling import OnProgress
from .verdicts import MapQuestion

POSES_A_BLOCK = 1 << 14
"""Poses of a block: enough to be worth sending to another process."""

SLOWER = 64
"""Factor by which a pose takes longer without closed forms, at least; blocks are smaller by that factor."""

Result = TypeVar("Result")
"""What a method of a question gives for a block."""

LOOKS = 4
"""Approximate number of points that locate the crossings of the border in each of its cells."""


class Measure:
    """Measures the points of a question, and reports progress.

    Attributes
    ----------
    total : estimate of the number of points in all.
    """

    def __init__(self, question: MapQuestion, executor: Executor | None, on_progress: OnProgress | None) -> None:
        self.question = question
        self.total = 0
        self._done = 0
        if executor is not None:
            require_method("executor", executor, "submit", "an executor of concurrent.futures, or None")
        self._executor, self._on_progress = executor, on_progress
        self._sent = b"" if executor is None else pickle.dumps(question)
        slower = 1 if question.has_margins else SLOWER
        self._points_a_block = max(1, POSES_A_BLOCK // (slower * len(question.turns)))

    def __call__(
        self, points: Floats, known: Starts | None = None, *, anew: bool = False
    ) -> tuple[Floats, Ints, Starts]:
        """Margins and bindings of points (n, d), and configurations at or nearest to them, as of `MapQuestion.look`."""
        known = self.question.first_start if known is None else known
        blocks = [(points[block], take_each(known, block), anew) for block in self._blocks(len(points))]
        parts = self._measured(MapQuestion.look, blocks)
        if not parts:
            return np.zeros(0), np.zeros(0, np.int64), take(known, slice(0))
        margins, bindings, ends = zip(*parts, strict=True)
        return np.concatenate(margins), np.concatenate(bindings), joined(ends)

    def name_limits(self, points: Floats, known: Starts) -> Ints:
        """The limits that points (n, d) just beyond the border exceed, as of `MapQuestion.name_limits`."""
        blocks = [(points[block], take_each(known, block)) for block in self._blocks(len(points))]
        return np.concatenate([np.zeros(0, np.int64), *self._measured(MapQuestion.name_limits, blocks, counts=False)])

    def expect(self, cells: int, width: int, d: int) -> None:
        """Update the estimate of the total, given the number and width of the cells at the border."""
        ahead, points = 0, cells * 2**d
        while width > 1:
            ahead, points, width = ahead + points, points * 2 ** (d - 1), width // 2
        self.total = self._done + ahead + LOOKS * points // 2**d

    def _blocks(self, n: int) -> list[slice]:
        """Slices of n points, each of as many as are worth sending to another process."""
        return [slice(i, i + self._points_a_block) for i in range(0, n, self._points_a_block)]

    def _measured(self, method: Callable[..., Result], blocks: list[Any], *, counts: bool = True) -> list[Result]:
        """What a method of the question gives for blocks: points, and what else it takes; counted if they are new."""
        if self._executor is None:
            return [self._counted(method(self.question, *block), counts * len(block[0])) for block in blocks]
        return self._elsewhere(self._executor, method, blocks, counts)

    def _elsewhere(
        self, executor: Executor, method: Callable[..., Result], blocks: list[Any], counts: bool
    ) -> list[Result]:
        """Measure blocks on an executor's workers; on a failure or interruption, drop those that have not begun."""
        futures = [executor.submit(measure_block, self._sent, method, *block) for block in blocks]
        try:
            return [
                self._counted(future.result(), counts * len(block[0]))
                for future, block in zip(futures, blocks, strict=True)
            ]
        finally:
            for future in futures:
                future.cancel()

    def _counted(self, measured: Result, n: int) -> Result:
        self._report(n)
        return measured

    def _report(self, n: int) -> None:
        """Report that n more points are known."""
        self._done += n
        if self._on_progress is not None:
            self._on_progress(self._done, max(self._done, self.total))


def measure_block(sent: bytes, method: Callable[..., Result], *block: Any) -> Result:
    """Measure a block on a worker; the question, which many blocks share, is unpacked once."""
    return method(_question(sent), *block)


@lru_cache(maxsize=4)
def _question(sent: bytes) -> MapQuestion:
    question: MapQuestion = pickle.loads(sent)
    return question
