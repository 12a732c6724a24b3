"""Kernels in C: functions for the types that they are called with."""

from __future__ import annotations

import ast
import re
import textwrap
from typing import Any

from .c_file import File
from .expressions import ANNOTATED
from .flow import flow_of
from .statements import Statements
from .types import NOTHING, NUMBERS, Array, StructLayout, Unreachable, Unsupported
from .values import RESERVED, UNKNOWN, c_name, comment, comments_of, short_path, source_of, tree_of

INDENTED: Any = {"initial_indent": "    ", "subsequent_indent": "    "}

MOST_PASSES = 8
"""A function is translated until its types, its result and its effects are settled; two or three times are usual."""


class Function(Statements):
    """A function: its text, name, arguments, result, reads and writes, and whether it allocates."""

    def __init__(self, program: File, source: Any, arguments: tuple[Any, ...]) -> None:
        super().__init__()
        self.program, self.source, self.arguments = program, source, arguments
        function = source.function
        self.globals, self.file = function.__globals__, function.__code__.co_filename
        self.node, self.path, self.comments = tree_of(function), short_path(self.file), comments_of(self.file)
        self.flow = flow_of(function)
        self.name = ""
        self.gives: Any = None
        self.types: dict[str, Any] = {}
        self.by_value: set[str] = set()
        self.is_unreachable = False  # whatever calls it never happens

    def translate(self) -> None:
        """Fill the lines of the body."""
        node, takes = self.node, self.node.args
        if len(takes.args) != len(self.arguments) or takes.defaults or takes.kwonlyargs or takes.vararg or takes.kwarg:
            raise self.refused(node.lineno, f"{node.name}: another number of arguments, or arguments with defaults")
        for part in self.flow.strange:
            raise self.fault(part, f"{type(part).__name__} is not in the subset")
        for name in self.flow.unset:
            raise self.fault(name, "read before it is assigned")
        if self.flow.perhaps_unset:
            names = ", ".join(sorted(self.flow.perhaps_unset))
            raise self.refused(node.lineno, f"{node.name}: perhaps read before it is assigned: {names}")
        self.parameters = [a.arg for a in takes.args]
        self.types = dict(zip(self.parameters, self.arguments, strict=True))
        for parameter, t in self.types.items():
            if isinstance(t, Array) and t.shape is not None:
                self.types[parameter], self.shapes[parameter] = Array(t.element, t.ndim), t.shape
        declared = ast.unparse(node.returns) if node.returns else ""
        self.gives = {"None": NOTHING, **ANNOTATED}.get(declared)
        for _ in range(MOST_PASSES):
            before = self._settled()
            self.lines, self.indent, self.n_temporaries, self._last = [], 1, 0, node.body[0].lineno - 1
            self._declared, self.results, self.fields, self.constants = set(self.parameters), [], set(), {}
            try:
                self.block(
                    node.body[1:] if isinstance(node.body[0], ast.Expr) and ast.get_docstring(node) else node.body
                )
            except Unreachable:
                self.is_unreachable = True
                return
            self.gives = self.gives or NOTHING
            if before == self._settled():
                return
        raise self.refused(node.lineno, f"{node.name}: its types do not settle")

    def _settled(self) -> Any:
        kinds = dict(self.types), dict(self.shapes), set(self.by_value)
        return kinds, self.gives, self.reads, self.writes, self.allocates

    @property
    def is_constant(self) -> bool:
        """True if the result is the same number whatever the facts leave open, and computing it changes nothing."""
        known = self.gives in NUMBERS and UNKNOWN not in self.results and not self.writes and not self.allocates
        return known and all(repr(each) == repr(self.results[0]) for each in self.results)

    def refused(self, line: int, what: str) -> Unsupported:
        return Unsupported(f"{self.path}:{line}: {what}")

    def text(self) -> str:
        """The function as C text."""
        spell = self.program.spell
        kinds = zip(self.arguments, self.parameters, strict=True)
        takes = [f"{spell.variable(t)}{c_name(name)}" for t, name in kinds]
        if self.allocates:
            takes.insert(0, "arena *memory")
        gives = spell.stored(self.gives)
        kind = {"inlined": "INLINED ", "flattened": "FLATTENED static "}.get(self.source.kind, "static ")
        head = f"{kind}{gives}{self.name}({', '.join(takes) or 'void'})"
        if len(head) > 118:
            head = f"{kind}{gives}{self.name}(\n" + textwrap.fill(f"{', '.join(takes)})", 116, **INDENTED)
        described = comment(f"{ast.get_docstring(self.node) or ''}\n[{self.path}:{self.node.lineno}]")
        body = re.sub(r"/\*.*?\*/", "", "\n".join(self.lines))
        used = set(re.findall(r"(?<![.>\w])\w+", body))
        unused = [f"    (void){c_name(name)};" for name in self.parameters if c_name(name) not in used]
        return f"{described}{head} {{\n" + "\n".join([*unused, *self.lines]) + "\n}\n"


class Program(File):
    """Kernels and their parts in C.

    Parameters
    ----------
    real, integer : C types of numbers: `double` or `float`; `int64_t`, or `int_fast32_t` for a controller. Constants
        that do not fit in the bits that the name of the integer has are refused.
    facts : what is known of the tables that the code is for: values of an integer field, by the names of its record and
        of itself, or lengths of an array, by its NamedTuple and its field. Code that no value reaches is left out.
    tolerances : values of constants that single precision needs, by module, without the package, and name.
    layout : of the structs of NamedTuples. Where functions make one with an array of another shape than `shapes` has,
        `of_other_shapes` names the field, and the text is of no use.
    """

    def __init__(
        self,
        real: str = "double",
        integer: str = "int64_t",
        facts: dict[tuple[str, str], set[int]] | None = None,
        tolerances: dict[tuple[str, str], float] | None = None,
        layout: StructLayout = StructLayout(),  # noqa: B008 - it has no state
    ) -> None:
        super().__init__(real, integer, facts, tolerances, layout)
        self.functions: dict[Any, Function] = {}
        self._active: list[Any] = []

    def add(self, kernel: Any, *samples: Any) -> Function:
        """Translate a kernel, or a part of one, for arguments of the samples' types."""
        return self.instance(kernel, tuple(map(self.type_of, samples)))

    def instance(self, called: Any, arguments: tuple[Any, ...]) -> Function:
        """A function in C for arguments of these types."""
        source = source_of(called)
        assert source is not None
        key = source.function, arguments
        if key in self._active:
            raise Unsupported(f"{source.function.__name__} calls itself")
        if key not in self.functions:
            self._active.append(key)
            try:
                made = Function(self, source, arguments)
                made.translate()
            finally:
                self._active.pop()
            if not made.is_unreachable:
                made.name = self._name_for(source.function)
                self.items[made.name] = made.text()
            self.functions[key] = made
        return self.functions[key]

    def _name_for(self, function: Any) -> str:
        plain, module = c_name(function.__name__.lstrip("_")), function.__module__.rpartition(".")[2]
        names = [plain, f"{module}_{plain}", *(f"{plain}_{k}" for k in range(2, 99))]
        return next(name for name in names if name not in self.items and name not in RESERVED)

    def fields_read(self, text: str) -> frozenset[tuple[str, str]]:
        """Fields of NamedTuples, by their classes, that the functions in C text read."""
        wanted = words(text)
        return frozenset[tuple[str, str]]().union(
            *(made.fields for made in self.functions.values() if made.name in wanted)
        )

    def text(self, more: str = "") -> str:
        """The C text: what its functions need, in order, and then what is given, whose names are needed too."""
        return "\n".join([*self.head, *self.needed(more).values(), more])

    def needed(self, text: str) -> dict[str, str]:
        """What C text needs, in order, by the names that are declared; all functions if there is none."""
        wanted, kept = words(text), {}
        if not text:
            wanted |= {made.name for made in self.functions.values()}
        for name, declared in reversed(self.items.items()):  # each was declared after what it needs
            if name in wanted:
                kept[name] = declared
                wanted |= words(declared)
        return dict(reversed(kept.items()))


def words(text: str) -> set[str]:
    """Names in C text."""
    return set(re.findall(r"\w+", re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)))
