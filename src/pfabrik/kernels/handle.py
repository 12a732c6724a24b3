"""What Python gives kernels of a machine: an address."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from threading import local
from typing import Any, Generic, TypeVar

import numpy as np

R = TypeVar("R", bound=tuple[Any, ...])  # a NamedTuple of arrays, and of such NamedTuples


class Handle(Generic[R]):
    """A NamedTuple of arrays kept in memory as compiled code has it.

    A kernel takes its `address`, a number, and opens it; from Python that costs a tenth of what the arrays would. The
    arrays are kept alive, and may be written to; whoever hands the address over keeps the handle until the kernel is
    done.
    """

    def __init__(self, record: R) -> None:
        import numba

        config: Any = numba.config
        self.record = record
        self._memory = np.fromiter(_descriptors(record), np.int64)
        self.address: Any = record if config.DISABLE_JIT else self._memory.ctypes.data

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy has arrays of its own, and their addresses."""
        return Handle, (self.record,)


class Scratch(local, Generic[R]):
    """Scratch memory of kernels: each thread has its own, for calls that it makes itself."""

    def __init__(self, new: Callable[..., R], *asked: Any) -> None:
        """`new` is called, with what it is asked, by each thread that comes to need the address."""
        self._handle = Handle(new(*asked))
        self.address = self._handle.address


def _descriptors(record: tuple[Any, ...]) -> Iterator[int]:
    """Arrays as Numba has them in memory: no owner, size, bytes of an element, where it is, shape, strides."""
    for each in record:
        if isinstance(each, tuple):
            yield from _descriptors(each)
        else:
            assert each.flags.c_contiguous and each.flags.writeable
            yield from (0, 0, each.size, each.itemsize, each.ctypes.data, *each.shape, *each.strides)
