"""Checks of array arguments: their type, shape and values, and the sentence of a refusal."""

from __future__ import annotations

import reprlib
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from ..errors import InvalidArgument
from .arrays import Floats, Mask

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
    shapes = _shapes(shape)
    expected = f"{what} of shape {shapes[0].shown}{note}"
    found = as_floats(name, value, expected)
    for form in shapes:
        if form.fits(found.shape):
            break
    else:
        raise InvalidArgument(name, f"shape {found.shape}", expected)
    good = holds(found)
    if not good.all():
        words = reprlib.repr(found.tolist()) if np.isfinite(found[~good]).all() else "a number that is not finite"
        batch = found.shape[: found.ndim - form.n_of_row]
        bad = np.flatnonzero(~good.reshape(*batch, -1).all(axis=-1))
        raise InvalidArgument(name, words, expected, rows=bad[:5].tolist() if batch else ())
    return found


class _Shape(NamedTuple):
    """A shape that an array may have.

    Attributes
    ----------
    is_open : True if any axes may come before.
    sizes : of its axes; None for those that are free.
    n_of_row : number of axes that are not those of a batch.
    shown : what a sentence says of it, and of others that may be too.
    """

    is_open: bool
    sizes: tuple[int | None, ...]
    n_of_row: int
    shown: str

    def fits(self, shape: tuple[int, ...]) -> bool:
        """True if an array's shape is such a one."""
        inner = shape[max(len(shape) - len(self.sizes), 0) :] if self.is_open else shape
        if inner == self.sizes or len(inner) != len(self.sizes):
            return inner == self.sizes
        return all(known in (None, size) for size, known in zip(inner, self.sizes, strict=True))


@cache
def _shapes(text: str) -> list[_Shape]:
    """The shapes that a text stands for."""
    words = [each.strip("() ").split() for each in text.split("|")]
    shown = (f"({', '.join(each)}{',' if len(each) == 1 and each != ['...'] else ''})" for each in words)
    sentence = " or ".join(shown)
    return [
        _Shape(
            each[:1] == ["..."],
            tuple(int(size) if size.isdigit() else None for size in each if size != "..."),
            sum(size not in ("...", "n") for size in each),
            sentence,
        )
        for each in words
    ]


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
    """True where values are finite and greater than 0."""
    return np.isfinite(values) & (values > 0.0)


def is_not_negative(values: Floats) -> Mask:
    """True where values are finite and not negative."""
    return np.isfinite(values) & (values >= 0.0)


def any_values(values: Floats) -> Mask:
    """Accept all values; they are checked later, row by row."""
    return np.ones(values.shape, bool)


def is_not_infinite(values: Floats) -> Mask:
    """True where values are finite, or NaN for unknown values."""
    return np.asarray(~np.isinf(values))
