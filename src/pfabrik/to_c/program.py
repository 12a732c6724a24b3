"""Kernels in C: functions for the types that they are called with."""

from __future__ import annotations

import re
from typing import Any

from .c_file import File
from .function import Function
from .naming import RESERVED, c_name
from .sources import source_of
from .types import Unsupported


class Program(File):
    """Kernels and their parts in C.

    Parameters
    ----------
    real, integer : C types of numbers: `double` or `float`; `int64_t`, or `intptr_t` for a controller.
    facts : what is known of the tables that the code is for: values of an integer field, by the names of its record and
        of itself, or lengths of an array, by its NamedTuple and its field. Code that no value reaches is left out.
    tolerances : values of constants that single precision needs, by module, without the package, and name.
    """

    def __init__(
        self,
        real: str = "double",
        integer: str = "int64_t",
        facts: dict[tuple[str, str], set[int]] | None = None,
        tolerances: dict[tuple[str, str], float] | None = None,
    ) -> None:
        super().__init__(real, integer, facts, tolerances)
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
            made.name = self._name_for(source.function)
            self.items[made.name] = made.text()
            self.functions[key] = made
        return self.functions[key]

    def _name_for(self, function: Any) -> str:
        plain, module = c_name(function.__name__.lstrip("_")), function.__module__.rpartition(".")[2]
        names = [plain, f"{module}_{plain}", *(f"{plain}_{k}" for k in range(2, 99))]
        return next(name for name in names if name not in self.items and name not in RESERVED)

    def text(self, more: str = "") -> str:
        """The C text: what its functions need, in order, and then what is given, whose names are needed too."""
        wanted, kept = words(more), []
        if not more:
            wanted |= {made.name for made in self.functions.values()}
        for name, text in reversed(self.items.items()):  # each was declared after what it needs
            if name in wanted:
                kept.append(text)
                wanted |= words(text)
        return "\n".join([*self._head, *reversed(kept), more])


def words(text: str) -> set[str]:
    """Names in C text."""
    return set(re.findall(r"\w+", re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)))
