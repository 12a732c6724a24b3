"""The two streams: answers on stdout, in lines that fit or as one JSON object; notes and complaints on stderr."""

from __future__ import annotations

import functools
import json
import os
import re
import shutil
import sys
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Protocol

import click

from ..common.printed import ResultTable
from .options import Decorator

LEAST = 20
"""Least width of a last column that goes on below itself; a narrower one goes on at the margin [characters]."""

INDENT = 4
"""Of what goes on at the margin [characters]."""


class Result(Protocol):
    """A result that prints itself, as text and as JSON."""

    def to_dict(self) -> dict[str, Any]: ...
    def table(self) -> ResultTable: ...


def json_option(help: str = "One JSON object on stdout; angles in radians.") -> Decorator:
    """The option ``--json``, which a command gets as `as_json`."""
    return click.option("--json", "as_json", is_flag=True, help=help)


def print_answer(
    as_json: bool, to_object: Callable[[], object], to_text: Callable[[], str], *, to_stderr: bool = False
) -> None:
    """Print an answer as JSON on stdout, or as text on stdout or stderr; only the form that is printed is made."""
    if as_json:
        print_json(to_object())
    else:
        print_text(to_text(), to_stderr=to_stderr)


def print_result(
    as_json: bool, result: Result, others: Mapping[str, Result] | None = None, *, to_stderr: bool = False
) -> None:
    """Print what a result says of itself, and others after it: as JSON, in its object by their names."""
    print_answer(
        as_json,
        lambda: result.to_dict() | {name: other.to_dict() for name, other in (others or {}).items()},
        lambda: "\n\n".join(str(each.table()) for each in (result, *(others or {}).values())),
        to_stderr=to_stderr,
    )


def printing_result(command: Callable[..., Result]) -> Callable[..., Any]:
    """Adds ``--json`` to a command whose result is printed; exit code 1 if it is no success, or has a `reason`."""

    @json_option()
    @functools.wraps(command)
    def with_printing(*, as_json: bool, **parameters: Any) -> int:
        result = command(**parameters)
        print_result(as_json, result)
        return int(not result or bool(getattr(result, "reason", "")))

    return with_printing


def print_text(text: str, *, to_stderr: bool = False) -> None:
    """Print text for people in lines that fit the terminal."""
    click.echo(fitted(text, line_width()), err=to_stderr)


def print_json(answer: object) -> None:
    """Print one JSON object on stdout."""
    click.echo(json.dumps(answer, allow_nan=False))


def note(remark: str) -> None:
    """Print a note on stderr."""
    complain(f"note: {remark}")


def complain(message: str) -> None:
    """Print each line of a message on stderr, marked as ours."""
    for line in message.splitlines() or ["failed without a message"]:
        click.echo(f"pfabrik: {line}", err=True)


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
    """The place of a table's last column, read from its header; None if the lines are not a table."""
    start = _last_of(lines[0])
    is_table = len(lines) > 1 and start and all(not line[start - 2 : start].strip() for line in lines)
    return start if is_table else None


def _last_of(line: str) -> int:
    """The place of the last part of a line, parts being two spaces apart; 0 if there is one part."""
    gaps = list(re.finditer(r"\S( {2,})(?=\S)", line))
    return gaps[-1].end(1) if gaps else 0
