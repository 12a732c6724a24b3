"""Kernels of a checkout's own programs, which are in no wheel: translated and compiled when they are first called.

They are what the paper, benchmarks and tests time and check. Where there is no C compiler, and where the library's
kernels run as plain Python, so do these, and a sentence says so.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import sys
import threading
import warnings
from collections.abc import Callable
from importlib.machinery import ExtensionFileLoader
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np

from pfabrik.kernels._jit import SOURCES, Marked, inlined
from pfabrik.kernels._shipped import LIBRARY
from pfabrik.to_c import Program
from pfabrik.to_c.c_file import named_records

from . import compile_kernels as building

F = TypeVar("F", bound=Callable[..., Any])

KEPT = building.ROOT / "build" / "on_call"
"""Where modules are kept, by their text and the compiler's command."""

routine = inlined
"""Decorator of a part of a kernel, which is Python where Python calls it."""


def kernel(function: F) -> F:
    """Decorator of what Python calls; compiled for the types of its arguments, as the library's for this processor."""
    if LIBRARY is None:
        return function
    made = OnCall(function)
    SOURCES[made] = Marked(function, "kernel")
    return cast(F, made)


def for_each(function: F) -> F:
    """A kernel that is given a count in place of its last argument, an index: one call for each, without Python.

    Each has memory of its own, as a call from Python has.
    """
    return cast(F, repeated(function) if LIBRARY is None else OnCall(function, is_repeated=True))


def repeated(function: Callable[..., Any]) -> Callable[..., Any]:
    """The same in plain Python."""
    return lambda *given: sum(function(*given[:-1], index) for index in range(given[-1]))


REPEATED = """
int pf_{0}(const integer *words, integer *results);
int pf_{0}(const integer *words, integer *results) {{
    integer now[{1}], sum = 0;
    for (integer k = 0; k < {1}; k++) now[k] = words[k];
    for (integer k = 0; k < words[{1} - 1]; k++) {{
        now[{1} - 1] = k;
        if (pf_one_{0}(now, results)) return 1;
        sum += results[0];
    }}
    results[0] = sum;
    return 0;
}}
"""


class OnCall:
    """A function, and what has been compiled from it."""

    def __init__(self, function: Callable[..., Any], is_repeated: bool = False) -> None:
        functools.update_wrapper(self, function)
        self.function, self.is_repeated = function, is_repeated
        self.compiled, self._lock = list[Callable[..., Any]](), threading.Lock()

    def __call__(self, *arguments: Any) -> Any:
        for call in self.compiled:
            try:
                return call(*arguments)
            except TypeError:  # it is for other types
                continue
        with self._lock:
            made = compiled(self.function, arguments, self.is_repeated)
            self.compiled.append(made)
        return made(*arguments)


@functools.cache
def platform() -> dict[str, str] | None:
    """What the compiler defines; None, and a warning, where there is none."""
    found = building.macros()
    if found is None:
        warnings.warn("there is no C compiler: kernels of this program are plain Python", RuntimeWarning, stacklevel=3)
    return found


def compiled(function: Callable[..., Any], arguments: tuple[Any, ...], is_repeated: bool) -> Callable[..., Any]:
    """A function for arguments of these types, compiled now or kept from before; itself without a compiler."""
    defined = platform()
    if defined is None:
        return repeated(function) if is_repeated else function
    program, name = Program(), function.__name__
    program.records = named_records() | records_of(function.__module__.partition(".")[0])
    SOURCES.setdefault(function, Marked(function, "kernel"))
    made = program.add(function, *arguments)
    text, words = building.entry(made, f"pf_one_{name}" if is_repeated else f"pf_{name}", program.spell)
    text += REPEATED.format(name, words) if is_repeated else ""
    text = program.text("\n".join([building.host(""), text]))
    table = building.table_of(
        [building.Kernel(name, "".join(map(building.code_of, arguments)), made.gives, words, name)]
    )
    level = building.LEVELS.get(LIBRARY.level if LIBRARY else "", [])
    command = [*building.compiler(), *building.flags_for(defined), *level]
    key = hashlib.sha256("\n".join([text, table, *command]).encode()).hexdigest()[:16]
    module = KEPT / f"{name}-{key}" / building.file_name(defined)
    if not module.exists():
        source = module.with_name(f"{name}.c")
        building.write(source, text.encode())
        building.write(module.with_name("table.h"), table.encode())
        object_file = source.with_suffix(".o")
        building.run([*command, "-c", str(source), "-o", str(object_file)])
        building.link(defined, [object_file], module.parent, module, [])
    return cast(Callable[..., Any], getattr(load(module), name))


def records_of(package: str) -> dict[Any, str]:
    """Structured types of a program's modules by the names of their globals."""
    modules = [module for name, module in list(sys.modules.items()) if name.partition(".")[0] == package]
    return {
        value: f"{key.capitalize()}Record"
        for module in modules
        for key, value in vars(module).items()
        if isinstance(value, np.dtype) and value.names
    }


def load(path: Path) -> Any:
    """An extension module from its file."""
    spec = importlib.util.spec_from_file_location("_compiled", path, loader=ExtensionFileLoader("_compiled", str(path)))
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
