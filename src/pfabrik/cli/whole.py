"""Output that appears whole or not at all."""

from __future__ import annotations

import errno
import os
import shutil
import sys
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, TextIO

import click

from ..writing import whole_path

STANDARD = Path("-")
"""Standard input or output, in place of a file."""


def standard_if_so_named(context: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    """Standard output also by the name that systems have for it."""
    return STANDARD if path == Path("/dev/stdout") else path


OUTPUT: dict[str, Any] = {"type": click.Path(path_type=Path, allow_dash=True), "callback": standard_if_so_named}
"""What an option is that takes a file to write."""


@contextmanager
def whole_file(path: Path, inputs: Iterable[Path] = ()) -> Iterator[TextIO]:
    """A text file for writing that takes the name `path` only when the block ends without an error.

    It is opened at once, so an unwritable place is found before the work begins. A device or pipe, and standard output
    for ``-``, is written directly.

    Parameters
    ----------
    inputs : files that were read, by any name or link, ``-`` for standard input: none of them is ever overwritten.
    """
    if path == STANDARD:
        yield sys.stdout
        sys.stdout.flush()  # so that what it does not take is told
        return
    refuse_input(path, inputs)
    if path.exists() and not path.is_file():
        with path.open("w", newline="", encoding="utf-8") as direct:
            yield direct
        return
    with whole_path(path) as part, part.open("x", newline="", encoding="utf-8") as handle:
        yield handle


def refuse_existing(path: Path, force: bool) -> None:
    """Stop if an output would replace a file, unless that is wanted."""
    if path.is_dir():
        raise click.ClickException(f"{path}: is a folder; expected the name of a file")
    if path != STANDARD and path.is_file() and not force:
        raise click.ClickException(f"{path}: exists already; --force replaces it")


def refuse_input(path: Path, inputs: Iterable[Path]) -> None:
    """Stop if an output would overwrite a file that was read."""
    if any(is_same_file(path, read) for read in inputs):
        raise click.UsageError(f"{path}: found a file that was read; expected another file")


def is_same_file(path: Path, read: Path) -> bool:
    """Whether a path leads to the file that was read, or that standard input (``-``) comes from."""
    if read != STANDARD:
        return path.exists() and read.exists() and path.samefile(read)
    try:
        return path.is_file() and os.path.samestat(path.stat(), os.fstat(sys.stdin.fileno()))
    except (OSError, ValueError):  # standard input is closed, or no file at all
        return False


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """An empty folder beside `path` that goes when the block ends; a failure speaks of `path`, which the user knows."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    with ExitStack() as removals:
        for _ in range(2):  # an interruption may come while it is removed
            removals.callback(shutil.rmtree, part, ignore_errors=True)
        try:
            part.mkdir(parents=True)
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(path)) from error
        yield part


@contextmanager
def whole_folder(path: Path) -> Iterator[Path]:
    """A folder to fill; its files move into `path` only when the block ends without an error."""
    path = path.resolve()
    if path.exists() and not path.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(path))
    with new_folder(path) as part:
        yield part
        path.mkdir(exist_ok=True)
        for item in sorted(part.iterdir()):
            item.replace(path / item.name)
