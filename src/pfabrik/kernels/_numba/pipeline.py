"""The compiler pipeline of kernels: parts are optimised once, with the kernel that they go into."""

from __future__ import annotations

import gc
import sys
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partialmethod
from types import SimpleNamespace
from typing import Any

from numba.core import base, codegen, compiler, cpu, dispatcher, event, types
from numba.core.registry import cpu_target

from .._shipped import REASON

# Numba has type annotations in some versions only, and none for internals.
_Library: Any = codegen.JITCodeLibrary
_Compiler: Any = compiler.Compiler
_Flags: Any = compiler.Flags
_Dispatcher: Any = dispatcher.Dispatcher
_Function: Any = types.BaseFunction
_Context: Any = base.BaseContext
_CpuContext: Any = cpu.CPUContext
_event: Any = event

LARGE = 150
"""Instructions of a part, before optimisation, above which a search does not inline it."""


def compile_announced(name: str, original: Callable[..., Any], *arguments: Any) -> Any:
    """Compile a kernel, announced on standard error, with the seconds taken.

    Numba calls this for what is not in the cache, holding its lock: one thread compiles, the others wait.
    """
    _say_reason()
    _say(f"pfabrik: compiling {name} ...")
    began = time.perf_counter()
    try:
        with in_haste():
            return original(*arguments)
    finally:
        _say(f" {time.perf_counter() - began:.1f} s\n")


@cache
def _say_reason() -> None:
    """Say once why no kernels that were compiled before run here."""
    if REASON:
        _say(f"pfabrik: {REASON}; Numba compiles\n")


def _say(text: str) -> None:
    """Write on standard error at once, if there is one: a program without a terminal may have closed it."""
    if sys.stderr is not None:
        sys.stderr.write(text)
        sys.stderr.flush()


@contextmanager
def in_haste() -> Iterator[None]:
    """Compile without the parts of Numba that cost time and have no effect here, and align arrays to cache lines.

    Garbage collection among so many objects takes a tenth of the compile time.
    """
    collects = gc.isenabled()
    gc.disable()
    cpu_target.target_context.refresh()
    for owner, name, _, ours in _REPLACED:
        setattr(owner, name, ours)
    try:
        yield
    finally:
        for owner, name, theirs, _ in _REPLACED:
            setattr(owner, name, theirs)
        if collects:
            gc.enable()


_CALL_TYPES: dict[Any, Any] = {}


def _cached_call_type(function: Any, find: Callable[..., Any], context: Any, arguments: Any, keywords: Any) -> Any:
    """Numba's call type of a function for arguments of some types, cached.

    Numba infers it anew at each place, by trying all candidates of an operator: another tenth of the time.
    """
    key = function, context, arguments, tuple(keywords.items())
    if key not in _CALL_TYPES:
        _CALL_TYPES[key] = find(function, context, arguments, keywords)
    return _CALL_TYPES[key]


_SIZES: dict[str, int] = {}


def _cached_size(context: Any, measure: Callable[..., int], kind: Any) -> int:
    """The size of a type, cached: LLVM compiles a module for it, twice for every variable."""
    if str(kind) not in _SIZES:
        _SIZES[str(kind)] = measure(context, kind)
    return _SIZES[str(kind)]


def _short_mangled(context: Any, mangle: Callable[..., str], name: str, taken: Any, **tags: Any) -> str:
    """The name of a function in machine code, with a checksum of its argument types.

    The types of records are thousands of letters long, and every call would repeat them.
    """
    return mangle(context, name, (f"{zlib.crc32(repr(taken).encode()):08x}",), **tags)


def _install_declared(context: Any) -> None:
    """Install the declarations made meanwhile.

    Numba imports all its own modules again before that, a dozen times for every function.
    """
    for registry in list(context._registries):
        context.install_registry(registry)


def _cache_line(context: Any, kind: Any) -> int:
    """Alignment of arrays [bytes], a cache line: a vector as long as one would otherwise span two."""
    return 64


def _no_broadcast(event: Any) -> None:
    """Drop events: there is one for each call of LLVM, with times that are not used."""


def _replaced(owner: Any, name: str, ours: Callable[..., Any], *, asks: bool) -> tuple[Any, str, Any, Any]:
    """A function of Numba with its replacement, which gets the original as an argument if `asks`."""
    theirs = getattr(owner, name)
    return owner, name, theirs, partialmethod(ours, theirs) if asks else ours


_REPLACED = (
    _replaced(_Function, "get_call_type", _cached_call_type, asks=True),
    _replaced(_Context, "get_abi_sizeof", _cached_size, asks=True),
    _replaced(_Context, "mangler", _short_mangled, asks=True),
    _replaced(_CpuContext, "load_additional_registries", _install_declared, asks=False),
    _replaced(_event, "broadcast", _no_broadcast, asks=False),
    _replaced(_Context, "get_preferred_array_alignment", _cache_line, asks=False),
)


class _PartLibrary(_Library):
    """The code of one part, neither optimised nor compiled to machine code.

    Each kernel that it goes into includes the part's callees, and does both for the whole.
    """

    def _optimize_functions(self, module: Any) -> None:
        """Simplify each function by itself, all with the same pass manager; Numba makes a new one for each."""
        module.data_layout = self._codegen._data_layout
        passes, builder = self._codegen._function_pass_manager()
        for function in module.functions:
            if not function.is_declaration:
                passes.run(function, builder)

    def finalize(self) -> None:
        self._finalized = True

    @property
    def codegen(self) -> Any:
        """Stand-in for the code generator: there is no machine code to store the Python environment in."""
        return SimpleNamespace(set_env=lambda name, environment: None)


class _KernelLibrary(_Library):
    """The code of a kernel with all its parts; nothing else calls these, so that unused arguments are dropped.

    A mechanism by value is more than fifty arguments, of which most parts use a few. Optimised once: Numba does it
    twice, for the sake of reference counts, of which there are hardly any here; that takes a sixth of its time.
    """

    _optimize_functions = _PartLibrary._optimize_functions

    def finalize(self) -> None:
        """Link the parts, and the parts of these, each once; Numba links them again at every step up to here."""
        taken = self._linking_libraries
        for library in taken:  # which grows in the loop
            if isinstance(library, _PartLibrary):
                taken += [each for each in library._linking_libraries if each not in taken]
        super().finalize()

    def _optimize_final_module(self) -> None:
        self.prepare()
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)

    def prepare(self) -> None:
        """Mark what only this kernel calls."""
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage.name == "linkonce_odr":
                function.linkage = "internal"


class _SearchLibrary(_KernelLibrary):
    """The code of a search, with large parts called and not inlined."""

    def _optimize_functions(self, module: Any) -> None:
        """Defer: the search is optimised with all its parts, and has no loop that vectorises."""
        module.data_layout = self._codegen._data_layout

    def prepare(self) -> None:
        for function in self._final_module.functions:
            if str(function).count("\n  ") > LARGE and not any(b"alwaysinline" in each for each in function.attributes):
                function.add_function_attribute("noinline")
        super().prepare()


class _StackedOptions(_Flags):
    """Options of a function under compilation, compared by identity."""

    __hash__ = object.__hash__
    __eq__ = object.__eq__


_STACKED: dict[str, _StackedOptions] = {}


class _Options(_Flags):
    """Options of a function, one object for all that are equal.

    Numba takes a copy while it compiles the function, and compares it option by option for every expression and every
    candidate of it: a tenth of its time.
    """

    def copy(self) -> Any:
        return _STACKED.setdefault(self.summary(), _StackedOptions(self))


_UNUSED_PASSES = {"WithLifting", "InlineClosureLikes", "InlineInlinables", "InlineOverloads", "NopythonRewrites"}
"""Numba's passes for constructs that no kernel has: `with`, closures, comprehensions, array expressions."""


class KernelCompiler(_Compiler):
    """Numba's compiler without the separate optimisation of parts."""

    library: Any = _KernelLibrary

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self.state.flags = _Options(self.state.flags)

    def define_pipelines(self) -> Any:
        if self.state.library is None:
            self.state.library = self.library(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
            self.state.library.enable_object_caching()
        pipelines = super().define_pipelines()
        for pipeline in pipelines:
            pipeline.passes = [each for each in pipeline.passes if each[0].__name__ not in _UNUSED_PASSES]
            pipeline.finalize()
        return pipelines


class SearchCompiler(KernelCompiler):
    library = _SearchLibrary


class PartCompiler(KernelCompiler):
    library = _PartLibrary


class Part(_Dispatcher):
    """A part of kernels, compiled for them; called from Python, it is interpreted."""

    def __call__(self, *arguments: Any) -> Any:
        return self.py_func(*arguments)
