"""Statements of kernels in C."""

from __future__ import annotations

import ast
import re
from typing import Any

from .calls import Calls
from .expressions import ANNOTATED
from .flow import is_range, names_in
from .operators import OPERATORS
from .types import BOOL, INTEGER, NOTHING, NUMBERS, REAL, Array, Struct, Tuple, Unreachable, join
from .values import CONDITION, ORDER, POSTFIX, UNARY, Value, c_name, comment, conflict, is_simple

WITH_BLOCKS = (ast.For, ast.While, ast.If)
LEAVING = (ast.Return, ast.Break, ast.Continue)


class Statements(Calls):
    """Translates statements; `gives` is the type of the result."""

    node: ast.FunctionDef
    comments: dict[int, tuple[str, bool]]
    gives: Any

    def __init__(self) -> None:
        super().__init__()
        self._last = 0  # last line whose comments are written
        self._declared: set[str] = set()
        self.results: list[Any] = []  # constants that are returned, UNKNOWN for any other value

    def block(self, statements: list[ast.stmt]) -> None:
        first, before = len(self.lines), self._noted()
        for place, s in enumerate(statements):
            begin, noted = len(self.lines), self._noted()
            try:
                self._write(s)
            except Unreachable:
                if not any(isinstance(part, LEAVING) for each in statements[:place] for part in ast.walk(each)):
                    self._forget(first, before)
                    raise
                self._forget(begin, noted)
                return

    def _noted(self) -> tuple[Any, ...]:
        return set(self.fields), self.reads, self.writes, self.allocates, list(self.results), set(self._declared)

    def _forget(self, line: int, noted: tuple[Any, ...]) -> None:
        """Undo what was written from a line on, and what was noted of it."""
        del self.lines[line:]
        self.fields, self.reads, self.writes, self.allocates, self.results, self._declared = noted

    def _write(self, s: ast.stmt) -> None:
        self._write_notes(s)
        is_whole = isinstance(s, WITH_BLOCKS)
        if is_whole or isinstance(s, ast.AugAssign):
            for name in self.flow.at_home(s):
                self._declare(name)
        n = len(self.lines)
        getattr(self, f"do_{type(s).__name__}", self._unknown)(s)
        note = self.comments.get(s.lineno if is_whole else s.end_lineno or s.lineno)
        if note and not note[1] and not is_whole and len(self.lines) > n:
            self.lines[-1] += f" {comment(note[0]).strip()}"

    def _write_notes(self, s: ast.stmt) -> None:
        """The comments before a statement, and after the head of one with blocks."""
        for line in range(self._last + 1, s.lineno + 1):
            note = self.comments.get(line)
            if note and (note[1] or (line == s.lineno and isinstance(s, WITH_BLOCKS))):
                self.emit(comment(note[0]).strip())
        self._last = s.lineno if isinstance(s, WITH_BLOCKS) else s.end_lineno or s.lineno

    def _unknown(self, s: ast.stmt) -> None:
        raise self.fault(s, f"{type(s).__name__} is not in the subset")

    def do_Expr(self, s: ast.Expr) -> None:
        if not isinstance(s.value, ast.Constant):
            v = self.expression(s.value)
            if v.type is not None:
                self.emit(f"{'' if v.type == NOTHING else '(void)'}{v.text};")

    def do_Pass(self, s: ast.Pass) -> None:
        pass

    def do_Break(self, s: ast.Break) -> None:
        self.emit("break;")

    def do_Continue(self, s: ast.Continue) -> None:
        self.emit("continue;")

    def do_Return(self, s: ast.Return) -> None:
        if s.value is None or (isinstance(s.value, ast.Constant) and s.value.value is None):
            self.emit("return;")
            return
        v = self.expression(s.value, self.gives)
        if v.type is None:
            return
        if self.gives is None or not isinstance(self.gives, str):
            joined = join(self.gives, v.type)
            if joined is None:
                raise self.fault(s, "results of different types")
            self.gives = joined
        v = self.cast(v, self.gives, s)
        self.results.append(v.constant)
        self.emit(f"return {self.stored(v)};")

    def do_AnnAssign(self, s: ast.AnnAssign) -> None:
        if s.value is None:
            raise self.fault(s, "a variable without a value")
        wanted = ANNOTATED.get(ast.unparse(s.annotation))
        v = self.expression(s.value, wanted)
        self.assign(s.target, self.cast(v, wanted, s) if v.type in NUMBERS else v, s)

    def do_Assign(self, s: ast.Assign) -> None:
        if len(s.targets) > 1:
            v = self.expression(s.value)
            if v.type is not None and not v.is_constant and not is_simple(v.text):
                v = self.keep(v)
            for target in s.targets:
                self.assign(target, v, s)
            return
        target, value = s.targets[0], s.value
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
            self.assign_all(target.elts, value.elts, s)
        elif isinstance(target, ast.Tuple) and is_choice(value, len(target.elts)):
            assert isinstance(value, ast.IfExp)
            self.assign_chosen(target, value, s)
        else:
            self.assign(target, self.expression(value, self.type_of(target)), s)

    def assign_chosen(self, target: ast.Tuple, value: ast.IfExp, s: ast.stmt) -> None:
        """One of two tuples, item by item: loops over it are vectors then."""
        test = self.truth(value.test)
        assert isinstance(value.body, ast.Tuple) and isinstance(value.orelse, ast.Tuple)
        if test.is_constant and not test.writes:
            self.assign_all(target.elts, (value.body if test.constant else value.orelse).elts, s)
            return
        test = test if is_simple(test.text) else self.keep(test)
        made = []
        for a, b, place in zip(value.body.elts, value.orelse.elts, target.elts, strict=True):
            x, y = self.perhaps(a, self.type_of(place)), self.perhaps(b, self.type_of(place))
            t = join(x.type, y.type)
            if t is None and x.type is not None and y.type is not None:
                raise self.fault(s, "a choice of values of different types")
            x, y = (self.addressed(self.as_view(self.cast(v, t, s))) for v in (x, y))
            text = f"{test.text} ? {x.at(UNARY)} : {y.at(UNARY)}"
            made.append(Value(text, t, CONDITION, is_lasting=x.is_lasting and y.is_lasting, reads=x.reads | y.reads))
        read = names_in(value)
        if any(names_in(place, ast.Store) & read for place in target.elts) or any(v.reads for v in made[1:]):
            made = [self.keep(v) if v.type is not None else v for v in made]
        for place, v in zip(target.elts, made, strict=True):
            self.assign(place, v, s)

    def type_of(self, target: ast.expr) -> Any:
        """Type of a variable, if it is known."""
        return self.types.get(target.id) if isinstance(target, ast.Name) else None

    def assign_all(self, targets: list[ast.expr], values: list[ast.expr], s: ast.stmt) -> None:
        """As many values as targets: all are computed before any is stored, where that matters."""
        if len(targets) != len(values):
            raise self.fault(s, "tuples of different lengths")
        if not self._matters(targets, values):
            for target, node in zip(targets, values, strict=True):
                if isinstance(target, ast.Tuple) and isinstance(node, ast.Tuple):
                    self.assign_all(target.elts, node.elts, s)
                else:
                    self.assign(target, self.expression(node, self.type_of(target)), s)
            return
        wants = [self.type_of(target) for target in targets]
        found = self.evaluate(values, wants)
        for k, (v, want) in enumerate(zip(found, wants, strict=True)):
            if v.type is not None and not v.is_constant:
                v = self.cast(v, want, s) if want in NUMBERS and v.type in NUMBERS else v
                found[k] = self.keep(v)
        for target, v in zip(targets, found, strict=True):
            self.assign(target, v, s)

    def _matters(self, targets: list[ast.expr], values: list[ast.expr]) -> bool:
        """True if what is stored first could be read by a value after it."""
        for k, target in enumerate(targets):
            places = [n for t in targets[k + 1 :] for n in ast.walk(t) if isinstance(n, ast.Subscript)]
            later: list[ast.expr] = [*values[k + 1 :], *places]
            if any(names_in(target, ast.Store) & names_in(node) for node in later):
                return True
            stores = any(isinstance(n, ast.Subscript) and isinstance(n.ctx, ast.Store) for n in ast.walk(target))
            reads = [n for node in values[k + 1 :] for n in ast.walk(node) if isinstance(n, (ast.Subscript, ast.Call))]
            if stores and reads:
                return True
        return False

    def assign(self, target: ast.expr, v: Value, s: ast.stmt) -> None:
        if isinstance(target, ast.Name):
            self.assign_name(target.id, v, s)
        elif v.type is None:
            for name in names_in(target, ast.Store):
                self.assign_name(name, v, s)
        elif isinstance(target, ast.Tuple):
            if not isinstance(v.type, Tuple) or len(v.type.items) != len(target.elts):
                raise self.fault(s, "another number of values than of variables")
            v = v if is_simple(v.text) else self.keep(v)
            for k, each in enumerate(target.elts):
                if not isinstance(each, ast.Name) or each.id in self.flow.read:
                    self.assign(each, self.item(v, k), s)
        elif isinstance(target, ast.Subscript):
            n = len(self.lines)
            place = self.expression(target)
            if (len(self.lines) > n and v.has_effect) or conflict([v, place]):
                kept = self.keep(v, n)  # Python computes the value first
                v = kept
            self.store(place, v, s)
        else:
            raise self.fault(s, "a target that is not in the subset")

    def store(self, place: Value, v: Value, s: ast.stmt) -> None:
        """Store into memory."""
        if place.type is None:
            return
        if place.type not in (INTEGER, REAL) or v.type not in NUMBERS:
            raise self.fault(s, "an element that is no number")
        self.writes |= place.reads
        self.emit(f"{place.text} = {self.cast(v, place.type, s).text};")

    def assign_name(self, name: str, v: Value, s: ast.stmt) -> None:
        if v.type == NOTHING:
            raise self.fault(s, "nothing is assigned")
        known = self.types.get(name)
        if v.type is not None:
            shape = v.inner[1] if v.inner and name not in self.parameters else None
            if isinstance(v.type, Array) and self.shapes.setdefault(name, shape) != shape:
                self.shapes[name] = shape = None
            v = Value(v.inner[0], v.type, reads=v.reads, writes=v.writes) if v.inner and shape else self.as_view(v)
            joined = v.type if known is None else known if known == v.type else None
            if joined is None:
                raise self.fault(s, f"{name} changes its type")
            self.types[name] = joined
        if v.type is None:
            return
        if name not in self.flow.read:
            self.emit(f"(void){v.at(UNARY)};")
            return
        if isinstance(v.type, Struct) and not v.is_lasting and name not in self.parameters:
            self.by_value.add(name)
        if v.is_constant and v.type in (BOOL, INTEGER) and name in self.flow.once:
            self.constants[name] = v.constant
        own, text = c_name(name), self.stored(v) if name in self.by_value else v.text
        if isinstance(v.type, Struct) and name in self.parameters and not v.is_lasting:
            raise self.fault(s, "a parameter that becomes a new NamedTuple")
        if self.flow.homes.get(name) is s and name not in self._declared:
            self._declared.add(name)
            self.emit(f"{self._kind_of(name)}{own} = {text};")
        else:
            self.emit(f"{own} = {text};")

    def _kind_of(self, name: str) -> str:
        t, spell = self.types[name], self.program.spell
        if self.shapes.get(name) is not None:
            return spell.pointer(t)
        return f"{spell.value(t)} " if name in self.by_value else spell.variable(t)

    def _declare(self, name: str) -> None:
        if name not in self._declared and name in self.flow.read and self.types.get(name) is not None:
            self.emit(f"{self._kind_of(name)}{c_name(name)};")
        self._declared.add(name)

    def do_AugAssign(self, s: ast.AugAssign) -> None:
        load = as_load(s.target)
        place, right = self.evaluate([load, s.value])
        made = self.operated(place, s.op, right, s)
        if made.type is None:
            return
        if made.type != place.type:
            raise self.fault(s, "a variable that changes its type")
        if isinstance(s.target, ast.Subscript):
            lvalue = place if place.reads else self.expression(load)  # it was kept, if the value changes it
            if not lvalue.reads:
                raise self.fault(s, "an element that is no number")
            self.writes |= lvalue.reads
        else:
            lvalue = place
        inside = [n for n in ast.walk(load) if isinstance(n, (ast.Subscript, ast.Call)) and n is not load]
        if lvalue.writes or (lvalue is not place and inside):
            raise self.fault(s, "an index that is computed twice, and changes")
        sign, level, _ = OPERATORS[type(s.op)]
        if place.text == lvalue.text and level != POSTFIX and not isinstance(s.op, (ast.LShift, ast.RShift)):
            right = self.cast(right, made.type, s)
            if right.is_constant and right.text == "1" and sign in "+-":
                self.emit(f"{lvalue.text}{sign}{sign};")
            else:
                self.emit(f"{lvalue.text} {sign}= {right.text};")
        else:
            self.emit(f"{lvalue.text} = {made.text};")

    def do_If(self, s: ast.If) -> None:
        test = self.truth(s.test)
        if test.is_constant and not test.writes:
            self._last = s.lineno
            self._same_level(s.body if test.constant else s.orelse)
            return
        begin, noted = len(self.lines), self._noted()
        self.emit(f"if ({test.text}) {{")
        try:
            self.inside(s.body)
        except Unreachable:  # the test is never true
            self._forget(begin, noted)
            self._last = s.lineno
            self._same_level(s.orelse)
            return
        rest = s.orelse
        while len(rest) == 1 and isinstance(rest[0], ast.If):
            inner, n = rest[0], len(self.lines)
            homes = any(home is inner for home in self.flow.homes.values())
            test = self.truth(inner.test)
            if len(self.lines) > n or test.is_constant or homes or self.comments.get(inner.lineno, ("", False))[0]:
                del self.lines[n:]
                break
            n, noted = len(self.lines), self._noted()
            self.emit(f"}} else if ({test.text}) {{")
            try:
                self.inside(inner.body)
            except Unreachable:
                self._forget(n, noted)
            rest = inner.orelse
        if rest:
            n, noted = len(self.lines), self._noted()
            self.emit("} else {")
            try:
                self.inside(rest)
            except Unreachable:
                self._forget(n, noted)
        self.emit("}")

    def _same_level(self, statements: list[ast.stmt]) -> None:
        """A block that always runs: its variables stay within it."""
        if any(home in statements for home in self.flow.homes.values()):
            self.emit("{")
            self.inside(statements)
            self.emit("}")
        else:
            self.block(statements)

    def inside(self, statements: list[ast.stmt]) -> None:
        self.indent += 1
        try:
            self.block(statements)
        finally:
            self.indent -= 1

    def do_While(self, s: ast.While) -> None:
        if s.orelse:
            raise self.fault(s, "a loop with else")
        n, noted = len(self.lines), self._noted()
        self.indent += 1
        try:
            test = self.truth(s.test)
        finally:
            self.indent -= 1
        before, self.lines[n:] = self.lines[n:], []
        if before:
            self.emit("while (true) {")
            self.lines += before
            self.lines.append("    " * (self.indent + 1) + f"if (!({test.text})) break;")
        else:
            self.emit(f"while ({test.text}) {{")
        try:
            self.inside(s.body)
        except Unreachable:
            self._forget(n, noted)
            return
        self.emit("}")

    def do_For(self, s: ast.For) -> None:
        if s.orelse:
            raise self.fault(s, "a loop with else")
        begin, noted, indent = len(self.lines), self._noted(), self.indent
        try:
            if is_range(s.iter):
                self.count(s)
            else:
                self.for_each(s)
        except Unreachable:  # it has no turns
            self._forget(begin, noted)
            self.indent = indent

    def count(self, s: ast.For) -> None:
        """A loop over a range."""
        assert isinstance(s.iter, ast.Call)
        if not isinstance(s.target, ast.Name):
            raise self.fault(s, "a loop over a range with several variables")
        given = [self.cast(v, INTEGER, s) if v.type in (BOOL, INTEGER) else v for v in self.evaluate(s.iter.args)]
        if any(v.type not in (INTEGER, None) for v in given):
            raise self.fault(s, "a range that is no integer")
        zero, one = Value("0", INTEGER, constant=0), Value("1", INTEGER, constant=1)
        start = given[0] if len(given) > 1 else zero
        stop, step = given[min(len(given) - 1, 1)], given[2] if len(given) > 2 else one
        if not step.is_constant or step.constant == 0:
            raise self.fault(s, "a range whose step is not constant")
        if start.is_constant and stop.is_constant and not range(start.constant, stop.constant, step.constant):
            return
        name = c_name(s.target.id) if s.target.id in self.flow.read else f"turn{self.indent}"
        assigned = names_in(ast.Module(s.body, []), ast.Store)
        is_own = s.target.id in self.flow.counters or s.target.id not in self.flow.read
        counter = name if is_own else f"next_{name}"
        end, more = stop.at(ORDER + 1), ""
        if not self._stays(s.iter.args[min(len(given) - 1, 1)], stop, assigned):
            end, more = f"{counter}_end", f", {counter}_end = {stop.text}"
        compare, by = ("<", f" += {step.constant}") if step.constant > 0 else (">", f" -= {-step.constant}")
        by = {1: "++", -1: "--"}.get(step.constant, by)
        known = self.types.setdefault(s.target.id, INTEGER) if s.target.id in self.flow.read else INTEGER
        if known != INTEGER:
            raise self.fault(s, f"{name} changes its type")
        self.emit(f"for (integer {counter} = {start.text}{more}; {counter} {compare} {end}; {counter}{by}) {{")
        if not is_own:
            self.lines.append("    " * (self.indent + 1) + f"{name} = {counter};")
        self.inside(s.body)
        self.emit("}")

    def _stays(self, node: ast.expr, stop: Value, assigned: frozenset[str]) -> bool:
        """True if the end of a range is the same at each turn, and costs nothing."""
        if stop.is_constant:
            return True
        if re.fullmatch(r"t\d+", stop.text):
            return True
        if names_in(node) & assigned or stop.has_effect or "?" in stop.text:
            return False
        calls = [n for n in ast.walk(node) if isinstance(n, ast.Call)]
        return all(isinstance(n.func, ast.Name) and n.func.id == "len" for n in calls)

    def for_each(self, s: ast.For) -> None:
        """A loop over a tuple."""
        v = self.expression(s.iter)
        if v.type is None:
            return
        if not isinstance(v.type, Tuple) or not v.type.items:
            raise self.fault(s, "a loop over what is neither a range nor a tuple")
        t: Any = None
        for item in v.type.items:
            joined = join(t, item)
            if joined is None:
                raise self.fault(s, "a loop over values of different types")
            t = joined
        if not v.type.is_uniform:
            v = self.cast(v, Tuple((t,) * len(v.type.items)), s)
        self.n_temporaries += 1
        values, k = f"each{self.n_temporaries}", f"k{self.n_temporaries}"
        self.emit("{")
        self.indent += 1
        self.emit(f"const {self.program.spell.value(v.type)} {values} = {v.text};")
        self.emit(f"for (int {k} = 0; {k} < {len(v.type.items)}; {k}++) {{")
        self.indent += 1
        self.assign(s.target, Value(f"{values}.at[{k}]", t), s)
        self.indent -= 1
        self.inside(s.body)
        self.emit("}")
        self.indent -= 1
        self.emit("}")


def is_choice(node: ast.expr, n: int) -> bool:
    """True if a value is one of two tuples of a length."""
    return isinstance(node, ast.IfExp) and all(
        isinstance(each, ast.Tuple) and len(each.elts) == n for each in (node.body, node.orelse)
    )


def as_load(target: ast.expr) -> ast.expr:
    """A target as an expression that reads it."""
    read = ast.parse(ast.unparse(target), mode="eval").body
    for node in ast.walk(read):
        ast.copy_location(node, target)
    return read
