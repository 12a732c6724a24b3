"""The digits of a file, and how exactly they place the axes of its joints."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats

FEWEST = 4
"""Significant digits from which a number was rounded: what people type in full (`0.25`) rarely has more than three."""

HALF = 0.5
"""By how many units of its last digit rounding changes a number at most."""


class Rounding(NamedTuple):
    """How far from what was meant the digits of a file put a joint at most: its point [length], its axis [rad]."""

    length: float
    angle: float

    def on(self, offset: ArrayLike, length: float, angle: float) -> Rounding:
        """Of what is placed on a body so rounded, at an offset (3,) from its origin, with its own digits."""
        arm = float(np.linalg.norm(offset))
        return Rounding(self.length + self.angle * arm + length, self.angle + angle)


NOTHING = Rounding(0.0, 0.0)


def worst(roundings: Iterable[Rounding]) -> Rounding:
    """The largest length and the largest angle; nothing of none."""
    each = [NOTHING, *roundings]
    return Rounding(max(one.length for one in each), max(one.angle for one in each))


@dataclass(frozen=True)
class Digits:
    """How numbers of one kind were rounded: to significant digits, or to decimals (`decimals` is then not None)."""

    significant: int = 17
    decimals: int | None = None

    def errors(self, values: ArrayLike, fewest: int | None = None) -> Floats:
        """By how much rounding changed numbers at most, in their shape.

        Parameters
        ----------
        fewest : significant digits from which a number counts as rounded at its own last digit, even where others of
            the file have more; None where it does not.
        """
        flat = [self._error(float(value), fewest) for value in np.ravel(values)]
        return np.reshape(np.array(flat), np.shape(values))

    def _error(self, value: float, fewest: int | None) -> float:
        if self.decimals is not None:
            places = self.decimals
        elif value == 0.0:
            return 0.0
        else:
            places = self.significant - 1 - math.floor(math.log10(abs(value)))
        if fewest is not None:
            own = _shape(repr(value))
            if own is not None and own[0] >= fewest:
                places = own[1]
        return HALF * 10.0 ** -min(places, 300)


def digits_of(texts: Iterable[str], fewest: int = FEWEST - 1) -> Digits:
    """How the numbers in some texts, with blanks between them, were rounded.

    The number of digits that most long numbers have: significant ones, or, if more of them agree in these, decimals.
    Numbers that are all short are taken as rounded if some have `fewest` significant digits, else as exact.
    """
    shapes = [shape for text in texts for word in text.split() if (shape := _shape(word)) is not None]
    long = [shape for shape in shapes if shape[0] >= FEWEST]
    if not long:
        long = [shape for shape in shapes if shape[0] >= fewest]
        return Digits(significant=max(n for n, _ in long)) if long else Digits()
    significant, agree = _most_common(n for n, _ in long)
    decimals, agree_fixed = _most_common(d for _, d in long)
    return Digits(significant, decimals if agree_fixed > agree else None)


def _most_common(counts: Iterable[int]) -> tuple[int, int]:
    """The value met most often, of several the largest, and how often."""
    return max(Counter(counts).items(), key=lambda each: (each[1], each[0]))


def _shape(word: str) -> tuple[int, int] | None:
    """Significant digits and decimals of a number as it is written, without the zeros at its end; None of 0."""
    try:
        parts = Decimal(word).normalize().as_tuple()
    except InvalidOperation:
        return None
    if not isinstance(parts.exponent, int) or not any(parts.digits):
        return None
    return len(parts.digits), -parts.exponent
