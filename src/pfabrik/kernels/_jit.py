"""The decorators of compiled code.

Python calls kernels; their parts (`routine`, `inlined`, `allocator`) are called by compiled code alone: where Python
calls one, it is interpreted. Kernels are looked up in the compiled module; without one all are plain Python.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar, cast

from ._shipped import LIBRARY, name_of

F = TypeVar("F", bound=Callable[..., Any])
R = TypeVar("R", bound=tuple[Any, ...])  # a NamedTuple of arrays


class Marked(NamedTuple):
    """A function of Python that a decorator was given, and the decorator's name."""

    function: Any
    kind: str


SOURCES: dict[Any, Marked] = {}
"""What each decorated function was made of, for the translation to C."""

OPENERS: dict[Any, tuple[Any, ...]] = {}
"""The sample of each `opener`."""


def _marked(function: F, kind: str, made: Any) -> F:
    SOURCES[made] = Marked(function, kind)
    return cast(F, made)


def kernel(function: F) -> F:
    """Compiled code that Python calls from any thread: no GIL, IEEE division.

    A kernel with a `scratch_address` cannot allocate, as a `routine` cannot.
    """
    return _kernel(function, "kernel")


def flattened(function: F) -> F:
    """A kernel in which every call is inlined: it is called for one pose at a time."""
    return _kernel(function, "flattened")


def search(function: F) -> F:
    """A kernel that searches, or works row by row: no loop is short enough to vectorise."""
    return _kernel(function, "search")


def _kernel(function: F, kind: str) -> F:
    return _marked(function, kind, function if LIBRARY is None else LIBRARY.kernel(name_of(function)))


def routine(function: F) -> F:
    """A part of kernels that cannot allocate."""
    return _marked(function, "routine", function)


def inlined(function: F) -> F:
    """A `routine` inlined at every call: it is called so often that the calls would cost time."""
    return _marked(function, "inlined", function)


def allocator(function: F) -> F:
    """A part of kernels that may allocate."""
    return _marked(function, "allocator", function)


def opener(sample: R) -> Callable[[Any], R]:
    """Function from the address of a `Handle` to its NamedTuple, with the types of a sample.

    Interpreted code is given the NamedTuple itself.
    """

    def given(record: R) -> R:
        return record

    OPENERS[given] = sample
    return given
