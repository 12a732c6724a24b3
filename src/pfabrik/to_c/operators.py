"""Operators of kernels in C: arithmetic, comparisons, truth, choices, tuples."""

from __future__ import annotations

import ast
import operator
from typing import Any

from .c_file import SMALL
from .expressions import Expressions
from .types import BOOL, INTEGER, NUMBERS, REAL, Struct, Tuple, Unreachable, join
from .values import (
    AND,
    BIT_AND,
    BIT_OR,
    BIT_XOR,
    CONDITION,
    EQUAL,
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
    is_simple,
)

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


class Operators(Expressions):
    """Translates operators."""

    def truth(self, node: ast.expr) -> Value:
        """An expression as a condition."""
        if isinstance(node, ast.BoolOp):
            return self.on_BoolOp(node, None, is_truth=True)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            return self.negated(self.truth(node.operand))
        return self.cast(self.expression(node), BOOL, node)

    def perhaps(self, node: ast.expr, want: Any = None, *, is_truth: bool = False) -> Value:
        """An expression that may not be evaluated: nothing can be computed before it."""
        n, noted = len(self.lines), set(self.fields)
        try:
            value = self.truth(node) if is_truth else self.expression(node, want)
        except Unreachable:
            self.fields = noted
            del self.lines[n:]
            raise
        if len(self.lines) > n:
            raise self.fault(node, "must be computed before an expression in which it may not be evaluated")
        return value

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
            try:
                values.append(self.perhaps(each, is_truth=is_truth))
            except Unreachable:  # what is before it settles the whole
                values.append(self.boolean(absorbing))
        if any(v.type not in (BOOL, None) for v in values):
            raise self.fault(node, "`and` or `or` of what is not a truth value")
        if values[-1].is_constant and bool(values[-1].constant) is absorbing and not any(v.writes for v in values):
            return self.boolean(absorbing)
        values = [v for v in values if not v.is_constant or bool(v.constant) is absorbing] or values[:1]
        if len(values) == 1:
            return values[0]
        sign, level = ("||", OR) if absorbing else ("&&", AND)
        least = EQUAL if absorbing else level  # compilers ask for parentheses around && within ||
        return Value(f" {sign} ".join(v.at(least) for v in values), BOOL, level, **effects(values))

    def on_Compare(self, node: ast.Compare, want: Any) -> Value:
        if isinstance(node.ops[0], (ast.In, ast.NotIn)):
            return self.member(node)
        values = self.evaluate([node.left, node.comparators[0]])
        values += [self.perhaps(each) for each in node.comparators[1:]]  # only if what is before it holds
        if any(v.writes for v in values[1:-1]) or (len(values) > 2 and conflict(values[1:])):
            values[1] = self.keep(values[1])
            if conflict(values[2:]):
                raise self.fault(node, "a chain of comparisons whose order matters")
        parts = [self.compared(values[k], op, values[k + 1], node) for k, op in enumerate(node.ops)]
        if all(p.is_constant for p in parts):
            return self.boolean(all(p.constant for p in parts))
        if len(parts) == 1:
            return parts[0]
        return Value(" && ".join(p.at(AND) for p in parts), BOOL, AND, **effects(parts))

    def member(self, node: ast.Compare) -> Value:
        """True if a value is one of a tuple's."""
        is_in, among = isinstance(node.ops[0], ast.In), node.comparators[0]
        if len(node.ops) > 1 or not isinstance(among, ast.Tuple) or not among.elts:
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
        try:
            a = self.perhaps(node.body, want)
        except Unreachable:
            return self.expression(node.orelse, want)
        try:
            b = self.perhaps(node.orelse, want)
        except Unreachable:
            return a
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
        if isinstance(op, ast.Pow) and b.is_constant and b.constant < 0:
            raise self.fault(node, "a negative power of an integer")
        a, b = self.cast(a, t, node), self.cast(b, t, node)
        constant = UNKNOWN
        if a.is_constant and b.is_constant and t == INTEGER:
            constant = int(operate(a.constant, b.constant))
            known = self.fitting(constant, node)
            if abs(constant) >= SMALL:  # constants of C are narrower than integers
                return known
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
            if isinstance(op, ast.LShift) and a.is_constant and a.constant >= 0:
                a_text = f"(integer){a_text}"
            elif isinstance(op, ast.LShift):  # C shifts no negative number
                return Value(f"{a.at(PRODUCT)} * ((integer)1 << {b_text})", t, PRODUCT, constant, **more)
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
        """True if what is divided counts a loop from a constant on."""
        left = node.left if isinstance(node, ast.BinOp) else node
        return isinstance(left, ast.Name) and left.id in self.flow.rising


def is_number(v: Value, t: Any) -> bool:
    """True if a value can become one of a type of numbers."""
    return v.type in NUMBERS and t in NUMBERS
