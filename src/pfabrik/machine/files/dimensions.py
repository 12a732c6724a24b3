"""Named dimensions of a mechanism file, and the expressions of them that stand in place of numbers.

An expression is parsed and computed here; it is never run as Python.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from ...errors import Fault, counted, near_miss
from ..description.leg_points import WORDS
from ..noted_numbers import Number, atan2, cos, power, radians, sin, sqrt, tan

TEXTS = (
    *("name", "type", "connects", "along", "chain", "fixed_to", "base", "end_effector", "units", "task", "schema"),
    *("shape", "file", "between", "ignore"),
)
"""Keys whose strings are text. Of a leg, `base` has points: there, strings in lists are expressions."""

LONGEST = 200
"""Longest expression [characters]."""

EXPECTED = "a number, or an expression of numbers and dimensions with + - * / ** ( ) sqrt sin cos tan atan2 pi"

_OPERATORS: dict[type, Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: power,
}


class NoNumber(Exception):
    """An expression without a value; the text says why."""


def dimension_values(dimensions: Any, angle_unit: str, faults: list[Fault]) -> dict[str, float]:
    """The value of every dimension; each may use those before it.

    Parameters
    ----------
    dimensions : the table of a file: name -> number or expression.
    angle_unit : "deg" or "rad", of the arguments of sin, cos and tan and of the result of atan2.
    faults : what is wrong is added.
    """
    computed: dict[str, float] = {}
    if not isinstance(dimensions, dict):
        faults.append(Fault("dimensions", repr(dimensions), "a table of names and numbers"))
        return computed
    for name, said in dimensions.items():
        place = f"dimensions.{name}"
        if not name.isidentifier() or name in ("pi", *_functions(angle_unit)):
            faults.append(Fault(place, f"the name '{name}'", "letters, digits and _, and no name of a function"))
            continue
        try:
            computed[name] = number_of(said, computed, angle_unit, tuple(dimensions))
        except NoNumber as reason:
            faults.append(Fault(place, str(reason), EXPECTED))
            computed[name] = math.nan  # so that its uses are no further faults
    return computed


def with_numbers(table: Any, values: Mapping[str, float], angle_unit: str, place: str, faults: list[Fault]) -> Any:
    """A table of a file with every expression replaced by its value; faults of expressions are added.

    Words for directions ("vertical", "-x") stay under `axis` and `axes`, whatever dimensions are called.
    """
    if isinstance(table, dict):
        return {
            key: item
            if key in TEXTS and not (key == "base" and isinstance(item, list))
            else with_numbers(item, values, angle_unit, f"{place}.{key}" if place else key, faults)
            for key, item in table.items()
        }
    if isinstance(table, list):
        is_tables = bool(table) and all(isinstance(item, dict) for item in table)
        return [
            with_numbers(item, values, angle_unit, f"{place}[{k}]" if is_tables else place, faults)
            for k, item in enumerate(table)
        ]
    if not isinstance(table, str) or (_is_axis(place) and table.removeprefix("-") in WORDS):
        return table
    try:
        return number_of(table, values, angle_unit, ())
    except NoNumber as reason:
        faults.append(Fault(place, str(reason), EXPECTED))
        return 1.0


def _is_axis(place: str) -> bool:
    return place.rpartition(".")[2] in ("axis", "axes")


def number_of(said: Any, values: Mapping[str, float], angle_unit: str, later: tuple[str, ...]) -> float:
    """The value of a number or an expression.

    Parameters
    ----------
    values : of the dimensions that it may use.
    later : names that are dimensions too, but have no value yet.

    Raises
    ------
    NoNumber : it has none; the text is what was found.
    """
    if isinstance(said, bool) or not isinstance(said, int | float | str):
        raise NoNumber(repr(said))
    if isinstance(said, str):
        if len(said) > LONGEST:
            raise NoNumber(f"an expression of {len(said)} characters")
        try:
            value = _computed(_parsed(said.strip()), values, _functions(angle_unit), later)
        except NoNumber as reason:
            raise NoNumber(f"'{said}': {reason}") from None
        except (SyntaxError, RecursionError, MemoryError):
            raise NoNumber(f"'{said}'") from None
        except (ArithmeticError, ValueError):  # a fraction of 0; a power that is not real is a ValueError
            raise NoNumber(f"'{said}', which has no finite value") from None
    else:
        value = said if isinstance(said, Number) else float(said) if abs(said) < 1e300 else math.inf
    if math.isinf(value):
        raise NoNumber(f"'{said}', which has no finite value")
    return value


@cache
def _parsed(text: str) -> ast.expr:
    return ast.parse(text, mode="eval").body


def _functions(angle_unit: str) -> dict[str, tuple[int, Callable[..., float]]]:
    """Functions by name, with the number of their arguments; angles in the unit of the file."""
    into, out = (radians(1.0), math.degrees(1.0)) if angle_unit == "deg" else (1.0, 1.0)
    return {
        "sqrt": (1, sqrt),
        "sin": (1, lambda angle: sin(angle * into)),
        "cos": (1, lambda angle: cos(angle * into)),
        "tan": (1, lambda angle: tan(angle * into)),
        "atan2": (2, lambda y, x: atan2(y, x) * out),
    }


def _computed(
    node: ast.AST,
    values: Mapping[str, float],
    functions: Mapping[str, tuple[int, Callable[..., float]]],
    later: tuple[str, ...],
) -> float:
    """The value of a node of a parsed expression."""

    def compute(inner: ast.AST) -> float:
        return _computed(inner, values, functions, later)

    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return float(value)
        case ast.Name(id="pi"):
            return math.pi
        case ast.Name(id=name):
            if name not in values:
                hint = "; it comes later" if name in later else near_miss(name, values)
                raise NoNumber(f"no dimension '{name}' here{hint}")
            return values[name]
        case ast.UnaryOp(op=ast.USub() | ast.UAdd() as sign, operand=operand):
            return compute(operand) if isinstance(sign, ast.UAdd) else -compute(operand)
        case ast.BinOp(op=operation, left=left, right=right) if type(operation) in _OPERATORS:
            return _OPERATORS[type(operation)](compute(left), compute(right))
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in functions:
            n_arguments, function = functions[name]
            if len(args) != n_arguments:
                raise NoNumber(f"{name} of {counted(len(args), 'argument')} in place of {n_arguments}")
            numbers = [compute(each) for each in args]
            if name == "sqrt" and numbers[0] < 0.0:
                raise NoNumber(f"{ast.unparse(args[0])} is {numbers[0]:.6g}, which has no root")
            return function(*numbers)
        case ast.Call(func=ast.Name(id=name)):
            raise NoNumber(f"no function '{name}'{near_miss(name, functions)}")
    raise NoNumber("more than an expression may have")
