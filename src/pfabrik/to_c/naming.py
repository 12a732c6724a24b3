"""Names, comments and numbers in C."""

from __future__ import annotations

import math
import re

_KEYWORDS = (
    "auto break case char const continue default do double else enum extern float for goto if inline int long register "
    "restrict return short signed sizeof static struct switch typedef union unsigned void volatile while bool true "
    "false integer real arena memory take place near far huge small y0 y1 yn j0 j1 jn gamma round floor sqrt sin cos "
    "tan atan2 acos asin atan hypot fabs log exp pow fmin fmax fma remainder signbit isnan isfinite index div abs "
    "catch class delete explicit export friend mutable namespace new operator private protected public template this "
    "throw try typename using virtual"
)
RESERVED = frozenset(_KEYWORDS.split())

LEAST, MOST = 1e-30, 3e38
"""Numbers in single precision: their squares neither vanish nor overflow where those in double precision do not."""


def c_name(name: str) -> str:
    """A name of Python in C."""
    return f"{name}_" if name in RESERVED else name


def comment(text: str, indent: str = "") -> str:
    """A comment of C, with its end of line; nothing for no text."""
    text = re.sub(r"/\*|\*/", "|", text.strip())
    lines = [f"{indent}   {line.strip()}".rstrip() for line in text.split("\n")]
    return f"{indent}/* {chr(10).join(lines).lstrip()} */\n" if text else ""


def number(value: float, is_single: bool) -> str:
    """A number as a constant of C; in single precision it neither vanishes nor overflows."""
    value = float(value)
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return "INFINITY" if value > 0.0 else "-INFINITY"
    if not is_single:
        return repr(value)
    if value != 0.0:
        value = math.copysign(min(max(abs(value), LEAST), MOST), value)
    return f"{value!r}f"


def is_simple(text: str) -> bool:
    """True if C text is a path of names: it may be repeated."""
    return re.fullmatch(r"[A-Za-z_][\w.]*(->[\w.]+)*", text) is not None
