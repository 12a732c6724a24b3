"""Numbers with derivatives, on which the routines of legs run as plain Python (forward differentiation)."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest


class Dual:
    """A value and its derivatives; what compares it cannot be asked `if`, only by `where`."""

    __array_ufunc__ = None  # numbers of NumPy leave operators to it

    def __init__(self, value: float, slope: Any = 0.0) -> None:
        self.value, self.slope = float(value), slope

    def __add__(self, other: Any) -> Dual:
        other = dual(other)
        return Dual(self.value + other.value, self.slope + other.slope)

    def __mul__(self, other: Any) -> Dual:
        other = dual(other)
        return Dual(self.value * other.value, self.slope * other.value + self.value * other.slope)

    def __truediv__(self, other: Any) -> Dual:
        other = dual(other)
        value = self.value / other.value
        return Dual(value, (self.slope - value * other.slope) / other.value)

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.slope)

    def __sub__(self, other: Any) -> Dual:
        return self + -other

    def __rsub__(self, other: Any) -> Dual:
        return -self + other

    def __rtruediv__(self, other: Any) -> Dual:
        return dual(other) / self

    def __abs__(self) -> Dual:
        return self if self.value >= 0.0 else -self

    def __lt__(self, other: Any) -> Comparison:
        return Comparison(self.value < dual(other).value)

    def __gt__(self, other: Any) -> Comparison:
        return Comparison(self.value > dual(other).value)

    __radd__, __rmul__ = __add__, __mul__


class Comparison:
    """The result of a comparison of numbers."""

    def __init__(self, holds: bool) -> None:
        self.holds = holds

    def __bool__(self) -> bool:
        raise AssertionError("a formula asks `if` of a number: use `where`")


def dual(x: Any) -> Dual:
    return x if isinstance(x, Dual) else Dual(x)


def duals(values: Any, slopes: Any) -> Any:
    """An array of values, each with its derivatives (..., n)."""
    made = np.empty(np.shape(values), object)
    for place in np.ndindex(made.shape):
        made[place] = Dual(values[place], slopes[place])
    return made


def _arctangent(y: Any, x: Any) -> Dual:
    y, x = dual(y), dual(x)
    return Dual(math.atan2(y.value, x.value), (x.value * y.slope - y.value * x.slope) / (x.value**2 + y.value**2))


def _root(x: Any) -> Dual:
    root = math.sqrt(dual(x).value)
    return Dual(root, 0.5 / root * dual(x).slope if root > 0.0 else 0.0)


_FUNCTIONS = SimpleNamespace(
    inf=math.inf,
    pi=math.pi,
    sqrt=_root,
    atan2=_arctangent,
    sin=lambda x: Dual(math.sin(dual(x).value), math.cos(dual(x).value) * dual(x).slope),
    cos=lambda x: Dual(math.cos(dual(x).value), -math.sin(dual(x).value) * dual(x).slope),
    floor=lambda x: math.floor(dual(x).value),
    copysign=lambda x, sign: abs(x) * math.copysign(1.0, dual(sign).value),
)


@contextmanager
def on_duals(modules: tuple[ModuleType, ...], choices: dict[str, set[bool]]) -> Iterator[pytest.MonkeyPatch]:
    """Let functions of modules take numbers with derivatives; what `where` chooses is noted by function."""

    def where(condition: Any, a: Any, b: Any) -> Any:
        holds = bool(getattr(condition, "holds", condition))
        choices.setdefault(sys._getframe(1).f_code.co_name, set()).add(holds)
        return a if holds else b

    instead: dict[str, Any] = {
        "math": _FUNCTIONS,
        "where": where,
        "float": lambda x: x,
        "max": lambda *numbers: max(numbers, key=lambda x: dual(x).value),
        "min": lambda *numbers: min(numbers, key=lambda x: dual(x).value),
    }
    with pytest.MonkeyPatch.context() as patch:
        for module in modules:
            for name, function in instead.items():
                patch.setattr(module, name, function, raising=False)
        yield patch
