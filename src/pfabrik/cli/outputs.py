"""Places that commands write to: none is that of a file that was read, nor of another output."""

from __future__ import annotations

import os
import sys
import unicodedata
from collections.abc import Iterable, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any, TextIO

import click

STANDARD = Path("-")
"""Standard input or output, in place of a file."""


def standard_if_so_named(context: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    """Standard output also by the name that systems have for it."""
    return STANDARD if path == Path("/dev/stdout") else path


OUTPUT: dict[str, Any] = {"type": click.Path(path_type=Path, allow_dash=True), "callback": standard_if_so_named}
"""What an option is that takes a file to write."""


def check_outputs(outputs: Sequence[tuple[str, Path | None]], inputs: Iterable[Path] = ()) -> None:
    """Stop if an output would overwrite a file that was read, or another output; say so where one is a link.

    Parameters
    ----------
    outputs : options, each with its path, or None where it is not given.
    """
    given = [(option, path) for option, path in outputs if path is not None]
    for _, path in given:
        refuse_input(path, inputs)
    for (option, path), (other, its) in combinations(given, 2):
        if is_one_place(path, its):
            both = " and ".join(dict.fromkeys(f"{name} {place}" for name, place in ((option, path), (other, its))))
            raise click.UsageError(f"{both}: found one place for two outputs; expected a place for each")
    for _, path in given:
        if path.is_symlink() and not real(path).is_symlink() and not _is_device(path):
            click.echo(f"pfabrik: note: {path} is a link; {real(path)} is written", err=True)


def _is_device(path: Path) -> bool:
    """Whether it is there, and neither a file nor a folder: a pipe, say."""
    return path.exists() and not path.is_file() and not path.is_dir()


def refuse_existing(path: Path, force: bool) -> None:
    """Stop if an output would replace a file, unless that is wanted."""
    if path.is_dir():
        raise click.ClickException(f"{path}: is a folder; expected the name of a file")
    if path != STANDARD and path.is_file() and not force:
        raise click.ClickException(f"{path}: exists already; --force replaces it")


def refuse_input(path: Path, inputs: Iterable[Path]) -> None:
    """Stop if an output would overwrite a file that was read."""
    if path != STANDARD and any(is_same_file(path, read, sys.stdin) for read in inputs):
        raise click.UsageError(f"{path}: found a file that was read; expected another file")


def is_same_file(path: Path, other: Path, standard: TextIO) -> bool:
    """Whether a path leads to another file, or to the one behind a standard stream where that is ``-``."""
    if other != STANDARD:
        return path.exists() and other.exists() and path.samefile(other)
    try:
        return path.is_file() and os.path.samestat(path.stat(), os.fstat(standard.fileno()))
    except (OSError, ValueError):  # the stream is closed, or no file at all
        return False


def is_one_place(path: Path, other: Path) -> bool:
    """Whether what is written to two paths would be one file, by whatever names or links."""
    if STANDARD in (path, other):
        path, other = (other, path) if path == STANDARD else (path, other)
        return path == STANDARD or is_same_file(path, other, sys.stdout)
    if real(path) == real(other) or is_same_file(path, other, sys.stdout):
        return True
    folder, name = real(path).parent, _folded(path)
    return folder == real(other).parent and name == _folded(other) and ignores_case(folder)


def real(path: Path) -> Path:
    """A path without links, but for those that lead round in circles."""
    return Path(os.path.realpath(path))


def _folded(path: Path) -> str:
    """A name as file systems compare it that ignore case."""
    return unicodedata.normalize("NFC", real(path).name).casefold()


def ignores_case(folder: Path) -> bool:
    """Whether names differ by case alone in a folder, as far as the names of the folders that it is in tell."""
    for each in (folder, *folder.parents):
        other = each.with_name(each.name.swapcase()) if each.name else each
        if other != each:
            return other.exists() and other.samefile(each)
    return False
