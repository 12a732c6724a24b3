"""Values in C: the text of an expression, names, comments and numbers, and the source of Python functions."""

from __future__ import annotations

import ast
import math
import re
import tokenize
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any

from ..kernels._jit import OPENERS, SOURCES, Marked

PACKAGE = Path(__file__).parents[1]


@cache
def _functions(path: str) -> dict[tuple[str, int], ast.FunctionDef]:
    tree = ast.parse(Path(path).read_text(encoding="utf-8"))
    found = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    return {(f.name, min([f.lineno, *(d.lineno for d in f.decorator_list)])): f for f in found}


def tree_of(function: FunctionType) -> ast.FunctionDef:
    """The syntax tree of a function."""
    code = function.__code__
    return _functions(code.co_filename)[code.co_name, code.co_firstlineno]


@cache
def comments_of(path: str) -> dict[int, tuple[str, bool]]:
    """Comments of a file by their lines, and whether each has its line alone."""
    with open(path, "rb") as file:
        found = [t for t in tokenize.tokenize(file.readline) if t.type == tokenize.COMMENT]
    return {t.start[0]: (t.string.lstrip("# "), not t.line[: t.start[1]].strip()) for t in found}


def short_path(path: str) -> str:
    """A path from the package's folder on, for comments and messages."""
    where = Path(path)
    return where.relative_to(PACKAGE).as_posix() if PACKAGE in where.parents else where.name


def source_of(called: Any) -> Marked | None:
    """The function of Python that a decorator of kernels was given, with its kind; None for anything else."""
    source: Marked | None = found_in(SOURCES, called)
    return source


def opened_by(called: Any) -> Any:
    """The sample of what opens a handle; None for anything else."""
    return found_in(OPENERS, called)


def found_in(known: dict[Any, Any], called: Any) -> Any:
    try:
        return known.get(called)
    except TypeError:  # it has no hash
        return None


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


COMMA, CONDITION, OR, AND, BIT_OR, BIT_XOR, BIT_AND, EQUAL, ORDER, SHIFT, SUM, PRODUCT, UNARY, POSTFIX = range(14)
"""Precedence of the operators of C, the loosest first."""

NONE: frozenset[str] = frozenset()
UNKNOWN = object()


@dataclass
class Value:
    """An expression of C."""

    text: str
    type: Any  # None while a function's types are not settled
    level: int = POSTFIX
    constant: Any = UNKNOWN
    reads: frozenset[str] = NONE  # kinds of elements in memory that it reads
    writes: frozenset[str] = NONE  # and that functions which it calls write
    possible: frozenset[int] | None = None  # all values that it can have, if the facts say
    inner: tuple[str, tuple[int, ...]] | None = None  # an array of known shape, as of a record: where, and its shape
    parts: list[Value] | None = None  # items of a tuple that is only written down
    rounded: str = ""  # the real number that an integer is of, which may be more than an integer holds
    is_held: bool = False  # a NamedTuple that has no address yet: the text is its value
    is_lasting: bool = False  # a NamedTuple whose address outlives the function

    @property
    def is_constant(self) -> bool:
        return self.constant is not UNKNOWN

    @property
    def has_effect(self) -> bool:
        return bool(self.reads or self.writes)

    def at(self, level: int) -> str:
        """The text, in parentheses where it binds less than a level."""
        return self.text if self.level >= level else f"({self.text})"


def effects(values: list[Value]) -> dict[str, Any]:
    """Reads and writes of several expressions together."""
    return {
        "reads": NONE.union(*[v.reads for v in values if v.reads]),
        "writes": NONE.union(*[v.writes for v in values if v.writes]),
    }


def conflict(values: list[Value]) -> bool:
    """True if the order of evaluation could matter: one writes what another reads or writes."""
    writing = [v for v in values if v.writes]
    return any(a.writes & (b.reads | b.writes) for a in writing for b in values if a is not b)
