"""Expressions of kernels in C, with their types."""

from __future__ import annotations

import ast
import builtins
import math
import operator
from collections.abc import Sequence
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from .flow import Flow
from .naming import c_name, is_simple
from .types import (
    BOOL,
    INTEGER,
    NUMBERS,
    REAL,
    WIDE,
    Array,
    Record,
    Struct,
    Tuple,
    Unsupported,
    element_of,
    join,
)
from .values import (
    AND,
    BIT_AND,
    BIT_OR,
    BIT_XOR,
    CONDITION,
    EQUAL,
    NONE,
    OR,
    ORDER,
    POSTFIX,
    PRODUCT,
    SHIFT,
    SUM,
    UNARY,
    UNKNOWN,
    Value,
    conflict,
    effects,
)

if TYPE_CHECKING:
    from .program import Program

OPERATORS: dict[type[ast.operator], tuple[str, int, Any]] = {
    ast.Add: ("+", SUM, operator.add),
    ast.Sub: ("-", SUM, operator.sub),
    ast.Mult: ("*", PRODUCT, operator.mul),
    ast.Div: ("/", PRODUCT, operator.truediv),
    ast.FloorDiv: ("div_i", POSTFIX, operator.floordiv),
    ast.Mod: ("mod_i", POSTFIX, operator.mod),
    ast.Pow: ("power_i", POSTFIX, operator.pow),
    ast.LShift: ("<<", SHIFT, operator.lshift),
    ast.RShift: (">>", SHIFT, operator.rshift),
    ast.BitAnd: ("&", BIT_AND, operator.and_),
    ast.BitOr: ("|", BIT_OR, operator.or_),
    ast.BitXor: ("^", BIT_XOR, operator.xor),
}
COMPARISONS: dict[type[ast.cmpop], tuple[str, Any]] = {
    ast.Eq: ("==", operator.eq),
    ast.NotEq: ("!=", operator.ne),
    ast.Lt: ("<", operator.lt),
    ast.LtE: ("<=", operator.le),
    ast.Gt: (">", operator.gt),
    ast.GtE: (">=", operator.ge),
}
BITS = (ast.LShift, ast.RShift, ast.BitAnd, ast.BitOr, ast.BitXor)
MATH = frozenset(
    ["sqrt", "sin", "cos", "tan", "atan2", "acos", "asin", "atan", "hypot", "fabs", "copysign", "exp", "log"]
)
ANNOTATED = {"float": REAL, "int": INTEGER, "bool": BOOL}


class Expressions:
    """Translates the expressions of one function; what must be computed before one goes into `lines`."""

    program: Program
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
        self._spilled: frozenset[str] = NONE  # what lines that were put before an expression write

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
        self._spilled |= value.writes
        if value.is_held:
            return Value(f"&{name}", value.type, UNARY)
        return Value(name, value.type, is_lasting=value.is_lasting, possible=value.possible)

    def evaluate(self, nodes: Sequence[ast.expr], wants: Sequence[Any] = ()) -> list[Value]:
        """Values of several expressions, in Python's order: C evaluates the parts of an expression in any."""
        before, self._spilled = self._spilled, NONE
        values: list[Value] = []
        for k, node in enumerate(nodes):
            at, self._spilled = len(self.lines), NONE
            value = self.expression(node, wants[k] if wants else None)
            if self._spilled and any((v.reads | v.writes) & self._spilled for v in values):
                for j, earlier in enumerate(values):
                    if earlier.has_effect:
                        values[j] = self.keep(earlier, at)
                        at += 1
            before |= self._spilled
            values.append(value)
        self._spilled = NONE
        if conflict(values):
            last = max(k for k, v in enumerate(values) if v.writes)
            for k, v in enumerate(values[: last + 1]):
                if v.has_effect:
                    values[k] = self.keep(v)
        self._spilled |= before
        return values

    def expression(self, node: ast.expr, want: Any = None) -> Value:
        """An expression; `want` is the type that its place has, if that is known."""
        method = getattr(self, f"on_{type(node).__name__}", None)
        if method is None:
            raise self.fault(node, f"{type(node).__name__} is not in the subset")
        value: Value = method(node, want)
        return value

    def perhaps(self, node: ast.expr, want: Any = None, *, is_truth: bool = False) -> Value:
        """An expression that may not be evaluated: nothing can be computed before it."""
        n = len(self.lines)
        value = self.truth(node) if is_truth else self.expression(node, want)
        if len(self.lines) > n:
            raise self.fault(node, "must be computed before an expression in which it may not be evaluated")
        return value

    def truth(self, node: ast.expr) -> Value:
        """An expression as a condition."""
        if isinstance(node, ast.BoolOp):
            return self.on_BoolOp(node, None, is_truth=True)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            return self.negated(self.truth(node.operand))
        return self.cast(self.expression(node), BOOL, node)

    # ---- types ----

    def cast(self, v: Value, t: Any, node: ast.AST) -> Value:
        """A value as one of another type, where Python takes it for one."""
        if t is None or v.type is None or v.type == t:
            return v
        more = effects([v])
        if v.type in NUMBERS and t in NUMBERS:
            if t == REAL and v.is_constant and v.type == INTEGER and v.text.lstrip("-").isdigit():
                return Value(self.program.number(v.constant), REAL, v.level, float(v.constant))
            constant = {REAL: float, INTEGER: int, BOOL: bool}[t](v.constant) if v.is_constant else UNKNOWN
            if t == BOOL:
                return Value(f"{v.at(EQUAL + 1)} != 0", BOOL, EQUAL, constant, **more)
            kind = self.program.spell.variable(t).strip()
            return Value(f"({kind}){v.at(UNARY)}", t, UNARY, constant, **more)
        if isinstance(v.type, Array) and isinstance(t, Array) and join(v.type, t) is not None:
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
            t = self.program.type_of(value)
            return Value(self.program.literal(value, t), t, constant=value)
        raise self.fault(node, "a constant that is no number")

    def on_Name(self, node: ast.Name, want: Any) -> Value:
        name = node.id
        if name in self.flow.local:
            t, own = self.types.get(name), c_name(name)
            if name in self.by_value:
                return Value(f"&{own}", t, UNARY)
            return Value(own, t, is_lasting=True)
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
            text, more = f"{self.path_of(owner)}{c_name(node.attr)}", effects([owner])
            if isinstance(t, Struct):
                return Value(f"&{text}", t, UNARY, is_lasting=owner.is_lasting, **more)
            return Value(text, t, possible=self.fact(owner.type.cls.__name__, node.attr), **more)
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

    # ---- operators ----

    def on_Tuple(self, node: ast.Tuple, want: Any) -> Value:
        n = len(node.elts)
        wants = want.items if isinstance(want, Tuple) and len(want.items) == n else [None] * n
        items = self.evaluate(node.elts, wants)
        items = [self.cast(v, w, node) if is_number(v, w) else v for v, w in zip(items, wants, strict=True)]
        if any(v.type is None for v in items):
            return Value("0", None, **effects(items))
        return self.tuple_of(items, Tuple(tuple(v.type for v in items)))

    def negated(self, v: Value) -> Value:
        if v.is_constant:
            return self.boolean(not v.constant)
        return Value(f"!{v.at(UNARY)}", BOOL, UNARY, reads=v.reads, writes=v.writes)

    def boolean(self, value: bool) -> Value:
        return Value("true" if value else "false", BOOL, constant=value)

    def on_UnaryOp(self, node: ast.UnaryOp, want: Any) -> Value:
        if isinstance(node.op, ast.Not):
            return self.truth(node)
        v = self.expression(node.operand, want)
        if v.type is None:
            return v
        if v.type not in (INTEGER, REAL) or (isinstance(node.op, ast.Invert) and v.type != INTEGER):
            raise self.fault(node, "an operator of what is no number")
        sign = {ast.USub: "-", ast.UAdd: "", ast.Invert: "~"}[type(node.op)]
        text = v.at(UNARY)
        constant = UNKNOWN if not v.is_constant or sign == "~" else -v.constant if sign else v.constant
        inner = f"({text})" if sign and text.startswith(sign) else text
        return Value(f"{sign}{inner}", v.type, UNARY, constant, v.reads, v.writes)

    def on_BoolOp(self, node: ast.BoolOp, want: Any, *, is_truth: bool = False) -> Value:
        first = self.truth(node.values[0]) if is_truth else self.expression(node.values[0])
        values, absorbing = [first], isinstance(node.op, ast.Or)
        for each in node.values[1:]:
            if values[-1].is_constant and bool(values[-1].constant) is absorbing:
                break
            values.append(self.perhaps(each, is_truth=is_truth))
        if any(v.type not in (BOOL, None) for v in values):
            raise self.fault(node, "`and` or `or` of what is not a truth value")
        if values[-1].is_constant and bool(values[-1].constant) is absorbing and not any(v.writes for v in values):
            return self.boolean(absorbing)
        values = [v for v in values if not v.is_constant] or values[:1]
        if len(values) == 1:
            return values[0]
        sign, level = ("||", OR) if absorbing else ("&&", AND)
        least = EQUAL if absorbing else level  # compilers ask for parentheses around && within ||
        return Value(f" {sign} ".join(v.at(least) for v in values), BOOL, level, **effects(values))

    def on_Compare(self, node: ast.Compare, want: Any) -> Value:
        if isinstance(node.ops[0], (ast.In, ast.NotIn)):
            return self.member(node)
        values = self.evaluate([node.left, *node.comparators])
        values[1:-1] = [self.keep(v) if v.writes else v for v in values[1:-1]]  # they are compared twice
        parts = [self.compared(values[k], op, values[k + 1], node) for k, op in enumerate(node.ops)]
        if all(p.is_constant for p in parts):
            return self.boolean(all(p.constant for p in parts))
        if len(parts) == 1:
            return parts[0]
        return Value(" && ".join(p.at(AND) for p in parts), BOOL, AND, **effects(parts))

    def member(self, node: ast.Compare) -> Value:
        """Whether a value is one of a tuple's."""
        is_in, among = isinstance(node.ops[0], ast.In), node.comparators[0]
        if len(node.ops) > 1 or not isinstance(among, ast.Tuple):
            raise self.fault(node, "`in` of what is not a tuple")
        left, *others = self.evaluate([node.left, *among.elts])
        left = left if is_simple(left.text) else self.keep(left)
        op = ast.Eq() if is_in else ast.NotEq()
        parts = [self.compared(left, op, v, node) for v in others]
        sign, level = ("||", OR) if is_in else ("&&", AND)
        return Value(f" {sign} ".join(p.at(EQUAL) for p in parts), BOOL, level, **effects(parts))

    def compared(self, a: Value, op: ast.cmpop, b: Value, node: ast.AST) -> Value:
        more = effects([a, b])
        if a.type is None or b.type is None:
            return Value("false", BOOL, **more)
        if type(op) not in COMPARISONS:
            raise self.fault(node, "a comparison that is not in the subset")
        sign, compare = COMPARISONS[type(op)]
        if isinstance(a.type, Tuple) and a.type == b.type and sign in ("==", "!="):
            a, b = (v if is_simple(v.text) else self.keep(v) for v in (a, b))
            pairs = [f"{self.item(a, k).text} {sign} {self.item(b, k).text}" for k in range(len(a.type.items))]
            return Value((" && " if sign == "==" else " || ").join(pairs), BOOL, AND if sign == "==" else OR, **more)
        if a.type not in NUMBERS or b.type not in NUMBERS:
            raise self.fault(node, "a comparison of what is no number")
        sides = [v.possible or (frozenset({v.constant}) if v.is_constant else None) for v in (a, b)]
        if sides[0] and sides[1] and not more["writes"]:
            outcomes = {bool(compare(x, y)) for x in sides[0] for y in sides[1]}
            if len(outcomes) == 1:
                return self.boolean(outcomes.pop())
        if a.type != b.type:
            t = join(a.type, b.type)
            a, b = self.cast(a, t, node), self.cast(b, t, node)
        level = EQUAL if sign in ("==", "!=") else ORDER
        return Value(f"{a.at(SHIFT)} {sign} {b.at(SHIFT)}", BOOL, level, **more)

    def on_IfExp(self, node: ast.IfExp, want: Any) -> Value:
        test = self.truth(node.test)
        if test.is_constant and not test.writes:
            return self.expression(node.body if test.constant else node.orelse, want)
        a, b = self.perhaps(node.body, want), self.perhaps(node.orelse, want)
        t = join(a.type, b.type)
        if t is None and a.type is not None and b.type is not None:
            raise self.fault(node, "a choice of values of different types")
        a, b = self.as_view(self.cast(a, t, node)), self.as_view(self.cast(b, t, node))
        if isinstance(t, Struct) and (a.is_held or b.is_held):
            text = f"{test.at(EQUAL)} ? {self.stored(a)} : {self.stored(b)}"
            return Value(text, t, CONDITION, is_held=True, **effects([test, a, b]))
        text = f"{test.at(EQUAL)} ? {a.at(CONDITION + 1)} : {b.at(CONDITION)}"
        return Value(text, t, CONDITION, is_lasting=a.is_lasting and b.is_lasting, **effects([test, a, b]))

    def on_BinOp(self, node: ast.BinOp, want: Any) -> Value:
        a, b = self.evaluate([node.left, node.right])
        return self.operated(a, node.op, b, node)

    def operated(self, a: Value, op: ast.operator, b: Value, node: ast.AST) -> Value:
        """An operation with two numbers."""
        more = effects([a, b])
        if a.type is None or b.type is None:
            return Value("0", None, **more)
        if a.type not in NUMBERS or b.type not in NUMBERS:
            raise self.fault(node, "arithmetic with what is no number")
        if type(op) not in OPERATORS:
            raise self.fault(node, "an operator that is not in the subset")
        sign, level, operate = OPERATORS[type(op)]
        t = join(a.type, b.type)
        if isinstance(op, BITS):
            if t == REAL:
                raise self.fault(node, "bits of a number that is no integer")
            if t == BOOL and isinstance(op, (ast.LShift, ast.RShift)):
                t = INTEGER
        elif t == BOOL:
            raise self.fault(node, "arithmetic with two truth values")
        if isinstance(op, ast.Div):
            t = REAL
        if isinstance(op, ast.Pow) and t == REAL:
            return self.power(a, b, node)
        if isinstance(op, (ast.FloorDiv, ast.Mod)) and t == REAL:
            raise self.fault(node, "// or % of a number that is no integer")
        a, b = self.cast(a, t, node), self.cast(b, t, node)
        constant = UNKNOWN
        if a.is_constant and b.is_constant and t == INTEGER and not isinstance(op, ast.Pow):
            constant = int(operate(a.constant, b.constant))
        if (
            isinstance(op, (ast.FloorDiv, ast.Mod))
            and self.is_never_negative(node)
            and b.is_constant
            and b.constant > 0
        ):
            sign, level = ("/" if isinstance(op, ast.FloorDiv) else "%"), PRODUCT
        if level == POSTFIX:
            return Value(f"{sign}({a.text}, {b.text})", t, POSTFIX, constant, **more)
        if isinstance(op, BITS):  # compilers ask for parentheses in them
            a_text, b_text = a.at(UNARY), b.at(UNARY)
            if isinstance(op, ast.LShift) and a.is_constant:
                a_text = f"(integer){a_text}"
        else:
            a_text, b_text = a.at(level), b.at(level + 1)
        return Value(f"{a_text} {sign} {b_text}", t, level, constant, **more)

    def power(self, a: Value, b: Value, node: ast.AST) -> Value:
        more = effects([a, b])
        if a.type == REAL and b.is_constant and b.constant in (2, 3) and b.type == INTEGER:
            return Value(f"{'square_of' if b.constant == 2 else 'cube_of'}({a.text})", REAL, **more)
        a, b = self.cast(a, REAL, node), self.cast(b, REAL, node)
        return Value(f"pow{self.program.suffix}({a.text}, {b.text})", REAL, **more)

    def is_never_negative(self, node: ast.AST) -> bool:
        """Whether what is divided counts a loop from a constant on."""
        left = node.left if isinstance(node, ast.BinOp) else node
        return isinstance(left, ast.Name) and left.id in self.flow.counters and self.counts_up(left.id)

    def counts_up(self, name: str) -> bool:
        raise NotImplementedError

    # ---- subscripts ----

    def on_Subscript(self, node: ast.Subscript, want: Any) -> Value:
        groups: list[ast.expr] = []
        base: ast.expr = node
        while isinstance(base, ast.Subscript):
            groups.insert(0, base.slice)
            base = base.value
        v = self.expression(base)
        pending: list[Value] = []
        for group in groups:
            indices = list(group.elts) if isinstance(group, ast.Tuple) else [group]
            if v.type is None:
                return Value("0", None)
            if isinstance(v.type, Array):
                if len(pending) + len(indices) > v.type.ndim:
                    raise self.fault(node, "too many indices")
                if any(isinstance(i, ast.Slice) for i in indices):
                    v, pending = self.sliced(self.rows(v, pending), indices, node), []
                else:
                    pending = [*pending, *self.places(v, indices, len(pending), node)]
                    if len(pending) == v.type.ndim:
                        v, pending = self.element(v, pending), []
            elif isinstance(v.type, Record):
                v = self.field(v, group, node)
            elif isinstance(v.type, Tuple):
                v = self.chosen(v, group, node)
            else:
                raise self.fault(node, "an index of what has none")
        return self.rows(v, pending)

    def places(self, v: Value, indices: list[ast.expr], first: int, node: ast.AST) -> list[Value]:
        """Indices as integers; a negative constant counts from the end."""
        found = []
        for k, place in enumerate(self.evaluate(indices)):
            if place.type == BOOL:
                place = self.cast(place, INTEGER, node)
            if place.type not in (INTEGER, None):
                raise self.fault(node, "an index that is no integer")
            if place.is_constant and place.constant < 0:
                place = Value(f"{self.length(v, first + k).text} - {-place.constant}", INTEGER, SUM)
            found.append(place)
        if conflict([v, *found]):
            raise self.fault(node, "an index that changes what it is an index of")
        return found

    def element(self, v: Value, indices: list[Value]) -> Value:
        """An element of an array: a number, or a record by its address."""
        t, more = v.type, effects([v, *indices])
        if v.inner:
            path, shape = v.inner
            text = indices[0].text
            if len(shape) > 1:
                text = f"{indices[0].at(PRODUCT)} * {shape[1]} + {indices[1].at(SUM)}"
            return self.read(f"{path}[{text}]", t.element, more)
        text = v.text if is_simple(v.text) else self.keep(v).text
        places = ", ".join(i.at(SUM) for i in indices)
        if t.width:
            return self.read(f"WIDE2({text}, {t.width}, {places})", t.element, more)
        macro = f"{'AT' if t.is_contiguous else 'STRIDED'}{t.ndim}({text}, {places})"
        if isinstance(t.element, Record):
            self.program.spell.value(t.element)
            return Value(f"&{macro}", t.element, UNARY, **more)
        return self.read(macro, t.element, more)

    def read(self, text: str, kind: str, more: dict[str, frozenset[str]], owner: str = "") -> Value:
        """A number in memory."""
        self.reads |= {owner or kind}
        return Value(text, kind, reads=more["reads"] | {owner or kind}, writes=more["writes"])

    def rows(self, v: Value, indices: list[Value]) -> Value:
        """What the first indices leave of an array."""
        if not indices:
            return v
        more = effects([v, *indices])
        v = self.as_view(v)
        if not v.type.is_contiguous:
            return self.strided(v, indices)
        text, t = v.text, v.type
        for place in indices:
            text, t = f"row_{self.program.spell.value(t)}({text}, {place.text})", Array(t.element, t.ndim - 1)
        return Value(text, t, **more)

    def as_view(self, v: Value) -> Value:
        """An array of a record as any other."""
        if not v.inner:
            return v
        path, shape = v.inner
        lengths = ", ".join(map(str, shape))
        text = f"({self.program.spell.value(v.type)}){{{path}, {{{lengths}}}}}"
        return Value(text, v.type, reads=v.reads, writes=v.writes)

    def sliced(self, v: Value, indices: list[ast.expr], node: ast.AST) -> Value:
        """A part of an array: contiguous if only its rows are fewer, else with steps."""
        v = self.as_view(v)
        if any(isinstance(i, ast.Slice) and i.step is not None for i in indices):
            raise self.fault(node, "a slice with a step")
        *before, part = indices
        slices = [isinstance(i, ast.Slice) for i in before]
        if v.type.is_contiguous and not any(slices) and isinstance(part, ast.Slice):
            v = self.rows(v, self.places(v, before, 0, node))
            if part.lower is None and part.upper is None:
                return v
            first = self.end(part.lower, node) if part.lower is not None else Value("0", INTEGER)
            made = Array(v.type.element, v.type.ndim)
            v = self.cast(v, made, node) if v.type.width else v
            name, end = self.program.spell.value(made), ""
            if part.upper is not None:
                end = f", {self.end(part.upper, node).text}"
            return Value(f"{'part' if end else 'rest'}_{name}({v.text}, {first.text}{end})", made, **effects([v]))
        places: list[Value | ast.Slice] = []
        for k, i in enumerate(indices):
            places.append(i if isinstance(i, ast.Slice) else self.places(v, [i], k, node)[0])
        return self.strided(v, places)

    def end(self, node: ast.expr, whole: ast.AST) -> Value:
        """Where a slice begins or ends."""
        v = self.expression(node)
        if v.type not in (INTEGER, None) or v.writes:
            raise self.fault(whole, "a slice whose ends are no integers")
        return v

    def strided(self, v: Value, indices: Sequence[Value | ast.Slice]) -> Value:
        """A part of an array with any steps."""
        spell = self.program.spell
        if v.type.is_contiguous:
            whole = Array(v.type.element, v.type.ndim)
            loose = Array(whole.element, whole.ndim, is_contiguous=False)
            spell.value(loose)
            if v.type.width:
                v = self.cast(v, whole, ast.Pass())
            v = Value(f"strided_{spell.value(whole)}({v.text})", loose, **effects([v]))
        v = self.keep(v)
        data, lengths, steps = [f"{v.text}.data"], [], []
        for k in range(v.type.ndim):
            index = indices[k] if k < len(indices) else ast.Slice()
            if isinstance(index, Value):
                data.append(f"IN({index.text}, {v.text}.n[{k}]) * {v.text}.step[{k}]")
                continue
            steps.append(f"{v.text}.step[{k}]")
            if index.lower is None and index.upper is None:
                lengths.append(f"{v.text}.n[{k}]")
                continue
            first = f"place({self.end(index.lower, index).text}, {v.text}.n[{k}])" if index.lower is not None else "0"
            end = f"{v.text}.n[{k}]"
            if index.upper is not None:
                end = f"place({self.end(index.upper, index).text}, {end})"
            data.append(f"{first} * {v.text}.step[{k}]")
            lengths.append(f"max_i({end} - {first}, 0)")
        made = Array(v.type.element, len(lengths), is_contiguous=False)
        text = f"({spell.value(made)}){{{' + '.join(data)}, {{{', '.join(lengths)}}}, {{{', '.join(steps)}}}}}"
        return Value(text, made)

    def field(self, owner: Value, key: ast.expr, node: ast.AST) -> Value:
        """A field of a record."""
        if not (isinstance(key, ast.Constant) and isinstance(key.value, str)):
            raise self.fault(node, "a field that has no name")
        kind = owner.type.dtype[key.value]
        t, path = element_of(kind.base, {}), f"{self.path_of(owner)}{c_name(key.value)}"
        more = effects([owner])
        if kind.shape:
            return Value(path, Array(t, len(kind.shape)), inner=(path, kind.shape), **more)
        v = self.read(path, t, more, owner.type.name)
        v.possible = self.fact(owner.type.name, key.value)
        return self.known(v)

    def chosen(self, v: Value, key: ast.expr, node: ast.AST) -> Value:
        """An item of a tuple by its place."""
        index = self.expression(key)
        if index.is_constant:
            n = len(v.type.items)
            if not -n <= index.constant < n:
                raise self.fault(node, "a place that the tuple has not")
            is_one = v.level == POSTFIX and not v.text.startswith("(")  # a call, evaluated once
            v = v if (v.parts and not v.has_effect) or is_one else self.keep(v)
            return self.item(v, index.constant % n)
        if not v.type.is_uniform or index.type != INTEGER:
            raise self.fault(node, "a place in a tuple that is not known")
        v = v if is_simple(v.text) else self.keep(v)
        return Value(f"{v.text}.at[IN({index.text}, {len(v.type.items)})]", v.type.items[0], **effects([v, index]))

    # ---- calls ----

    def on_Call(self, node: ast.Call, want: Any) -> Value:
        from .program import source_of

        if isinstance(node.func, ast.Attribute) and not self.is_global(node.func):
            return self.reshaped(node)
        if not self.is_global(node.func):
            raise self.fault(node, "a call of a variable")
        called = self.global_of(node.func)
        if isinstance(called, type) and hasattr(called, "_fields"):
            return self.constructed(node, called)
        if node.keywords or any(isinstance(a, ast.Starred) for a in node.args):
            raise self.fault(node, "arguments by name, or in a tuple")
        if called is np.zeros or called is np.empty:
            return self.allocated(node, "zeros" if called is np.zeros else "empty")
        values = self.evaluate(node.args)
        if any(v.type is None for v in values):
            return Value("0", None, **effects(values))
        if (sample := opened_by(called)) is not None:
            t = self.program.type_of(sample)
            kind = self.program.spell.variable(t).strip()
            return Value(f"({kind})(intptr_t){values[0].at(UNARY)}", t, UNARY, is_lasting=True)
        if source_of(called) is not None:
            return self.called(called, values, node)
        name = getattr(called, "__name__", "")
        if getattr(math, name, None) is called:
            return self.of_math(name, values, node)
        return self.of_python(called, values, node)

    def called(self, called: Any, values: list[Value], node: ast.Call) -> Value:
        """A call of a part of kernels."""
        from .program import source_of
        from .sources import tree_of

        takes = tree_of(source_of(called).function).args.args
        if len(takes) != len(values):
            raise self.fault(node, "another number of arguments than the function takes")
        given = []
        for v, a in zip(values, takes, strict=True):
            declared = ANNOTATED.get(ast.unparse(a.annotation) if a.annotation else "")
            given.append(self.cast(v, declared, node) if declared and v.type in NUMBERS else self.addressed(v))
        made = self.program.instance(called, tuple(v.type for v in given))
        more = effects(given)
        self.reads |= made.reads
        self.writes |= made.writes
        self.allocates |= made.allocates
        texts = [*(["memory"] if made.allocates else []), *(self.as_view(v).text for v in given)]
        text = f"{made.name}({', '.join(texts)})"
        return Value(
            text,
            made.gives,
            reads=more["reads"] | made.reads,
            writes=more["writes"] | made.writes,
            is_held=isinstance(made.gives, Struct),
        )

    def constructed(self, node: ast.Call, cls: Any) -> Value:
        """A new NamedTuple."""
        nodes = dict(zip(cls._fields, node.args, strict=False)) | {str(k.arg): k.value for k in node.keywords}
        if list(nodes) != list(cls._fields):
            raise self.fault(node, "a NamedTuple without all of its fields in order")
        wants = [ANNOTATED.get(str(hint)) for hint in cls.__annotations__.values()]
        values = self.evaluate([nodes[f] for f in cls._fields])
        if any(v.type is None for v in values):
            return Value("0", None, **effects(values))
        pairs = zip(values, wants, strict=True)
        values = [self.cast(v, w, node) if v.type in NUMBERS else self.as_view(v) for v, w in pairs]
        t = Struct(cls, tuple(v.type for v in values))
        text = f"({self.program.spell.value(t)}){{{', '.join(map(self.stored, values))}}}"
        return Value(text, t, is_held=True, **effects(values))

    def allocated(self, node: ast.Call, how: str) -> Value:
        """New memory of a call."""
        self.allocates = True
        shape = node.args[0]
        if isinstance(shape, ast.Tuple):
            sizes = self.evaluate(shape.elts)
        else:
            v = self.expression(shape)
            if isinstance(v.type, Tuple):
                v = self.keep(v)
                sizes = [self.item(v, k) for k in range(len(v.type.items))]
            else:
                sizes = [v]
        if any(v.type not in (INTEGER, None) for v in sizes):
            raise self.fault(node, "a shape that is no integer")
        element = element_of(self.global_of(node.args[1]), self.program.records) if len(node.args) > 1 else REAL
        last = sizes[-1]
        width = last.constant if len(sizes) == 2 and last.is_constant and last.constant >= WIDE else 0
        t = Array(element, len(sizes), width=width)
        taken = ", ".join(["memory", *(v.text for v in sizes)])
        return Value(f"{how}_{self.program.spell.value(t)}({taken})", t, **effects(sizes))

    def reshaped(self, node: ast.Call) -> Value:
        """An array in another shape."""
        assert isinstance(node.func, ast.Attribute)
        v = self.expression(node.func.value)
        if v.type is None:
            return v
        if node.func.attr != "reshape" or not isinstance(v.type, Array) or not v.type.is_contiguous or node.keywords:
            raise self.fault(node, "a method that is not in the subset")
        v = self.as_view(v)
        v = v if is_simple(v.text) else self.keep(v)
        sizes = self.evaluate(node.args)
        known = " * ".join(s.at(UNARY) for s in sizes if not (s.is_constant and s.constant == -1)) or "1"
        whole = " * ".join(f"{v.text}.n[{k}]" for k in range(v.type.ndim))
        lengths = [f"{whole} / ({known})" if s.is_constant and s.constant == -1 else s.text for s in sizes]
        t = Array(v.type.element, len(sizes))
        return Value(f"({self.program.spell.value(t)}){{{v.text}.data, {{{', '.join(lengths)}}}}}", t)

    def of_math(self, name: str, values: list[Value], node: ast.AST) -> Value:
        """A call of a function of `math`."""
        values = [self.cast(v, REAL, node) for v in values]
        inner, more, suffix = ", ".join(v.text for v in values), effects(values), self.program.suffix
        if name in MATH:
            return Value(f"{name}{suffix}({inner})", REAL, **more)
        if name == "floor":
            return Value(f"(integer)floor{suffix}({inner})", INTEGER, UNARY, **more)
        if name in ("isnan", "isfinite"):
            return Value(f"({name}({inner}) != 0)", BOOL, **more)
        raise self.fault(node, "a function of math that is not in the subset")

    def of_python(self, called: Any, values: list[Value], node: ast.AST) -> Value:
        """A call of a function that Python has itself."""
        v, more, suffix = values[0], effects(values), self.program.suffix
        if called in (min, max):
            if len(values) == 1 and isinstance(v.type, Tuple):
                v = v if is_simple(v.text) else self.keep(v)
                values = [self.item(v, k) for k in range(len(v.type.items))]
            t: Any = None
            for each in values:
                t = join(t, each.type)
            if t not in (INTEGER, REAL):
                raise self.fault(node, "the least or most of what are no numbers")
            first, *others = [self.cast(each, t, node) for each in values]
            text = first.text
            for each in others:
                text = f"{called.__name__}_{t}({text}, {each.text})"
            return Value(text, t, **more)
        if called is len and isinstance(v.type, Array):
            return self.length(v, 0)
        if called is len and isinstance(v.type, Tuple):
            return Value(str(len(v.type.items)), INTEGER, constant=len(v.type.items))
        if v.type not in NUMBERS or len(values) != 1:
            raise self.fault(node, "a call of what is no part of kernels")
        if called is abs and v.type != BOOL:
            return Value(f"{f'fabs{suffix}' if v.type == REAL else 'abs_i'}({v.text})", v.type, **more)
        if called in (int, float, bool):
            return self.cast(v, ANNOTATED[called.__name__], node)
        if called is round:
            return Value(f"(integer)rint{suffix}({v.text})", INTEGER, UNARY, **more)
        raise self.fault(node, "a call of what is no part of kernels")


def is_number(v: Value, t: Any) -> bool:
    """Whether a value can become one of a type of numbers."""
    return v.type in NUMBERS and t in NUMBERS


def opened_by(called: Any) -> Any:
    """The sample of what opens a handle; None for anything else."""
    from ..kernels._jit import OPENERS

    try:
        return OPENERS.get(called)
    except TypeError:  # it has no hash
        return None
