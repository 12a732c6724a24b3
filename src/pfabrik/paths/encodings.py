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
"""How files begin that tell their encoding."""

LATIN = "pfabrik.latin"


def _as_latin(error: UnicodeError) -> tuple[str, int]:
    """Bytes that are no UTF-8, as the letters of western Europe that they are in older files."""
    if not isinstance(error, UnicodeDecodeError):
        raise error
    return error.object[error.start : error.end].decode("cp1252", "replace"), error.end


codecs.register_error(LATIN, _as_latin)


def as_text(raw: BufferedReader) -> TextIOWrapper:
    """The text of a file: as the mark that it begins with says, else UTF-8, and Latin-1 where it is none."""
    begin = raw.peek(4)
    encoding = next((name for mark, name in MARKS if begin.startswith(mark)), "utf-8")
    return TextIOWrapper(raw, encoding, LATIN if encoding.startswith("utf-8") else "strict", newline="")
