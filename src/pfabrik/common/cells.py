"""Cells of CSV files: numbers as people write them, and text that no spreadsheet takes for a formula."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable
from typing import Any, TextIO

NUMBER = re.compile(r"\s*[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?\s*")
"""A decimal number; Python would also read 1_0, digits of other scripts and names of infinities."""

FORMULA = re.compile(r"'*\s*[=+\-@＝＋－＠].")
"""The beginning of text that spreadsheets take for a formula, also behind marks."""

MARK = "'"
"""The character at which spreadsheets recognise text."""


def is_finite(text: str) -> bool:
    """True if a text is a finite number."""
    return NUMBER.fullmatch(text) is not None and math.isfinite(float(text))


def marked(text: str) -> str:
    """Text for a cell: with a mark in front where a spreadsheet would take it for a formula; numbers stay."""
    return text if text[:1].isalnum() or not _is_formula(text) else f"{MARK}{text}"


def unmarked(cell: str) -> str:
    """The text of a cell that `marked` made."""
    return cell[1:] if cell.startswith(MARK) and _is_formula(cell) else cell


def _is_formula(text: str) -> bool:
    if FORMULA.match(text) is None:
        return False
    plain = text.lstrip(MARK)
    return not (is_finite(plain) or is_finite(plain.replace(",", ".")))


class CsvWriter:
    """Writes rows to an open file, with text marked."""

    def __init__(self, handle: TextIO) -> None:
        self._writer = csv.writer(handle, lineterminator="\n")

    def writerow(self, cells: Iterable[Any]) -> None:
        """One row of text and numbers."""
        self._writer.writerow([marked(cell) if isinstance(cell, str) else cell for cell in cells])

    def writerows(self, rows: Iterable[Iterable[Any]]) -> None:
        """Many of them."""
        for row in rows:
            self.writerow(row)
