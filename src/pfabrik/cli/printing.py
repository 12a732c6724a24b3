"""The two streams: answers on stdout, as text or as one JSON object; notes and complaints on stderr."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any, Protocol

import click

from ..printed import ResultTable
from .fitted import fitted, line_width


class Result(Protocol):
    """A result that prints itself, as text and as JSON."""

    def to_dict(self) -> dict[str, Any]: ...
    def table(self) -> ResultTable: ...


def json_option(help: str = "One JSON object on stdout; angles in radians.") -> Callable[..., Any]:
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


def print_result(as_json: bool, result: Result, *, to_stderr: bool = False, **others: Result) -> None:
    """Print what a result says of itself, and others after it: as JSON, in its object by their names."""
    print_answer(
        as_json,
        lambda: result.to_dict() | {name: other.to_dict() for name, other in others.items()},
        lambda: "\n\n".join(str(each.table()) for each in (result, *others.values())),
        to_stderr=to_stderr,
    )


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
