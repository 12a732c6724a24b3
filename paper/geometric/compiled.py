"""How the formulas are compiled: by Numba, without the GIL, once a process."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])

_njit: Any = numba.njit


def kernel(function: F) -> F:
    """Compile what Python calls.

    Nothing is kept on disk: Numba's cache does not see that a part in another file has changed.
    """
    return cast(F, _njit(nogil=True, error_model="numpy")(function))


def routine(function: F) -> F:
    """Compile a part that kernels take in whole: they are optimised together, which a fifth of the time hangs on."""
    return cast(F, _njit(nogil=True, error_model="numpy", forceinline=True)(function))
