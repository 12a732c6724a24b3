"""The decorators of `_jit` where Numba compiles: cached on disk, keyed by its source text, announced when compiled.

Compile time grows with the number of functions and of their arguments, so parts are compiled for one set of types each,
and take a NamedTuple of arrays as one pointer.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from inspect import signature
from typing import Any, TypeVar, cast

import numba
import numpy as np

from .._shipped import name_of
from .cache import KernelCache
from .pipeline import KernelCompiler, Part, PartCompiler, SearchCompiler, compile_announced
from .references import argument_type
from .references import opener as opener

_njit: Any = numba.njit
_typeof: Any = numba.typeof

F = TypeVar("F", bound=Callable[..., Any])

_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
_KERNEL, _SEARCH = _OPTIONS | {"pipeline_class": KernelCompiler}, _OPTIONS | {"pipeline_class": SearchCompiler}
# Parts of kernels are called by compiled code alone: without entry points for Python they compile faster.
_PART = _OPTIONS | {"pipeline_class": PartCompiler, "no_cpython_wrapper": True}


def kernel(function: F) -> F:
    """Compile `function` for any thread: no GIL, IEEE division, results cached on disk.

    The cache is beside the source if that is writable, else in the user's cache folder, else there is none.
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
    dispatcher._compiler.compile = partial(compile_announced, name_of(function), dispatcher._compiler.compile)
    with suppress(RuntimeError):  # no folder can be written to: each process compiles
        dispatcher._cache = KernelCache(function)
    return cast(F, dispatcher)


def compile_for(compiled: Any, arguments: tuple[Any, ...]) -> None:
    """Compile a kernel for arguments of these types, or load it from the cache."""
    compiled.compile(types_of(arguments))


def types_of(arguments: tuple[Any, ...]) -> tuple[Any, ...]:
    """Types that a kernel is compiled for: read-only arrays are taken as the others are."""
    return tuple(_typeof(_writable(argument)) for argument in arguments)


def _writable(value: Any) -> Any:
    if isinstance(value, tuple):
        return value._make(map(_writable, value))  # type: ignore[attr-defined]
    return value.copy() if isinstance(value, np.ndarray) else value


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
