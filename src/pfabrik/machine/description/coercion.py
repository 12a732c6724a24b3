"""Plain immutable values out of whatever a caller passes: tuples of floats, unit vectors, texts.

Nothing here refuses a value. What cannot be converted stays as it is, for `find_faults` to name.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Sequence
from numbers import Real
from typing import Any

import numpy as np

from ..noted_numbers import Number, sqrt

UNIT_SLACK = 4 * sys.float_info.epsilon
"""How far the norm of a vector may be from 1 and still count as 1: the rounding of one division by the norm. Dividing
again would move the last digit, and a saved mechanism would not load as its equal."""


def items(value: Any) -> Any:
    """The items of anything that can be iterated, as a tuple."""
    return tuple(value) if isinstance(value, Iterable) and getattr(value, "shape", None) != () else value


def truths(value: Any, type_: Any) -> Any:
    """Truth values as Python's own, a pair as a tuple; one for both of a cylindrical joint, if they are the same."""
    if isinstance(value, np.ndarray | np.bool_):
        value = value.tolist()
    if not _is_list(value):
        return value
    found = tuple(bool(each) if isinstance(each, np.bool_) else each for each in value)
    pair = isinstance(type_, str) and type_ == "cylindrical" and [type(each) for each in found] == [bool, bool]
    return found[0] if pair and found[0] == found[1] else found


def text(value: Any) -> Any:
    """A text as a plain `str`, whatever subclass it comes in."""
    value = value.tolist() if isinstance(value, np.ndarray) else value
    return str.__str__(value) if isinstance(value, str) else value


def texts(value: Any) -> Any:
    """A list or array of texts as a tuple."""
    value = value.tolist() if isinstance(value, np.ndarray) else value
    return tuple(map(text, value)) if _is_list(value) else value


def numbers(value: Any, depth: int = 2) -> Any:
    """Numbers as floats, sequences and arrays of them as tuples; anything else as it is, for `find_faults` to name."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if _is_list(value) and depth > 0:
        return tuple(numbers(item, depth - 1) for item in value)
    if isinstance(value, Number | bool) or not isinstance(value, Real):
        return value
    try:
        return float(value)
    except OverflowError:
        return value


def unit_vector(value: Any) -> Any:
    """The direction as a unit vector; a unit vector, a zero one, or what is no vector, as it is."""
    vector = numbers(value)
    if not (isinstance(vector, tuple) and len(vector) == 3 and all(isinstance(part, float) for part in vector)):
        return vector
    if any(isinstance(part, Number) for part in vector):
        norm = sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2])
        return tuple(part / norm for part in vector)
    if not all(map(math.isfinite, vector)) or abs(math.hypot(*vector) - 1.0) <= UNIT_SLACK:
        return vector
    largest = max(map(abs, vector)) or 1.0
    scaled = [part / largest for part in vector]  # so that no square over- or underflows
    norm = math.hypot(*scaled) or 1.0
    return tuple(part / norm for part in scaled)


def unit_vectors(value: Any) -> Any:
    """A list or array of directions as a tuple of unit vectors."""
    vectors = numbers(value)
    return tuple(map(unit_vector, vectors)) if isinstance(vectors, tuple) else vectors


def home_value(value: Any, type_: Any) -> Any:
    """The home coordinate; zero, however it is written, is (0, 0) where there are two coordinates and 0 elsewhere."""
    home = numbers(value)
    two = isinstance(type_, str) and type_ in ("universal", "cylindrical")
    if isinstance(home, float) and not two:
        return home + 0.0  # without asking if it is 0: a formula of dimensions then holds at other values, too
    if isinstance(home, bool) or home not in (0.0, (0.0, 0.0)):
        return home
    return (0.0, 0.0) if two else 0.0


def _is_list(value: object) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str | bytes | bytearray)
