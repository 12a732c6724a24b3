"""Text that fits the terminal: long rows of tables go on below their last column, sentences below themselves."""

from __future__ import annotations

import os
import re
import shutil
import sys
import textwrap
from collections.abc import Iterator, Sequence

LEAST = 20
"""Least width of a last column that goes on below itself; a narrower one goes on at the margin [characters]."""

INDENT = 4
"""Of what goes on at the margin [characters]."""


def line_width() -> int | None:
    """The width of lines on standard output: `COLUMNS`, or the terminal's; None for pipes and files without it."""
    columns = os.environ.get("COLUMNS", "")
    if columns.isdecimal() and int(columns):
        return int(columns)
    return shutil.get_terminal_size().columns if sys.stdout.isatty() else None


def fitted(text: str, width: int | None) -> str:
    """The text in lines of at most `width` characters, as far as its words allow; as it is with None."""
    if width is None or all(len(line) <= width for line in text.split("\n")):
        return text
    blocks = text.split("\n\n")
    return "\n\n".join("\n".join(_fitted_lines(block.split("\n"), width)) for block in blocks)


def _fitted_lines(lines: Sequence[str], width: int) -> Iterator[str]:
    start = _last_column(lines)
    for line in lines:
        if len(line) <= width:
            yield line
            continue
        own = _last_of(line) if start is None else start
        if 0 < own <= width - LEAST:
            yield from _wrapped(line[own:], width, line[:own], " " * own)
        elif own:
            yield from _wrapped(line[:own].rstrip(), width, "", " " * INDENT)
            yield from _wrapped(line[own:], width, " " * INDENT, " " * INDENT)
        else:
            yield from _wrapped(line, width, "", " " * INDENT)


def _wrapped(text: str, width: int, first: str, others: str) -> list[str]:
    return textwrap.wrap(
        text, width, initial_indent=first, subsequent_indent=others, break_long_words=False, break_on_hyphens=False
    ) or [first.rstrip()]


def _last_column(lines: Sequence[str]) -> int | None:
    """Where the last column of a table begins, which its header says; None if lines are no table."""
    start = _last_of(lines[0])
    is_table = len(lines) > 1 and start and all(not line[start - 2 : start].strip() for line in lines)
    return start if is_table else None


def _last_of(line: str) -> int:
    """Where the last part of a line begins, of those two spaces apart; 0 if there is one alone."""
    gaps = list(re.finditer(r"\S( {2,})(?=\S)", line))
    return gaps[-1].end(1) if gaps else 0
