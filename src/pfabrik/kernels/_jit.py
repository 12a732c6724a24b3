"""The decorators of compiled code.

Python calls kernels; their parts (`routine`, `inlined`, `allocator`) are called by compiled code alone: where Python
calls one, it is interpreted. Kernels are looked up in the compiled module; without one Numba compiles, in `_numba`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar, cast

from ._shipped import COMPILES, LIBRARY, name_of

F = TypeVar("F", bound=Callable[..., Any])
R = TypeVar("R", bound=tuple[Any, ...])  # a NamedTuple of arrays

if COMPILES and not TYPE_CHECKING:
    from ._numba.decorators import allocator, inlined, kernel, opener, routine, search
else:

    def kernel(function: F) -> F:
        """Compiled code that Python calls from any thread: no GIL, IEEE division.

        A kernel with a `scratch_address` cannot allocate, as a `routine` cannot.
        """
        return function if LIBRARY is None else cast(F, LIBRARY.kernel(name_of(function)))

    def search(function: F) -> F:
        """A kernel that searches, or works row by row: no loop is short enough to vectorise."""
        return kernel(function)

    def routine(function: F) -> F:
        """A part of kernels that cannot allocate."""
        return function

    def inlined(function: F) -> F:
        """A `routine` inlined at every call: it is called so often that the calls would cost time."""
        return function

    def allocator(function: F) -> F:
        """A part of kernels that may allocate."""
        return function

    def opener(sample: R) -> Callable[[Any], R]:
        """Compiled function from the address of a `Handle` to its NamedTuple, with the types of a sample.

        Interpreted code is given the NamedTuple itself.
        """
        return lambda record: record
