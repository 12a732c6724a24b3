"""Rows of measured times, and how they are shown."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np


class Row(NamedTuple):
    """One line of the table; times in seconds a pose (or in all)."""

    what: str
    poses: int
    seconds: float
    baseline: str = ""
    baseline_seconds: float = float("nan")


def shown(seconds: float) -> str:
    """A time in the unit that suits it."""
    units = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"))
    size, unit = next((each for each in units if seconds >= each[0]), units[-1])
    return f"{seconds / size:.3g} {unit}"


def cells(row: Row) -> list[str]:
    rate = f"{1.0 / row.seconds:,.0f}" if row.poses > 1 else ""
    ratio = f"{row.seconds / row.baseline_seconds:.2f}" if row.baseline else ""
    baseline = f"{row.baseline}: {shown(row.baseline_seconds)}" if row.baseline else ""
    return [row.what, f"{row.poses:,}", shown(row.seconds), rate, baseline, ratio]


HEADER = ["what", "poses", "time a pose", "poses/s", "baseline", "ratio"]


def table(rows: list[list[str]], markdown: bool) -> Iterator[str]:
    """The rows under their header, as a Markdown table or aligned."""
    if markdown:
        rows = [HEADER, ["---"] * len(HEADER), *rows]
        yield from ("| " + " | ".join(row) + " |" for row in rows)
        return
    rows = [HEADER, *rows]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    yield from ("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows)


def machine() -> str:
    """What this ran on, and how busy that was with other work."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    versions = f"Python {platform.python_version()}, NumPy {np.__version__}"
    cores, load = len(os.sched_getaffinity(0)), os.getloadavg()[0]
    return f"{names[0] if names else platform.processor()}, {cores} cores; {versions}; load at the start {load:.1f}"
