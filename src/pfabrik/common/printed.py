"""What a result prints: lines and a table, as text for terminals and files, and as HTML for notebooks."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from ..tolerances import TOLERANCES


@dataclass(frozen=True)
class ResultTable:
    """Lines of text, a table, further tables, and remarks. As text it is neither cut nor coloured.

    Attributes
    ----------
    title : str
        A name, which notebooks show.
    lines, remarks : sequence of str
        Text above the tables, and below them.
    header : sequence of str
        Names of the columns.
    rows : sequence of sequence of str
        Cells of the table.
    drawing : str
        HTML beside it in notebooks.
    more : sequence of ResultTable
        Tables below it, each with its own lines and remarks.
    """

    title: str
    lines: Sequence[str] = ()
    header: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    remarks: Sequence[str] = ()
    drawing: str = ""
    more: Sequence[ResultTable] = ()

    def __str__(self) -> str:
        table = aligned(self.header, self.rows) if self.rows else ""
        return "\n\n".join(filter(None, ["\n".join(self.lines), table, *map(str, self.more), *self.remarks]))

    def _repr_html_(self) -> str:
        """Words and tables beside the drawing."""
        text = f"<div><b>{escape(self.title)}</b>{self._words_and_tables()}</div>"
        return f'<div style="display:flex;gap:1em;align-items:flex-start">{text}{self.drawing}</div>'

    def _words_and_tables(self) -> str:
        head, body = _html_row(self.header, "th"), "".join(map(_html_row, self.rows))
        table = f"<table><thead>{head}</thead><tbody>{body}</tbody></table>" if self.rows else ""
        more = "".join(each._words_and_tables() for each in self.more)
        remarks = [line for remark in self.remarks for line in remark.splitlines()]
        return _html_lines(self.lines) + table + more + _html_lines(remarks)


class Printed:
    """A result that prints its table."""

    def table(self) -> ResultTable:
        """The table to print."""
        raise NotImplementedError

    def to_dict(self) -> dict[str, Any]:
        """Its fields as plain numbers, lists and texts, ready for JSON."""
        from .arrays import as_plain  # NumPy, which a text of help does without

        plain: dict[str, Any] = as_plain(self)
        return plain

    def __str__(self) -> str:
        return str(self.table())

    def _repr_html_(self) -> str:
        return self.table()._repr_html_()


def _html_lines(lines: Iterable[str]) -> str:
    return "".join(f"<div>{escape(line)}</div>" for line in lines)


def _html_row(cells: Sequence[str], tag: str = "td") -> str:
    return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"


def aligned(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """The rows under their header, columns two spaces apart; columns of numbers are aligned to the right."""
    body = [tuple(map(str, row)) for row in rows]
    columns = list(zip(header, *body, strict=True))
    padded = [pad(column) for column in columns]
    return "\n".join("  ".join(cells).rstrip() for cells in zip(*padded, strict=True))


def pad(column: Sequence[str]) -> list[str]:
    """All cells of a column (its header first) at one width."""
    width = max(map(len, column))
    numeric = len(column) > 1 and all(starts_like_a_number(cell) for cell in column[1:])
    return [cell.rjust(width) if numeric else cell.ljust(width) for cell in column]


def starts_like_a_number(cell: str) -> bool:
    """True if a cell is a number, perhaps with a unit; ``-`` stands for a missing one."""
    head = cell.split(" ")[0]
    try:
        float(head)
    except ValueError:
        return head in ("", "-")
    return True


def plain(value: float, smallest: float, form: str = ".6g") -> str:
    """A number with six digits, or as `form` says; 0 if its magnitude is not above `smallest`, "-" if it is NaN."""
    if math.isnan(value):
        return "-"
    return "0" if abs(value) <= smallest else format(value, form)


def triple(values: Iterable[float], least: float) -> str:
    """A direction or a point: ``(0, 0, 1)``; numbers up to `least` are 0."""
    return f"({', '.join(plain(value, least, '.4g') for value in values)})"


def spanned(values: Iterable[float], form: str = ".6g") -> str:
    """One number, or the least and the greatest of several; "-" where none is known."""
    known = [value for value in values if not math.isnan(value)]
    if not known:
        return "-"
    low, high = (format(end, form) for end in (min(known), max(known)))
    return low if low == high else f"{low} to {high}"


def error_text(value: float, form: str, scale: float = 1.0) -> str:
    """An error as a number, or ``< 1e-12`` where it is rounding, whose digits differ between processors.

    Parameters
    ----------
    scale : size of what is computed, in the unit of `value`: rounding leaves a share of it.
    """
    least = 10.0 ** math.ceil(math.log10(max(TOLERANCES.implied * scale, sys.float_info.min)) - 1e-9)
    return f"< {least:g}" if abs(value) < least else format(value, form)
