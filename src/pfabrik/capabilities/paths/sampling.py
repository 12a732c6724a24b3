"""Paths with times, and with steps in between, a block at a time."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np

from ...common.arrays import Floats
from ...common.rotations import angles_and_sines
from ...common.text_lines import WrongText
from .path import BLOCK, MOST_STEPS, Path, joined

LEAST_TURN = 1e-6
"""Rotations below this angle are rounding [deg]."""


def timed(blocks: Iterable[Path], sample_time: float | None, rapid: float | None) -> Iterator[Path]:
    """Blocks with times: evenly spaced, as given, or from feeds; NaN from the first step on that has no feed.

    Parameters
    ----------
    sample_time : from each step to the next [s].
    rapid : feed of rapid moves [length/s].
    """
    count, since, before = 0, 0.0, None
    for block in blocks:
        steps = len(block.lines)
        if sample_time is not None:
            block = block._replace(times=sample_time * np.arange(count, count + steps, dtype=np.float64))
        elif block.times is None:
            targets = np.concatenate([block.targets[:1] if before is None else before, block.targets])
            dwells = 0.0 if block.dwells is None else block.dwells
            times = since + np.cumsum(_durations(targets, block.feeds, rapid) + dwells)
            since = float(times[-1])
            block = block._replace(times=times)
        count, before = count + steps, block.targets[-1:]
        yield block


def _durations(targets: Floats, feeds: Floats, rapid: float | None) -> Floats:
    """Durations (n,) [s] of the steps between consecutive targets (n + 1, 4, 4)."""
    feeds = feeds if rapid is None else np.where(np.isinf(feeds), rapid, feeds)
    moved = np.linalg.norm(np.diff(targets[:, :3, 3], axis=0), axis=1)
    turned = np.degrees(angles_and_sines(np.swapaxes(targets[:-1, :3, :3], 1, 2) @ targets[1:, :3, :3])[0])
    far = np.where(moved > 0.0, moved, np.where(turned > LEAST_TURN, turned, 0.0))
    return np.where(far == 0.0, 0.0, np.where(np.isfinite(feeds), far / feeds, math.nan))


def divided(blocks: Iterable[Path], longest: float) -> Iterator[Path]:
    """Blocks with every step divided into parts that are no longer than `longest` [length]."""
    for block, is_first in _with_step_before(blocks):
        far = np.linalg.norm(np.diff(block.targets[:, :3, 3], axis=0), axis=1)
        parts = np.maximum(np.ceil(far / longest * (1.0 - 1e-12)), 1.0)
        if parts.sum() > MOST_STEPS:
            raise WrongText(f"line {block.lines[int(parts.argmax()) + 1]}: too many steps; expected longer ones")
        ends = np.cumsum(parts).astype(np.int64)
        if is_first:
            yield block.at(np.zeros(1, np.int64), np.zeros(1))
        total = int(ends[-1]) if len(ends) else 0
        for start in range(0, total, BLOCK):
            sub = np.arange(start, min(start + BLOCK, total))
            place = np.searchsorted(ends, sub, side="right")
            yield block.at(place + 1, (sub + 1 - (ends - parts)[place]) / parts[place])


def at_rate(blocks: Iterable[Path], rate: float) -> Iterator[Path]:
    """Blocks at even times from the first step on, and at the very last step."""
    begin, count, last = 0.0, 0, None
    for block, is_first in _with_step_before(blocks):
        times = block.times
        if times is None or not np.isfinite(times).all():
            place = 0 if times is None else int(np.flatnonzero(~np.isfinite(times))[0])
            fault = "a step without a time; expected a column t or feed, or feeds and a speed of rapid moves"
            raise WrongText(f"line {block.lines[place]}: {fault}")
        begin = float(times[0]) if is_first else begin
        passed = (float(times[-1]) - begin) * rate * (1.0 + 1e-12)
        if passed >= count + MOST_STEPS:  # it may be infinite
            raise WrongText(f"line {block.lines[-1]}: more than {MOST_STEPS} samples; expected a lower rate")
        total = math.floor(passed) + 1
        for start in range(count, total, BLOCK):
            sampled = np.minimum(begin + np.arange(start, min(start + BLOCK, total)) / rate, times[-1])
            ends = np.clip(np.searchsorted(times, sampled, side="left"), 0, len(times) - 1)
            before = np.maximum(ends - 1, 0)
            steps = times[ends] - times[before]
            shares = np.divide(sampled - times[before], steps, out=np.ones(len(sampled)), where=steps > 0.0)
            yield block.at(ends, shares)
        count = max(total, count)
        last = block.after(len(block.lines) - 1)
    if last is not None and last.times is not None and last.times[-1] > begin + (count - 0.999) / rate:
        yield last


def _with_step_before(blocks: Iterable[Path]) -> Iterator[tuple[Path, bool]]:
    """Blocks, each with the last step of the block before it in front, and a flag that is True for the first block."""
    last: Path | None = None
    for block in blocks:
        yield (block, True) if last is None else (joined([last, block]), False)
        last = block.after(len(block.lines) - 1)
