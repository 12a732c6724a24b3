"""The one decorator of the compiled code: cached on disk, keyed by the text of every kernel, announced when cold."""

from __future__ import annotations

import contextlib
import hashlib
import sys
import threading
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeVar

import numba
from numba.core import codegen, compiler
from numba.core.caching import FunctionCache

# Numba is typed in some versions and not in others, and never for the options below the public ones.
_njit: Any = numba.njit
_Cache: Any = FunctionCache
_config: Any = numba.config
_Library: Any = getattr(codegen, "JITCodeLibrary", object)
_Compiler: Any = getattr(compiler, "Compiler", object)

F = TypeVar("F", bound=Callable[..., Any])


@lru_cache
def _sources_digest(folder: Path) -> str:
    """Hash of all sources in a folder: Numba itself does not see an edit in another file's function."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


_FOLDER = Path(__file__).parent
_DIGEST = _sources_digest(_FOLDER)


def _digest_for(function: Callable[..., Any]) -> tuple[str, ...]:
    """What a compiled function depends on: the kernels and, elsewhere in the package, the folder it is written in."""
    folder = Path(function.__code__.co_filename).parent
    return (_DIGEST, _sources_digest(folder)) if _FOLDER.parent in folder.parents else (_DIGEST,)


class _KernelCache(_Cache):  # type: ignore[misc]  # a class only at run time
    """Numba's file cache, made stale by an edit to any file beside the kernel; says so when it has to compile."""

    _announced = threading.Event()

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self._cache_file._source_stamp = (self._cache_file._source_stamp, *_digest_for(function))

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        overload = super().load_overload(signature, target_context)
        if overload is None and not self._announced.is_set():
            self._announced.set()
            sys.stderr.write("pfabrik: compiling the kernels, once per version ...\n")
            sys.stderr.flush()
        return overload


class _PartLibrary(_Library):  # type: ignore[misc]  # a class only at run time
    """The code of a part, not optimised and no machine code: each kernel that it goes into does both, for the whole."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True

    @property
    def codegen(self) -> Any:
        """What Numba asks, with the code in place, to note its Python environment there; here it is in no place."""
        return SimpleNamespace(set_env=lambda name, environment: None)


class _KernelLibrary(_Library):  # type: ignore[misc]  # a class only at run time
    """The code of a kernel with all its parts; nobody else can call them, so arguments that go unused are dropped.

    A mechanism by value is more than fifty arguments, of which most parts use a few.
    """

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage.name == "linkonce_odr":
                function.linkage = "internal"
        super()._optimize_final_module()


class _KernelCompiler(_Compiler):  # type: ignore[misc]  # a class only at run time
    """Numba's compiler, which otherwise optimises a part by itself and again in every function above it."""

    library: Any = _KernelLibrary

    def define_pipelines(self) -> Any:
        if self.state.library is None:
            self.state.library = self.library(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
            self.state.library.enable_object_caching()
        return super().define_pipelines()


class _PartCompiler(_KernelCompiler):
    library = _PartLibrary


# Numba promises these to nobody: with a version that has others, all is compiled in its own way, which takes longer.
_HOOKS = ((_Library, "_optimize_final_module _finalize_final_module codegen"), (_Compiler, "define_pipelines"))
_IS_HOOKED = all(hasattr(owner, name) for owner, names in _HOOKS for name in names.split())

_KERNEL: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
# Parts of kernels are called by compiled code alone: without entry points for Python they compile faster.
_PART = _KERNEL | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
if _IS_HOOKED:
    _KERNEL["pipeline_class"], _PART["pipeline_class"] = _KernelCompiler, _PartCompiler


def kernel(function: F) -> F:
    """Compile `function` for any thread: no GIL, IEEE division, results cached on disk."""
    dispatcher: Any = _njit(**_KERNEL)(function)
    if not _config.DISABLE_JIT:
        # where neither the package's folder nor the user's cache can be written, every process compiles anew
        with contextlib.suppress(RuntimeError):
            dispatcher._cache = _KernelCache(function)
    return dispatcher


def routine(function: F) -> F:
    """Compile `function` as a part of kernels: it has no cache entry of its own, and cannot allocate.

    Without Numba's memory manager no reference is counted, which is most of the time of code as small as this, and
    most of its compilation.
    """
    return _njit(**_PART, _nrt=False)(function)


def inlined(function: F) -> F:
    """A `routine` that every caller takes in whole: it is called so often that a call would show in the time."""
    return _njit(**_PART, _nrt=False, forceinline=True)(function)


def allocator(function: F) -> F:
    """Compile `function` as a part of kernels that may allocate."""
    return _njit(**_PART)(function)
