"""Output that appears whole or not at all."""

from __future__ import annotations

import errno
import os
import shutil
import sys
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TextIO

from ..whole_files import whole_path
from .outputs import STANDARD, real, refuse_input


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
    path = real(path)
    if path.exists() and not path.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(path))
    with new_folder(path) as part:
        yield part
        path.mkdir(exist_ok=True)
        for item in sorted(part.iterdir()):
            item.replace(path / item.name)
