"""Measures many points in blocks, here or on the workers of an executor, and reports progress."""

from __future__ import annotations

import pickle
from concurrent.futures import Executor
from functools import lru_cache

import numpy as np

from ..arrays import Floats, Ints
from ..telling import OnProgress
from .verdicts import MapQuestion

POSES_A_BLOCK = 1 << 14
"""Poses of a block: enough to be worth sending to another process."""

SLOWER = 64
"""Factor by which a pose takes longer without closed forms, at least; blocks are smaller by that factor."""

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
        self._executor, self._on_progress = executor, on_progress
        self._explorer = question.explorer()
        self._sent = b"" if executor is None or self._explorer is not None else pickle.dumps(question)
        slower = 1 if question.has_margins else SLOWER
        self._points_a_block = max(1, POSES_A_BLOCK // (slower * len(question.turns)))

    def __call__(self, points: Floats) -> tuple[Floats, Ints]:
        """Margins and bindings of points (n, d), as of `MapQuestion.measure`."""
        if self._explorer is not None:
            return self.question.explored(points, self._explorer, self._report)
        blocks = [points[i : i + self._points_a_block] for i in range(0, len(points), self._points_a_block)]
        if self._executor is None:
            measured = [self._counted(self.question.measure(block), len(block)) for block in blocks]
        else:
            measured = self._elsewhere(self._executor, blocks)
        margins, bindings = [np.zeros(0)], [np.zeros(0, np.int64)]
        for margin, binding in measured:
            margins.append(margin)
            bindings.append(binding)
        return np.concatenate(margins), np.concatenate(bindings)

    def expect(self, cells: int, width: int, d: int) -> None:
        """Update the estimate of the total, given the number and width of the cells at the border."""
        ahead, points = 0, cells * 2**d
        while width > 1:
            ahead, points, width = ahead + points, points * 2 ** (d - 1), width // 2
        self.total = self._done + ahead + LOOKS * points // 2**d

    def _elsewhere(self, executor: Executor, blocks: list[Floats]) -> list[tuple[Floats, Ints]]:
        """Measure blocks on an executor's workers; on a failure or interruption, drop those that have not begun."""
        futures = [executor.submit(measure_block, self._sent, block) for block in blocks]
        try:
            return [self._counted(future.result(), len(block)) for future, block in zip(futures, blocks, strict=True)]
        finally:
            for future in futures:
                future.cancel()

    def name_limits(self, points: Floats) -> Ints:
        """The limits that points (n, d) just beyond the border exceed, as of `MapQuestion.name_limits`."""
        return self.question.name_limits(points, self._explorer)

    def _counted(self, measured: tuple[Floats, Ints], n: int) -> tuple[Floats, Ints]:
        self._report(n)
        return measured

    def _report(self, n: int) -> None:
        """Report that n more points are known."""
        self._done += n
        if self._on_progress is not None:
            self._on_progress(self._done, max(self._done, self.total))


def measure_block(sent: bytes, points: Floats) -> tuple[Floats, Ints]:
    """Measure a block on a worker; the question, which many blocks share, is unpacked once."""
    return _question(sent).measure(points)


@lru_cache(maxsize=4)
def _question(sent: bytes) -> MapQuestion:
    question: MapQuestion = pickle.loads(sent)
    return question
