"""Arrays that callers pass: one check of what they are, their shape and their values, and one sentence that says it."""

from __future__ import annotations

import reprlib
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from .arrays import Floats, Mask
from .errors import InvalidArgument

DOUBLE = np.dtype(np.float64)


def array(
    name: str,
    value: Any,
    shape: str,
    what: str = "finite numbers",
    note: str = "",
    holds: Callable[[Floats], Mask] = np.isfinite,
) -> Floats:
    """An argument as an array of float64; InvalidArgument for another shape, or for values that may not be.

    Parameters
    ----------
    name : of the argument.
    shape : sizes of its axes, words for those that are free, `...` for leading ones: "... 3", "n 3". "()" is a number;
        one of several shapes has `|` between them.
    what, note : the sentence says that `what` is expected, then the shape, then the note, a unit for example.
    holds : which values may be.
    """
    shapes, shown = _shapes(shape)
    expected = f"{what} of shape {shown}{note}"
    found = as_floats(name, value, expected)
    core = next((each for each in shapes if _fits(found.shape, each)), None)
    if core is None:
        raise InvalidArgument(name, f"shape {found.shape}", expected)
    good = holds(found)
    if not good.all():
        words = reprlib.repr(found.tolist()) if np.isfinite(found[~good]).all() else "a number that is not finite"
        n_free = found.ndim - sum(each not in ("...", "n") for each in core)
        bad = np.flatnonzero(~good.reshape(*found.shape[:n_free], -1).all(axis=-1))
        raise InvalidArgument(name, words, expected, rows=bad[:5].tolist() if n_free else ())
    return found


@cache
def _shapes(text: str) -> tuple[list[tuple[str, ...]], str]:
    """The shapes that a text stands for, and what a sentence says of them."""
    shapes = [tuple(each.strip("() ").split()) for each in text.split("|")]
    shown = (f"({', '.join(each)}{',' if len(each) == 1 and each != ('...',) else ''})" for each in shapes)
    return shapes, " or ".join(shown)


def _fits(found: tuple[int, ...], shape: tuple[str, ...]) -> bool:
    """True if an array's shape is one that a text stands for."""
    if shape[:1] == ("...",):
        shape = shape[1:]
        found = found[max(len(found) - len(shape), 0) :]
    return len(found) == len(shape) and all(
        size == int(each) for size, each in zip(found, shape, strict=True) if each.isdigit()
    )


def as_floats(name: str, value: Any, expected: str) -> Floats:
    """`value` as an array of float64; InvalidArgument for text, ragged nests, complex, boolean and masked values."""
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        raise InvalidArgument(name, "an array with masked values", expected)
    try:
        found = np.asarray(value)
    except ValueError as error:
        raise InvalidArgument(name, "a ragged nest of sequences", expected) from error
    if found.dtype.kind not in "iuf":
        raise InvalidArgument(name, f"{type(value).__name__} of dtype {found.dtype}", expected)
    if found.dtype is DOUBLE and found.flags.carray:
        return found
    return np.array(found, np.float64, order="C")  # the one memory layout that kernels are compiled for


def is_positive(values: Floats) -> Mask:
    """Which values are finite and greater than 0."""
    return np.isfinite(values) & (values > 0.0)


def is_not_negative(values: Floats) -> Mask:
    """Which values are finite and not negative."""
    return np.isfinite(values) & (values >= 0.0)


def any_values(values: Floats) -> Mask:
    """All values: what they are is seen later, row by row."""
    return np.ones(values.shape, bool)


def is_not_infinite(values: Floats) -> Mask:
    """Which values are finite, or NaN for what is not known."""
    return np.asarray(~np.isinf(values))
