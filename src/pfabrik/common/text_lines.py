"""The lines of a text file, in the encodings that spreadsheets and controllers write, and what is refused in them."""

from __future__ import annotations

import codecs
from collections.abc import Iterator
from contextlib import contextmanager
from io import BufferedReader, TextIOWrapper
from typing import TextIO

from ..errors import InvalidArgument

MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),  # before that of UTF-16, which it begins with
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
"""Byte order marks at the beginning of files, each with its encoding."""

LATIN = "pfabrik.latin"

LONGEST_LINE = 100_000
"""Characters of a line at most; a file with a longer one is not text."""


class WrongText(ValueError):
    """A file that is not what is read; its text names line, column and what was found, then what was expected."""


@contextmanager
def refusing(file: str, expected: str) -> Iterator[None]:
    """InvalidArgument, which names the file, for text that is wrong: it expects what the text does, or this."""
    try:
        yield
    except WrongText as error:
        found, _, asked = str(error).partition("; expected ")
        raise InvalidArgument(file, found, asked or expected) from None
    except UnicodeDecodeError:
        raise InvalidArgument(file, "a file that is no text", expected) from None


def _as_latin(error: UnicodeError) -> tuple[str, int]:
    """Decode bytes that are not UTF-8 as the western European letters that they are in older files."""
    if not isinstance(error, UnicodeDecodeError):
        raise error
    return error.object[error.start : error.end].decode("cp1252", "replace"), error.end


codecs.register_error(LATIN, _as_latin)


def as_text(raw: BufferedReader) -> TextIOWrapper:
    """The text of a file in the encoding of its byte order mark; without one, UTF-8, and Latin-1 for invalid bytes."""
    begin = raw.peek(4)
    encoding = next((name for mark, name in MARKS if begin.startswith(mark)), "utf-8")
    return TextIOWrapper(raw, encoding, LATIN if encoding.startswith("utf-8") else "strict", newline="")


def lines_of(handle: TextIO, most: int, what: str) -> Iterator[str]:
    """Lines, up to as many as a file may have, blank ones and comments included, and none of them endless."""
    number = 0
    while line := handle.readline(LONGEST_LINE):
        number += 1
        if len(line) == LONGEST_LINE or "\0" in line:
            raise WrongText(f"line {number}: no text of {what}")
        if number > most:
            raise WrongText(f"more than {most} lines; expected {what} that is shorter, or parts of it")
        yield line
