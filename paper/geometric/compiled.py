"""Closed forms are compiled where the tools of a checkout of pfabrik are beside this package; else plain Python."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])

try:
    from tools.kernels.on_call import for_each, kernel, routine

    IS_COMPILED = True
except ImportError:
    IS_COMPILED = False

    def routine(function: F) -> F:
        """A part of a closed form."""
        return function

    def kernel(function: F) -> F:
        """A closed form."""
        return function

    def for_each(function: F) -> F:
        """One call for each index up to the last argument, a count."""
        raise RuntimeError(f"{function.__name__} is plain Python, which nothing is timed by")


__all__ = ["IS_COMPILED", "for_each", "kernel", "routine"]
