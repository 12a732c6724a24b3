"""Types of arrays, and the conversion of rows to the shape of a batch."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Mask: TypeAlias = NDArray[np.bool_]
Records: TypeAlias = NDArray[np.void]
Record: TypeAlias = Any  # one of them: its fields are numbers and arrays


def shaped(array: NDArray[Any], shape: tuple[int, ...]) -> Any:
    """Results row by row, (n, ...), in the batch shape of the question; a number if that shape is ()."""
    found = array.reshape(shape + array.shape[1:])
    return found if found.ndim else found.item()


def as_plain(value: Any) -> Any:
    """An array as numbers and lists, a result as a dict of its fields; numbers that are not finite become None."""
    if is_dataclass(value):
        return {each.name: as_plain(getattr(value, each.name)) for each in fields(value) if each.repr}
    if isinstance(value, tuple | list):
        return [as_plain(each) for each in value]
    if isinstance(value, dict):
        return {name: as_plain(each) for name, each in value.items()}
    if hasattr(value, "to_dict"):
        return value.to_dict()
    array = np.asarray(value)
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        return np.where(np.isfinite(array), array.astype(object), np.array(None)).tolist()
    return array.tolist()


def read_only(array: Floats) -> Floats:
    """A read-only view of an array."""
    view = array.view()
    view.setflags(write=False)
    return view
