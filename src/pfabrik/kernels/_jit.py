"""The decorators of the compiled code: cached on disk, keyed by the text it is made of, announced when compiled.

A kernel is what Python calls; its parts (`routine`, `inlined`, `allocator`) are called by compiled code alone. Most of
the time of compiling grows with the number of functions and of their arguments, so parts are compiled for one set of
types each, and take a NamedTuple of arrays as one pointer.
"""

from __future__ import annotations

import gc
import hashlib
import pickle
import re
import sys
import threading
import time
import warnings
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, lru_cache, partial, partialmethod
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeVar, cast

import numba
from llvmlite import ir
from numba import extending
from numba.core import cgutils, codegen, compiler, imputils, types
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.typing.templates import AttributeTemplate

# Numba is typed in some versions and not in others, and never for the options below the public ones.
_njit: Any = numba.njit
_Cache: Any = FunctionCache
_CacheFiles: Any = IndexDataCacheFile
_config: Any = numba.config
_typeof: Any = numba.typeof
_Library: Any = getattr(codegen, "JITCodeLibrary", object)
_Codegen: Any = getattr(codegen, "CPUCodegen", object)
_Compiler: Any = getattr(compiler, "Compiler", object)
_Flags: Any = getattr(compiler, "Flags", object)
_Function: Any = getattr(types, "BaseFunction", object)
_ir: Any = ir
_types: Any = types
_cgutils: Any = cgutils
_imputils: Any = imputils
_extending: Any = extending
_AttributeTemplate: Any = AttributeTemplate

F = TypeVar("F", bound=Callable[..., Any])


_IMPORTS = re.compile(r"^\s*from (\.+)([\w.]*) import (\([^)]*\)|.*)$", re.MULTILINE)


@cache
def _imported(path: Path) -> tuple[Path, ...]:
    """The files of this package that a file imports."""
    found = []
    for dots, module, names in _IMPORTS.findall(path.read_text(encoding="utf-8")):
        base = path.parents[len(dots) - 1].joinpath(*module.split("."))
        found += [base, *(base / name for name in re.findall(r"\w+", names))]
    files = (each for base in found for each in (base.with_name(f"{base.name}.py"), base / "__init__.py"))
    return tuple(each for each in files if each.is_file())


def _sources_of(path: Path) -> set[Path]:
    """A file, the files of this package that it imports, and those that these import."""
    found, waiting = {path}, [path]
    while waiting:
        fresh = set(_imported(waiting.pop())) - found
        found |= fresh
        waiting += fresh
    return found


def _digest_for(function: Callable[..., Any]) -> str:
    """Hash of all sources that a compiled function is made of: Numba itself sees no edit of another file."""
    digest = hashlib.sha256()
    for path in sorted(_sources_of(Path(function.__code__.co_filename))):
        digest.update(path.read_bytes())
    return digest.hexdigest()


class _WholeFiles(_CacheFiles):
    """Numba's files of one kernel. What is not as it was written counts as missing, so that it is compiled again:
    machine code that a crash or a full disk has cut short must not run."""

    def _load_index(self) -> dict[Any, Any]:
        try:
            return cast(dict[Any, Any], super()._load_index())
        except Exception:  # damaged bytes unpickle to anything
            return {}

    def _load_data(self, name: str) -> Any:
        written = Path(self._data_path(name)).read_bytes()
        checksum, data = written[:CHECKSUM_BYTES], written[CHECKSUM_BYTES:]
        if checksum != _checksum(data):
            raise OSError(f"{name} is damaged")  # which Numba takes for one that is gone
        return pickle.loads(data)

    def _save_data(self, name: str, data: Any) -> None:
        dumped = self._dump(data)
        with self._open_for_write(self._data_path(name)) as file:
            file.write(_checksum(dumped) + dumped)


CHECKSUM_BYTES = 4


def _checksum(data: bytes) -> bytes:
    return zlib.crc32(data).to_bytes(CHECKSUM_BYTES, "little")


class _KernelCache(_Cache):
    """Numba's file cache, made stale by an edit to any file that the kernel is made of."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        files = self._cache_file
        self._cache_file = _WholeFiles(self._cache_path, self._impl.filename_base, files._source_stamp)
        # with the version, not the stamp: an index of other sources may hold types there are no more, and is not read
        self._cache_file._version = (files._version, _digest_for(function))

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Keep what was compiled; where the disk takes no more, it runs all the same."""
        try:
            super().save_overload(signature, compiled)
        except OSError:
            _warn_of_no_cache()


@contextmanager
def _in_haste() -> Iterator[None]:
    """Without what takes Numba long and gives nothing here, for as long as it compiles.

    Collecting garbage among so many objects is a tenth of its time. Another is to find out what an operator means for
    arguments of some types, at each place anew, by trying all that it could mean.
    """
    collects, find = gc.isenabled(), getattr(_Function, "get_call_type", None)
    gc.disable()
    if _IS_HOOKED:
        _Function.get_call_type = partialmethod(_find_once, find)
    try:
        yield
    finally:
        if _IS_HOOKED:
            _Function.get_call_type = find
        if collects:
            gc.enable()


_FOUND: dict[Any, Any] = {}


def _find_once(function: Any, find: Callable[..., Any], context: Any, arguments: Any, keywords: Any) -> Any:
    """What a function of Numba's means for arguments of some types, found before or now."""
    asked = function, context, arguments, tuple(keywords.items())
    if asked not in _FOUND:
        _FOUND[asked] = find(function, context, arguments, keywords)
    return _FOUND[asked]


LARGE = 150
"""Instructions of a part, before it is optimised, beyond which a search does not take it in whole."""

TICK = 2.0
"""Seconds between two signs of life while a kernel compiles."""


def _name_of(function: Callable[..., Any]) -> str:
    """A kernel as it is announced: its folder and its name."""
    return f"{function.__module__.rpartition('.')[0].rpartition('.')[2]}.{function.__name__}".lstrip(".")


def _compile_announced(name: str, original: Callable[..., Any], *arguments: Any) -> Any:
    """Compile a kernel, saying so on standard error before, and afterwards how long it took.

    Numba calls this for what is not in the cache, with its lock held: one thread compiles, others wait for it.
    """
    _say(f"pfabrik: compiling {name} ...")
    began, done = time.perf_counter(), threading.Event()
    threading.Thread(target=_tick, args=(done,), daemon=True).start()
    try:
        with _in_haste():
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


@lru_cache(maxsize=1)
def _warn_of_no_cache() -> None:
    """Say once that compiled code cannot be kept."""
    warnings.warn(
        "compiled kernels cannot be kept, for neither the package's folder nor the user's cache folder can be written: "
        "every process compiles them anew (the environment variable NUMBA_CACHE_DIR names another folder)",
        RuntimeWarning,
        stacklevel=2,
    )


class Reference(_types.Type):
    """Numba's type of a NamedTuple of arrays taken by reference: a pointer to what its owner keeps alive.

    In compiled code it reads like the NamedTuple; whoever calls a part with one converts it. By value, every array
    would be seven or more arguments of every function that it goes through.
    """

    def __init__(self, record: Any) -> None:
        self.record = record
        super().__init__(f"Reference({record.name})")


@_extending.register_model(Reference)
class _ReferenceModel(_extending.models.PrimitiveModel):
    def __init__(self, manager: Any, reference: Any) -> None:
        super().__init__(manager, reference, manager.lookup(reference.record).get_value_type().as_pointer())


@_extending.infer_getattr
class _ReferenceAttribute(_AttributeTemplate):
    key = Reference

    def generic_resolve(self, reference: Any, name: str) -> Any:
        fields = reference.record.fields
        return _argument_type(reference.record.types[fields.index(name)]) if name in fields else None


@_extending.lower_getattr_generic(Reference)
def _load_field(context: Any, builder: Any, reference: Any, pointer: Any, name: str) -> Any:
    place = reference.record.fields.index(name)
    own, field = reference.record.types[place], _cgutils.gep_inbounds(builder, pointer, 0, place)
    if isinstance(own, _types.BaseNamedTuple):
        return field
    return _imputils.impl_ret_borrowed(context, builder, own, builder.load(field))


@_extending.lower_cast(_types.BaseNamedTuple, Reference)
def _refer(context: Any, builder: Any, record: Any, reference: Any, value: Any) -> Any:
    """Where a NamedTuple is, if it was loaded from somewhere; LLVM takes long to copy it, array by array."""
    if isinstance(value, _ir.LoadInstr) and isinstance(value.operands[0], _ir.AllocaInstr):
        return value.operands[0]
    return _cgutils.alloca_once_value(builder, value)


def _argument_type(given: Any) -> Any:
    """The type by which a part takes an argument: a number's value is not part of it, a NamedTuple is a reference."""
    given = _types.unliteral(given)
    return Reference(given) if isinstance(given, _types.BaseNamedTuple) else given


def _resolve_call(
    dispatcher: Any, original: Callable[..., Any], known: dict[Any, Any], arguments: Any, keywords: Any
) -> Any:
    """What Numba asks of a function called with arguments of some types, for the types that the part takes.

    It asks at each call, and to be told that the part is compiled already takes it long: what is known is kept.
    """
    _, folded = dispatcher._compiler.fold_argument_types(arguments, keywords)
    taken = tuple(_argument_type(given) for given in folded)
    if taken not in known:
        known[taken] = original(taken, {})
    return known[taken]


class _PartLibrary(_Library):
    """The code of a part, not optimised and no machine code: each kernel that it goes into does both, for the whole."""

    def _optimize_functions(self, module: Any) -> None:
        """Tidy each function by itself, all with the same passes; Numba makes them anew for each, also for those that
        are only declared."""
        module.data_layout = self._codegen._data_layout
        passes, builder = self._codegen._function_pass_manager()
        for function in module.functions:
            if not function.is_declaration:
                passes.run(function, builder)

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
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

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage.name == "linkonce_odr":
                function.linkage = "internal"
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)


class _SearchLibrary(_KernelLibrary):
    """The code of a search, whose large parts are called where they are used, and not taken in whole at each place."""

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


class _KernelCompiler(_Compiler):
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


class _SearchCompiler(_KernelCompiler):
    library = _SearchLibrary


class _PartCompiler(_KernelCompiler):
    library = _PartLibrary


# Numba promises these to nobody: with a version that has others, all is compiled in its own way, which takes longer.
_HOOKS = (
    (_Library, "_optimize_functions _optimize_final_module _finalize_final_module codegen"),
    (_Codegen, "_function_pass_manager _module_pass_manager"),
    (_Compiler, "define_pipelines"),
    (_Flags, "summary copy"),
    (_Function, "get_call_type"),
)
_IS_HOOKED = all(hasattr(owner, name) for owner, names in _HOOKS for name in names.split())

_KERNEL: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
_SEARCH = _KERNEL.copy()
# Parts of kernels are called by compiled code alone: without entry points for Python they compile faster.
_PART = _KERNEL | {"no_cpython_wrapper": True}
if _IS_HOOKED:
    _KERNEL["pipeline_class"], _SEARCH["pipeline_class"] = _KernelCompiler, _SearchCompiler
    _PART["pipeline_class"] = _PartCompiler


def kernel(function: F) -> F:
    """Compile `function` for any thread: no GIL, IEEE division, results cached on disk.

    The cache is beside the source if that can be written, else in the user's cache folder, else there is none.
    """
    return _cached(_njit(**_KERNEL)(function), function)


def search(function: F) -> F:
    """Compile `function` as a kernel that searches: much code, of which no loop is short enough for vectors.

    A few in a hundred slower than a `kernel`, and optimised in half the time.
    """
    return _cached(_njit(**_SEARCH)(function), function)


def _cached(dispatcher: Any, function: F) -> F:
    """Keep what is compiled of a kernel, and say when it is compiled."""
    if not _config.DISABLE_JIT:
        compile_quietly = dispatcher._compiler.compile
        dispatcher._compiler.compile = partial(_compile_announced, _name_of(function), compile_quietly)
        try:
            dispatcher._cache = _KernelCache(function)
        except RuntimeError:
            _warn_of_no_cache()
    return cast(F, dispatcher)


def _part(function: F, **options: Any) -> F:
    """Compile `function` as a part of kernels."""
    dispatcher: Any = _njit(**_PART, **options)(function)
    if not _config.DISABLE_JIT:
        dispatcher.get_call_template = partial(_resolve_call, dispatcher, dispatcher.get_call_template, {})
    return dispatcher


def routine(function: F) -> F:
    """Compile `function` as a part of kernels: it has no cache entry of its own, and cannot allocate.

    Without Numba's memory manager no reference is counted, which is most of the time of code as small as this, and
    most of its compilation.
    """
    return _part(function, _nrt=False)


def inlined(function: F) -> F:
    """A `routine` that every caller takes in whole: it is called so often that a call would show in the time."""
    return _part(function, _nrt=False, forceinline=True)


def allocator(function: F) -> F:
    """Compile `function` as a part of kernels that may allocate."""
    return _part(function)
