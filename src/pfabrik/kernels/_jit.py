"""The decorators of compiled code: cached on disk, keyed by its source text, announced when compiled.

Python calls kernels; their parts (`routine`, `inlined`, `allocator`) are called by compiled code alone. Compile time
grows with the number of functions and of their arguments, so parts are compiled for one set of types each, and take a
NamedTuple of arrays as one pointer.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from inspect import signature
from typing import Any, TypeVar, cast

import numba

from ._cache import KernelCache, warn_of_no_cache
from ._pipeline import IS_HOOKED, KernelCompiler, Part, PartCompiler, SearchCompiler, compile_announced, name_of
from .references import argument_type

_njit: Any = numba.njit
_config: Any = numba.config

F = TypeVar("F", bound=Callable[..., Any])

_KERNEL: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
_SEARCH = _KERNEL.copy()
# Parts of kernels are called by compiled code alone: without entry points for Python they compile faster.
_PART = _KERNEL | {"no_cpython_wrapper": True}
if IS_HOOKED:
    _KERNEL["pipeline_class"], _SEARCH["pipeline_class"] = KernelCompiler, SearchCompiler
    _PART["pipeline_class"] = PartCompiler


def kernel(function: F) -> F:
    """Compile `function` for any thread: no GIL, IEEE division, results cached on disk.

    The cache is beside the source if that is writable, else in the user's cache folder, else there is none. A kernel
    with a `scratch_address` cannot allocate, as a `routine` cannot.
    """
    return _compiled(function, _KERNEL)


def search(function: F) -> F:
    """Compile `function` as a kernel that searches, or works row by row: no loop is short enough to vectorise.

    A few per cent slower than a `kernel`, and optimised in half the time.
    """
    return _compiled(function, _SEARCH)


def _compiled(function: F, options: dict[str, Any]) -> F:
    """Compile a kernel, cached and announced."""
    dispatcher = _njit(**options, _nrt="scratch_address" not in signature(function).parameters)(function)
    if not _config.DISABLE_JIT:
        compile_quietly = dispatcher._compiler.compile
        dispatcher._compiler.compile = partial(compile_announced, name_of(function), compile_quietly)
        try:
            dispatcher._cache = KernelCache(function)
        except RuntimeError:
            warn_of_no_cache()
    return cast(F, dispatcher)


def _resolve_call(
    dispatcher: Any, original: Callable[..., Any], known: dict[Any, Any], arguments: Any, keywords: Any
) -> Any:
    """Numba's call template for the types that a part takes.

    Numba asks at each call, and takes long to see that the part is compiled already: results are cached.
    """
    _, folded = dispatcher._compiler.fold_argument_types(arguments, keywords)
    taken = tuple(argument_type(given) for given in folded)
    if taken not in known:
        known[taken] = original(taken, {})
    return known[taken]


def _part(function: F, **options: Any) -> F:
    """Compile `function` as a part of kernels."""
    part: Any = _njit(**_PART, **options)(function)
    if not _config.DISABLE_JIT:
        part.__class__ = Part
        part.get_call_template = partial(_resolve_call, part, part.get_call_template, {})
    return part


def routine(function: F) -> F:
    """Compile `function` as a part of kernels: it has no cache entry of its own, and cannot allocate.

    Without Numba's memory manager no references are counted: that would be most of the run time of code as small as
    this, and most of its compile time.
    """
    return _part(function, _nrt=False)


def inlined(function: F) -> F:
    """A `routine` inlined at every call: it is called so often that the calls would cost time."""
    return _part(function, _nrt=False, forceinline=True)


def allocator(function: F) -> F:
    """Compile `function` as a part of kernels that may allocate."""
    return _part(function)
