"""C text in a given precision and with a given prefix; templates are in double, with the prefix pfk."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Literal

import numpy as np

from .machine_data import Number

Precision = Literal["double", "float"]

_MATHS = re.compile(r"\b(sqrt|fabs|sin|cos|atan2|floor)\(")
_LITERAL = re.compile(r"(?<![\w.])(\d+\.\d*(?:[eE][+-]?\d+)?|\d+[eE][+-]?\d+)(?![\w.])")
_COMMENT = re.compile(r"(/\*.*?\*/|\"(?:[^\"\\]|\\.)*\")", re.DOTALL)


def in_words(text: str, name: str, precision: Precision) -> str:
    """A template with its prefix pfk replaced, and its numbers and mathematics in the given precision."""
    text = re.sub(r"\bpfk_", f"{name}_", re.sub(r"\bPFK_", f"{name.upper()}_", text))
    if precision == "double":
        return text
    parts = _COMMENT.split(text.replace("typedef double", "typedef float"))
    parts[::2] = [_LITERAL.sub(_single, _MATHS.sub(r"\1f(", part)) for part in parts[::2]]
    return "".join(parts)


def _single(match: re.Match[str]) -> str:
    """A number in single precision; zero if it is too small for that, which compilers warn of."""
    return f"{match[1]}f" if abs(float(match[1])) >= SMALLEST or not float(match[1]) else "0.0f"


SMALLEST = float(np.finfo(np.float32).tiny)


def literal(value: Number) -> str:
    """A number, or nested braces of numbers, with every digit of a double."""
    if np.ndim(value):
        return "{" + ", ".join(literal(item) for item in np.asarray(value)) + "}"
    number = float(value) + 0.0  # so that no -0.0 is written
    text = repr(number)
    return text if "." in text or "e" in text else f"{text}.0"


def comment(text: str) -> str:
    """Text safe in a C comment: it does not end the comment, and is printable ASCII."""
    plain = text.encode("ascii", "replace").decode().replace("*/", "* /").replace("/*", "/ *").replace("??", "? ?")
    return "".join(character if character.isprintable() else " " for character in plain)


def quoted(text: str) -> str:
    """A C string literal."""
    return '"' + comment(text).replace("\\", "\\\\").replace('"', '\\"') + '"'


def table(declaration: str, rows: Iterable[str]) -> Iterator[str]:
    """A table of rows, with one of zeros where there are none."""
    yield f"static const {declaration} = {{"
    yield ",\n".join(rows) or "    {0}"
    yield "};"
    yield ""


def words(name: str, texts: Sequence[str]) -> Iterator[str]:
    """Texts in rows of one width: pointers would have to be relocated when the file is loaded."""
    quotes = [quoted(text) for text in texts] or ['""']
    yield f"static const char pfk_{name}_words[][{max(map(len, quotes)) - 1}] = {{"
    yield from (f"    {text}," for text in quotes)
    yield "};"
    yield ""
