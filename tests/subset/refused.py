"""What the subset has not: the first line of each function's docstring is what the refusal says."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from pfabrik.kernels._jit import routine

SIZES = np.zeros(3)


class Pair(NamedTuple):
    """Two arrays."""

    a: Any
    b: Any


@routine
def two_types(x: Any) -> None:
    """total changes its type"""
    total = 0
    total = x[0]
    x[0] = total


@routine
def widened(x: Any) -> None:
    """a variable that changes its type"""
    total = 1
    total += x[0]
    x[0] = total


@routine
def unset(x: Any) -> None:
    """read before it is assigned"""
    x[0] = later
    later = 1.0


@routine
def perhaps_unset(x: Any) -> None:
    """perhaps read before it is assigned: value"""
    for i in range(x.shape[0]):
        value = x[i]
    x[0] = value


@routine
def closure(x: Any) -> None:
    """FunctionDef is not in the subset"""

    def inner() -> float:
        return 1.0

    x[0] = inner()


@routine
def comprehension(x: Any) -> None:
    """ListComp is not in the subset"""
    x[0] = [v for v in x][0]


@routine
def text(x: Any) -> None:
    """a constant that is no number"""
    name = "x"
    x[0] = len(name)


@routine
def strided_slice(x: Any) -> None:
    """a slice with a step"""
    x[0] = x[::2][0]


@routine
def filled(x: Any) -> None:
    """an element that is no number"""
    x[:] = 0.0


@routine
def method(x: Any) -> None:
    """a method that is not in the subset"""
    x[0] = x.mean()


@routine
def foreign(x: Any) -> None:
    """a call of what is no part of kernels"""
    x[0] = sum(x)


@routine
def by_name(x: Any) -> None:
    """arguments by name, or in a tuple"""
    x[0] = strided_slice(x=x)


@routine
def recursive(x: Any) -> None:
    """recursive calls itself"""
    recursive(x)


@routine
def global_array(x: Any) -> None:
    """a global array: SIZES"""
    x[0] = SIZES[0]


@routine
def choice(x: Any) -> None:
    """a choice of values of different types"""
    x[0] = (x if x[0] > 0.0 else x[0])[0]


@routine
def mixed_and(x: Any) -> None:
    """`and` or `or` of what is not a truth value"""
    x[0] = x[0] or 1.0


@routine
def raising(x: Any) -> None:
    """Raise is not in the subset"""
    raise ValueError


@routine
def set_anew(pair: Pair, x: Any) -> None:
    """a parameter that becomes a new NamedTuple"""
    pair = Pair(pair.b, pair.a)
    x[0] = pair.a[0]


@routine
def move(x: Any) -> float:
    """"""
    x[0] += 1.0
    return float(x[0])


@routine
def lazily(x: Any) -> None:
    """must be computed before an expression in which it may not be evaluated"""
    x[0] = 1.0 if x[0] > 0.0 and x[0] + move(x) > 1.0 else 0.0


@routine
def gamma(x: Any) -> None:
    """a function of math that is not in the subset"""
    x[0] = math.gamma(x[0])


@routine
def ended(x: Any) -> None:
    """a loop with else"""
    for i in range(3):
        x[i] = 0.0
    else:
        x[0] = 1.0


@routine
def truths(x: Any) -> None:
    """arithmetic with two truth values"""
    x[0] = (x[0] > 0.0) + (x[1] > 0.0)


@routine
def less_than_one(x: Any) -> None:
    """a negative power of an integer"""
    x[0] = 10**-3


@routine
def place_moved(x: Any) -> None:
    """an index that is computed twice, and changes"""
    x[int(x[0])] += move(x)


@routine
def moved_place(x: Any) -> None:
    """an index that changes what it is an index of"""
    x[0] = pair_of(x)[int(move(x) - move(x)) % 2]


@routine
def pair_of(x: Any) -> tuple[float, float]:
    """"""
    x[1] += 1.0
    return x[0], x[1]


@routine
def in_nothing(x: Any) -> None:
    """`in` of what is not a tuple"""
    x[0] = 1.0 if x[0] in () else 0.0  # noqa: RUF060
