"""The file of C that functions are written for: its types, constants and names, declared as they are needed."""

from __future__ import annotations

import re
import sys
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from ..kernels._jit import SOURCES
from .types import INTEGER, REAL, Array, Spelling, Struct, StructLayout, Unsupported, type_of
from .values import RESERVED, Value, number

PRELUDE = Path(__file__).with_name("prelude.h")
SMALL = 2**31


class File:
    """C text by the names that it declares, for arguments as of `Program`."""

    def __init__(
        self,
        real: str,
        integer: str,
        facts: dict[tuple[str, str], set[int]] | None,
        tolerances: dict[tuple[str, str], float] | None,
        layout: StructLayout,
    ) -> None:
        self.real, self.integer, self.facts, self.tolerances = real, integer, facts or {}, tolerances or {}
        self.suffix = "f" if real == "float" else ""
        self.bits = int(re.sub(r"\D", "", integer))  # that an integer has at least
        self.records = named_records()
        self.items: dict[str, str] = {}  # C text by the name that it declares
        self.layout = layout
        self.given: dict[tuple[Any, str], set[Any]] = {}  # shapes of arrays that functions are given, by parameter
        self.of_other_shapes: set[tuple[str, str]] = set()  # where functions make an array otherwise
        self.spell = Spelling(self._declare, layout)
        self._constants: dict[str, Any] = {}
        prelude = PRELUDE.read_text(encoding="utf-8").replace("REAL", real).replace("INTEGER", integer)
        if self.suffix:
            prelude = re.sub(r"\b(fabs|sqrt)\(", r"\1f(", prelude)
        self.head: list[str] = []
        for chunk in prelude.split("\n\n"):
            name = re.match(r"(?:/\*.*\*/\n)?static inline \w+ (\w+)\(", chunk)
            if name:
                self.items[name[1]] = f"{chunk.rstrip()}\n"
            else:
                self.head.append(f"{chunk.rstrip()}\n")

    def _declare(self, name: str, text: str) -> None:
        self.items[name] = text

    def type_of(self, value: Any) -> Any:
        """Type of a value of Python."""
        return type_of(value, self.records)

    def instance(self, called: Any, arguments: tuple[Any, ...]) -> Any:
        """A function in C for arguments of these types."""
        raise NotImplementedError

    def fits(self, value: Any) -> bool:
        """True if an integer, or every one in a tuple, is one of the C type; True for what is no integer."""
        if isinstance(value, tuple):
            return all(map(self.fits, value))
        return bool(self.type_of(value) != INTEGER or abs(int(value)) < 2 ** (self.bits - 1))

    def number(self, value: float) -> str:
        """A number as a constant of C."""
        return number(value, bool(self.suffix))

    def literal(self, value: Any, t: Any) -> str:
        """A constant of Python in C."""
        if t == REAL:
            return self.number(value)
        if t == INTEGER:
            return str(int(value)) if abs(int(value)) < SMALL else f"INT64_C({int(value)})"
        if isinstance(t, str):
            return "true" if value else "false"
        inner = ", ".join(self.literal(v, item) for v, item in zip(value, t.items, strict=True))
        return f"{{{{{inner}}}}}" if t.is_uniform else f"{{{inner}}}"

    def constant(self, name: str, value: Any, module: str) -> Value:
        """A global of Python as a constant of C with its name."""
        t = self.type_of(value)
        if isinstance(t, (Array, Struct)):
            raise Unsupported(f"a global array: {name}")
        value = self.tolerances.get((module.partition(".")[2], name), value)
        if not self.fits(value):
            raise Unsupported(f"{name} of {module} does not fit in an integer of {self.bits} bits: {value}")
        own, short = name.lstrip("_"), module.rpartition(".")[2].upper()
        plain = [own] if len(own) > 1 else []  # a variable may have a letter as its name
        for wanted in chain(plain, [f"{own}_{short}"], (f"{own}_{short}_{k}" for k in range(2, 99))):
            if wanted not in RESERVED and (wanted not in self.items or same(self._constants.get(wanted), value)):
                break
        if wanted not in self.items:
            self._constants[wanted] = value
            text = self.literal(value, t)
            is_small = t == INTEGER and abs(value) < SMALL
            text = f"{wanted} = {text}"
            text = f"enum {{ {text} }};\n" if is_small else f"static const {self.spell.stored(t)}{text};\n"
            self.items[wanted] = text
        return Value(wanted, t, constant=value)


def same(a: Any, b: Any) -> bool:
    """True if two constants are equal, and of one type."""
    return type(a) is type(b) and bool(a == b)


def named_records() -> dict[Any, str]:
    """Structured types by the names of the globals that hold them; a name that is taken has its module's before it."""
    found: dict[Any, str] = {}
    own = f"{__package__.partition('.')[0]}.kernels."
    names = {name for name in sys.modules if name.startswith(own)} | {s.function.__module__ for s in SOURCES.values()}
    for module in sorted(names):
        for name, value in vars(sys.modules[module]).items():
            if isinstance(value, np.dtype) and value.names and value not in found:
                parts = name.strip("_").split("_")
                if camel(parts) in found.values():
                    parts = [*module.rpartition(".")[2].split("_"), *parts]
                found[value] = camel(parts)
    return found


def camel(parts: list[str]) -> str:
    return "".join(part.capitalize() for part in parts)
