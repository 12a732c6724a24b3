"""Conditions of C's preprocessor, `#if` and its kin, as far as the names that a file defines decide them."""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Collection, Mapping
from typing import Any

LONGEST = 500
"""Longest condition [characters]; longer ones count as open."""

DEEPEST = 100
"""Deepest nesting, of conditions and of names that stand for names."""

_DIRECTIVE = re.compile(r"[ \t]*#[ \t]*(define|undef|ifdef|ifndef|if|elif|else|endif)\b[ \t]*(.*?)[ \t]*$")
_DEFINED = re.compile(r"(\w+)(?![\w(])[ \t]*(.*)")
_OFF = re.compile(r"^[ \t]*//+[ \t]*#[ \t]*define[ \t]+(\w+)", re.MULTILINE)
_COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)

_ANY, _ALL, _NONE = ("defined", "ENABLED", "ANY", "EITHER"), ("BOTH", "ALL"), ("DISABLED", "NONE", "NEITHER")
"""Words that ask which of some names are on."""

_COMPARED: dict[type, Callable[[float, float], bool]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}


def definitions(text: str) -> tuple[dict[str, str], set[str]]:
    """The names that a text defines in the end, with their values; and those of which it leaves open which value holds.

    A name is off where the text has not defined it, if it is defined further on or in a comment; else another file may
    define it, and branches that depend on it are open.
    """
    lines = _COMMENT.sub(" ", text).replace("\\\n", " ").splitlines()
    found = [match.groups() for line in lines if (match := _DIRECTIVE.match(line))]
    known = {*_OFF.findall(text), *(said.split()[0] for kind, said in found if kind == "define" and said)}
    held: dict[str, str] = {}
    unclear: set[str] = set()
    branches: list[tuple[bool | None, bool | None]] = []  # if the branch holds, and if one of those so far does
    for kind, said in found:
        if kind in ("if", "ifdef", "ifndef"):
            asked = said if kind == "if" else f"{'!' * (kind == 'ifndef')}defined({said})"
            holds = is_true(asked, held, known)
            branches.append((holds, holds))
        elif kind in ("elif", "else") and branches:
            before = branches.pop()[1]
            own = True if kind == "else" else is_true(said, held, known)
            branches.append((_all([_not(before), own]), _any([before, own])))
        elif kind == "endif":
            branches = branches[:-1]
        elif all(holds is not False for holds, _ in branches) and (match := _DEFINED.match(said)):
            _put(kind, match[1], match[2], held, unclear)
    return held, unclear


def _put(kind: str, name: str, value: str, held: dict[str, str], unclear: set[str]) -> None:
    """Obey a `#define` or `#undef`; a name that is defined twice has to say the same."""
    if kind == "undef":
        held.pop(name, None)
    elif held.setdefault(name, value) != value:
        unclear.add(name)


def is_true(condition: str, held: Mapping[str, str], known: Collection[str]) -> bool | None:
    """True or False where the names that are held or known decide a condition; else None.

    Parameters
    ----------
    held : names that are defined -> their values.
    known : names that are off unless they are held.
    """
    words = re.sub(r"\bdefined\s+(\w+)", r"defined(\1)", condition).replace("&&", " and ").replace("||", " or ")
    words = re.sub(r"!(?!=)", " not ", words).strip()
    try:
        value = None if len(condition) > LONGEST else _value(ast.parse(words, mode="eval").body, held, known, 0)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None
    return None if value is None else bool(value)


def _value(node: ast.AST, held: Mapping[str, str], known: Collection[str], depth: int) -> float | None:
    """The value of a node of a parsed condition; None where the names that are known do not tell."""

    def value(inner: ast.AST) -> float | None:
        return _value(inner, held, known, depth + 1)

    if depth > DEEPEST:
        return None
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.BoolOp(op=joined, values=values):
            every = [None if (each := value(inner)) is None else bool(each) for inner in values]
            return _all(every) if isinstance(joined, ast.And) else _any(every)
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            return _not(value(operand))
        case ast.Compare(left=left, ops=[compared], comparators=[right]) if type(compared) in _COMPARED:
            one, other = value(left), value(right)
            return None if one is None or other is None else _COMPARED[type(compared)](one, other)
        case ast.Call(func=ast.Name(id=asked), args=args) if asked in (*_ANY, *_ALL, *_NONE):
            on = [_is_on(each, held, known) for each in args]
            return _all(on) if asked in _ALL else _any(on) if asked in _ANY else _not(_any(on))
        case ast.Name(id=name) if name in held:
            return value(ast.parse(held[name] or "1", mode="eval").body)
        case ast.Name(id="true" | "false" as name):
            return float(name == "true")
    return None


def _is_on(node: Any, held: Mapping[str, str], known: Collection[str]) -> bool | None:
    """True for a name that is defined, unless as 0 or false; None where another file may define it."""
    name = getattr(node, "id", "")
    if name in held:
        return held[name] not in ("0", "false")
    return False if name in known else None


def _all(values: list[Any]) -> bool | None:
    return False if any(each is False for each in values) else None if None in values else True


def _any(values: list[Any]) -> bool | None:
    return True if any(each is True for each in values) else None if None in values else False


def _not(value: Any) -> bool | None:
    return None if value is None else not value
