"""The text of path files, in the encodings that spreadsheets and controllers write."""

from __future__ import annotations

import codecs
from io import BufferedReader, TextIOWrapper

MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),  # before that of UTF-16, which it begins with
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
"""Byte order marks at the beginning of files, each with its encoding."""

LATIN = "pfabrik.latin"


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
