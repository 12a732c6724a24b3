"""The one decorator of the compiled code: cached on disk, keyed by the text of every kernel, announced when cold."""

from __future__ import annotations

import contextlib
import hashlib
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core.caching import FunctionCache

# Numba is typed in some versions and not in others, and never for the options below the public ones.
_njit: Any = numba.njit
_Cache: Any = FunctionCache
_config: Any = numba.config

F = TypeVar("F", bound=Callable[..., Any])


def _sources_digest() -> str:
    """Hash of all kernel sources: Numba itself does not see an edit in another file's function."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


_DIGEST = _sources_digest()


class _KernelCache(_Cache):  # type: ignore[misc]  # a class only at run time
    """Numba's file cache, made stale by an edit to any kernel file; says so when it has to compile."""

    _announced = threading.Event()

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self._cache_file._source_stamp = (self._cache_file._source_stamp, _DIGEST)

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        overload = super().load_overload(signature, target_context)
        if overload is None and not self._announced.is_set():
            self._announced.set()
            sys.stderr.write("pfabrik: compiling the kernels, once per version (under a minute) ...\n")
            sys.stderr.flush()
        return overload


# Parts of kernels are called by compiled code alone: without entry points for Python they compile faster.
_PART = {"nogil": True, "error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def kernel(function: F) -> F:
    """Compile `function` for any thread: no GIL, IEEE division, results cached on disk."""
    dispatcher: Any = _njit(nogil=True, error_model="numpy")(function)
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
    """A `routine` that every caller takes in whole: passing a mechanism by value costs more than such a call does."""
    return _njit(**_PART, _nrt=False, forceinline=True)(function)


def allocator(function: F) -> F:
    """Compile `function` as a part of kernels that may allocate."""
    return _njit(**_PART)(function)
