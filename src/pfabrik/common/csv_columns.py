"""CSV as people write it: a header that names columns in any order, then rows; decimal commas, and other separators."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from itertools import chain, islice
from typing import NamedTuple

from ..errors import counted
from .cells import is_finite, unmarked
from .text_lines import WrongText

SEPARATORS = (",", ";", "\t")
SAID = re.compile(r'"?sep=(.)"?', re.IGNORECASE)
"""A first line that gives spreadsheets the separator."""


class CsvRows(NamedTuple):
    """Some rows: the line of each, counted from 1, and the texts of their cells by column."""

    lines: list[int]
    texts: dict[str, tuple[str, ...]]


class CsvColumns:
    """The lines of a table, of which only the header is read at first.

    Parameters
    ----------
    spelled : the name of a column from its cell.
    known : names by which the separator is recognised; without them, by the number of cells.
    columns : the columns that are expected, in words, of a file without any.

    Attributes
    ----------
    header : the names of the columns; line : where they stand.

    Raises
    ------
    WrongText : a file without a header, or with a column twice.
    """

    def __init__(
        self,
        lines: Iterable[str],
        spelled: Callable[[str], str] = unmarked,
        known: Collection[str] = (),
        columns: str = "names of columns",
    ) -> None:
        self._separator, lines = _separated(iter(lines), lambda cell: spelled(cell) in known)
        self._decimal = "." if self._separator == "," else None
        self._rows = (row for row in _numbered(lines, self._separator) if any(row[1]))
        self.line, header = next(self._rows, (1, []))
        if not header:
            raise WrongText(f"empty; expected a header with {columns}")
        self.header = [spelled(name) for name in header]
        twice = [name for name in dict.fromkeys(self.header) if self.header.count(name) > 1]
        if twice:
            raise WrongText(f"line {self.line}: column '{twice[0]}' appears twice; expected every column once")

    def rows(self, most: int) -> Iterator[CsvRows]:
        """The rows below the header, in parts of so many at most; WrongText for one with more or fewer cells."""
        while rows := list(islice(self._rows, most)):
            for number, cells in rows:
                if len(cells) != len(self.header):
                    raise WrongText(f"line {number}: found {counted(len(cells), 'cell')}; expected {len(self.header)}")
            texts = zip(*(cells for _, cells in rows), strict=True)
            yield CsvRows([number for number, _ in rows], dict(zip(self.header, texts, strict=True)))

    def numbers(self, rows: CsvRows, name: str, *, gaps: bool = False) -> Sequence[str]:
        """The cells of a column as numbers with decimal points; WrongText for other text, and for two decimal marks.

        Parameters
        ----------
        gaps : True if cells may be empty or NaN: they are "nan" then.
        """
        return [self._number(text, name, line, gaps) for line, text in zip(rows.lines, rows.texts[name], strict=True)]

    def _number(self, text: str, name: str, line: int, gaps: bool) -> str:
        if gaps and text.lower() in ("", "nan"):
            return "nan"
        number = text if self._separator == "," else text.replace(",", ".")
        if not is_finite(number):
            expected = "a finite number, or nothing" if gaps else "a finite number"
            raise WrongText(f"line {line}: column '{name}': found '{text[:20]}'; expected {expected}")
        mark = "," if "," in text else "." if "." in text else self._decimal
        if self._decimal not in (None, mark):
            fault = f"found '{text[:20]}'; expected decimals with '{self._decimal}', as before"
            raise WrongText(f"line {line}: column '{name}': {fault}")
        self._decimal = mark
        return number


def _separated(lines: Iterator[str], is_known: Callable[[str], bool]) -> tuple[str, Iterator[str]]:
    """The separator of cells, from a first line that gives it or from the column names in the header; and all lines."""
    read: list[str] = []
    for line in lines:
        read.append(line)
        if line.strip():
            break
    stated = SAID.fullmatch(read[-1].strip(" \r\n")) if read else None
    if stated is not None:
        read[-1] = "\n"
        return stated[1], chain(read, lines)

    def names(separator: str) -> tuple[int, int]:
        cells = [cell.strip() for row in csv.reader(read[-1:], delimiter=separator) for cell in row]
        return sum(map(is_known, cells)), len(cells)

    return max(SEPARATORS, key=names), chain(read, lines)


def _numbered(lines: Iterable[str], separator: str) -> Iterator[tuple[int, list[str]]]:
    reader = csv.reader(lines, delimiter=separator)
    try:
        for cells in reader:
            yield reader.line_num, [cell.strip() for cell in cells]
    except csv.Error as error:
        raise WrongText(f"line {reader.line_num}: not a CSV text file: {error}") from error
