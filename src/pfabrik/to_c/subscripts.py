"""Subscripts of kernels in C: elements and parts of arrays, fields of records, items of tuples."""

from __future__ import annotations

import ast
import math
from collections.abc import Sequence
from functools import reduce
from typing import Any

from .operators import Operators
from .types import BOOL, INTEGER, Array, Record, Tuple, Unreachable, element_of
from .values import POSTFIX, SUM, UNARY, Value, c_name, conflict, effects, is_simple


class Subscripts(Operators):
    """Translates subscripts."""

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
        found, lines = [], len(self.lines)
        for k, place in enumerate(self.evaluate(indices)):
            if place.type == BOOL:
                place = self.cast(place, INTEGER, node)
            if place.type not in (INTEGER, None):
                raise self.fault(node, "an index that is no integer")
            if place.is_constant and place.constant < 0:
                place = Value(f"{self.length(v, first + k).text} - {-place.constant}", INTEGER, SUM)
            found.append(place)
        if conflict([v, *found]) or (v.writes and len(self.lines) > lines):
            raise self.fault(node, "an index that changes what it is an index of")
        return found

    def element(self, v: Value, indices: list[Value]) -> Value:
        """An element of an array: a number, or a record by its address."""
        t, more = v.type, effects([v, *indices])
        self.require_elements(v)
        if v.inner:
            path, shape = v.inner
            inside = [f"IN({i.text}, {length})" for i, length in zip(indices, shape, strict=True)]
            text = reduce(lambda before, k: f"({before}) * {shape[k]} + {inside[k]}", range(1, len(shape)), inside[0])
            if isinstance(t.element, Record):
                self.program.spell.value(t.element)
                return Value(f"&{path}[{text}]", t.element, UNARY, **more)
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

    def require_elements(self, v: Value) -> None:
        """Unreachable if an array has no elements, as the facts say."""
        if v.possible == frozenset({0}) or (v.inner and 0 in v.inner[1]):
            raise Unreachable

    def read(self, text: str, kind: str, more: dict[str, frozenset[str]], owner: str = "") -> Value:
        """A number in memory."""
        self.reads |= {owner or kind}
        return Value(text, kind, reads=more["reads"] | {owner or kind}, writes=more["writes"])

    def rows(self, v: Value, indices: list[Value]) -> Value:
        """What the first indices leave of an array."""
        if not indices:
            return v
        more = effects([v, *indices])
        self.require_elements(v)
        if v.inner:
            path, shape = v.inner
            inside = [f"IN({i.text}, {length})" for i, length in zip(indices, shape, strict=False)]
            text = reduce(lambda before, k: f"({before}) * {shape[k]} + {inside[k]}", range(1, len(inside)), inside[0])
            left = shape[len(inside) :]
            path = f"({path} + ({text}) * {math.prod(left)})"
            return Value(path, Array(v.type.element, len(left)), inner=(path, left), **more)
        if not v.type.is_contiguous:
            return self.strided(v, indices)
        text, t = v.text, v.type
        for place in indices:
            text, t = f"row_{self.program.spell.value(t)}({text}, {place.text})", Array(t.element, t.ndim - 1)
        return Value(text, t, **more)

    def sliced(self, v: Value, indices: list[ast.expr], node: ast.AST) -> Value:
        """A part of an array: contiguous if only its rows are fewer, else with steps."""
        if any(isinstance(i, ast.Slice) and i.step is not None for i in indices):
            raise self.fault(node, "a slice with a step")
        *before, part = indices
        slices = [isinstance(i, ast.Slice) for i in before]
        if v.type.is_contiguous and not any(slices) and isinstance(part, ast.Slice):
            v = self.rows(v, self.places(v, before, 0, node))
            if part.lower is None and part.upper is None:
                return v
            if v.inner and (known := self.known_part(v, part, node)) is not None:
                return known
            v = self.as_view(v)
            ends = [self.end(part.lower, node) if part.lower is not None else Value("0", INTEGER)]
            made = Array(v.type.element, v.type.ndim)
            v = self.cast(v, made, node) if v.type.width else v
            name, end = self.program.spell.value(made), ""
            if part.upper is not None:
                ends.append(self.end(part.upper, node))
                end = f", {ends[1].text}"
            return Value(
                f"{'part' if end else 'rest'}_{name}({v.text}, {ends[0].text}{end})", made, **effects([v, *ends])
            )
        v = self.as_view(v)
        places: list[Value | ast.Slice] = []
        for k, i in enumerate(indices):
            places.append(i if isinstance(i, ast.Slice) else self.places(v, [i], k, node)[0])
        return self.strided(v, places)

    def known_part(self, v: Value, part: ast.Slice, node: ast.AST) -> Value | None:
        """A part of an array of known shape between constant ends within it; None if it is none."""
        assert v.inner is not None
        path, (n, *more) = v.inner
        ends = [None if end is None else self.end(end, node) for end in (part.lower, part.upper)]
        if any(end is not None and not end.is_constant for end in ends):
            return None
        first = ends[0].constant if ends[0] is not None else 0
        end = ends[1].constant if ends[1] is not None else n
        if not 0 <= first <= end <= n:
            return None
        path = f"({path} + {first * math.prod(more)})" if first else path
        return Value(path, v.type, inner=(path, (end - first, *more)), **effects([v]))

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
        ends = [i for i in indices if isinstance(i, Value)]
        for k in range(v.type.ndim):
            index = indices[k] if k < len(indices) else ast.Slice()
            if isinstance(index, Value):
                data.append(f"IN({index.text}, {v.text}.n[{k}]) * {v.text}.step[{k}]")
                continue
            steps.append(f"{v.text}.step[{k}]")
            if index.lower is None and index.upper is None:
                lengths.append(f"{v.text}.n[{k}]")
                continue
            limits = [self.end(part, index) if part is not None else None for part in (index.lower, index.upper)]
            ends += [limit for limit in limits if limit is not None]
            first = f"place({limits[0].text}, {v.text}.n[{k}])" if limits[0] is not None else "0"
            end = f"{v.text}.n[{k}]"
            if limits[1] is not None:
                end = f"place({limits[1].text}, {end})"
            data.append(f"{first} * {v.text}.step[{k}]")
            lengths.append(f"max_i({end} - {first}, 0)")
        made = Array(v.type.element, len(lengths), is_contiguous=False)
        text = f"({spell.value(made)}){{{' + '.join(data)}, {{{', '.join(lengths)}}}, {{{', '.join(steps)}}}}}"
        return Value(text, made, **effects(ends))

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
        lines = len(self.lines)
        index = self.expression(key)
        if conflict([v, index]) or (v.has_effect and len(self.lines) > lines):
            raise self.fault(node, "an index that changes what it is an index of")
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
