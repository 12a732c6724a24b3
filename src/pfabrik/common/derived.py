"""Values derived from an object: computed once, and kept in it."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, Concatenate, ParamSpec, TypeVar, cast

Owner = TypeVar("Owner")
P = ParamSpec("P")
Value = TypeVar("Value")

MOST = 256
"""Most values of one function with other arguments that an object keeps: options may vary from call to call."""


MISSING = object()
"""What an object keeps that is not computed yet: no value, which may be None."""


def derived(function: Callable[Concatenate[Owner, P], Value]) -> Callable[Concatenate[Owner, P], Value]:
    """A function whose value for an object is computed once and kept in this object, as long as that lives.

    The object does not change, and other arguments are hashable. Threads may compute a value at the same time.
    """
    name = _name_of(function)

    @wraps(function)
    def once(owner: Owner, /, *args: P.args, **kwargs: P.kwargs) -> Value:
        values: dict[Any, Value] = owner.__dict__
        key: Any = name
        if args or kwargs:
            values = owner.__dict__.setdefault(name, {})
            key = args, *kwargs.items()
        found = values.get(key, MISSING)
        if found is not MISSING:
            return cast(Value, found)
        value = function(owner, *args, **kwargs)
        if len(values) >= MOST and key is not name:
            values.clear()
        values[key] = value
        return value

    return once


def is_derived(function: Callable[[Owner], Value], owner: Owner) -> bool:
    """True if the value of such a function for an object is computed already."""
    return _name_of(function) in owner.__dict__


def _name_of(function: Callable[..., Any]) -> str:
    return f"{function.__module__}.{function.__qualname__}"
