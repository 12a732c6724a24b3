"""Arguments of kernels in memory, passed by address."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from threading import local
from typing import Any, Generic, TypeVar

import numpy as np

from ._shipped import IS_INTERPRETED

R = TypeVar("R", bound=tuple[Any, ...])  # a NamedTuple of arrays, and of such NamedTuples


class Handle(Generic[R]):
    """A NamedTuple of arrays in memory, laid out as in compiled code.

    A kernel takes its `address`, a number, and opens it: from Python that costs a tenth of passing the arrays. The
    handle keeps the arrays alive, and they may be written to; the caller keeps the handle until the kernel returns.
    """

    def __init__(self, record: R) -> None:
        self.record = record
        self._memory = np.fromiter(_descriptors(record), np.int64)
        self.address: Any = record if IS_INTERPRETED else self._memory.ctypes.data

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies get new arrays and their addresses."""
        return Handle, (self.record,)


class Scratch(local, Generic[R]):
    """Scratch memory of kernels, one per thread, for the thread's own calls."""

    def __init__(self, new: Callable[..., R], *arguments: Any) -> None:
        """Each thread that accesses this object calls `new` with the arguments."""
        self._handle = Handle(new(*arguments))
        self.address = self._handle.address


def _descriptors(record: tuple[Any, ...]) -> Iterator[int]:
    """Arrays as compiled code has them: address and shape."""
    for item in record:
        if isinstance(item, tuple):
            yield from _descriptors(item)
        else:
            assert item.flags.c_contiguous and item.flags.writeable
            yield from (item.ctypes.data, *item.shape)
