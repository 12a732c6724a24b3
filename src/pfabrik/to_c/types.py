"""Types of the subset: numbers, arrays, records, tuples, NamedTuples of arrays; and how C spells them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from .values import c_name, comment

NOTHING, BOOL, INTEGER, REAL = "nbif"
NUMBERS = (BOOL, INTEGER, REAL)
WIDE = 32
"""Least constant length of the rows of a new table that its type has: loops over its rows are vectors then."""


class Unsupported(Exception):
    """An unsupported construct, with its place in the source."""


class Unreachable(Exception):
    """Code that the facts do not let happen: it has an element of an array that has none."""


@dataclass(frozen=True)
class Record:
    """An element of a structured array, by address."""

    name: str
    dtype: Any = field(compare=False)


@dataclass(frozen=True)
class Array:
    """A view of memory: `data` and the lengths `n`; where it is not contiguous, steps too."""

    element: Any  # INTEGER, REAL or a Record
    ndim: int
    is_contiguous: bool = True
    width: int = 0  # constant length of the rows, if it is known
    shape: tuple[int, ...] | None = None  # of a parameter that is a pointer


@dataclass(frozen=True)
class Tuple:
    """A tuple, by value."""

    items: tuple[Any, ...]

    @property
    def is_uniform(self) -> bool:
        return len(set(self.items)) == 1


@dataclass(frozen=True)
class Struct:
    """A NamedTuple, by address."""

    cls: Any
    items: tuple[Any, ...] = field(hash=False)  # long, and looked up at every call


class StructLayout(NamedTuple):
    """How NamedTuples are structs of C; fields by the names of their class and of themselves."""

    fields: frozenset[tuple[str, str]] | None = None  # that are read: others are left out; all if None
    shapes: Mapping[tuple[str, str], tuple[int, ...]] = {}  # of arrays that have one wherever they are: pointers then
    constant: frozenset[tuple[str, str]] = frozenset()  # NamedTuples that are constant: pointers too
    views: frozenset[tuple[Any, str]] = frozenset()  # parameters that are arrays of several shapes: no pointers


def type_of(value: Any, records: dict[Any, str]) -> Any:
    """Type of a value of Python; `records` has the names of structured types."""
    if isinstance(value, (bool, np.bool_)):
        return BOOL
    if isinstance(value, (int, np.integer)):
        return INTEGER
    if isinstance(value, (float, np.floating)):
        return REAL
    if isinstance(value, np.ndarray):
        return Array(element_of(value.dtype, records), value.ndim)
    if isinstance(value, tuple):
        items = tuple(type_of(item, records) for item in value)
        return Struct(type(value), items) if hasattr(value, "_fields") else Tuple(items)
    raise Unsupported(f"a value of type {type(value).__name__}")


def element_of(dtype: Any, records: dict[Any, str]) -> Any:
    """Type of the elements of an array."""
    dtype = np.dtype(dtype)
    if dtype.names:
        if dtype not in records:
            raise Unsupported(f"a record without a name: {dtype}")
        return Record(records[dtype], dtype)
    if (dtype.kind, dtype.itemsize) not in (("f", 8), ("i", 8)):
        raise Unsupported(f"elements of type {dtype}")
    return dtype.kind


def join(a: Any, b: Any) -> Any:
    """The type that holds values of both; None if there is none."""
    if a is None or b is None or a == b:
        return a if b is None else b
    if a in NUMBERS and b in NUMBERS:
        return max(a, b, key=NUMBERS.index)
    if isinstance(a, Tuple) and isinstance(b, Tuple) and len(a.items) == len(b.items):
        items = tuple(join(x, y) for x, y in zip(a.items, b.items, strict=True))
        return None if None in items else Tuple(items)
    return without_width(a) if without_width(a) == without_width(b) else None


def without_width(t: Any) -> Any:
    """An array type of rows of any length."""
    return Array(t.element, t.ndim, t.is_contiguous) if isinstance(t, Array) else t


class Spelling:
    """The C types of a program, declared as they are needed."""

    def __init__(
        self,
        declare: Any,
        layout: StructLayout,
    ) -> None:
        self.declare = declare  # takes a name and its text
        self.layout = layout
        self.known: dict[Any, str] = {}
        self.taken: set[str] = set()

    def variable(self, t: Any) -> str:
        """The C type of a variable, with a space where a name may follow."""
        if isinstance(t, str):
            return {NOTHING: "void ", BOOL: "bool ", INTEGER: "integer ", REAL: "real "}[t]
        if isinstance(t, Array) and t.shape is not None:
            return self.pointer(t)
        name = self.value(t)
        return f"{name} *" if isinstance(t, Record) else f"const {name} *" if isinstance(t, Struct) else f"{name} "

    def stored(self, t: Any) -> str:
        """The C type of a field or of a result."""
        return self.variable(t) if isinstance(t, (str, Record)) else f"{self.value(t)} "

    def value(self, t: Any) -> str:
        """The name of a type's values."""
        if isinstance(t, str):
            return self.variable(t).strip()
        if t not in self.known:
            self.known[t] = self._define(t)
        return self.known[t]

    def members(self, cls: Any) -> list[str]:
        """The fields of a NamedTuple that its struct has."""
        read = self.layout.fields
        return [each for each in cls._fields if read is None or (cls.__name__, each) in read]

    def pointer(self, t: Array) -> str:
        """The C type of a pointer to an array of known shape, with a space where a name may follow."""
        return f"{self.value(t.element)} *"

    def _member(self, cls: Any, field: str, t: Any) -> str:
        if (cls.__name__, field) in self.layout.constant:
            return self.variable(t)
        return self.pointer(t) if (cls.__name__, field) in self.layout.shapes else self.stored(t)

    def _named(self, wanted: str) -> str:
        name, k = wanted, 2
        while name in self.taken:
            name, k = f"{wanted}_{k}", k + 1
        self.taken.add(name)
        return name

    def _define(self, t: Any) -> str:
        if isinstance(t, Array):
            return self._define_array(t)
        if isinstance(t, Record):
            name, fields = self._named(t.name), []
            for each in t.dtype.names:
                kind, shape = element_of(t.dtype[each].base, {}), t.dtype[each].shape
                fields.append(
                    f"    {self.stored(kind)}{c_name(each)}" + (f"[{int(np.prod(shape))}]" if shape else "") + ";"
                )
            self.declare(name, "typedef struct {\n" + "\n".join(fields) + f"\n}} {name};\n")
        elif isinstance(t, Tuple) and t.is_uniform:
            item = self.stored(t.items[0])
            name = self._named(f"vec{len(t.items)}" if t.items[0] == REAL else f"{item.strip(' *')}_x{len(t.items)}")
            self.declare(name, f"typedef struct {{ {item}at[{len(t.items)}]; }} {name};\n")
        elif isinstance(t, Tuple):
            fields = [f"{self.stored(item)}f{k};" for k, item in enumerate(t.items)]
            shorts = [item if isinstance(item, str) else self.value(item) for item in t.items]
            name = self._named("_".join(["tuple", *shorts]))
            self.declare(name, f"typedef struct {{ {' '.join(fields)} }} {name};\n")
        else:
            items = dict(zip(t.cls._fields, t.items, strict=True))
            fields = [f"    {self._member(t.cls, f, items[f])}{c_name(f)};" for f in self.members(t.cls)]
            fields = fields or ["    char nothing;"]
            name, doc = self._named(t.cls.__name__), t.cls.__doc__ or ""
            described = "" if doc.startswith(f"{t.cls.__name__}(") else comment(doc)
            self.declare(name, f"{described}typedef struct {{\n" + "\n".join(fields) + f"\n}} {name};\n")
        return name

    def _define_array(self, t: Array) -> str:
        item, n = self.value(t.element), t.ndim
        base = f"{item}s" if isinstance(t.element, Record) else {REAL: "Floats", INTEGER: "Ints"}[t.element]
        base += "" if isinstance(t.element, Record) and n == 1 else str(n)
        name = self._named(base + (f"x{t.width}" if t.width else "" if t.is_contiguous else "Strided"))
        steps = "" if t.is_contiguous else f" integer step[{n}];"
        self.declare(name, f"typedef struct {{ {item} *data; integer n[{n}];{steps} }} {name};\n")
        lengths, given = [f"a.n[{k}]" for k in range(n)], [f"n{k}" for k in range(n)]
        size = " * ".join([*(f"(size_t){k}" for k in given), f"sizeof({item})"])
        takes = ", ".join(f"integer {k}" for k in given)
        for how in ("zeros", "empty"):
            self.declare(
                f"{how}_{name}",
                f"static inline {name} {how}_{name}(arena *memory, {takes}) {{\n"
                f"    {name} made = {{take(memory, {size}, {int(how == 'zeros')}), {{{', '.join(given)}}}}};\n"
                "    return made;\n}\n",
            )
        if not t.is_contiguous:
            return name
        inner = " * ".join(lengths[1:]) or "1"
        if n > 1:
            row = self.value(Array(t.element, n - 1))
            self.declare(
                f"row_{name}",
                f"static inline {row} row_{name}({name} a, integer i) {{\n"
                f"    {row} made = {{a.data + IN(i, a.n[0]) * {t.width or inner}, {{{', '.join(lengths[1:])}}}}};\n"
                "    return made;\n}\n",
            )
        rest = "".join(f", {k}" for k in lengths[1:])
        self.declare(
            f"part_{name}",
            f"static inline {name} part_{name}({name} a, integer from, integer to) {{\n"
            "    integer first = place(from, a.n[0]), end = place(to, a.n[0]);\n"
            f"    {name} made = {{a.data + first * {inner}, {{end > first ? end - first : 0{rest}}}}};\n"
            "    return made;\n}\n",
        )
        self.declare(
            f"rest_{name}",
            f"static inline {name} rest_{name}({name} a, integer from) {{ return part_{name}(a, from, a.n[0]); }}\n",
        )
        strided = self.value(Array(t.element, n, is_contiguous=False))
        steps = ", ".join(" * ".join(lengths[k + 1 :]) or "1" for k in range(n))
        self.declare(
            f"strided_{name}",
            f"static inline {strided} strided_{name}({name} a) {{\n"
            f"    {strided} made = {{a.data, {{{', '.join(lengths)}}}, {{{steps}}}}};\n"
            "    return made;\n}\n",
        )
        return name
