"""What expressions of kernels are in C: constants, names, attributes, tuples; and the order of evaluation."""

from __future__ import annotations

import ast
import builtins
import math
from collections.abc import Sequence
from types import ModuleType
from typing import Any

from .c_file import File
from .flow import Flow
from .types import BOOL, INTEGER, NUMBERS, REAL, Array, Struct, Tuple, Unsupported, join
from .values import EQUAL, NONE, POSTFIX, SUM, UNARY, UNKNOWN, Value, c_name, conflict, effects, is_simple

ANNOTATED = {"float": REAL, "int": INTEGER, "bool": BOOL}


class Expressions:
    """Translates the expressions of one function; what must be computed before one goes into `lines`."""

    program: File
    flow: Flow
    path: str
    globals: dict[str, Any]
    types: dict[str, Any]  # of variables, by their names in Python
    by_value: set[str]  # NamedTuples that this function keeps itself
    parameters: list[str]

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.indent = 1
        self.n_temporaries = 0
        self.reads: frozenset[str] = NONE
        self.writes: frozenset[str] = NONE
        self.allocates = False
        self.fields: set[tuple[str, str]] = set()  # of NamedTuples, that are read
        self.constants: dict[str, int] = {}  # values of variables that have one alone
        self.shapes: dict[str, tuple[int, ...] | None] = {}  # of variables that are arrays, where they are known
        self._before = Value("", None)  # what lines that were put before an expression read and write

    # ---- lines ----

    def fault(self, node: ast.AST, what: str) -> Unsupported:
        """An error with the place in the source."""
        return Unsupported(f"{self.path}:{getattr(node, 'lineno', 0)}: {what}: {ast.unparse(node)[:80]}")

    def emit(self, text: str) -> None:
        self.lines.append("    " * self.indent + text)

    def keep(self, value: Value, at: int | None = None) -> Value:
        """A value computed before the expression that it is a part of."""
        value = self.as_view(value)
        self.n_temporaries += 1
        name = f"t{self.n_temporaries}"
        spell = self.program.spell
        kind = f"const {spell.value(value.type)} " if value.is_held else spell.variable(value.type)
        place = len(self.lines) if at is None else at
        self.lines.insert(place, "    " * self.indent + f"{kind}{name} = {value.text};")
        self._before = Value("", None, **effects([self._before, value]))
        if value.is_held:
            return Value(f"&{name}", value.type, UNARY)
        return Value(name, value.type, is_lasting=value.is_lasting, possible=value.possible)

    def evaluate(self, nodes: Sequence[ast.expr], wants: Sequence[Any] = ()) -> list[Value]:
        """Values of several expressions, in Python's order: C evaluates the parts of an expression in any."""
        before = self._before
        values: list[Value] = []
        for k, node in enumerate(nodes):
            at, self._before = len(self.lines), Value("", None)
            value = self.expression(node, wants[k] if wants else None)
            if any(conflict([v, self._before]) for v in values):
                for j, earlier in enumerate(values):
                    if earlier.has_effect:
                        values[j] = self.keep(earlier, at)
                        at += 1
            before = Value("", None, **effects([before, self._before]))
            values.append(value)
        self._before = before
        if conflict(values):
            last = max(k for k, v in enumerate(values) if v.writes)
            for k, v in enumerate(values[: last + 1]):
                if v.has_effect:
                    values[k] = self.keep(v)
        return values

    def expression(self, node: ast.expr, want: Any = None) -> Value:
        """An expression; `want` is the type that its place has, if that is known."""
        method = getattr(self, f"on_{type(node).__name__}", None)
        if method is None:
            raise self.fault(node, f"{type(node).__name__} is not in the subset")
        value: Value = method(node, want)
        return value

    # ---- types ----

    def cast(self, v: Value, t: Any, node: ast.AST) -> Value:
        """A value as one of another type, where Python takes it for one."""
        if t is None or v.type is None or v.type == t:
            return v
        more = effects([v])
        if v.type in NUMBERS and t in NUMBERS:
            if t == REAL and v.is_constant and v.type == INTEGER and v.text.lstrip("-").isdigit():
                return Value(self.program.number(v.constant), REAL, v.level, float(v.constant))
            if t == REAL and v.rounded:  # without the sign of zero, which integers have not
                return Value(f"{v.rounded} + {self.program.number(0.0)}", REAL, SUM, **more)
            constant = {REAL: float, INTEGER: int, BOOL: bool}[t](v.constant) if v.is_constant else UNKNOWN
            if t == BOOL:
                return Value(f"{v.at(EQUAL + 1)} != 0", BOOL, EQUAL, constant, **more)
            kind = self.program.spell.variable(t).strip()
            return Value(f"({kind}){v.at(UNARY)}", t, UNARY, constant, **more)
        if isinstance(v.type, Array) and isinstance(t, Array) and join(v.type, t) is not None:
            v = self.as_view(v)
            v = v if is_simple(v.text) else self.keep(v)
            counts = ", ".join(f"{v.text}.n[{k}]" for k in range(t.ndim))
            return Value(f"({self.program.spell.value(t)}){{{v.text}.data, {{{counts}}}}}", t)
        if isinstance(v.type, Tuple) and isinstance(t, Tuple) and len(v.type.items) == len(t.items):
            v = v if is_simple(v.text) else self.keep(v)
            items = [self.cast(self.item(v, k), each, node) for k, each in enumerate(t.items)]
            return self.tuple_of(items, t)
        raise self.fault(node, "a value of another type than its place has")

    def tuple_of(self, items: list[Value], t: Tuple) -> Value:
        """A tuple of values."""
        name, inner = self.program.spell.value(t), ", ".join(self.stored(v) for v in items)
        text = f"({name}){{{{{inner}}}}}" if t.is_uniform else f"({name}){{{inner}}}"
        made = Value(text, t, parts=items, **effects(items))
        if items and all(v.is_constant for v in items):
            made.constant = tuple(v.constant for v in items)
        return made

    def item(self, v: Value, k: int) -> Value:
        """An item of a tuple."""
        if v.parts:
            return v.parts[k]
        t = v.type.items[k]
        text = f"{v.at(POSTFIX)}." + (f"at[{k}]" if v.type.is_uniform else f"f{k}")
        more = effects([v])
        if isinstance(t, Struct):
            return Value(f"&{text}", t, UNARY, **more)
        return Value(text, t, constant=v.constant[k] if v.is_constant else UNKNOWN, **more)

    def stored(self, v: Value) -> str:
        """The text of a value where it is stored: a NamedTuple by itself, not by its address."""
        if not isinstance(v.type, Struct) or v.is_held:
            return self.as_view(v).text
        return v.text[1:] if v.text.startswith("&") else f"*{v.at(UNARY)}"

    def addressed(self, v: Value) -> Value:
        """A value with an address, if it is a NamedTuple."""
        return self.keep(v) if v.is_held else v

    # ---- constants and names ----

    def on_Constant(self, node: ast.Constant, want: Any) -> Value:
        value = node.value
        if isinstance(value, (bool, int, float)):
            return self.fitting(value, node)
        raise self.fault(node, "a constant that is no number")

    def fitting(self, value: Any, node: ast.AST) -> Value:
        """A number that is known; integers that C has no room for are refused."""
        t = self.program.type_of(value)
        if not self.program.fits(value):
            raise self.fault(node, f"more than an integer of {self.program.bits} bits")
        text = self.program.literal(value, t)
        return Value(text, t, UNARY if text.startswith("-") else POSTFIX, value)

    def on_Name(self, node: ast.Name, want: Any) -> Value:
        name = node.id
        if name in self.flow.local:
            t, own = self.types.get(name), c_name(name)
            if name in self.by_value:
                return Value(f"&{own}", t, UNARY)
            shape, constant = self.shapes.get(name), self.constants.get(name, UNKNOWN)
            return Value(own, t, constant=constant, is_lasting=True, inner=None if shape is None else (own, shape))
        return self.program.constant(name, self.global_of(node), self.globals["__name__"])

    def global_of(self, node: ast.expr) -> Any:
        """What a name stands for outside the function."""
        if isinstance(node, ast.Name):
            if node.id in self.globals:
                return self.globals[node.id]
            if hasattr(builtins, node.id):
                return getattr(builtins, node.id)
            raise self.fault(node, "a name that is not known")
        assert isinstance(node, ast.Attribute)
        return getattr(self.global_of(node.value), node.attr)

    def is_global(self, node: ast.expr) -> bool:
        while isinstance(node, ast.Attribute):
            node = node.value
        return isinstance(node, ast.Name) and node.id not in self.flow.local

    def on_Attribute(self, node: ast.Attribute, want: Any) -> Value:
        if self.is_global(node):
            owner, value = self.global_of(node.value), self.global_of(node)
            if owner is math and not math.isfinite(value):
                return Value(self.program.number(value), REAL, constant=value)
            if isinstance(owner, ModuleType):
                return self.program.constant(node.attr.upper() if owner is math else node.attr, value, owner.__name__)
            raise self.fault(node, "an attribute of what is no module")
        owner = self.addressed(self.expression(node.value))
        if owner.type is None:
            return Value("0", None)
        if isinstance(owner.type, Struct) and node.attr in owner.type.cls._fields:
            t = owner.type.items[owner.type.cls._fields.index(node.attr)]
            self.fields.add((owner.type.cls.__name__, node.attr))
            text, more = f"{self.path_of(owner)}{c_name(node.attr)}", effects([owner])
            if (owner.type.cls.__name__, node.attr) in self.program.layout.constant:
                return Value(text, t, is_lasting=True, **more)
            if isinstance(t, Struct):
                return Value(f"&{text}", t, UNARY, is_lasting=owner.is_lasting, **more)
            shape = self.program.layout.shapes.get((owner.type.cls.__name__, node.attr))
            inner = None if shape is None else (text, shape)
            return Value(text, t, possible=self.fact(owner.type.cls.__name__, node.attr), inner=inner, **more)
        if isinstance(owner.type, Array) and node.attr == "shape":
            lengths = [self.length(owner, k) for k in range(owner.type.ndim)]
            return self.tuple_of(lengths, Tuple((INTEGER,) * len(lengths)))
        raise self.fault(node, "an attribute that is not in the subset")

    def fact(self, owner: str, field: str) -> frozenset[int] | None:
        """All values of a field, or lengths of an array, of the tables that the program is for."""
        known = self.program.facts.get((owner, field))
        return None if known is None else frozenset(known)

    def path_of(self, owner: Value) -> str:
        """What a field's name follows."""
        if owner.text.startswith("&"):
            return f"{owner.text[1:]}."
        return f"{owner.at(POSTFIX)}->"

    def known(self, v: Value) -> Value:
        """A value that the facts determine is a constant."""
        if v.possible is not None and len(v.possible) == 1 and v.type == INTEGER:
            (constant,) = v.possible
            return Value(str(constant), INTEGER, POSTFIX if constant >= 0 else UNARY, constant)
        return v

    def length(self, v: Value, k: int) -> Value:
        """The length of an array along a dimension."""
        v = v if is_simple(v.text) or v.inner else self.keep(v)
        if v.inner:
            return Value(str(v.inner[1][k]), INTEGER, constant=v.inner[1][k])
        return self.known(Value(f"{v.text}.n[{k}]", INTEGER, possible=v.possible if k == 0 else None))

    def as_view(self, v: Value) -> Value:
        """An array of known shape, as one of a record is, as any other."""
        if not v.inner:
            return v
        path, shape = v.inner
        lengths = ", ".join(map(str, shape))
        text = f"({self.program.spell.value(v.type)}){{{path}, {{{lengths}}}}}"
        return Value(text, v.type, reads=v.reads, writes=v.writes)
