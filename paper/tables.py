"""Rows of named values: as CSV files that keep every digit, and as Markdown tables for people."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

Row = Mapping[str, Any]
ROUNDING = "< 1e-09"
"""What is below the tolerance of answers."""


def write_csv(path: Path, rows: Sequence[Row]) -> None:
    """The rows under the names of the first one; floats with all their digits."""
    with path.open("w", newline="", encoding="utf-8") as handle:
        writer = csv.DictWriter(handle, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows({name: _plain(value) for name, value in row.items()} for row in rows)


def _plain(value: Any) -> Any:
    return value.item() if hasattr(value, "item") else value


def markdown(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table; the first column to the left, the others to the right."""
    lines = [header, [":---", *["---:"] * (len(header) - 1)], *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def number(value: float | None, digits: int = 3) -> str:
    """A number with a few digits, none of them of rounding; a dash where there is none."""
    if value is None or value != value:
        return "–"
    return ROUNDING if 0.0 < abs(value) < 1e-9 else f"{value:.{digits}g}"


def tiny(value: float) -> str:
    """A number of which only the size matters."""
    return "0" if not value else ROUNDING if value < 1e-9 else f"{value:.0e}"
