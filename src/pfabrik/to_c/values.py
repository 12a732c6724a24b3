"""Values in C: the text of an expression, with its known properties."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

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
    inner: tuple[str, tuple[int, ...]] | None = None  # an array within a record: where it is, and its shape
    parts: list[Value] | None = None  # items of a tuple that is only written down
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
        "reads": NONE.union(*(v.reads for v in values)),
        "writes": NONE.union(*(v.writes for v in values)),
    }


def conflict(values: list[Value]) -> bool:
    """True if the order of evaluation could matter: one writes what another reads or writes."""
    return any(a.writes & (b.reads | b.writes) for a in values for b in values if a is not b)
