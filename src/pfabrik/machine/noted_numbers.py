"""Formulas: numbers that note how they were computed, so that it can be computed again, with slopes, compiled.

A `Number` is a float to all code that reads it, and keeps what it was computed from. Code that asks something of one,
`if length > 0`, makes a *decision*: with other inputs the expressions hold as long as all decisions come out alike.
What is chosen by `kernels.vectors.where` instead is part of the expression. Numbers that are `open` differ between the
rows that an expression is evaluated at: nothing can be decided by them.
"""

from __future__ import annotations

import builtins
import math
import operator
from collections.abc import Callable, Sequence
from functools import cache, partial
from types import FunctionType, SimpleNamespace
from typing import Any

import numpy as np

from ..common.arrays import Floats, Ints
from ..kernels import noted_steps as K


class Trace:
    """What numbers were computed from.

    Attributes
    ----------
    steps : operation and operands of every number, by its place; an input has neither.
    decisions : comparisons that were asked for, by place: 1 where they held, or 0.
    """

    def __init__(self) -> None:
        self.steps: list[tuple[int, tuple[Number | float, ...]]] = []
        self.decisions: dict[int, Number] = {}
        self._made: dict[tuple[Any, ...], Number] = {}

    def input(self, value: float, is_open: bool = False) -> Number:
        """An input, at the value that it has while this is noted."""
        self.steps.append((INPUT, ()))
        return Number(value, self, len(self.steps) - 1, is_open)

    def number(self, operation: int, *operands: Number | float) -> Number | float:
        """The result of a step, the same number each time."""
        key = operation, *(each.place if isinstance(each, Number) else float(each).hex() for each in operands)
        if key not in self._made:
            value = _value(operation, *map(float, operands))
            self.steps.append((operation, operands))
            is_open = any(isinstance(each, Number) and each.is_open for each in operands)
            self._made[key] = Number(value, self, len(self.steps) - 1, is_open)
        return self._made[key]


INPUT = -1


class Number(float):
    """A number with its place in a trace; `is_open` where it differs between rows."""

    __slots__ = ("is_open", "place", "trace")

    trace: Trace
    place: int
    is_open: bool

    def __new__(cls, value: float, trace: Trace, place: int, is_open: bool) -> Number:
        made = float.__new__(cls, value)
        made.trace, made.place, made.is_open = trace, place, is_open
        return made

    def __bool__(self) -> bool:
        if self.is_open:
            raise TypeError("a decision by a number that differs between rows")
        operation = self.trace.steps[self.place][0]
        asked: Any = self if operation in _TRUTHS else self.trace.number(K.EQUAL, self, 0.0)
        self.trace.decisions[asked.place] = asked
        return float(self) != 0.0

    def __reduce__(self) -> tuple[Any, ...]:
        return float, (float(self),)

    __hash__ = float.__hash__

    def __add__(self, other: Any) -> Any:
        return self if _is(other, 0.0) else _step(K.ADD, self, other)

    def __sub__(self, other: Any) -> Any:
        return self if _is(other, 0.0) else _step(K.SUBTRACT, self, other)

    def __rsub__(self, other: Any) -> Any:
        return _step(K.SUBTRACT, other, self)

    def __mul__(self, other: Any) -> Any:
        return 0.0 if _is(other, 0.0) else self if _is(other, 1.0) else _step(K.MULTIPLY, self, other)

    def __truediv__(self, other: Any) -> Any:
        return self if _is(other, 1.0) else _step(K.DIVIDE, self, other)

    def __rtruediv__(self, other: Any) -> Any:
        return 0.0 if _is(other, 0.0) else _step(K.DIVIDE, other, self)

    def __pow__(self, other: Any, modulo: None = None) -> Any:
        return self * self if _is(other, 2.0) else _step(K.POWER, self, other)

    def __rpow__(self, other: Any, modulo: None = None) -> Any:
        return _step(K.POWER, other, self)

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self) -> Any:
        return self * -1.0

    def __pos__(self) -> Any:
        return self

    def __abs__(self) -> Any:
        return _step(K.MAGNITUDE, self)

    def __lt__(self, other: Any) -> Any:
        return _step(K.BELOW, self, other)

    def __le__(self, other: Any) -> Any:
        return _step(K.AT_MOST, self, other)

    def __gt__(self, other: Any) -> Any:
        return _step(K.BELOW, other, self)

    def __ge__(self, other: Any) -> Any:
        return _step(K.AT_MOST, other, self)

    def __eq__(self, other: Any) -> Any:
        return _step(K.EQUAL, self, other)

    def __ne__(self, other: Any) -> Any:
        return 1.0 - self.__eq__(other) if isinstance(other, int | float) else NotImplemented


def _is(value: Any, constant: float) -> bool:
    return not isinstance(value, Number) and isinstance(value, int | float) and value == constant


def _step(operation: int, *operands: Any) -> Any:
    """A step, or what Python answers where an operand is no number."""
    if not all(isinstance(each, int | float) for each in operands):
        return NotImplemented
    trace = next(each.trace for each in operands if isinstance(each, Number))
    return trace.number(operation, *operands)


_PLAIN: dict[int, Callable[..., Any]] = {
    K.ADD: operator.add,
    K.SUBTRACT: operator.sub,
    K.MULTIPLY: operator.mul,
    K.DIVIDE: operator.truediv,
    K.LARGER: max,
    K.SMALLER: min,
    K.MAGNITUDE: abs,
    K.COPYSIGN: math.copysign,
    K.ANGLE: math.atan2,
    K.POWER: math.pow,
    K.ROOT: math.sqrt,
    K.SINE: math.sin,
    K.COSINE: math.cos,
    K.TANGENT: math.tan,
    K.FLOOR: math.floor,
    K.BELOW: operator.lt,
    K.AT_MOST: operator.le,
    K.EQUAL: operator.eq,
    K.CHOOSE: lambda condition, first, second: first if condition == 1.0 else second,
}


def _value(operation: int, *operands: float) -> float:
    """The result of a step; NaN where there is none: an expression only has one at other values of its inputs."""
    try:
        return float(_PLAIN[operation](*operands))
    except (ArithmeticError, ValueError):
        return math.nan


def lifted(operation: int) -> Callable[..., Any]:
    """A function of floats, for numbers that note how they were computed too."""

    def function(*operands: Any) -> Any:
        is_noted = any(isinstance(each, Number) for each in operands)
        return _step(operation, *operands) if is_noted else _PLAIN[operation](*operands)

    return function


sqrt, sin, cos, tan, atan2, power, copysign, floor = map(
    lifted, (K.ROOT, K.SINE, K.COSINE, K.TANGENT, K.ANGLE, K.POWER, K.COPYSIGN, K.FLOOR)
)


def radians(angle: Any) -> Any:
    """`math.radians`, to the last bit."""
    return angle * (math.pi / 180.0)


def _fold(operation: int, *numbers: Any) -> Any:
    """The largest or the smallest number."""
    first, *rest = numbers
    for each in rest:
        first = lifted(operation)(first, each)
    return first


def largest(numbers: Any) -> Any:
    """The largest of some numbers, whichever it is."""
    return _fold(K.LARGER, *numbers)


def smallest(numbers: Any) -> Any:
    """The smallest of some numbers, whichever it is."""
    return _fold(K.SMALLER, *numbers)


def where(condition: Any, a: Any, b: Any) -> Any:
    """`kernels.vectors.where`."""
    if isinstance(condition, Number):
        return a if a is b else _step(K.CHOOSE, condition, a, b)
    return a if condition else b


_MATH = SimpleNamespace(
    sqrt=sqrt, sin=sin, cos=cos, tan=tan, atan2=atan2, copysign=copysign, floor=floor,
    pi=math.pi, inf=math.inf, nan=math.nan,
)  # fmt: skip
_PARTS = {
    "math": _MATH,
    "where": where,
    "max": partial(_fold, K.LARGER),
    "min": partial(_fold, K.SMALLER),
    "float": lambda value: value,
}


@cache
def of_numbers(function: Any) -> Any:
    """A part of kernels that computes with numbers: the same text, with the functions that it calls like it."""
    parts: dict[str, Any] = {"__builtins__": builtins} | _PARTS
    for name in set(function.__code__.co_names).intersection(function.__globals__).difference(_PARTS):
        part = function.__globals__[name]
        parts[name] = of_numbers(part) if isinstance(part, FunctionType) else part
    return FunctionType(function.__code__, parts, function.__name__)


NOTHING = np.empty((1, 0))
"""No inputs that differ between rows, at one row."""


class Formulas:
    """Numbers of a trace as steps for `kernels.noted_steps.evaluate`.

    Parameters
    ----------
    outputs : numbers, or constants.
    inputs : the numbers that are given, those that are the same at all rows first; what they were computed from counts
        no more.
    n_uniform : how many are the same at all rows.
    """

    def __init__(self, outputs: Sequence[Any], inputs: Sequence[Number], n_uniform: int) -> None:
        given = [number.place for number in inputs]
        at: dict[int | str, int] = dict.fromkeys(given, 0)
        order = [each for each in numbers_behind(outputs, lambda each: each.place in at) if each.place not in at]
        steps_of = [(each.place, each.trace.steps[each.place]) for each in order]
        self._order = [(place, operation, list(map(_name, parts))) for place, (operation, parts) in steps_of]
        results = [_name(each) for each in outputs]
        used = [*results, *(name for _, _, names in self._order for name in names)]
        constants = list(dict.fromkeys(name for name in used if isinstance(name, str)))
        self._constants, self._n_uniform = np.array([float.fromhex(name) for name in constants]), n_uniform
        self._inputs: list[int | str] = [*given[:n_uniform], *constants, *given[n_uniform:]]
        at |= {name: k for k, name in enumerate(self._inputs)}
        last: dict[int | str, int] = {name: k for k, (_, _, names) in enumerate(self._order) for name in names}
        last |= dict.fromkeys(results, len(self._order))
        free: list[int] = []
        steps, n_inputs = [], len(at)
        n_values = n_inputs
        for k, (place, operation, names) in enumerate(self._order):
            to = free.pop() if free else n_values
            n_values = max(n_values, to + 1)
            steps.append((operation, *([at[name] for name in names] + [0, 0])[:3], to))
            at[place] = to
            free += [at[name] for name in dict.fromkeys(names) if last[name] == k and at[name] >= n_inputs]
        self._steps, self._n_values = np.array(steps, np.int64).reshape(-1, 5), n_values
        self._outputs = [(at[name], name) for name in results]
        self._columns: dict[tuple[int, bytes], tuple[Ints, Ints]] = {}
        self._without_slopes = np.zeros((n_inputs, 0))

    def __call__(
        self, uniform: Floats, varying: Floats = NOTHING, tangents: Floats | None = None
    ) -> tuple[Floats, Floats]:
        """Values (n, r) of the expressions, and their slopes (n, r, c).

        Parameters
        ----------
        uniform, varying : the inputs: those that are the same at all rows, then the others (n, v).
        tangents : slopes of the inputs in all columns (inputs, c); those that are 0 cost nothing. By default c is 0.
        """
        n, r = len(varying), len(self._outputs)
        given, own = np.concatenate([uniform, self._constants]), self._without_slopes
        if tangents is not None:
            of_constants, m = np.zeros((len(self._constants), tangents.shape[1])), self._n_uniform
            own = np.concatenate([tangents[:m], of_constants, tangents[m:]])
        hulls, outputs = self._columns_of(own)
        values, slopes = np.empty((n, r)), np.zeros((n, r, own.shape[1]))
        K.evaluate(self._steps, hulls, outputs, self._n_values, given, varying, own, values, slopes)
        return values, slopes

    def _columns_of(self, slopes: Floats) -> tuple[Ints, Ints]:
        """Columns of steps and outputs, as of `evaluate`, from the slopes of all inputs and constants."""
        key = slopes.shape[1], (slopes != 0.0).tobytes()
        if key not in self._columns:
            hulls = [_hull(np.flatnonzero(row).tolist()) for row in slopes]
            rows = [(*hull, *NOWHERE, *NOWHERE) for hull in hulls]
            hull_of = dict(zip(self._inputs, hulls, strict=True))
            for place, operation, names in self._order:
                moving = [] if operation in (K.FLOOR, *_TRUTHS) else names[1:] if operation == K.CHOOSE else names
                x, y = ([hull_of[name] for name in moving] + [NOWHERE, NOWHERE])[:2]
                hull_of[place] = _union(x, y)
                rows.append((*hull_of[place], *x, *y))
            ends = [(at, *hull_of[name]) for at, name in self._outputs]
            self._columns[key] = np.array(rows, np.int64).reshape(-1, 6), np.array(ends, np.int64).reshape(-1, 3)
        return self._columns[key]


NOWHERE = (0, 0)
"""The columns of a number without slopes."""

_TRUTHS = (K.BELOW, K.AT_MOST, K.EQUAL)
"""Operations whose results are 1 or 0."""


def _name(number: Number | float) -> int | str:
    """A number's place, or a constant's digits, which tell -0 from 0."""
    return number.place if isinstance(number, Number) else float(number).hex()


def uniform_parts(outputs: Sequence[Any]) -> list[Number]:
    """The numbers that are the same at all rows and that those which differ are computed from, or that are outputs."""
    return [number for number in numbers_behind(outputs, lambda each: not each.is_open) if not number.is_open]


def numbers_behind(outputs: Sequence[Any], is_end: Callable[[Number], bool]) -> list[Number]:
    """All numbers that outputs are computed from, these included, in the order of their places; none behind an end."""
    found: dict[int, Number] = {}
    waiting = [*outputs]
    while waiting:
        number = waiting.pop()
        if isinstance(number, Number) and number.place not in found:
            found[number.place] = number
            waiting += () if is_end(number) else number.trace.steps[number.place][1]
    return [found[place] for place in sorted(found)]


def _hull(columns: list[int]) -> tuple[int, int]:
    return (columns[0], columns[-1] + 1) if columns else NOWHERE


def _union(x: tuple[int, int], y: tuple[int, int]) -> tuple[int, int]:
    spans = [span for span in (x, y) if span != NOWHERE]
    return (min(first for first, _ in spans), max(last for _, last in spans)) if spans else NOWHERE
