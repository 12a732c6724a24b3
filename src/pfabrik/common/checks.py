"""What arguments of several questions are checked for: positive numbers, paths of files, names, functions to call, and
highest values of actuators by name."""

from __future__ import annotations

import math
import os
import reprlib
from collections.abc import Collection, Iterable, Mapping, Sequence
from numbers import Integral, Real
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from ..errors import InvalidArgument, UnknownName

if TYPE_CHECKING:
    from .arrays import Floats

Kind = TypeVar("Kind")


def require_positive(name: str, value: Any) -> float:
    """A number of any type that is positive and, as a float, finite; InvalidArgument for anything else."""
    if isinstance(value, bool) or not isinstance(value, Real) or not _is_positive(value):
        raise InvalidArgument(name, reprlib.repr(value), "a positive number")
    return float(value)


def _is_positive(value: Real) -> bool:
    return _is_finite(value) and float(value) > 0.0


def _is_finite(value: Real) -> bool:
    try:
        return math.isfinite(float(value))
    except OverflowError:  # an integer or a fraction too large for a float
        return False


def _is_angle(value: Real) -> bool:
    return _is_finite(value) and 0.0 <= float(value) <= math.pi


def require_finite(name: str, value: Any) -> float:
    """A number of any type that is, as a float, finite; InvalidArgument for anything else."""
    if isinstance(value, bool) or not isinstance(value, Real) or not _is_finite(value):
        raise InvalidArgument(name, reprlib.repr(value), "a finite number")
    return float(value)


def require_count(name: str, value: Any, least: int = 1, most: int = 1_000_000) -> int:
    """An integer between two; InvalidArgument for anything else."""
    if isinstance(value, bool) or not (isinstance(value, Integral) and least <= int(value) <= most):
        raise InvalidArgument(name, reprlib.repr(value), f"a whole number from {least} to {most}")
    return int(value)


def require_angle(name: str, value: Any) -> float:
    """An angle from 0 to pi [rad]; InvalidArgument for anything else."""
    if isinstance(value, bool) or not isinstance(value, Real) or not _is_angle(value):
        raise InvalidArgument(name, reprlib.repr(value), "an angle from 0 to pi [rad]")
    return float(value)


def require_type(name: str, value: Any, kind: type[Kind], expected: str) -> Kind:
    """Return a value of a type; raise InvalidArgument for anything else."""
    if not isinstance(value, kind):
        raise InvalidArgument(name, type(value).__name__, expected)
    return value


def require_path(name: str, value: Any) -> Path:
    """The path of a file; InvalidArgument for what cannot be one."""
    path = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    if not isinstance(path, str) or "\0" in path:
        raise InvalidArgument(name, reprlib.repr(value), "the path of a file")
    return Path(path)


def require_ending(path: Any, known: Sequence[str]) -> str:
    """The ending of a file's name, in small letters; InvalidArgument if no format has it."""
    suffix = require_path("path", path).suffix.lower()
    if suffix not in known:
        raise InvalidArgument("path", f"'{path}'", f"a name that ends in {', '.join(known[:-1])} or {known[-1]}")
    return suffix


def require_names(name: str, value: Any) -> tuple[str, ...]:
    """Names, as a tuple; InvalidArgument for a single text and for any value but a list of texts."""
    names = tuple(value) if isinstance(value, Iterable) and not _is_single(value) else None
    if names is None or not all(isinstance(each, str) for each in names):
        raise InvalidArgument(name, reprlib.repr(value), "a list of names")
    return names


def require_known(kind: str, names: Iterable[Any], known: Collection[str]) -> None:
    """UnknownName for the first of some names that is not known; of any type."""
    for name in names:
        if not isinstance(name, str) or name not in known:
            raise UnknownName(kind, name, known)


def require_each(argument: str, given: Mapping[Any, Any], names: Sequence[str]) -> None:
    """UnknownName or InvalidArgument where values by name are not one for each actuator."""
    require_known("actuator", given, names)
    missing = [name for name in names if name not in given]
    if missing:
        raise InvalidArgument(argument, f"no value of {', '.join(missing)}", f"one for each of {', '.join(names)}")


def names_of(name: str, value: Any) -> tuple[str, ...]:
    """Names, as a tuple: one text, or several in a list."""
    return (value,) if isinstance(value, str) else require_names(name, value)


def require_choice(name: str, value: Any, choices: Iterable[str | None]) -> None:
    """Refuse a value of any type that is none of some choices; None may be one of them."""
    known = tuple(choices)
    if not (value is None or isinstance(value, str)) or value not in known:
        raise InvalidArgument(name, reprlib.repr(value), " or ".join(map(repr, known)))


def _is_single(value: Any) -> bool:
    """True if what seems to be many things is a text, or an array without axes."""
    return isinstance(value, str | bytes) or getattr(value, "shape", None) == ()


def require_mapping(name: str, value: Any, expected: str) -> Mapping[Any, Any]:
    """Values by name, none for None; InvalidArgument for any value but a mapping."""
    if value is not None and not isinstance(value, Mapping):
        raise InvalidArgument(name, reprlib.repr(value), expected)
    return value or {}


def require_callable(name: str, value: Any) -> None:
    """Refuse a value that is neither None nor callable."""
    if value is not None and not callable(value):
        raise InvalidArgument(name, reprlib.repr(value), "a function to call, or None")


def require_method(name: str, value: Any, method: str, expected: str) -> None:
    """InvalidArgument for what has no such method: objects of libraries that may not be there are told by these."""
    if not callable(getattr(value, method, None)):
        raise InvalidArgument(name, reprlib.repr(value), expected)


def put_limits(limits: Floats, argument: str, given: float | Mapping[str, float] | None, names: Sequence[str]) -> None:
    """Put limits that were given, one for all actuators or by name, in place of those that hold otherwise, (n_a,).

    Raises
    ------
    UnknownName : no actuator of such a name.
    InvalidArgument : a limit that is no positive number.
    """
    if isinstance(given, Mapping):
        require_known("actuator", given, names)
        for name, limit in given.items():
            limits[names.index(name)] = require_positive(f"{argument}['{name}']", limit)
    elif given is not None:
        limits[:] = require_positive(argument, given)
