"""Where the variables of a function are set, read and at home."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from functools import cache
from types import FunctionType
from typing import Any

from .values import tree_of

STRANGE = (
    ast.ListComp,
    ast.SetComp,
    ast.DictComp,
    ast.GeneratorExp,
    ast.Lambda,
    ast.FunctionDef,
    ast.NamedExpr,
    ast.Starred,
)
"""What brings variables of its own, or sets them within an expression."""

State = tuple[frozenset[str], frozenset[str]] | None
"""Names that are set on every way to a place, and on some way; None where no way leads."""


@cache
def mentions_in(node: ast.AST) -> frozenset[tuple[str, type[ast.expr_context]]]:
    """Names within a node, with what is done there: `ast.Load` or `ast.Store`."""
    own = [(node.id, type(node.ctx))] if isinstance(node, ast.Name) else []
    return frozenset(own).union(*map(mentions_in, ast.iter_child_nodes(node)))


@cache
def names_in(node: ast.AST, context: type[ast.expr_context] = ast.expr_context) -> frozenset[str]:
    """Names within a node, of all that read or set them, or of one kind."""
    return frozenset(name for name, use in mentions_in(node) if issubclass(use, context))


def blocks_of(statement: ast.stmt) -> Iterator[list[ast.stmt]]:
    """The blocks within a statement."""
    for field in ("body", "orelse"):
        if inner := getattr(statement, field, None):
            yield inner


def is_range(node: ast.expr) -> bool:
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "range"


def constant_of(node: ast.expr, constants: dict[str, Any]) -> int | None:
    """An integer that a number, the name of a constant or a sum stands for."""
    if isinstance(node, ast.Constant) or (isinstance(node, ast.Name) and node.id in constants):
        value = node.value if isinstance(node, ast.Constant) else constants[node.id]
        return value if isinstance(value, int) else None
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub)):
        a, b = constant_of(node.left, constants), constant_of(node.right, constants)
        return None if a is None or b is None else a + b if isinstance(node.op, ast.Add) else a - b
    return None


def turns_at_least_once(loop: ast.For, constants: dict[str, Any]) -> bool:
    """True if a loop's body runs whatever the arguments are."""
    if not isinstance(loop.iter, ast.Call) or not is_range(loop.iter):
        return True  # over a tuple
    limits = [constant_of(a, constants) for a in loop.iter.args]
    known = [limit for limit in limits if limit is not None]
    return len(known) == len(limits) and len(range(*known)) > 0


class Flow:
    """Facts about a function's variables before any type is known."""

    def __init__(self, function: ast.FunctionDef, constants: dict[str, Any]) -> None:
        self.arguments = {a.arg for a in function.args.args}
        self.constants = {name: value for name, value in constants.items() if name not in self.arguments}
        body = ast.Module(function.body, [])
        self.strange = [part for part in ast.walk(body) if isinstance(part, STRANGE)]
        changed = [s.target for s in ast.walk(body) if isinstance(s, ast.AugAssign)]
        self.local = self.arguments | names_in(body, ast.Store)
        self.read = names_in(body, ast.Load).union(*map(names_in, changed))
        self.unset: list[ast.Name] = []  # read where no way has set them
        self.perhaps_unset: set[str] = set()  # read where some way has not
        self._jumps: list[tuple[list[State], list[State]]] = []  # of each loop: at its breaks and continues
        self._run(function.body, (frozenset(self.arguments), frozenset(self.arguments)))
        self.homes: dict[str, ast.stmt] = {}  # statement that a variable is declared at
        for name in self.local - self.arguments - self.perhaps_unset:
            self.homes[name] = self._home(name, function.body)
        self.rising: set[str] = set()  # counters from a constant on, never negative
        self.counters = self._counters(function)
        stores = [n.id for n in ast.walk(body) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
        counting = {name for s in ast.walk(body) if isinstance(s, ast.For) for name in names_in(s.target)}
        self.parameters_that_stay = self.arguments - set(stores) - counting
        self.once = {name for name in self.local - self.arguments - counting if stores.count(name) == 1}  # set once

    def _home(self, name: str, block: Sequence[ast.stmt]) -> ast.stmt:
        """The first statement of the innermost block that has all of a name."""
        mentions = [s for s in block if name in names_in(s)]
        if len(mentions) == 1:
            inner = [b for b in blocks_of(mentions[0]) if any(name in names_in(s) for s in b)]
            head = [part for part in ast.iter_child_nodes(mentions[0]) if isinstance(part, ast.expr)]
            if len(inner) == 1 and not any(name in names_in(part) for part in head):
                return self._home(name, inner[0])
        return mentions[0]

    def at_home(self, s: ast.stmt) -> list[str]:
        """Variables that are declared at a statement; counters of loops are declared in them."""
        return sorted(name for name, home in self.homes.items() if home is s and name not in self.counters)

    def _counters(self, function: ast.FunctionDef) -> set[str]:
        """Names that only count loops: every mention is in a loop over a range that sets it, and no body sets it."""
        loops: dict[str, list[ast.For]] = {}
        mentions_of: dict[str, list[ast.Name]] = {}
        for node in ast.walk(function):
            if isinstance(node, ast.Name):
                mentions_of.setdefault(node.id, []).append(node)
            if isinstance(node, ast.For) and isinstance(node.target, ast.Name) and is_range(node.iter):
                loops.setdefault(node.target.id, []).append(node)
        found = set()
        for name, own in loops.items():
            inside = {id(n) for loop in own for part in (loop.target, *loop.body) for n in ast.walk(part)}
            mentions = mentions_of[name]
            stores = sum(isinstance(n.ctx, ast.Store) for n in mentions)
            nested = any(name in names_in(s, ast.Store) for loop in own for s in loop.body)
            if all(id(n) in inside for n in mentions) and stores == len(own) and not nested:
                found.add(name)
                ranges = [loop.iter.args for loop in own if isinstance(loop.iter, ast.Call)]
                starts = [constant_of(limits[0], self.constants) if len(limits) > 1 else 0 for limits in ranges]
                if all(len(limits) < 3 for limits in ranges) and all(s is not None and s >= 0 for s in starts):
                    self.rising.add(name)
        return found - self.arguments

    # ---- which ways set what ----

    def _read(self, node: ast.AST | None, state: State) -> None:
        for n in ast.walk(node) if node is not None and state is not None else ():
            if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load) and n.id in self.local:
                assert state is not None
                if n.id not in state[1]:
                    self.unset.append(n)
                elif n.id not in state[0]:
                    self.perhaps_unset.add(n.id)

    def _set(self, node: ast.AST, state: State) -> State:
        self._read(node, state)  # indices of elements
        new = names_in(node, ast.Store)
        return state and (state[0] | new, state[1] | new)

    def _run(self, block: Sequence[ast.stmt], state: State) -> State:
        for s in block:
            state = self._step(s, state)
        return state

    def _step(self, s: ast.stmt, state: State) -> State:
        if isinstance(s, ast.Assign):
            self._read(s.value, state)
            for target in s.targets:
                state = self._set(target, state)
        elif isinstance(s, (ast.AugAssign, ast.AnnAssign)):
            self._read(s.value, state)
            if isinstance(s, ast.AugAssign) and isinstance(s.target, ast.Name):
                self._read(ast.Name(s.target.id, ast.Load(), lineno=s.lineno), state)
            state = self._set(s.target, state)
        elif isinstance(s, ast.If):
            self._read(s.test, state)
            state = meet([self._run(s.body, state), self._run(s.orelse, state)])
        elif isinstance(s, (ast.For, ast.While)):
            state = self._loop(s, state)
        elif isinstance(s, (ast.Break, ast.Continue)):
            self._jumps[-1][isinstance(s, ast.Continue)].append(state)
            state = None
        elif isinstance(s, ast.Return):
            self._read(s.value, state)
            state = None
        elif isinstance(s, ast.Expr):
            self._read(s.value, state)
        return state

    def _loop(self, s: ast.For | ast.While, state: State) -> State:
        self._read(s.iter if isinstance(s, ast.For) else s.test, state)
        if isinstance(s, ast.For):
            begin, runs, ends = self._set(s.target, state), turns_at_least_once(s, self.constants), True
        else:
            forever = isinstance(s.test, ast.Constant) and bool(s.test.value)
            begin, runs, ends = state, forever, not forever
        self._jumps.append(([], []))
        end = self._run(s.body, begin)
        breaks, continues = self._jumps.pop()
        last = meet([end, *continues])
        return meet([*breaks, *([last] if ends else []), *([] if runs else [state])])


@cache
def flow_of(function: FunctionType) -> Flow:
    """Facts about a function's variables, found once for all types that it is translated for."""
    return Flow(tree_of(function), function.__globals__)


def meet(states: list[State]) -> State:
    """The common state where several paths of control join."""
    known = [s for s in states if s is not None]
    if not known:
        return None
    every = frozenset.intersection(*(s[0] for s in known))
    return every, frozenset.union(*(s[1] for s in known))
