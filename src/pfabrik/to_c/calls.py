"""Calls of kernels in C: of their parts, of NamedTuples, of NumPy, `math` and Python."""

from __future__ import annotations

import ast
import math
from typing import Any

import numpy as np

from .expressions import ANNOTATED
from .flow import flow_of
from .subscripts import Subscripts
from .types import BOOL, INTEGER, NUMBERS, REAL, WIDE, Array, Struct, Tuple, Unreachable, element_of, join
from .values import UNARY, Value, effects, is_simple, opened_by, source_of, tree_of

MATH = frozenset(
    ["sqrt", "sin", "cos", "tan", "atan2", "acos", "asin", "atan", "hypot", "fabs", "copysign", "exp", "log"]
)


class Calls(Subscripts):
    """Translates calls."""

    def on_Call(self, node: ast.Call, want: Any) -> Value:
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
        source = source_of(called)
        assert source is not None
        takes = tree_of(source.function).args.args
        if len(takes) != len(values):
            raise self.fault(node, "another number of arguments than the function takes")
        given = []
        for v, a in zip(values, takes, strict=True):
            declared = ANNOTATED.get(ast.unparse(a.annotation) if a.annotation else "")
            given.append(self.cast(v, declared, node) if declared and v.type in NUMBERS else self.addressed(v))
        stays, kinds = flow_of(source.function).parameters_that_stay, [v.type for v in given]
        for k, (v, a) in enumerate(zip(given, takes, strict=True)):
            key, shape = (source.function, a.arg), v.inner[1] if v.inner else None
            if isinstance(v.type, Array) and a.arg in stays:
                self.program.given.setdefault(key, set()).add(shape)
                if self.program.layout.shapes and shape is not None and key not in self.program.layout.views:
                    kinds[k] = Array(v.type.element, v.type.ndim, shape=shape)
        made = self.program.instance(called, tuple(kinds))
        if made.is_unreachable:
            raise Unreachable
        more = effects(given)
        self.reads |= made.reads
        self.writes |= made.writes
        self.allocates |= made.allocates
        if made.is_constant and not more["writes"]:
            return Value(self.program.literal(made.results[0], made.gives), made.gives, UNARY, made.results[0])
        texts = [
            *(["memory"] if made.allocates else []),
            *(self.given(v, t) for v, t in zip(given, kinds, strict=True)),
        ]
        text = f"{made.name}({', '.join(texts)})"
        return Value(
            text,
            made.gives,
            reads=more["reads"] | made.reads,
            writes=more["writes"] | made.writes,
            is_held=isinstance(made.gives, Struct),
        )

    def given(self, v: Value, t: Any) -> str:
        """An argument of a function."""
        is_pointer = v.inner and isinstance(t, Array) and t.shape is not None
        return v.inner[0] if v.inner and is_pointer else self.as_view(v).text

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
        values = [self.cast(v, w, node) if v.type in NUMBERS else v for v, w in pairs]
        t, given = Struct(cls, tuple(v.type for v in values)), []
        for field in self.program.spell.members(cls):
            v, shape = values[cls._fields.index(field)], self.program.layout.shapes.get((cls.__name__, field))
            if (cls.__name__, field) in self.program.layout.constant:
                raise self.fault(node, f"{field}, which is constant elsewhere")
            if shape is not None and (v.inner is None or v.inner[1] != shape):
                self.program.of_other_shapes.add((cls.__name__, field))
            given.append(self.stored(v) if shape is None or v.inner is None else v.inner[0])
        text = f"({self.program.spell.value(t)}){{{', '.join(given) or '0'}}}"
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
        return Value(f"({self.program.spell.value(t)}){{{v.text}.data, {{{', '.join(lengths)}}}}}", t, **effects(sizes))

    def of_math(self, name: str, values: list[Value], node: ast.AST) -> Value:
        """A call of a function of `math`."""
        values = [self.cast(v, REAL, node) for v in values]
        inner, more, suffix = ", ".join(v.text for v in values), effects(values), self.program.suffix
        if name in MATH:
            return Value(f"{name}{suffix}({inner})", REAL, **more)
        if name == "floor":
            return rounded(f"floor{suffix}({inner})", values)
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
            return rounded(f"rint{suffix}({v.text})", [v])
        raise self.fault(node, "a call of what is no part of kernels")


def rounded(text: str, of: list[Value]) -> Value:
    """A rounded number as an integer."""
    return Value(f"(integer){text}", INTEGER, UNARY, rounded=text, **effects(of))
