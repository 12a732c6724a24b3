"""How Numba compiles kernels here: parts once, optimised with what they go into, without what gives nothing."""

from __future__ import annotations

import gc
import sys
import threading
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partialmethod
from types import SimpleNamespace
from typing import Any

from numba.core import base, codegen, compiler, cpu, dispatcher, event, types
from numba.core.registry import cpu_target

# Numba is typed in some versions and not in others, and never for the options below the public ones.
_Library: Any = getattr(codegen, "JITCodeLibrary", object)
_Codegen: Any = getattr(codegen, "CPUCodegen", object)
_Compiler: Any = getattr(compiler, "Compiler", object)
_Flags: Any = getattr(compiler, "Flags", object)
_Dispatcher: Any = dispatcher.Dispatcher
_Function: Any = getattr(types, "BaseFunction", object)
_Context: Any = getattr(base, "BaseContext", object)
_CpuContext: Any = getattr(cpu, "CPUContext", object)
_event: Any = event

# Numba promises these to nobody: with a version that has others, all is compiled in its own way, which takes longer.
_HOOKS = (
    (_Library, "_optimize_functions _optimize_final_module finalize codegen"),
    (_Codegen, "_function_pass_manager _module_pass_manager"),
    (_Compiler, "define_pipelines"),
    (_Flags, "summary copy"),
    (_Function, "get_call_type"),
    (_Context, "get_abi_sizeof get_preferred_array_alignment install_registry mangler refresh"),
    (_CpuContext, "load_additional_registries"),
    (_event, "broadcast"),
)
IS_HOOKED = all(hasattr(owner, name) for owner, names in _HOOKS for name in names.split())

LARGE = 150
"""Instructions of a part, before it is optimised, beyond which a search does not take it in whole."""

TICK = 2.0
"""Seconds between two signs of life while a kernel compiles."""


def name_of(function: Callable[..., Any]) -> str:
    """A kernel as it is announced: its folder and its name."""
    return f"{function.__module__.rpartition('.')[0].rpartition('.')[2]}.{function.__name__}".lstrip(".")


def compile_announced(name: str, original: Callable[..., Any], *arguments: Any) -> Any:
    """Compile a kernel, saying so on standard error before, and afterwards how long it took.

    Numba calls this for what is not in the cache, with its lock held: one thread compiles, others wait for it.
    """
    _say(f"pfabrik: compiling {name} ...")
    began, done = time.perf_counter(), threading.Event()
    threading.Thread(target=_tick, args=(done,), daemon=True).start()
    try:
        with in_haste():
            return original(*arguments)
    finally:
        done.set()
        _say(f" {time.perf_counter() - began:.1f} s\n")


def _tick(done: threading.Event) -> None:
    """A dot on standard error every few seconds, until it is done."""
    while not done.wait(TICK):
        _say(".")


def _say(text: str) -> None:
    """Write on standard error at once, where there is one: a program without a terminal may have closed it."""
    if sys.stderr is not None:
        sys.stderr.write(text)
        sys.stderr.flush()


@contextmanager
def in_haste() -> Iterator[None]:
    """Without what takes Numba long and gives nothing here, and arrays on whole lines of the cache, while it compiles.

    Collecting garbage among so many objects is a tenth of its time.
    """
    collects = gc.isenabled()
    gc.disable()
    if IS_HOOKED:
        cpu_target.target_context.refresh()
        for owner, name, _, ours in _HASTENED:
            setattr(owner, name, ours)
    try:
        yield
    finally:
        if IS_HOOKED:
            for owner, name, theirs, _ in _HASTENED:
                setattr(owner, name, theirs)
        if collects:
            gc.enable()


_FOUND: dict[Any, Any] = {}


def _find_once(function: Any, find: Callable[..., Any], context: Any, arguments: Any, keywords: Any) -> Any:
    """What a function of Numba's means for arguments of some types, found before or now.

    To find it out at each place anew, by trying all that an operator could mean, is another tenth.
    """
    asked = function, context, arguments, tuple(keywords.items())
    if asked not in _FOUND:
        _FOUND[asked] = find(function, context, arguments, keywords)
    return _FOUND[asked]


_SIZES: dict[str, int] = {}


def _measure_once(context: Any, measure: Callable[..., int], kind: Any) -> int:
    """The size of a type, for which LLVM is given a module with a variable of it, for every variable twice."""
    if str(kind) not in _SIZES:
        _SIZES[str(kind)] = measure(context, kind)
    return _SIZES[str(kind)]


def _mangle_briefly(context: Any, mangle: Callable[..., str], name: str, taken: Any, **tags: Any) -> str:
    """The name of a function in machine code, with a checksum of the types it takes: the types of records are thousands
    of letters, and every call would repeat them."""
    return mangle(context, name, (f"{zlib.crc32(repr(taken).encode()):08x}",), **tags)


def _install_new(context: Any) -> None:
    """Take note of what was declared meanwhile; Numba imports all its own modules again before, a dozen times for every
    function."""
    for registry in list(context._registries):
        context.install_registry(registry)


def _whole_lines(context: Any, kind: Any) -> int:
    """Arrays begin where a line of the cache does: vectors as long as one would otherwise be read from two."""
    return 64


def _tell_nobody(event: Any) -> None:
    """Events, of which there are as many as calls of LLVM, tell times that nobody asks for."""


def _hastened(owner: Any, name: str, ours: Callable[..., Any], *, asks: bool) -> tuple[Any, str, Any, Any]:
    """What of Numba is replaced by what of ours, which is given the replaced one if it `asks` that."""
    theirs = getattr(owner, name, None)
    return owner, name, theirs, partialmethod(ours, theirs) if asks else ours


_HASTENED = (
    _hastened(_Function, "get_call_type", _find_once, asks=True),
    _hastened(_Context, "get_abi_sizeof", _measure_once, asks=True),
    _hastened(_Context, "mangler", _mangle_briefly, asks=True),
    _hastened(_CpuContext, "load_additional_registries", _install_new, asks=False),
    _hastened(_event, "broadcast", _tell_nobody, asks=False),
    _hastened(_Context, "get_preferred_array_alignment", _whole_lines, asks=False),
)


class _PartLibrary(_Library):
    """The code of a part alone, not optimised and no machine code: each kernel that it goes into takes in what the part
    calls, and does both for the whole."""

    def _optimize_functions(self, module: Any) -> None:
        """Tidy each function by itself, all with the same passes; Numba makes them anew for each, also for those that
        are only declared."""
        module.data_layout = self._codegen._data_layout
        passes, builder = self._codegen._function_pass_manager()
        for function in module.functions:
            if not function.is_declaration:
                passes.run(function, builder)

    def finalize(self) -> None:
        self._finalized = True

    @property
    def codegen(self) -> Any:
        """What Numba asks, with the code in place, to note its Python environment there; here it is in no place."""
        return SimpleNamespace(set_env=lambda name, environment: None)


class _KernelLibrary(_Library):
    """The code of a kernel with all its parts; nobody else can call them, so arguments that go unused are dropped.

    A mechanism by value is more than fifty arguments, of which most parts use a few. Optimised once: Numba does it
    twice, for the sake of counts of references, of which there are hardly any here; that is a sixth of all its time.
    """

    _optimize_functions = _PartLibrary._optimize_functions

    def finalize(self) -> None:
        """Take in the parts, and the parts of these, each once; Numba takes them in again at every step up to here."""
        taken = self._linking_libraries
        for library in taken:  # which grows meanwhile
            if isinstance(library, _PartLibrary):
                taken += [each for each in library._linking_libraries if each not in taken]
        super().finalize()

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage.name == "linkonce_odr":
                function.linkage = "internal"
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)


class _SearchLibrary(_KernelLibrary):
    """The code of a search, whose large parts are called where they are used, and not taken in whole at each place."""

    def _optimize_functions(self, module: Any) -> None:
        """Nothing yet: what is the search's own is optimised with all it takes in, and has no loop to be vectors."""
        module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if str(function).count("\n  ") > LARGE and not any(b"alwaysinline" in each for each in function.attributes):
                function.add_function_attribute("noinline")
        super()._optimize_final_module()


class _StackedOptions(_Flags):
    """Options of a function being compiled, equal to themselves alone."""

    __hash__ = object.__hash__
    __eq__ = object.__eq__


_STACKED: dict[str, _StackedOptions] = {}


class _Options(_Flags):
    """Options of a function, which give one object for all that are equal.

    Numba takes a copy along while it compiles the function, and compares it, option by option, for every expression
    and everything that the expression could mean: a tenth of its time.
    """

    def copy(self) -> Any:
        return _STACKED.setdefault(self.summary(), _StackedOptions(self))


_NEEDLESS = {"WithLifting", "InlineClosureLikes", "InlineInlinables", "InlineOverloads", "NopythonRewrites"}
"""Numba's passes for what no kernel has: `with`, closures and comprehensions, arithmetic of whole arrays."""


class KernelCompiler(_Compiler):
    """Numba's compiler, which otherwise optimises a part by itself and again in every function above it."""

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
            pipeline.passes = [each for each in pipeline.passes if each[0].__name__ not in _NEEDLESS]
            pipeline.finalize()
        return pipelines


class SearchCompiler(KernelCompiler):
    library = _SearchLibrary


class PartCompiler(KernelCompiler):
    library = _PartLibrary


class Part(_Dispatcher):
    """A part of kernels, compiled for them; Python that calls it has it interpreted."""

    def __call__(self, *arguments: Any) -> Any:
        return self.py_func(*arguments)
